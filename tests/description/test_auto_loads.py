"""`water: auto`: a file with it is the robot of the file written out; each shape has loads or a sentence."""

import math
import re

import pytest

from nectosome.description import dump_robot, load_robot, parse_robot
from nectosome.description.auto_file import auto_loads, write_auto_loads
from nectosome.units import InputError

SINE = "joint: {kind: revolute, axis: z, motion: {kind: sine, amplitude: 25 deg, frequency: 0.8 Hz}}"
HULL = (
    "body: {kind: rigid, shape: spheroid, length: 0.3 m, radius: 40 mm, mass: 1.8 kg, joint: {kind: free}, water: auto}"
)
FLIPPER = f"""at: root, rotation: [90 deg, 0 deg, 90 deg], {SINE}, water: auto"""
BOX = "kind: rigid, shape: box, length: 0.2 m, width: 2 mm, height: 50 mm, mass: 20 g"
ROD = "kind: rod, section: ellipse, length: 0.2 m, young: 1 MPa, density: 1000 kg/m3, strains: {bending_z: 1}"
PLATE = (
    "kind: rigid, shape: {outline: [[0 mm, -20 mm], [200 mm, -10 mm], [200 mm, 10 mm], [0 mm, 20 mm]], "
    "thickness: 2 mm, plane: xz}, mass: 20 g"
)
ALL = f"""
name: ray # with comments
{HULL}
limbs:
  # a pair
  fin: {{{BOX}, repeat: {{mirror: y}}, # both sides
    {FLIPPER}}}
  tail:
    {ROD.replace(", ", chr(10) + "    ").replace("{bending_z: 1}", "{bending_z: 1}")}
    width: 8 mm
    height: 50 mm
    at: root
    rotation: [0 deg, 0 deg, 180 deg]
    water: auto # first guesses
    loads:
      # of our own
      drag: {{kind: drag, normal: 1.3}}
  arm:
    {{kind: rigid, shape: cylinder, length: 0.1 m, radius: 5 mm, mass: 10 g, repeat: {{count: 3, around: x}},
     rotation: [0 deg, 60 deg, 0 deg], {SINE}, water: auto, loads: {{}}}}
"""


def chosen(limb: str, text: str = f"name: robot\n{HULL}\nlimbs:\n  limb: {{LIMB}}\n") -> dict:
    """Loads of a limb, by name their numbers."""
    part = parse_robot(text.replace("LIMB", limb)).parts["limb"]
    return {name: dict(load) for name, load in part.loads.items()}


def test_a_file_with_auto_is_the_robot_of_the_file_written_out_which_keeps_its_comments(tmp_path):
    path = tmp_path / "ray.yaml"
    path.write_text(ALL)
    before = load_robot(path)
    write_auto_loads(path, auto_loads(path, before))
    text = path.read_text()
    assert "auto" not in text and load_robot(path) == before
    assert parse_robot(dump_robot(before)) == before
    comments = [
        "# with comments",
        "# a pair",
        "# both sides",
        "# first guesses",
        "# of our own\n      drag: {kind: drag,",
    ]
    assert all(one in text for one in comments)
    kept = [line for line in ALL.splitlines() if "auto" not in line]
    assert all(line in text.splitlines() for line in kept)
    write_auto_loads(path, auto_loads(path, before))
    assert path.read_text() == text  # nothing more is to be written


def test_lines_end_as_they_did(tmp_path):
    texts = []
    for ends in ("\n", "\r\n"):
        path = tmp_path / "ray.yaml"
        path.write_text(ALL, newline=ends)
        write_auto_loads(path, auto_loads(path, load_robot(path)))
        texts.append(path.read_bytes())
    assert texts[1] == texts[0].replace(b"\n", b"\r\n")


def test_the_word_may_be_a_group(tmp_path):
    group = ALL.replace("water: auto #", "water: #").replace("water: auto", "water: {auto: true}")
    group = group.replace("water: # first guesses\n", "water: # first guesses\n      auto: true\n")
    texts = []
    for k, text in enumerate((ALL, group)):
        path = tmp_path / f"{k}.yaml"
        path.write_text(text)
        before = load_robot(path)
        write_auto_loads(path, auto_loads(path, before))
        assert load_robot(path) == before
        texts.append(path.read_text())
    assert texts[1] == texts[0]


def test_copies_have_the_loads_of_the_first_one_as_its_images():
    parts = parse_robot(ALL).parts
    assert parts["fin2"].loads == {name: load.image() for name, load in parts["fin1"].loads.items()}
    assert parts["arm1"].loads == parts["arm2"].loads == parts["arm3"].loads
    assert [*parts["arm1"].loads] == ["drag", "added_mass"]


def test_given_loads_stay_and_what_is_missing_is_added():
    tail = parse_robot(ALL).parts["tail"]
    assert sorted(tail.loads) == ["added_mass", "drag", "trailing_edge"] and dict(tail.loads["drag"])["normal"] == 1.3


