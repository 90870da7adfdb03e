"""The site builds: every page, formula and link of it."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_the_site_builds_without_a_warning(tmp_path):
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, check=False)
    assert done.returncode == 0, done.stderr
    for page in ("index", "theory/concepts/index", "how-to/measure/index", "develop/changelog/index"):
        assert (tmp_path / f"{page}.html").stat().st_size > 1000
    concepts = (tmp_path / "theory" / "concepts" / "index.html").read_text(encoding="utf-8")
    assert concepts.count("<math") > 40 and "arithmatex" not in concepts
