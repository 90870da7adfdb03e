"""What the pages take from the code is as the code has it: else `make docs` renews them."""

import math
import re
import sys
from dataclasses import fields
from functools import cache
from pathlib import Path

import pytest

import nectosome
from nectosome.designs import Problem
from nectosome_studies.gallery.entries import ENTRIES

DOCS = Path(__file__).parents[2] / "docs"
sys.path.insert(0, str(DOCS / "make"))
from generate import pages, renewed  # noqa: E402

LINK = re.compile(r"\]\((?!https?:)([^)\s#]*)(?:#([^)\s]*))?\)")


@pytest.mark.parametrize("page", pages(), ids=lambda page: str(page.relative_to(DOCS.parent)))
def test_what_is_generated_is_up_to_date(page):
    text = page.read_text(encoding="utf-8")
    assert renewed(text) == text


def test_pages_can_be_read_without_building_them():
    """Links lead to files of the clone and to headings in them (of the site, where it fills a list)."""
    wrong = []
    for page in DOCS.rglob("*.md"):
        text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
        assert "--8<--" not in text and "\n::: " not in text
        for to, heading in LINK.findall(text):
            target = (page.parent / to).resolve() if to else page
            if not target.exists():
                wrong.append((page.name, to))
            elif heading and heading not in anchors(target):
                wrong.append((page.name, f"{to}#{heading}"))
    assert wrong == []


@cache
def anchors(page: Path) -> set[str]:
    """Those that a heading gets, in a clone as on the site."""
    titles = re.findall(r"^#+ (.*)$", renewed(page.read_text(encoding="utf-8"), on_site=True), re.MULTILINE)
    return {re.sub(r"\s", "-", re.sub(r"[^\w\s-]", "", title).strip().lower()) for title in titles}


def test_every_room_has_a_page_of_its_names():
    rooms = {name for name in dir(nectosome) if name not in nectosome.__all__}
    assert {path.stem for path in (DOCS / "reference" / "python").glob("*.md")} - {"index"} == rooms


def test_the_page_on_design_has_every_field_of_a_problem():
    page = (DOCS / "how-to" / "design.md").read_text(encoding="utf-8")
    assert [f.name for f in fields(Problem) if f"| `{f.name}` |" not in page] == []


@pytest.mark.parametrize("entry", ENTRIES, ids=lambda entry: entry.name)
def test_the_gallery_has_every_robot_as_it_is_now_with_the_numbers_of_a_run(entry):
    """Else `nectosome reproduce`, and `make docs`, renew it."""
    page = (DOCS / "gallery" / f"{entry.name}.md").read_text(encoding="utf-8")
    assert page.startswith(f"# {entry.title}\n")
    assert f"{entry.what} {entry.drive}\n" in page and f"$ {entry.command}\n" in page
    assert (DOCS / "img" / f"gallery_{entry.name}.png").exists()
    numbers = next(line for line in page.splitlines() if re.match(r"\| -?\d", line)).split("|")[1:-1]
    assert all(math.isfinite(float(number)) for number in numbers)
    assert len(re.findall(r": (?:published|measured|derived) \S+ .*, ours ", page)) == len(entry.held)


def test_the_tables_hold_every_field_of_a_rod_with_unit_and_range():
    page = (DOCS / "reference" / "robot-file.md").read_text(encoding="utf-8")
    assert "| `young` | Young's modulus of the material. | pressure | Pa | more than 0 Pa | **needed** |" in page
