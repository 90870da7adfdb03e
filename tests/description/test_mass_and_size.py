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


def moments(*values: float) -> str:
    return ", ".join(f"{value:.12g} kg m2" for value in values)


LONG = "mass: 0.96 kg, "  # of 200 x 60 x 60 mm: 0.000576, 0.003488, 0.003488 kg m2; along x 57.7 mm, across 17.3 mm
X, Y = 0.96 / 12 * 0.0072, 0.96 / 12 * 0.0436


@pytest.mark.parametrize(
    ("more", "along"),
    [
        (f"inertia: [{moments(Y, Y, X)}]", "57.74 mm away from the centre of mass along z (root mean square)"),
        (f"inertia: [{moments(Y, X, Y)}]", "57.74 mm away from the centre of mass along y"),
        # turned by 45 deg about z: across the box, sqrt((57.7^2 + 17.3^2)/2)
        (f"inertia: [{moments((X + Y) / 2, (X + Y) / 2, Y)}], products: [{(X - Y) / 2} kg m2, 0 kg m2, 0 kg m2]", "42.62 mm"),
        # turned by 5 deg: 57.7^2 sin^2 + 17.3^2 cos^2 is (17.97 mm)^2
        (f"inertia: [{moments(0.000598121, 0.00346588, Y)}], products: [-0.000252837 kg m2, 0 kg m2, 0 kg m2]", None),
        # with all its mass at 90 mm of 100 the most is sqrt(10 x 190) = 43.6 mm
        (f"inertia: [{moments(X, Y, Y)}], centre_of_mass: [90 mm, 0 mm, 0 mm]", "at most 43.59 mm is possible"),
        (f"inertia: [{moments(0, 0.96 * 0.01, 0.96 * 0.01)}]", None),  # halves at both ends
        (f"inertia: [{moments(0.96 * 0.0018, 0.96 * 0.0009, 0.96 * 0.0009)}]", None),  # quarters at the edges across
    ],
)  # fmt: skip
def test_matter_is_inside_along_each_axis(more, along):
    said = box(LONG + more)
    assert list(said) == ([] if along is None else ["body.inertia"])
    assert along is None or along in said["body.inertia"]


def test_moments_of_thin_and_hollow_parts_are_possible_also_when_rounded():
    """A plate of 200 x 100 x 1 mm and 160 g; a hollow ball, 2/3 m R^2; the rim of a wheel, m R^2 about its axis."""
    rows = [
        "shape: box, length: 200 mm, width: 100 mm, height: 1 mm, mass: 160 g, inertia: [1.3e-4 kg m2, 5.3e-4 kg m2, 6.6e-4 kg m2]",
        "shape: spheroid, length: 200 mm, radius: 100 mm, mass: 1.5 kg, inertia: [0.01 kg m2, 0.01 kg m2, 0.01 kg m2]",
        "shape: cylinder, length: 5 mm, radius: 100 mm, mass: 1.5 kg, inertia: [0.015 kg m2, 7.5e-3 kg m2, 7.5e-3 kg m2]",
    ]
    for row in rows:
        assert not list(meaningless(parse_robot(f"name: b\nbody: {{kind: rigid, {row}, joint: {{kind: free}}}}")))


def test_what_is_fixed_to_a_part_and_the_joints_on_it_count_as_its_size():
    """Within 1.2 m, with the centre of mass at 0.5 m, sqrt(0.5 x 0.7) is 0.59 m; here it is 0.53 m."""
    moved = "inertia: [0 kg m2, 0.2 kg m2, 0.2 kg m2], mass: 0.72 kg, centre_of_mass: [400 mm, 0 mm, 0 mm]"
    told = ["body.centre_of_mass", "body.inertia"]
    assert list(box(moved)) == told
    limb = "limbs: {arm: {kind: rigid, shape: box, length: 1 m, width: 60 mm, height: 60 mm, mass: 1 kg, joint: JOINT}}"
    for joint, there in (("{kind: fixed}", []), ("{kind: revolute, axis: z}", told)):
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
    [("4.4e-4", "0", None), ("2.6e-3", "0", "body.inertia"), ("2616", "0", "body.inertia"), ("2.6e-9", "0", "body.inertia"), ("4.4e-4", "3", "body.centre_of_mass")],
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
