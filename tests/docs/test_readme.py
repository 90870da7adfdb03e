"""What the README and the changelog promise is so."""

import re
import tomllib
from pathlib import Path

import pytest
from tests.docs.test_tutorials import follow, steps

from nectosome.description import load_robot

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")


SWIMMER = README.partition("## A swimmer")[2].partition("\n## ")[0]


def test_the_first_robot_is_read(tmp_path):
    """Its commands, too, as those of all pages (`test_code.py`)."""
    (file,) = ((what, lines) for kind, what, lines in steps(SWIMMER) if kind == "file")
    (tmp_path / file[0]).write_text("\n".join(file[1]) + "\n", encoding="utf-8")
    assert (file[0], load_robot(tmp_path / file[0]).name) == ("wiggler.yaml", "wiggler")
    assert len(file[1]) <= 20


@pytest.mark.slow
def test_the_first_robot_runs_and_prints_what_is_said(tmp_path):
    follow(SWIMMER, tmp_path, width=80)
    shown = re.findall(r"`(nectosome (?:show|new)[^`]*)`", SWIMMER)
    assert len(shown) == 2
    follow("".join(f"```console\n$ {command}\n```\n" for command in shown), tmp_path)
    assert (tmp_path / "robot.html").stat().st_size > 10_000


def test_it_is_read_in_a_minute():
    assert len(README.splitlines()) <= 120


def test_its_numbers_are_those_of_the_scorecard():
    """Ten findings, each with the numbers of a row, to three digits."""
    table = README.partition("<!-- generated: evidence -->")[2].partition("<!-- end -->")[0]
    told = re.findall(r"^\| [^|]+ \| ([^|]*) \| ([^|]+) \| [^|]+ \|$", table, re.MULTILINE)[1:]
    assert len(told) == 10
    card = (ROOT / "docs" / "evidence" / "scorecard.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| [^|]* \| ([^|]*) \| ([^|]*) \|", card, re.MULTILINE)
    pairs = {(_rounded(theirs), _rounded(ours)) for theirs, ours in rows}
    assert [row for row in told if (_rounded(row[0]), _rounded(row[1])) not in pairs] == []


def _rounded(text: str) -> str:
    """The number at the beginning of a cell, to three digits."""
    number = re.match(r"-?[\d.]+(?:e-?\d+)?", text)
    return f"{float(number[0]):.3g}" if number else ""


@pytest.mark.parametrize("page", ["README.md", "CONTRIBUTING.md", "CHANGELOG.md"])
def test_every_file_that_a_page_names_is_there(page: str):
    text = (ROOT / page).read_text(encoding="utf-8")
    named = re.findall(r"\]\((?!http)([^)#]+)\)", text)
    named += [path for path in re.findall(r"`((?:src|tests|docs|examples)/[\w/.]*)`", text) if "<" not in path]
    assert [path for path in named if not (ROOT / path).exists()] == []


def test_the_changelog_has_this_version():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert f"## {project['version']}" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
