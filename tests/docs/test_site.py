"""The site builds: every page, formula and link of it."""

import re
import subprocess
import sys
from pathlib import Path

import markdown
import pytest

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
sys.path.insert(0, str(DOCS / "make"))
from hook import _AT_ROOT, on_page_content  # noqa: E402


def test_the_menu_has_every_page_once():
    menu = (ROOT / "mkdocs.yml").read_text(encoding="utf-8").partition("\nnav:")[2]
    named = re.findall(r"[\w./-]+\.md", menu)
    assert sorted(named) == sorted({*(str(page.relative_to(DOCS)) for page in DOCS.rglob("*.md")), *_AT_ROOT.values()})


@pytest.mark.parametrize("page", sorted(DOCS.rglob("*.md")), ids=lambda page: page.stem)
def test_every_formula_becomes_mathml(page: Path):
    text = page.read_text(encoding="utf-8")
    extension = {"pymdownx.arithmatex": {"generic": True}}
    made = markdown.markdown(text, extensions=[*extension], extension_configs=extension)
    shown = on_page_content(made)
    assert "arithmatex" not in shown
    assert shown.count("<math") == made.count('class="arithmatex"') and (page.stem != "concepts" or "<math" in shown)


@pytest.mark.slow
def test_the_site_builds_without_a_warning(tmp_path):
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, check=False)
    assert done.returncode == 0, done.stderr
    for page in ("index", "theory/concepts/index", "how-to/measure/index", "develop/changelog/index"):
        assert (tmp_path / f"{page}.html").stat().st_size > 1000
    concepts = (tmp_path / "theory" / "concepts" / "index.html").read_text(encoding="utf-8")
    assert concepts.count("<math") > 40 and "arithmatex" not in concepts
