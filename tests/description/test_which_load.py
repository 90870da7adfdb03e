"""What parts are to the water, the loads that fit them, and that no advice of a range leads to another load."""

import re

import pytest

from nectosome.description import parse_robot
from nectosome.description.plausible import implausible
from nectosome.description.shapes import shape_forms
from nectosome.description.which_load import ROWS, fitting, in_regime, in_words, lacking, load_kinds
from nectosome.robots import describe

KINDS = load_kinds()
# rows that the loads which a range names belong to, by the load that warns and the number
ADVISED = {
    ("drag", "reynolds"): "thread",
    ("lumped_drag", "reynolds"): "thread",
    ("plate_drag", "reynolds"): "thread",
    ("trailing_edge", "stalled"): "finned body",
    ("foil", "aspect_ratio"): "body",
}


def named(text: str) -> set[str]:
    """Kinds of loads in a text; "drag" is a word as well."""
    return {word for word in re.findall(r"[a-z_]+", text) if word in KINDS and (word == "foil" or "_" in word)}


def robot(limb: str, forward: str = "x", current: str = ""):
    """A hull with one limb that a motion turns."""
    water = f"water: {{current: {current}}}" if current else ""
    joint = "fixed" if current else "free"
    return parse_robot(f"""
name: robot
forward: {forward}
{water}
body: {{kind: rigid, shape: spheroid, length: 0.3 m, radius: 50 mm, mass: 1 kg, joint: {{kind: {joint}}}}}
limbs:
  limb: {{{limb}}}
""")


def flat(length: str, height: str, rotation: str = "[0 deg, 0 deg, 180 deg]", axis: str = "z", more: str = "") -> str:
    turns = f"joint: {{kind: revolute, axis: {axis}, motion: {{kind: sine, amplitude: 20 deg, frequency: 1 Hz}}}}"
    size = f"kind: rigid, shape: box, length: {length}, width: 4 mm, height: {height}, mass: 20 g"
    return f"{size}, at: root, rotation: {rotation}, {turns}{more}"


def test_every_load_of_the_table_exists_and_the_best_ones_stand_in_it():
    for row in ROWS.values():
        needed, best = {kind for kinds in row.needs for kind in kinds}, {kinds[0] for kinds in row.needs}
        written = {*re.findall(r"`([a-z_]+)`", row.loads)} - {"start_up", "separated"}
        assert needed <= {*KINDS}
        above = re.findall(r"`([a-z_]+)`", ROWS["body"].loads) if row.loads.startswith("as above") else ()
        assert best <= written | {*above} and written - {"trailing_edge"} <= needed | {"trailing_edge"}


@pytest.mark.parametrize("kind", [kind for kind, cls in KINDS.items() if cls.ranges])
def test_a_range_advises_what_the_table_has_for_that_part_and_what_can_act_there(kind: str):
    for one in KINDS[kind].ranges:
        row = ADVISED.get((kind, one.number)) if named(one.beyond) else None
        assert (row is not None) == bool(named(one.beyond)), one.beyond
        fits = {own for kinds in ROWS[row].needs for own in kinds} if row else set()
        assert named(one.beyond) <= fits
        forms = {form for form in (*shape_forms(), "rod") if KINDS[kind].acts_on(form)}
        for load in named(one.beyond):
            assert any(KINDS[load].acts_on(form) for form in forms)


def test_a_plate_along_a_body_is_not_advised_the_start_up_that_is_left_out_there_by_default():
    """The docs say that bodies swim out of their vortices, so that a start-up is for paddles only."""
    (words,) = (one.beyond for one in KINDS["plate_drag"].ranges if one.low == 64)
    assert "give a paddle start_up: {}" in words and "of a body that undulates, and of a thick bar, no law" in words
    assert "start_up" in ROWS["paddle"].loads and "start_up" not in ROWS["body"].loads


