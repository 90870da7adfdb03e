"""The pages made from the code: formulas, and the tables of robot files."""

import importlib.util
import math
import re
from dataclasses import fields
from pathlib import Path
from types import ModuleType
from xml.etree import ElementTree

import pytest

from nectosome.cli.app import app
from nectosome.designs import QUANTITIES, Problem
from nectosome.papers.gallery.entries import ENTRIES

DOCS = Path(__file__).parents[2] / "docs"


def load(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(f"docs_{name}", DOCS / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(
    ("latex", "mathml"),
    [
        (r"\tfrac{h}{2}", "<mfrac><mrow><mi>h</mi></mrow><mrow><mn>2</mn></mrow></mfrac>"),
        (r"\dot v_1", '<msub><mover><mi>v</mi><mo stretchy="false">.</mo></mover><mn>1</mn></msub>'),
        ("x^2_i", "<msubsup><mi>x</mi><mi>i</mi><mn>2</mn></msubsup>"),
    ],
)
def test_a_formula_becomes_mathml(latex: str, mathml: str):
    row = load("formulas").mathml(latex)[0]
    assert "".join(ElementTree.tostring(part, encoding="unicode") for part in row) == mathml


def test_a_formula_with_an_unknown_command_is_refused():
    with pytest.raises(ValueError, match="nonsense is not known"):
        load("formulas").mathml(r"\nonsense")


def test_the_page_on_design_has_every_quantity_and_every_field_of_a_problem():
    table = load("generate").quantities()
    assert [name for name in QUANTITIES if f"| `{name}` |" not in table] == []
    page = (DOCS / "design.md").read_text(encoding="utf-8")
    assert "generated/quantities.md" in page
    assert [f.name for f in fields(Problem) if f"| `{f.name}` |" not in page] == []


def test_every_command_is_on_the_page_of_commands():
    written = {name.split()[0] for name in load("generate").COMMANDS}
    assert written == {name for name in app if not name.startswith("-")}


def test_the_gallery_has_every_robot_as_it_is_now_with_the_numbers_of_a_run():
    """Else `nectosome reproduce`, and `make docs`, renew it."""
    page = (DOCS / "gallery_robots.md").read_text(encoding="utf-8")
    sections = dict(section.split("\n", 1) for section in page.removeprefix("## ").split("\n## "))
    assert list(sections) == [entry.title for entry in ENTRIES]
    for entry in ENTRIES:
        section = sections[entry.title]
        assert f"{entry.what} {entry.drive}\n" in section
        assert f"$ {entry.command}\n" in section
        assert (DOCS / "img" / f"gallery_{entry.name}.png").exists()
        numbers = next(line for line in section.splitlines() if re.match(r"\| -?\d", line)).split("|")[1:-1]
        assert all(math.isfinite(float(number)) for number in numbers)
        assert section.count("published") - len(entry.held) in (0, 1)


def test_the_tables_hold_every_field_of_a_rod_with_unit_and_range():
    page = load("generate").robot_fields()
    assert "| `young` | pressure | Pa | more than 0 Pa | **needed** |" in page
    assert "| `poisson` | number |  | from 0 to 0.5 | `0.5` |" in page
    assert "### Cylinder added mass load" in page
