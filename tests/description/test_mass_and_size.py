# ruff: noqa: E501  (tables: one case a line)
"""Moments of inertia and centres of mass against mass and size: matter in a box reaches half its diagonal at most."""

import math

import pytest

from nectosome.description import import_urdf, parse_robot
from nectosome.description.plausible import implausible, meaningless
from nectosome.units import InputError

BOX = """
name: b
body: {kind: rigid, shape: box, length: 200 mm, width: 60 mm, height: 60 mm, MORE, joint: {kind: free}}
"""
EVEN = "4.32e-4 kg m2, 2.616e-3 kg m2, 2.616e-3 kg m2"  # m/12 (b2 + c2)
HALF = math.hypot(100, 30, 30)  # [mm]


def box(more: str) -> dict[str, str]:
    return dict(meaningless(parse_robot(BOX.replace("MORE", more))))


def test_moments_in_another_unit_are_told_with_both_radii_and_the_unit():
    """Of 0.72 kg: 62.72 m = sqrt((432 + 2 x 2616)/(2 x 0.72)), where half the diagonal is 108.6 mm."""
    said = box("mass: 0.72 kg, inertia: [432 kg m2, 2616 kg m2, 2616 kg m2]")["body.inertia"]
    assert "with 720 g they have a radius of gyration of 62.72 m" in said and f"at most {HALF:.1f} mm" in said
    assert "0.00043, 0.0026, 0.0026 kg m2; those given would be like them in kg mm2" in said


@pytest.mark.parametrize(
    ("more", "path"),
    [
        (f"mass: 0.72 kg, inertia: [{EVEN}]", None),
        ("mass: 0.72 kg, inertia: [0 kg m2, 0 kg m2, 0 kg m2]", None),  # a point, by intention
        (f"mass: 720 kg, inertia: [{EVEN}]", "body.inertia"),
        (f"mass: 0.72 g, inertia: [{EVEN}]", "body.inertia"),
        (f"density: 1000 kg/m3, inertia: [{EVEN}]", None),
        ("density: 1000 kg/m3, inertia: [0.1 kg m2, 0.1 kg m2, 0.1 kg m2]", "body.inertia"),
        ("mass: 1 kg, centre_of_mass: [99 mm, 29 mm, -29 mm]", None),
        ("mass: 1 kg, centre_of_mass: [3 m, 0 m, 0 m]", "body.centre_of_mass"),
        ("mass: 1 kg, centre_of_mass: [0 m, 0 m, -109 mm]", "body.centre_of_mass"),
    ],
)
def test_what_matter_inside_can_have_is_not_told(more, path):
    assert list(box(more)) == ([] if path is None else [path])


def test_what_is_fixed_to_a_part_and_the_joints_on_it_count_as_its_size():
    """Masses at both ends of a rod of 1 m have a radius of gyration of 0.5 m, at one end or the other."""
    moved = "inertia: [0 kg m2, 0.2 kg m2, 0.2 kg m2], mass: 0.72 kg"
    assert list(box(moved)) == ["body.inertia"]
    limb = "limbs: {arm: {kind: rigid, shape: box, length: 1 m, width: 60 mm, height: 60 mm, mass: 1 kg, joint: JOINT}}"
    for joint, there in (("{kind: fixed}", []), ("{kind: revolute, axis: z}", ["body.inertia"])):
        whole = BOX.replace("MORE", moved) + limb.replace("JOINT", joint)
        assert [path for path, _ in implausible(parse_robot(whole))] == there
    far = BOX.replace("MORE", moved) + limb.replace("mass: 1 kg", "mass: 1 kg, offset: [1 m, 0 m, 0 m]")
    assert not list(implausible(parse_robot(far.replace("JOINT", "{kind: revolute, axis: z}"))))


URDF = """<robot name="a"><link name="base">
<inertial><origin xyz="0 0 OFF"/><mass value="0.72"/>
<inertia ixx="SIZE" iyy="SIZE" izz="SIZE" ixy="0" ixz="0" iyz="0"/></inertial>SHAPE</link></robot>"""
SHAPE = '<visual><geometry><box size="0.2 0.06 0.06"/></geometry></visual>'


@pytest.mark.parametrize(
    ("size", "off", "path"),
    [("2.6e-3", "0", None), ("2616", "0", "body.inertia"), ("2.6e-9", "0", "body.inertia"), ("2.6e-3", "3", "body.centre_of_mass")],
)  # fmt: skip
def test_a_link_of_urdf_has_the_size_of_its_shapes(tmp_path, size, off, path):
    file = tmp_path / "a.urdf"
    file.write_text(URDF.replace("SIZE", size).replace("OFF", off).replace("SHAPE", SHAPE))
    assert [where for where, _ in meaningless(import_urdf(file).description)] == ([] if path is None else [path])


def test_a_link_without_a_shape_is_held_against_the_robot(tmp_path):
    """An arm of 0.3 m: 1 kg m2 of 0.72 kg is 1.4 m, 1000 kg m2 is 46 m."""
    tip = '<link name="t"/><joint name="j" type="fixed"><parent link="base"/><child link="t"/><origin xyz="0.3 0 0"/></joint>'
    for size, there in (("1", []), ("1000", ["body.inertia"])):
        text = URDF.replace("SIZE", size).replace("OFF", "0").replace("SHAPE", "").replace("</robot>", f"{tip}</robot>")
        (tmp_path / "a.urdf").write_text(text)
        assert [where for where, _ in meaningless(import_urdf(tmp_path / "a.urdf").description)] == there


def test_moments_that_no_body_has_are_refused_with_both_numbers():
    with pytest.raises(InputError, match="3 kg m2 is larger than the sum of the other two, 2 kg m2"):
        box("mass: 1 kg, inertia: [1 kg m2, 1 kg m2, 3 kg m2]")
