"""The tutorials do what they say: `nectosome tutorial` writes their files, their commands run and print what is shown.

Where a tutorial leaves lines out it says `...`. Numbers may differ in their last digits.
"""

import os
import re
import runpy
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from nectosome.cli import main
from nectosome.cli.tutorial import tutorial_files, tutorial_pages

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "docs" / "tutorials"
SHIPPED = ROOT / "src" / "nectosome" / "cli" / "tutorials"
PAGES = re.findall(r"tutorials/(\w+)\.md", (ROOT / "mkdocs.yml").read_text(encoding="utf-8"))
NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
CLOSE = 5e-3  # relative


def steps(page: str) -> Iterator[tuple[str, str, list[str]]]:
    """Files to write as ("file", name, lines), commands as ("$", command, lines shown)."""
    for kind, title, body in re.findall(r'```(\w+)(?: title="([^"]+)")?\n(.*?)```', page, re.DOTALL):
        if title:
            yield "file", title, body.splitlines()
        elif kind == "console":
            for command, *shown in (text.splitlines() for text in re.split(r"^\$ ", body, flags=re.MULTILINE)[1:]):
                yield "$", command, [line for line in shown if line.strip()]


def alike(shown: str, printed: str) -> bool:
    """Whether two lines have the same words, and numbers that are close; runs of blanks and rules count alike."""
    words = [re.split(r"\s+", NUMBER.sub("#", line).strip()) for line in (shown, printed)]
    pairs = zip(NUMBER.findall(shown), NUMBER.findall(printed), strict=False)
    return words[0] == words[1] and all(near(float(b), a) for a, b in pairs)


def near(value: float, shown: str) -> bool:
    """Whether a number is what is shown, but for its last digit."""
    mantissa, _, power = shown.partition("e")
    last = 10.0 ** (int(power or 0) - len(mantissa.partition(".")[2]))
    return value == pytest.approx(float(shown), rel=CLOSE, abs=1.01 * last)


def read(name: str) -> str:
    """The text of a tutorial."""
    return (FOLDER / f"{name}.md").read_text(encoding="utf-8")


def begun(name: str, folder: Path) -> str:
    """The text of a tutorial in whose folder lies what `nectosome tutorial` writes: all files that it shows."""
    assert main(["tutorial", name, str(folder)]) == 0
    text = read(name)
    assert [what for kind, what, _ in steps(text) if kind == "file" and not (folder / what).exists()] == []
    return text


def follow(page: str, folder: Path, width: int = 160) -> None:
    """Do what the text of a page says in a folder; files that it shows are there as shown, or are written."""
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    told = os.environ | {"PATH": path, "COLUMNS": str(width)}
    for kind, what, lines in steps(page):
        if kind == "file":
            if (folder / what).exists():
                there = (folder / what).read_text(encoding="utf-8").splitlines()
                assert there[there[0].startswith("# yaml-language-server") :] == lines
            else:
                (folder / what).write_text("\n".join(lines) + "\n", encoding="utf-8")
            continue
        ran = subprocess.run(what, shell=True, cwd=folder, env=told, capture_output=True, text=True, check=False)
        printed = iter((ran.stdout + ran.stderr).splitlines())
        shown_to_fail = ran.returncode in (1, 2) and lines  # what is wrong is among the lines then
        assert ran.returncode == 0 or shown_to_fail, f"{what}\n{ran.stdout}{ran.stderr}"
        for line in lines:
            if line != "...":
                found = any(alike(line, other) for other in printed)
                assert found, f"{what}\nshown: {line}\nprinted:\n{ran.stdout}{ran.stderr}"


def test_every_tutorial_is_on_the_site_and_in_the_package():
    assert set(PAGES) == {path.stem for path in FOLDER.glob("*.md")}
    assert [*tutorial_pages()] == PAGES
    build = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["hatch"]["build"]
    assert build["targets"]["wheel"]["force-include"] == {"docs/tutorials": "nectosome/cli/tutorials"}


def test_the_robot_on_the_bench_is_the_swimmer_held():
    """As `record.py` of the page on recordings makes it."""
    needed = tutorial_files("recordings", tutorial_pages())
    held = needed["swimmer.yaml"].replace("{kind: planar, axis: z}", "{kind: fixed}")
    assert needed["bench.yaml"].partition("\n")[2] == held


def test_the_first_tutorial_says_what_happens(tmp_path):
    follow(begun(PAGES[0], tmp_path), tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES[1:])
def test_a_tutorial_says_what_happens(page, tmp_path):
    follow(begun(page, tmp_path), tmp_path)
    if page == "recordings":  # made by its script anew: the other pages use those that ship
        for file in SHIPPED.glob("*.csv"):
            made, shipped = (
                np.loadtxt((line.replace(",", ".") for line in path.read_text().splitlines()[1:]), delimiter=";")
                for path in (tmp_path / file.name, file)
            )
            np.testing.assert_allclose(made, shipped, atol=2e-4)


@pytest.mark.slow
def test_the_files_of_the_day_at_the_bench_are_those_of_its_script():
    """Counts of the load cell, of 2.3 uN each, within what the steps of an integration may change."""
    made = runpy.run_path(str(ROOT / "examples" / "bench_day" / "make.py"))["files"]("A15_2", 15, 1.0, 1)
    for name, lines in made.items():
        shipped = (SHIPPED / name).read_text(encoding="utf-8").splitlines()
        assert len(lines) == len(shipped)
        numbers = [[*map(float, NUMBER.findall(" ".join(each[1:])))] for each in (lines, shipped)]
        np.testing.assert_allclose(*numbers, atol=20 if name.startswith("cell") else 0.02)