@pytest.mark.parametrize(
    ("limb", "kinds"),
    [
        (f"{BOX}, {FLIPPER}", ["foil"]),
        (f"{PLATE}, {FLIPPER}".replace("[90 deg, 0 deg, 90 deg]", "[90 deg, 0 deg, 90 deg]"), ["foil"]),
        (f"{ROD}, width: 40 mm, height: 4 mm, {FLIPPER}".replace("[90 deg, 0", "[0 deg, 0"), ["foil"]),
        (f"{BOX}, {FLIPPER}".replace("[90 deg, 0", "[0 deg, 0"), ["plate_drag", "added_mass"]),
        (f"{BOX}, {FLIPPER}".replace("[90 deg, 0 deg, 90 deg]", "[0 deg, 0 deg, 180 deg]"),
         ["added_mass", "plate_drag", "skin_friction", "trailing_edge"]),
        (f"kind: rigid, shape: cylinder, length: 0.1 m, radius: 5 mm, mass: 10 g, {FLIPPER}", ["drag", "added_mass"]),
        (f"kind: rigid, shape: capsule, length: 0.1 m, radius: 5 mm, mass: 10 g, {FLIPPER}", ["drag", "added_mass"]),
        (f"kind: rigid, shape: spheroid, length: 0.1 m, radius: 5 mm, mass: 10 g, {FLIPPER}",
         ["lumped_drag", "spheroid_added_mass"]),
        ("kind: rigid, shape: cylinder, length: 0.1 m, radius: 50 mm, mass: 1 kg, water: auto",
         ["cylinder_added_mass", "lumped_drag"]),
        ("kind: rigid, shape: capsule, length: 0.3 m, radius: 50 mm, mass: 1 kg, water: auto",
         ["added_mass", "lumped_drag"]),
        ("kind: rigid, shape: box, length: 0.1 m, width: 50 mm, height: 50 mm, mass: 1 kg, water: auto",
         ["added_mass", "lumped_drag"]),
    ],
)  # fmt: skip
def test_every_shape_gets_the_loads_of_its_row(limb: str, kinds: list[str]):
    assert [*chosen(limb)] == kinds


@pytest.mark.parametrize(
    ("limb", "said"),
    [
        ("kind: rigid, shape: point, mass: 10 g, water: auto", "a point has no size. Give its loads instead."),
        (f"{BOX}, {FLIPPER}, loads: {{foil: {{kind: skin_friction}}}}", "auto adds a load called foil, and one of an"),
        (f"{BOX}, {FLIPPER.replace('auto', 'automatic')}", '"automatic"'),
    ],
)
def test_what_has_no_loads_and_bad_values_are_told(limb: str, said: str):
    with pytest.raises(InputError, match=re.escape(said)) as told:
        chosen(limb)
    assert told.value.field == "limbs.limb.water"


def test_a_foil_has_the_planform_of_its_part():
    box, rod = chosen(f"{BOX}, {FLIPPER}")["foil"], f"{ROD}, width: 40 mm, tip_width: 20 mm, height: 4 mm, {FLIPPER}"
    assert (box["span_along"], box["chord"], box["thickness"]) == ("x", (0.05,), 0.002) and box["ahead"][-1] == "z"
    along = chosen(rod.replace("[90 deg, 0", "[0 deg, 0"))["foil"]
    assert (along["span_along"], along["chord"]) == ("x", (0.04, 0.02)) and along["ahead"][-1] == "y"
    outline = chosen(f"{PLATE}, {FLIPPER}")["foil"]
    assert outline["chord"] is None and outline["span"] is None  # which the outline says


def test_numbers_are_those_of_the_laws_that_are_named():
    """A plate of A = 4 across the flow, 1.11 + 0.018 A; a spheroid's first guess, as a mesh of its form has it."""
    paddle = chosen(f"{BOX}, {FLIPPER}".replace("[90 deg, 0", "[0 deg, 0"))
    assert paddle["plate_drag"]["normal"] == pytest.approx(1.11 + 0.018 * 4, abs=0.005)
    assert paddle["added_mass"]["length"] == 0.2 and paddle["plate_drag"]["start_up"] is not None
    ball = "kind: rigid, shape: spheroid, length: 0.1 m, radius: 50 mm, mass: 0.5 kg, water: auto"
    drag = chosen(ball)["lumped_drag"]
    assert drag["drag_area"] == pytest.approx([0.47 * math.pi * 0.05**2] * 3, rel=0.005)
    assert drag["rotational"] == (0.0, 0.0, 0.0)


def test_the_first_guess_of_turning_is_that_of_a_mesh_of_the_same_form():
    """By strips of a cylinder's width; the mesh has 64 sides and 60 slices."""
    import numpy as np

    from nectosome.geometry.drag_guesses import guessed_turning
    from nectosome.geometry.triangles import Triangles

    length, radius, n = 0.6, 0.05, 64
    limb = f"kind: rigid, shape: cylinder, length: {length} m, radius: {radius} m, mass: 5 kg, water: auto"
    drag = chosen(limb)["lumped_drag"]
    turn = 2 * np.pi * np.arange(n) / n
    rim = radius * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    ends = [np.column_stack([np.full(n, x), rim]) for x in (-length / 2, length / 2)]
    vertices = np.concatenate([*ends, [[-length / 2, 0, 0], [length / 2, 0, 0]]])
    k, j = np.arange(n), np.roll(np.arange(n), -1)
    low, high = np.full(n, 2 * n), np.full(n, 2 * n + 1)
    faces = np.concatenate(
        [np.stack(f, axis=1) for f in ((k, j, n + j), (k, n + j, n + k), (low, j, k), (high, n + k, n + j))]
    )
    coefficients = drag["drag_area"][1] / (2 * radius * length)
    expected = guessed_turning(Triangles(vertices, faces), (0.0, coefficients, coefficients))
    assert drag["rotational"] == pytest.approx(expected, rel=0.02, abs=1e-9)


def test_a_part_that_is_written_once_for_two_is_not_written_out(tmp_path):
    """Of a mapping that an alias repeats, one may be in another place, and have other loads."""
    path = tmp_path / "two.yaml"
    one = f"{{{BOX}, {FLIPPER}}}"
    path.write_text(f"name: two\n{HULL.replace(', water: auto', '')}\nlimbs:\n  one: &fin {one}\n  other: *fin\n")
    robot = load_robot(path)
    before = path.read_text()
    with pytest.raises(InputError, match="written for several"):
        write_auto_loads(path, auto_loads(path, robot))
    assert path.read_text() == before
