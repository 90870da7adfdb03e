"""`identify ROBOT` with shapes at rest: one reading of a strip that hangs out sideways, and tables of weights."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from nectosome import static
from nectosome.description import load_robot
from nectosome.io import load_dataset
from nectosome.solve import reading

from .answers import check_made, check_wrong

EXAMPLE = Path(__file__).parents[2] / "examples" / "hanging_test"

STRIP = """
name: strip
about: A silicone strip clamped at one end, hanging out sideways in air. Its droop tells Young's modulus.
water: {density: 1.2 kg/m3}
body: {kind: rigid, shape: point, mass: 1 kg}
limbs:
  strip:
    kind: rod
    section: rectangle
    length: 120 mm
    width: 20 mm
    height: 4 mm
    young: 1 MPa
    density: 1080 kg/m3
    damping: 20 kPa s
    strains: {bending_y: 3}
    loads: {hook: {kind: force, force: [0 N, 0 N, 0 N]}}
aliases: {E: limbs.strip.young, hook: limbs.strip.loads.hook.force.2}
"""
FIND = ("identify", "strip.yaml", "--vary", "E=0.5..20MPa log", "--compare", "tip=strip.tip.position.z")
ONE = (*FIND, "--campaign", "one.yaml")
MANY = (*FIND, "--campaign", "many.yaml", "--drive", "weight=hook")

WRONG = [
    (*FIND, "--campaign", "timed.yaml"),
    (*FIND, "--campaign", "bare.yaml", "--drive", "weight=hook"),
    (*FIND, "--campaign", "none.yaml"),
    (*MANY, "--drive", "wait=hook"),
    (*MANY, "--drive", "weight=limbs.strip.loads.hok.force.2"),
]
WRONG_ROBOTS = [
    (*ONE, "--vary", "limbs.strip.height=2..8mm"),
    (*MANY, "--drive", "weight=E"),
    (*MANY[:-2], "--drive", "weight=limbs.strip.length"),
]


@pytest.fixture
def bench(tmp_path):
    for name, text in (
        ("strip.yaml", STRIP),
        ("one.csv", "time (s),tip (mm)\n0,-46\n"),
        ("one.yaml", "recordings:\n  - {file: one.csv}\n"),
        ("many.csv", "time (s),weight (mN),tip (mm)\n0,0,-46\n60,-5,-49\n120,5,-42\n"),
        ("many.yaml", "time: none\nrecordings:\n  - {file: many.csv}\n"),
        ("timed.yaml", "recordings:\n  - {file: many.csv}\n"),
        ("bare.csv", "weight (mN),tip (mm)\n0,-46\n-5,-49\n"),
        ("bare.yaml", "recordings:\n  - {file: bare.csv}\n"),
        ("stated.yaml", "columns: {tip: {unit: mm, error: 0.5 mm}}\nrecordings:\n  - {file: one.csv}\n"),
        ("none.yaml", "columns: {tip: {unit: mm, error: 0 mm}}\nrecordings:\n  - {file: one.csv}\n"),
    ):
        (tmp_path / name).write_text(text)
    return tmp_path


@pytest.mark.slow
@pytest.mark.usefixtures("bench")
def test_one_reading_gives_youngs_modulus(nectosome, tmp_path):
    """A droop of 46 mm is that of 3.931 MPa, from a robot of 1 MPa and without a start of its own."""
    answer = nectosome(*ONE, "--starts", "1", "--write", "tuned.yaml", "--plot", "strip.html", "--save", "strip.nc")
    assert (answer.code, answer.err) == (0, "")
    found = load_dataset(tmp_path / "strip.nc")
    assert found["value"].item() == pytest.approx(3.931e6, rel=1e-3)
    for words in ("3.931e+06 Pa", "no interval", "Give it (--error tip=...", "at rest"):
        assert words in " ".join(answer.out.split())
    tuned = static(load_robot(tmp_path / "tuned.yaml"))
    assert reading(tuned, "strip.tip.position.z")[0] == pytest.approx(-0.046, rel=1e-6)
    page = (tmp_path / "strip.html").read_text()
    assert "nan" not in page.split("<script")[0]
    assert "Recording one" in page


@pytest.mark.usefixtures("bench")
@pytest.mark.parametrize("how", [(*ONE, "--error", "tip=0.5mm"), (*FIND, "--campaign", "stated.yaml")])
def test_a_stated_error_gives_the_interval(nectosome, how):
    """0.5 mm of a droop that changes with log E by 35.85 mm: +- 1.96 * 0.5 / 35.85 = 2.73 %."""
    answer = nectosome(*how, "--starts", "1", "--json")
    (one,) = json.loads(answer.out)["tables"]["parameters"].values()
    low, value, high = (one[key]["value"] for key in ("low", "value", "high"))
    assert value == pytest.approx(3.931e6, rel=1e-3)
    assert np.log([value / low, high / value]) == pytest.approx([0.02734] * 2, rel=2e-3)
    assert answer.code == 0


@pytest.mark.slow
@pytest.mark.usefixtures("bench")
def test_a_table_of_weights_is_fitted_and_shown_row_by_row(nectosome):
    answer = nectosome(*MANY, "--starts", "1", "--json")
    told = json.loads(answer.out)["tables"]
    (one,) = told["parameters"].values()
    assert one["low"]["value"] < 3.931e6 < one["high"]["value"]
    assert [row["measured"]["value"] for row in told["rows"]] == [-0.046, -0.049, -0.042]
    assert [row["row"]["value"] for row in told["rows"]] == [1, 2, 3]
    assert answer.code == 0


@pytest.mark.usefixtures("bench")
@pytest.mark.parametrize("cases", [WRONG, pytest.param(WRONG_ROBOTS, marks=pytest.mark.slow)])
def test_what_is_wrong_is_told_in_one_sentence(nectosome, tmp_path, cases):
    check_wrong(nectosome, cases, tmp_path)


@pytest.mark.usefixtures("bench")
@pytest.mark.parametrize("error", [(), ("--error", "tip=0.5mm")])
def test_a_modulus_that_changes_nothing_is_not_identifiable(nectosome, error):
    """On a free hinge the strip hangs straight down, whatever its modulus."""
    answer = nectosome(*ONE, "--set", "limbs.strip.joint={kind: revolute, axis: y}", "--starts", "1", *error)
    assert "E: not identifiable: what was compared does not change with it" in " ".join(answer.out.split())


@pytest.mark.usefixtures("bench")
def test_rows_without_times_are_told_how_to_be_read(nectosome):
    answer = nectosome(*FIND, "--campaign", "bare.yaml")
    assert "write time: none there, where each row is a shape at rest" in " ".join(answer.err.split())


@pytest.mark.slow
def test_the_example_finds_the_filament_that_made_it(nectosome, tmp_path):
    """7.9 MPa lie in an interval of less than a tenth to each side; 12 readings of 1 mm."""
    shutil.copytree(EXAMPLE, tmp_path / "lab")
    drive = [word for name in ("low", "middle", "high") for word in ("--drive", f"{name}={name}")]
    places = {"middle": "filament.0.7", "tip": "filament.tip"}
    read = [f"{name}_{axis}={place}.position.{axis}" for name, place in places.items() for axis in "xz"]
    compare = [word for one in read for word in ("--compare", one)]
    given = ("lab/filament.yaml", "--campaign", "lab/campaign.yaml", "--vary", "E=1..50MPa log", *drive, *compare)
    answer = nectosome("identify", *given, "--starts", "1", "--json")
    told = json.loads(answer.out)
    one = told["tables"]["parameters"]["E"]
    low, high = one["low"]["value"], one["high"]["value"]
    assert low < 7.9e6 < high
    assert high / low < 1.2
    assert told["values"]["error.tip_x"]["value"] == pytest.approx(1e-3, rel=0.5)


@pytest.mark.slow
def test_the_readings_of_the_example_are_what_its_script_makes(tmp_path, monkeypatch):
    check_made(EXAMPLE, tmp_path, monkeypatch, lambda _: 0.11)
