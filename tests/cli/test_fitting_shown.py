"""Check and show tell before a run how parts move and which loads fit them; a run tells where others do."""

import json
from pathlib import Path

import numpy as np
import pytest

from nectosome.description import parse_robot
from nectosome.description.ranges import NUMBERS
from nectosome.solve.summaries.stroke_tables import after_run

FLIPPER = """
name: flipper
water: {gravity: 0 m/s2}
body: {kind: rigid, shape: spheroid, length: 0.3 m, radius: 40 mm, mass: 1.8 kg, joint: {kind: fixed}}
limbs:
  fin: {kind: rigid, shape: box, length: 0.2 m, width: 2 mm, height: 50 mm, mass: 20 g, at: root,
    rotation: [90 deg, 0 deg, 90 deg], repeat: {mirror: y},
    joint: {kind: revolute, axis: z, motion: {kind: sine, amplitude: 25 deg, frequency: 0.8 Hz}},
    loads: {water: LOAD}}
"""
FOIL, PLATE = "{kind: foil, span_along: x, ahead: -z, chord: 50 mm}", "{kind: plate_drag, normal: 1.2}"


@pytest.fixture
def flipper(nectosome):
    Path("flipper.yaml").write_text(FLIPPER.replace("LOAD", PLATE))
    Path("foil.yaml").write_text(FLIPPER.replace("LOAD", FOIL))
    return nectosome


def test_check_and_show_print_moved_parts_and_what_fits_them_in_80_columns(flipper):
    checked, shown = flipper("check", "flipper.yaml"), flipper("show", "flipper.yaml")
    lines = checked.out.splitlines()
    assert checked.code == 0 and "ok, 3 parts" in lines[0] and max(map(len, lines)) <= 80
    first = next(i for i, line in enumerate(lines) if line.startswith("moved part"))
    told = [" ".join(line.split()) for line in lines[first:]]
    assert told[:2] == ["moved part f sweep Re KC moored", "fin1 and 1 other 0.8 Hz 170 mm 21000 10 90 deg"]
    assert "fin1 and 1 other fin plate_drag foil" in told
    assert "\n".join(lines[first:]) in shown.out


def test_json_has_the_numbers_as_they_are(flipper):
    for command in ("check", "show"):
        tables = json.loads(flipper(command, "foil.yaml", "--json").out)["tables"]
        assert tables["moved"]["fin1"]["frequency"] == {"value": 0.8, "unit": "Hz"}
        assert tables["moved"]["fin1"]["speed"]["value"] is None  # of a robot that is held
        assert tables["fitting"]["fin1"] == {"as": "fin", "has": "foil", "fits": "what it has"}
        assert tables["regimes"]["fin"].startswith("gentle fins to 6 %")


def test_a_run_says_where_other_loads_fit_and_only_there():
    """The numbers of a run are made up: of a load on both fins; in oil that a stroke hardly stirs a rod is a thread."""
    size, both = "section: circle, length: 0.2 m, radius: 2 mm", "fin1 and 1 other: a"
    rod = f"kind: rod, {size}, young: 1 MPa, density: 1000 kg/m3, strains: {{bending_z: 0}}"
    box = "kind: rigid, shape: box, length: 0.2 m, width: 2 mm, height: 50 mm, mass: 20 g"
    web = "{sheet: {between: fin, thickness: 1 mm, young: 1 kPa, density: 1 g/cm3, loads: {drag: " + PLATE + "}}}"
    drag = FLIPPER.replace(box, rod).replace("LOAD", "{kind: drag, normal: 1}")
    cases = {
        FLIPPER.replace("LOAD", PLATE): f"{both} fin by shape and place, which takes foil; it has plate_drag",
        FLIPPER.replace("LOAD", FOIL): None,
        FLIPPER.replace("LOAD", PLATE) + f"webs: {web}\n": None,  # whose water is that of the web
        drag: f"{both} thread by shape and place, which takes stokes_drag; it has drag",
    }
    for text, said in cases.items():
        parts = ["body", "fin1", "fin2"]
        numbers = np.full((len(NUMBERS), 1, 3), 0.05)
        arrays = {"load": np.array(["water"]), "part": np.array(parts), "flow_number": numbers}
        arrays |= {"load_power": np.ones((1, 3)), "load_force": np.ones((1, 3, 3))}
        assert after_run(arrays, parse_robot(text)) == ([] if said is None else [said])


def test_nothing_is_told_of_robots_that_no_motion_moves(flipper):
    text = FLIPPER.replace("LOAD", PLATE).replace(", motion: {kind: sine, amplitude: 25 deg, frequency: 0.8 Hz}", "")
    Path("flipper.yaml").write_text(text)
    assert len(flipper("check", "flipper.yaml").out.splitlines()) == 1


def test_check_tells_what_auto_has_chosen_and_writes_it_out(flipper):
    text = FLIPPER.replace("loads: {water: LOAD}", "water: auto")
    Path("auto.yaml").write_text(text)
    assert "water: auto  is a  chosen" in flipper("check", "auto.yaml").out
    (row,) = json.loads(flipper("check", "auto.yaml", "--json").out)["tables"]["auto"]
    assert row["load"] == "foil, span_along: x, ahead: z, chord: 50 mm, thickness: 2 mm"
    assert (row["part"], row["as"], row["source"]) == ("fin", "fin", "span and chord of the part")
    assert Path("auto.yaml").read_text() == text
    assert flipper("check", "auto.yaml", "--write").code == 0
    foil = "loads: {foil: {kind: foil, span_along: x, ahead: z, chord: 50 mm, thickness: 2 mm}}"
    assert Path("auto.yaml").read_text() == text.replace("water: auto", foil)
    assert "water: auto" not in flipper("check", "auto.yaml").out
    refused = flipper("check", "auto.yaml", "--write", "--set", "limbs.fin1.mass=30 g")
    assert refused.code == 2 and "Leave one of the two out" in refused.err


@pytest.mark.slow
def test_a_fin_alone_that_flaps_with_auto_has_a_cycle(flipper):
    text = FLIPPER.replace("loads: {water: LOAD}", "water: auto").replace("repeat: {mirror: y},", "")
    Path("auto.yaml").write_text(text)
    found = flipper("periodic", "auto.yaml")
    assert found.code == 0 and "foil on fin" in found.out
