"""Numbers, tables, trees and sentences as text that fits a width, and as JSON."""

import math

import pytest

from nectosome.io.summary import Summary
from nectosome.io.tables import Branch, Label, Number, Table, wrapped

POWERS = Table(
    "power",
    {"of": "power into the robot", "mean": "mean", "peak": "largest"},
    [
        ("arm.angle", Number(7.29412, "W", 9.0), Number(9.0, "W")),
        (Label("hull_drag", "hull drag"), Number(-2.0, "W", 3.0), Number(3.0, "W")),
        ("spring", Number(2e-8, "W", 0.1), Number(0.1, "W")),
        ("viscous", Number(-9.7e-10, "W"), Number(1e-6, "W")),
        ("sum", Number(1e-4, "W", 9.0)),
    ],
    computed=True,
)


def text(table: Table | Branch | Summary, width: int = 80) -> list[str]:
    return [line.plain for line in table.lines(width)]


def test_numbers_stand_flush_right_with_their_unit_behind_and_noise_is_zero():
    assert text(POWERS) == [
        "power into the robot    mean  largest",
        "arm.angle              7.294        9 W",
        "hull drag                 -2        3 W",
        "spring                     0      0.1 W",
        "viscous                    0    1e-06 W",
        "sum                   0.0001          W",
    ]


def test_json_has_numbers_as_they_are_with_their_units():
    found = POWERS.to_json()
    assert found["viscous"] == {"mean": {"value": -9.7e-10, "unit": "W"}, "peak": {"value": 1e-6, "unit": "W"}}
    assert found["hull_drag"]["mean"] == {"value": -2.0, "unit": "W"}
    assert found["sum"] == {"mean": {"value": 1e-4, "unit": "W"}}


def test_what_is_given_is_never_made_zero():
    rows = [("E", Number(2e11, "Pa")), ("pressure", Number(1.0, "Pa"))]
    assert text(Table("parameters", {"name": "parameter", "value": "value"}, rows))[2].split() == [
        "pressure",
        "1",
        "Pa",
    ]


def test_an_axis_on_which_nothing_happens_is_not_shown():
    vector = (Number(0.5, "m/s"), Number(1e-17, "m/s"), Number(0.0, "m/s"))
    table = Table("body", {"of": "body", "x": "x", "y": "y", "z": "z"}, [("velocity", *vector)], computed=True)
    assert text(table) == ["body        x", "velocity  0.5 m/s"]
    assert table.to_json()["velocity"]["y"] == {"value": 1e-17, "unit": "m/s"}
    assert text(Table("body", {"of": "body", "x": "x"}, [("velocity", Number(0.0, "m/s"))], computed=True)) == []


def test_a_column_of_which_nothing_is_known_is_not_shown():
    table = Table(
        "fit", {"of": "parameter", "value": "value", "known": ""}, [("E", Number(1.0), ""), ("L", Number(2.0))]
    )
    assert text(table) == ["parameter  value", "E              1", "L              2"]


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_what_is_no_number_is_null_with_a_reason(value):
    assert Number(value, "s", shown="never").to_json() == {"value": None, "unit": "s", "reason": "never"}
    assert Number(value).to_json() == {"value": None, "unit": "1", "reason": "not defined"}


WIDE = Table(
    "wide",
    {"name": "parameter", **{f"c{k}": f"column {k}" for k in range(9)}, "said": ""},
    [
        (
            f"limbs.tail{row}.young",
            *(Number(1234.5 * k, f"u{k}") for k in range(9)),
            "known to 0.25 N m/rad or so, " * 4,
        )
        for row in range(3)
    ],
)


@pytest.mark.parametrize("width", [40, 60, 80, 100, 200])
def test_a_table_that_does_not_fit_goes_on_below_and_words_are_wrapped(width):
    lines = text(WIDE, width)
    assert max(map(len, lines)) <= width
    assert [line for line in lines if line != line.rstrip()] == []
    for k in range(9):
        assert sum(f"column {k}" in line for line in lines) == 1
    assert " ".join(" ".join(lines).split()).count("0.25 N m/rad") == 12 or width < 100
    assert [line for line in lines if line.split()[-1:] in (["0.25"], ["N"])] == []


@pytest.mark.parametrize("width", range(20, 60))
def test_no_line_ends_within_a_word_or_between_a_number_and_its_unit(width):
    said = "the servo gives 0.25 N m at 14.4 rad/s, with 4 joints of 3000 Pa s and 12 mm2, half-way at 5 % of it"
    lines = wrapped(said, width)
    assert max(map(len, lines)) <= width
    assert " ".join(line.strip() for line in lines) == said
    assert [line for line in lines if line[-1].isdigit() and not line.endswith("mm2")] == []
    assert [line for line in lines if line.endswith((" N", " Pa"))] == []


def test_a_path_is_broken_behind_its_slashes_only():
    assert wrapped("pneumatic/circle/dahl-pressure/limit", 20, "") == ["pneumatic/circle/", "dahl-pressure/limit"]


def test_a_tree_keeps_its_lines_to_the_end():
    tail = Branch("tail", "rod, length 0.2 m, young 1 MPa, density 1000 kg/m3", [Branch("joint", "revolute")])
    tree = Branch("body", "rigid", [tail, Branch("drag", "normal 1")])
    assert text(tree, 34) == [
        "body  rigid",
        "├── tail  rod, length 0.2 m, young",
        "│   1 MPa, density 1000 kg/m3",
        "│   └── joint  revolute",
        "└── drag  normal 1",
    ]


def test_a_page_has_its_parts_apart_and_its_status_last():
    page = Summary("eel: steady motion", [POWERS], notes=["means: over the cycle"], warnings=["it is rough"],
                   attributes={"status": "SOLVED", "status_reason": "solved", "seconds": 1.25})  # fmt: skip
    lines = text(page)
    assert lines[:2] == ["eel: steady motion", ""]
    assert lines[-4:] == [
        "",
        "means: over the cycle",
        "warning: it is rough",
        "status: SOLVED, solved; 1.2 s to compute",
    ]
    found = page.to_json()
    assert (found["status"], found["values"]["seconds"]) == ("SOLVED", {"value": 1.25, "unit": "s"})


def test_a_column_without_words_takes_no_room():
    """As that of units has none where all numbers are coefficients."""
    table = Table("parameters", {"name": "", "value": "", "unit": ""}, [("Cn", "x", ""), ("Ca", "y", "")])
    assert [line.plain for line in table.lines(80)] == ["Cn  x", "Ca  y"]
