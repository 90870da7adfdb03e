# ruff: noqa: E501  (tables: one case a line)
"""Soft plates in robot files: short forms, mirror images, what is refused and why, and that they read back."""

import pytest

from nectosome.description import SoftPlate, dump_robot, get_value, numeric_paths, parse_robot, with_values
from nectosome.description.drag import PlateDragLoad
from nectosome.description.plausible import implausible
from nectosome.units import InputError

TEXT = """
name: finned
body: {kind: rigid, shape: cylinder, radius: 20 mm, length: 60 mm, density: 1 g/cm3}
limbs:
  fin: {kind: soft_plate, offset: [0 mm, 20 mm, 0 mm], length: 60 mm, width: [20 mm, 40 mm], middle: [0 mm, 5 mm], thickness: [[2 mm, 1 mm, 1 mm], [1 mm, 0.5 mm, 0.5 mm]], young: 1 MPa, density: 1 g/cm3, repeat: {mirror: y}, loads: {drag: {kind: plate_drag, normal: 1.2}, water: {kind: sheet_added_mass}}}
  vane: {kind: soft_plate, length: 60 mm, width: 20 mm, thickness: 1 mm, young: 1 MPa, density: 1 g/cm3, water: auto}
"""


def fin(d, name="fin1") -> SoftPlate:
    part = d.limbs[name]
    assert isinstance(part, SoftPlate)
    return part


def test_numbers_have_paths_and_short_forms():
    d = parse_robot(TEXT)
    assert fin(d, "vane").thickness == ((1e-3,),)
    assert fin(d, "vane").width == (0.02,)
    assert {"limbs.fin1.thickness.1.2", "limbs.fin1.width.1", "limbs.vane.thickness.0.0"} <= {*numeric_paths(d)}
    assert get_value(with_values(d, {"limbs.fin1.thickness.1.2": 2e-3}), "limbs.fin1.thickness.1.2") == 2e-3
    row = parse_robot(TEXT.replace("thickness: 1 mm", "thickness: [1 mm, 0.5 mm]"))
    assert fin(row, "vane").thickness == ((1e-3,), (0.5e-3,))
    for one in (d, row):
        assert parse_robot(dump_robot(one)) == one


def test_the_image_of_a_plate_has_its_table_turned_round():
    one, other = (fin(parse_robot(TEXT), name) for name in ("fin1", "fin2"))
    assert other.middle == (0.0, -0.005)
    assert other.thickness == tuple(row[::-1] for row in one.thickness)
    drag = one.loads["drag"]
    assert isinstance(drag, PlateDragLoad) and drag.start_up is not None  # left open: a fin goes to and fro


def test_auto_gives_a_plate_its_water():
    assert {load.kind for load in fin(parse_robot(TEXT), "vane").loads.values()} == {"plate_drag", "sheet_added_mass"}


@pytest.mark.parametrize(
    ("there", "instead", "message"),
    [
        ("[1 mm, 0.5 mm, 0.5 mm]", "[1 mm, 0.5 mm]", "limbs.fin.thickness.1: row 2 of the table has 2 numbers, the first one 3. Give each row as many, from the edge at -y to that at +y."),
        ("thickness: 1 mm", "thickness: 1", "limbs.vane.thickness"),
        ("thickness: 1 mm", "thickness: -1 mm", 'limbs.vane.thickness.0.0: "-1 mm" is out of range'),
        ("thickness: 1 mm, ", "", "limbs.vane.thickness: is missing."),
        ("width: 20 mm", "width: []", "limbs.vane.width"),
        ("width: 20 mm", "width: 20 mm, modes: [4, 5]", "limbs.vane.points.1: 5 points across it do not tell 5 functions apart. Give at least 6, or fewer modes."),
        ("width: 20 mm", "width: 20 mm, modes: [4, 9]", "limbs.vane.modes.1"),
        ("width: 20 mm", "width: 20 mm, strains: {bending_y: 1}", "limbs.vane.strains"),
        ("width: 20 mm", "width: 20 mm, poisson: 0.6", "limbs.vane.poisson"),
        ("kind: sheet_added_mass", "kind: added_mass, normal: 1", "limbs.fin.loads.water.kind: added_mass does not act on a soft plate. Take plate_drag and sheet_added_mass."),
        ("water: auto}", "water: auto}\npairs: {pin: {kind: bushing, between: [body, vane], stiffness: 1 N/m}}", "pairs.pin.between.1: vane is a soft plate, on which no pair acts. Name a rigid part or a rod."),
        ("water: auto}", "water: auto}\nwebs: {skin: {between: [fin1, vane], thickness: 1 mm, young: 1 MPa, density: 1 g/cm3}}", "webs.skin.between: fin1 is a soft plate. A web joins rods, or rigid bodies with a length."),
    ],
)  # fmt: skip
def test_a_plate_that_does_not_fit_is_told(there, instead, message):
    assert there in TEXT
    with pytest.raises(InputError) as caught:
        parse_robot(TEXT.replace(there, instead), "robot.yaml")
    assert message in str(caught.value)


def test_a_plate_that_is_not_thin_is_told():
    thick = parse_robot(TEXT.replace("thickness: 1 mm", "thickness: 3 mm"))
    told = {path: words for path, words in implausible(thick) if path == "limbs.vane.thickness"}
    assert "more than a tenth of its shorter side" in told["limbs.vane.thickness"]
    assert not [path for path, _ in implausible(parse_robot(TEXT)) if path.endswith("thickness")]
