"""What the README and the changelog promise is so."""

import re
import tomllib
from pathlib import Path

import pytest

import nectosome
from nectosome.io import load_dataset

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def test_the_example_of_the_readme_runs_and_prints_what_it_says(tmp_path, monkeypatch, capsys):
    code = re.search(r"```python\n(.*?)```", README, re.DOTALL)
    said = re.search(r"It prints `(.*?)`", README)
    assert code is not None
    assert said is not None
    monkeypatch.chdir(tmp_path)
    exec(compile(code[1], "README.md", "exec"), {})
    assert capsys.readouterr().out.strip() == said[1]
    assert float(load_dataset("swim.nc")["time"][-1]) == 2.5
    assert Path("swim.html").stat().st_size > 10_000


def test_the_table_of_the_readme_has_the_printed_speeds():
    books = [
        tomllib.loads(file.read_text(encoding="utf-8")) for file in ROOT.glob("src/nectosome/papers/*/printed.toml")
    ]
    entries = [entry for book in books for entry in book.values()]
    speeds = {e["quantity"]: e["printed"] for e in entries if e.get("unit") == "m/s" and "printed" in e}
    found = dict(re.findall(r"^\| (.*?) \| ([\d.]+) m/s \|", README, re.MULTILINE))
    assert {q for q in speeds if "Table II, row" in q or "(Table 5)" in q} <= found.keys()
    assert {q: float(speed) for q, speed in found.items()} == pytest.approx({q: speeds[q] for q in found})


@pytest.mark.parametrize("page", ["README.md", "CONTRIBUTING.md", "CHANGELOG.md"])
def test_every_file_that_a_page_names_is_there(page: str):
    text = (ROOT / page).read_text(encoding="utf-8")
    named = re.findall(r"\]\((?!http)([^)#]+)\)", text)
    named += [path for path in re.findall(r"`((?:src|tests|docs|examples)/[\w/.]*)`", text) if "<" not in path]
    assert [path for path in named if not (ROOT / path).exists()] == []


def test_the_python_page_has_every_public_name():
    page = (ROOT / "docs" / "api.md").read_text(encoding="utf-8")
    assert [name for name in nectosome.__all__ if f".{name}\n" not in page] == []


def test_the_changelog_has_this_version():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert f"## {project['version']}" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