@pytest.mark.parametrize(
    ("limb", "row"),
    [
        (flat("40 mm", "80 mm"), "fin"),  # stands upright behind the hull: A = 2
        (flat("200 mm", "80 mm"), "body"),  # A = 0.4
        (flat("90 mm", "40 mm", "[0 deg, 0 deg, 90 deg]"), "paddle"),  # its broad side rows
        (flat("90 mm", "40 mm", "[90 deg, 0 deg, 90 deg]"), "fin"),  # a flipper: the broad side down
        (flat("90 mm", "6 mm"), "limb"),
        (flat("90 mm", "6 mm", more=", on: world"), "limb"),
    ],
)
def test_a_limb_is_what_its_shape_and_its_place_make_it(limb: str, row: str):
    found = robot(limb).in_water
    assert (found["body"].row, found["limb"].row) == ("hull", row)


def test_what_a_limb_is_goes_with_the_axis_that_points_ahead():
    """The same plate flaps ahead of one axis, and rows along the other."""
    limb = flat("90 mm", "40 mm")
    assert robot(limb).in_water["limb"].row == "body" and robot(limb, "y").in_water["limb"].row == "paddle"


def test_a_limb_that_joints_hold_in_a_stream_rests_there_unless_a_motion_turns_it():
    turned, still = flat("90 mm", "40 mm"), flat("90 mm", "40 mm").partition(", joint")[0]
    rows = [robot(limb, current="[0.1 m/s, 0 m/s, 0 m/s]").in_water["limb"].row for limb in (turned, still)]
    assert rows == ["body", "resting limb"]


@pytest.mark.parametrize("form", ["cylinder", "box", "spheroid", "capsule", "mesh", "plate", "rod"])
@pytest.mark.parametrize("row", ROWS)
def test_what_fits_acts_on_the_part(row: str, form: str):
    for kinds in fitting(form, row, True):
        assert all(KINDS[kind].acts_on(form) for kind in kinds)


def test_only_the_last_part_of_a_body_sheds_a_wake():
    assert in_words(fitting("box", "body", True)) == "added_mass, plate_drag, skin_friction, trailing_edge"
    assert in_words(fitting("box", "body", False)) == "added_mass, plate_drag, skin_friction"
    assert in_words(fitting("box", "finned body", True)) == "added_mass, plate_drag, skin_friction, foil"


def test_below_a_reynolds_number_of_a_tenth_a_limb_is_a_thread_and_a_fin_is_not():
    assert [in_regime(row, 0.09) for row in ("limb", "body", "fin")] == ["thread", "thread", "fin"]
    assert in_regime("limb", 0.11) == in_regime("limb", float("nan")) == "limb"


@pytest.mark.parametrize("name", ["eel", "catshark", "kern_eel", "rexeel", "tuna", "octopus", "jelly"])
def test_robots_that_ship_in_water_by_the_table_have_what_fits(name: str):
    robot = describe(name)
    for part, piece in robot.in_water.items():
        if robot.parts[part].loads:
            assert lacking(robot.parts[part], piece.row, piece.last)[1] == [], part


def test_a_body_that_bends_with_a_foil_on_its_tail_is_not_advised_a_trailing_edge_as_well():
    text = """
name: eel
forward: -x
body:
  {kind: rod, section: ellipse, length: 0.3 m, width: 10 mm, height: 30 mm, young: 1 MPa, density: 1000 kg/m3,
   strains: {bending_z: 5}, joint: {kind: planar, axis: z},
   motion: {bending_z: {kind: wave, amplitude: 5 1/m, wavelength: 0.4 m, frequency: 1 Hz}},
   loads: {water: {kind: added_mass, normal: 1}, drag: {kind: drag, normal: 1}}}
limbs:
  fin: {kind: rigid, shape: box, length: 30 mm, width: 2 mm, height: 60 mm, mass: 5 g LOADS}
"""
    foil = ", loads: {foil: {kind: foil, span_along: z, ahead: -x, chord: 30 mm}}"
    told = [list(implausible(parse_robot(text.replace(" LOADS", loads)))) for loads in ("", foil)]
    assert "no trailing_edge" in told[0][0][1] and told[1] == []
