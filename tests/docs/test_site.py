"""The site builds: every page, formula, link and docstring of it."""

import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_the_site_builds_without_a_warning(tmp_path):
    """In a copy, since building it renews pages in place."""
    shutil.copytree(ROOT / "docs", tmp_path / "docs", ignore=shutil.ignore_patterns("generated"))
    for file in (ROOT / "mkdocs.yml", *ROOT.glob("*.md")):
        shutil.copy(file, tmp_path)
    for name in ("src", "tests", "benchmarks"):
        (tmp_path / name).symlink_to(ROOT / name)
    for command in (["docs/generate.py"], ["-m", "mkdocs", "build", "--strict", "--quiet"]):
        done = subprocess.run([sys.executable, *command], capture_output=True, text=True, cwd=tmp_path, check=False)
        assert done.returncode == 0, done.stderr
    for page in ("index.html", "concepts/index.html", "measure/index.html", "scorecard/index.html"):
        assert (tmp_path / "site" / page).stat().st_size > 1000
