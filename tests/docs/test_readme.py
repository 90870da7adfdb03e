"""What the README and the changelog promise is so."""

import re
import tomllib
from pathlib import Path

import pytest
from tests.docs.test_tutorials import follow

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def test_the_first_robot_runs_and_prints_what_is_said(tmp_path):
    swimmer = README.partition("## A swimmer")[2].partition("\n## ")[0]
    follow(swimmer, tmp_path, width=80)
    assert len((tmp_path / "wiggler.yaml").read_text(encoding="utf-8").splitlines()) <= 20
    shown = re.findall(r"`(nectosome (?:show|new)[^`]*)`", swimmer)
    assert len(shown) == 2
    follow("".join(f"```console\n$ {command}\n```\n" for command in shown), tmp_path)
    assert (tmp_path / "robot.html").stat().st_size > 10_000


def test_it_is_read_in_a_minute():
    assert len(README.splitlines()) <= 120
    assert len(re.findall(r"^\| .* \| (?:match|differs|better) \|$", README, re.MULTILINE)) <= 8


def test_its_numbers_are_those_of_the_scorecard():
    card = (ROOT / "docs" / "evidence" / "scorecard.md").read_text(encoding="utf-8")
    pairs = re.findall(r"^\| [^|]* \| [^|]* \| ([-\d.e+]+) \| ([-\d.e+]+) \|", card, re.MULTILINE)
    numbers = [(float(printed), float(computed)) for printed, computed in pairs]
    rows = re.findall(r"^\| .* \| ([-\d.e+]+)[^|]* \| ([-\d.e+]+)[^|]* \| \w+ \|$", README, re.MULTILINE)
    assert len(rows) == 8
    told = [tuple(float(number) for number in row) for row in rows]
    assert [row for row in told if not any(row == pytest.approx(other, rel=5e-3) for other in numbers)] == []


@pytest.mark.parametrize("page", ["README.md", "CONTRIBUTING.md", "CHANGELOG.md"])
def test_every_file_that_a_page_names_is_there(page: str):
    text = (ROOT / page).read_text(encoding="utf-8")
    named = re.findall(r"\]\((?!http)([^)#]+)\)", text)
    named += [path for path in re.findall(r"`((?:src|tests|docs|examples)/[\w/.]*)`", text) if "<" not in path]
    assert [path for path in named if not (ROOT / path).exists()] == []


def test_the_changelog_has_this_version():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert f"## {project['version']}" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
