# ruff: noqa: E501  (tables: one case a line)
"""URDF files: what becomes of each part of them, and the sentence for what is none."""

import math

import numpy as np
import pytest
import trimesh

from nectosome.description import RobotDescription, dump_robot, import_urdf, parse_robot
from nectosome.description.orientation import applied, from_rpy
from nectosome.units import InputError

INERTIAL = '<inertial><mass value="1"/><inertia ixx="2" ixy="0" ixz="0" iyy="3" iyz="0" izz="4"/></inertial>'
BASE, TIP = f'<link name="base">{INERTIAL}</link>', f'<link name="tip">{INERTIAL}</link>'
HINGE = '<joint name="hinge" type="revolute"><parent link="base"/><child link="tip"/></joint>'
ARM = f'<robot name="a">{BASE}{TIP}{HINGE}</robot>'


def many(n):
    links = "".join(f'<link name="l{k}"/>' for k in range(n))
    joints = (f'<joint name="{k}" type="fixed"><parent link="base"/><child link="l{k}"/></joint>' for k in range(n))
    return f'<robot name="a">{BASE}{links}{"".join(joints)}</robot>'


@pytest.fixture
def read(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def read(text):
        (tmp_path / "arm.urdf").write_text(text)
        return import_urdf("arm.urdf")

    return read


def besides(found):
    """What was left out, but for the shapes that the arm has none of."""
    return [words for words in found.left_out if not words.endswith("displaces no water")]


def test_what_is_written_reads_back_exactly(read):
    found = read(ARM)
    assert besides(found) == []
    assert parse_robot(found.text) == found.description == parse_robot(dump_robot(found.description))
    assert "#   tip: link tip, revolute joint hinge\n" in found.text
    tip = found.description.limbs["tip"]
    assert (tip.mass, tip.inertia, tip.products, tip.joint.axis) == (1.0, (2.0, 3.0, 4.0), None, (1.0, 0.0, 0.0))


@pytest.mark.parametrize(
    ("kind", "ours"),
    [("fixed", "fixed"), ("revolute", "revolute"), ("continuous", "revolute"), ("prismatic", "prismatic"), ("floating", "free"), ("planar", "planar")],
)  # fmt: skip
def test_every_type_of_joint_has_its_kind(read, kind, ours):
    joint = HINGE.replace("revolute", kind).replace(
        "</joint>", '<axis xyz="0 0.6 0.8"/><dynamics damping="2" friction="0.3"/></joint>'
    )
    found = read(ARM.replace(HINGE, joint))
    made = found.description.limbs["tip"].joint
    assert made.kind == ours
    if ours in ("revolute", "prismatic"):
        assert (made.axis, made.damping, made.friction, besides(found)) == ((0.0, 0.6, 0.8), 2.0, 0.3, [])
    else:
        words = f"which a {kind} joint has not"
        assert besides(found) == [f'joint hinge: damping="2", {words}', f'joint hinge: friction="0.3", {words}']
    assert parse_robot(found.text) == found.description


@pytest.mark.parametrize(
    ("shape", "axis", "sizes"),
    [
        ('<box size="0.4 0.3 0.2"/>', (1, 0, 0), (0.4, None, 0.3, 0.2)),
        ('<cylinder radius="0.1" length="0.4"/>', (0, 0, 1), (0.4, 0.1, None, None)),
        ('<sphere radius="0.2"/>', (1, 0, 0), (0.4, 0.2, None, None)),
    ],
)
def test_a_shape_lies_where_it_lay(read, shape, axis, sizes):
    """Its middle is at the origin, its own x axis along that of URDF's shape."""
    rpy, place = (0.3, -0.7, 1.9), (0.5, 0.6, 0.7)
    text = f'<collision><origin xyz="0.5 0.6 0.7" rpy="0.3 -0.7 1.9"/><geometry>{shape}</geometry></collision></link>'
    part = read(ARM.replace("</link>", text, 1)).description.limbs["body_shape"]
    assert (part.length, part.radius, part.width, part.height) == pytest.approx(sizes)
    assert (part.mass, part.joint.kind, part.on) == (0.0, "fixed", "body")
    middle = np.array(part.offset) + applied(from_rpy(part.rotation), (0.5 * part.length, 0.0, 0.0))
    assert middle == pytest.approx(place, abs=1e-15)
    assert applied(from_rpy(part.rotation), (1.0, 0.0, 0.0)) == pytest.approx(applied(from_rpy(rpy), axis), abs=1e-15)


def test_a_cylinder_with_balls_around_its_ends_is_a_capsule(read):
    """Else the inner halves of the balls would displace water twice; a ball aside stays."""
    shapes = (
        ("0.5 0 0", '<cylinder radius="0.1" length="0.4"/>'),
        ("0.7 0 0", '<sphere radius="0.1"/>'),
        ("0.3 0 0", '<sphere radius="0.1"/>'),
        ("0.9 0 0", '<sphere radius="0.1"/>'),
    )
    text = "".join(
        f'<collision><origin xyz="{xyz}" rpy="0 1.5707963267948966 0"/><geometry>{shape}</geometry></collision>'
        for xyz, shape in shapes
    )
    limbs = read(ARM.replace("</link>", f"{text}</link>", 1)).description.limbs
    parts = {name: limb for name, limb in limbs.items() if name.startswith("body_shape")}
    assert [part.shape for part in parts.values()] == ["capsule", "spheroid"]
    capsule, ball = parts.values()
    assert (capsule.length, capsule.radius) == pytest.approx((0.6, 0.1))
    assert capsule.offset == pytest.approx((0.2, 0.0, 0.0), abs=1e-12)
    assert np.array(ball.offset) + applied(from_rpy(ball.rotation), (0.1, 0, 0)) == pytest.approx(
        (0.9, 0, 0), abs=1e-12
    )


def test_collision_shapes_come_before_visual_ones(read):
    shapes = "<collision><geometry><mesh filename='c.stl'/></geometry></collision><visual><geometry><sphere radius='1'/></geometry></visual>"
    found = read(ARM.replace("</link>", shapes + "</link>", 1))
    assert found.description.limbs["body_shape"].shape == "spheroid"
    assert 'link base: collision mesh filename="c.stl"' in found.left_out
    box = "<collision><geometry><box size='1 1 1'/></geometry></collision></link>"
    found = read(ARM.replace("</link>", shapes + box, 1))
    assert found.description.limbs["body_shape"].shape == "box"
    assert 'link base: visual sphere radius="1"' in found.left_out


def test_names_become_such_as_robot_files_allow(read):
    chain = "".join(f'<link name="{name}">{INERTIAL}</link>' for name in ("2 Arm-L", "arm.l", "body", "Arm/L"))
    joints = "".join(
        f'<joint name="j{k}" type="fixed"><parent link="base"/><child link="{name}"/></joint>'
        for k, name in enumerate(("2 Arm-L", "arm.l", "body", "Arm/L"))
    )
    found = read(f'<robot name="a">{BASE}{chain}{joints}</robot>')
    assert list(found.description.limbs) == ["link_2_arm_l", "arm_l", "body_2", "arm_l_2"]
    assert "arm_l_2: link Arm/L, fixed joint j3" in found.text
    assert parse_robot(found.text) == found.description


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("</joint>", '<limit lower="-1" upper="2" effort="3" velocity="4"/></joint>', 'joint hinge: limit lower="-1" upper="2" effort="3" velocity="4"'),
        ("</joint>", '<limit/><mimic joint="other"/></joint>', 'joint hinge: mimic joint="other"'),
        ("</joint>", '<safety_controller k_velocity="3"/></joint>', 'joint hinge: safety_controller k_velocity="3"'),
        ("</joint>", '<calibration rising="3"/></joint>', 'joint hinge: calibration rising="3"'),
        ("</joint>", '<dynamics damping="1" stiction="0.4"/></joint>', 'joint hinge: stiction="0.4"'),
        ("</link>", '<contact><lateral_friction value="1"/></contact></link>', "link base: contact"),
        ("</link>", '<visual><geometry><capsule radius="1"/></geometry></visual></link>', 'link base: visual capsule radius="1"'),
        ('name="tip"', 'name="tip" type="x"', 'link tip: type="x"'),
        ("</robot>", '<transmission name="t"/></robot>', 'transmission name="t"'),
        ("</robot>", '<gazebo reference="tip\n"/></robot>', 'gazebo reference="tip "'),
    ],
)  # fmt: skip
def test_what_has_no_place_is_told_there_and_in_the_file(read, old, new, words):
    found = read(ARM.replace(old, new, 1))
    assert words in found.left_out
    assert f"#   {words}\n" in found.text
    assert parse_robot(found.text) == found.description


def test_a_link_without_a_shape_is_told_to_displace_nothing(read):
    frame = '<link name="x"/><joint name="f" type="fixed"><parent link="tip"/><child link="x"/></joint></robot>'
    found = read(ARM.replace("</robot>", frame))
    none = "no box, cylinder, sphere or mesh to be used, so it displaces no water"
    assert found.left_out == (f"link base: {none}", f"link tip: {none}")
    assert found.description.limbs["x"].mass == 0


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("no robot", "arm.urdf, line 1: this is not XML: syntax error."),
        (ARM[:-3], "arm.urdf, line 1: this is not XML: unclosed token."),
        ("<sdf/>", "arm.urdf: this is no URDF: it describes a <sdf>, where <robot> is expected."),
        ('<robot name="a"/>', "arm.urdf: this robot has no links."),
        ('<!DOCTYPE r [<!ENTITY e SYSTEM "file:///etc/hosts">]><robot name="a">&e;</robot>', "arm.urdf: declares a document type or entities, which are not read. Take them out."),
        ('<robot name="a" xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:include filename="b"/></robot>', "arm.urdf: is a xacro file, which is not a robot yet. Unfold it first: xacro arm.urdf > robot.urdf"),
        ("<robot>" + " " * 4_000_000, "arm.urdf: larger than 4 MB, which is too large."),
        (many(501), "arm.urdf: links and shapes make more than 500 parts, too many for a robot file."),
        (ARM.replace(HINGE, ""), "arm.urdf: these links hang on nothing: base, tip. A robot has one such link: join the others to it, if need be by a fixed joint."),
        (ARM.replace("</robot>", HINGE.replace("hinge", "two") + "</robot>"), "arm.urdf, joint two: moves tip, which hangs on joint hinge already. Take one of them out, and close the loop with a bushing in the robot file."),
        (ARM.replace("</robot>", '<joint name="two" type="fixed"><parent link="tip"/><child link="base"/></joint></robot>'), "arm.urdf: these links hang on one another in a ring: base, tip. Take one joint of it out, and close the loop with a bushing in the robot file."),
        (ARM.replace('child link="tip"', 'child link="tipp"'), 'arm.urdf, joint hinge: there is no link "tipp". Did you mean "tip"?'),
        (ARM.replace("revolute", "ball"), 'arm.urdf, joint hinge, type: "ball" is no type of joint. Known: fixed, revolute, continuous, prismatic, floating, planar.'),
        (ARM.replace(' type="revolute"', ""), 'arm.urdf, joint hinge, type: "null" is no type of joint. Known: fixed, revolute, continuous, prismatic, floating, planar.'),
        (ARM.replace(TIP, TIP + TIP), "arm.urdf, link tip: there are two links of this name. Names must differ."),
        (ARM.replace('name="tip"', "", 1), "arm.urdf, link: has no name."),
        (ARM.replace(TIP, '<link name="tip"/>'), "arm.urdf, link tip, inertial: is missing. A link that moves needs mass and inertia: write them, or fix it to what it sits on."),
        (ARM.replace(TIP, TIP.replace('mass value="1"', 'mass value="0"')), 'arm.urdf, link tip, inertial, mass: "0" kg is no mass. A link that moves needs mass and inertia: write them, or fix it to what it sits on.'),
        (ARM.replace(BASE, BASE.replace('mass value="1"', 'mass value="-2"')), 'arm.urdf, link base, inertial, mass: "-2" kg is no mass. A link that moves needs mass and inertia: write them, or fix it to what it sits on.'),
        (ARM.replace(BASE, BASE.replace('mass value="1"', 'mass value="0"')), "arm.urdf, link base, inertial, inertia: is given, but the mass is 0 kg. Write the mass, or take the inertial out."),
        (ARM.replace(TIP, '<link name="tip"><inertial><mass value="1"/></inertial></link>'), "arm.urdf, link tip, inertial, inertia: is missing or zero. A link that moves needs mass and inertia: write them, or fix it to what it sits on."),
        (ARM.replace('izz="4"', 'izz="6"', 1), "arm.urdf, link base, inertial, inertia: no body has the principal moments 2, 3, 6 kg m2: none may be below 0, or larger than the sum of the other two. Correct it; it is about the centre of mass."),
        (ARM.replace('ixy="0"', 'ixy="2.5"', 1), "arm.urdf, link base, inertial, inertia: no body has the principal moments -0.04951, 4, 5.05 kg m2: none may be below 0, or larger than the sum of the other two. Correct it; it is about the centre of mass."),
        (ARM.replace('izz="4"', 'izz="nan"', 1), 'arm.urdf, link base, inertial, inertia: "nan" must be finite.'),
        (ARM.replace('mass value="1"', 'mass value="inf"', 1), 'arm.urdf, link base, inertial, mass: "inf" must be finite.'),
        (ARM.replace('mass value="1"', 'mass value="heavy"', 1), "arm.urdf, link base: cannot be read: could not convert string to float: 'heavy'."),
        (ARM.replace('mass value="1"', 'mass kg="1"', 1), "arm.urdf, link base: cannot be read: a value is missing in one of its elements."),
        (ARM.replace(' izz="4"', "", 1), "arm.urdf, link base: cannot be read: Required attribute not set in XML: izz."),
        (ARM.replace("</inertial>", '<origin xzy="0 0 0"/></inertial>', 1), """arm.urdf, link base: cannot be read: Unknown attribute "xzy" in /link[@name='base']/inertial/origin."""),
        (ARM.replace("</inertial>", '<origin xyz="0 0"/></inertial>', 1), "arm.urdf, link base: cannot be read: a row of numbers has too few or too many, three are expected."),
        (ARM.replace("</link>", INERTIAL + "</link>", 1), "arm.urdf, link base: cannot be read: Scalar element defined multiple times: inertial."),
        (ARM.replace("</joint>", '<axis xyz="0 0 0"/></joint>'), "arm.urdf, joint hinge, axis: has no length. Write the direction, as in 0 0 1."),
        (ARM.replace("</joint>", '<axis xyz="0 inf 0"/></joint>'), 'arm.urdf, joint hinge, axis: "inf" must be finite.'),
        (ARM.replace("</joint>", '<dynamics damping="-1"/></joint>'), 'arm.urdf, joint hinge, damping: "-1" must be at least 0.'),
        (ARM.replace("</link>", '<collision><geometry><box size="1 0 1"/></geometry></collision></link>', 1), 'arm.urdf, link base, collision, box: "1 0 1" must be more than 0 m.'),
    ],
)  # fmt: skip
def test_a_mistake_is_told(read, text, message):
    with pytest.raises(InputError) as caught:
        read(text)
    assert str(caught.value) == message


def test_a_missing_parser_is_told(read, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "urdf_parser_py.urdf", None)
    with pytest.raises(InputError, match=r"the package urdf_parser_py is missing: pip install 'nectosome\[urdf\]'"):
        read(ARM)


def part(**fields):
    body = {"kind": "rigid", "shape": "point", "mass": 1.0, **fields}
    return RobotDescription.model_validate({"name": "a", "body": body}).body


def test_a_mirrored_part_has_the_mirrored_inertia():
    """I -> D I D with D = diag(1, -1, 1)."""
    twin = part(inertia=(2, 3, 4), products=(0.1, 0.2, 0.3)).image()
    assert (twin.inertia, twin.products) == ((2.0, 3.0, 4.0), (-0.1, 0.2, -0.3))


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ("products: [0.1 kg m2, 0 kg m2, 0 kg m2]", "robot, line 2, body.products: the inertia is missing. Give its moments as well."),
        ("inertia: [1 kg m2, 1 kg m2, 1 kg m2], products: [1.5 kg m2, 0 kg m2, 0 kg m2]", "robot, line 2, body.products: with the inertia they lead to principal moments of -0.5, 1, 2.5 kg m2, which no body has: none may be below 0, or larger than the sum of the other two."),
    ],
)  # fmt: skip
def test_products_that_no_body_has_are_refused(fields, message):
    with pytest.raises(InputError) as caught:
        parse_robot(f"name: a\nbody: {{kind: rigid, shape: point, mass: 1 kg, {fields}}}")
    assert str(caught.value) == message


def test_a_slender_body_is_one():
    """A rod turned out of its axes: one principal moment is 0, but for rounding."""
    c = s = math.sqrt(0.5)
    assert part(inertia=(c * c, s * s, 1.0), products=(-s * c, 0.0, 0.0)).products == (-s * c, 0.0, 0.0)


@pytest.mark.parametrize("kind", ["revolute", "prismatic"])
def test_a_joint_that_is_locked_by_its_limits_is_fixed(read, kind):
    urdf = ARM.replace('type="revolute">', f'type="{kind}"><limit LIMITS effort="1" velocity="1"/>')
    found = read(urdf.replace("LIMITS", 'lower="0.0" upper="0"'))
    assert found.description.limbs["tip"].joint.kind == "fixed"
    assert "joint hinge: how it would move, since its limits lock it at 0: it is fixed here" in found.left_out
    for limits in ('lower="0" upper="1e-9"', 'upper="0"', 'lower="a" upper="0"', ""):
        assert read(urdf.replace("LIMITS", limits)).description.limbs["tip"].joint.kind == kind


def mesh_read(folder, mesh: str, collision: str = "collision"):
    """The arm with a mesh on its base."""
    text = (
        f'<{collision}><origin xyz="0.5 0.6 0.7" rpy="0.3 -0.7 1.9"/><geometry>{mesh}</geometry></{collision}></link>'
    )
    (folder / "arm.urdf").write_text(ARM.replace("</link>", text, 1))
    return import_urdf(folder / "arm.urdf")


@pytest.mark.parametrize(
    ("name", "place"),
    [
        ("part.stl", "part.stl"),
        ("meshes/part.stl", "meshes/part.stl"),
        ("package://arm/meshes/part.stl", "meshes/part.stl"),
        ("package://elsewhere/meshes/part.stl", "../meshes/part.stl"),
    ],
)
def test_a_mesh_comes_along(tmp_path, name, place):
    """Its frame is that of the shape; what was measured is in the robot."""
    folder = tmp_path / "arm"
    file = folder / place
    folder.mkdir()
    file.parent.mkdir(exist_ok=True)
    trimesh.creation.box((300.0, 40.0, 50.0)).apply_translation([100, 0, 0]).export(file)
    found = mesh_read(folder, f'<mesh filename="{name}" scale="0.001 0.001 0.001"/>')
    part = found.description.limbs["body_shape"]
    assert besides(found) == []
    assert (part.shape.mesh, part.shape.unit, part.mass) == ("part.stl", "mm", 0.0)
    assert part.shape.numbers.volume == pytest.approx(6e-4, rel=1e-6)
    assert part.shape.numbers.centre == pytest.approx((0.1, 0, 0), abs=1e-9)
    assert part.offset == pytest.approx((0.5, 0.6, 0.7))
    assert part.rotation == pytest.approx((0.3, -0.7, 1.9))
    file.unlink()
    assert parse_robot(found.text) == found.description


def test_meshes_that_cannot_be_used_are_left_out_and_told(tmp_path):
    box = trimesh.creation.box((300.0, 40.0, 50.0))
    box.export(tmp_path / "part.stl")
    (tmp_path / "bad.stl").write_bytes(b"")
    words = {
        '<mesh filename="gone.stl"/>': 'mesh filename="gone.stl"',
        '<mesh filename="part.dae"/>': 'mesh filename="part.dae"',
        '<mesh filename=""/>': 'mesh filename=""',
        '<mesh filename="bad.stl"/>': "mesh bad.stl: is empty.",
        '<mesh filename="part.stl" scale="1 -2 1"/>': 'its scale "1 -2 1" is that of no unit',
        '<mesh filename="part.stl" scale="0.5 0.5 0.5"/>': 'its scale "0.5 0.5 0.5" is that of no unit',
    }
    for mesh, sentence in words.items():
        found = mesh_read(tmp_path, mesh)
        assert "body_shape" not in found.description.limbs
        assert any(sentence in told for told in found.left_out), mesh
        assert any(told.startswith("link base: no box") for told in found.left_out), mesh
    large = mesh_read(tmp_path, '<mesh filename="part.stl"/>', "visual")
    assert large.description.limbs["body_shape"].shape.numbers.volume == pytest.approx(6e5, rel=1e-6)
    assert any("check the unit, m" in told for told in large.left_out)


@pytest.mark.parametrize("signs", [(1, -1, 1), (-1, 1, 1), (1, 1, -1), (-1, -1, -1), (-1, -1, 1)])
def test_a_scale_below_0_mirrors_a_mesh(tmp_path, signs):
    """Corners x of the file are at p + R S x, S the scale; a wedge beside the origin is like none of its images."""
    wedge = trimesh.creation.extrude_triangulation([(10.0, 0.0), (300.0, 0.0), (0.0, 200.0)], [[0, 1, 2]], 100.0)
    wedge.export(tmp_path / "part.stl")
    scale = 1e-3 * np.array(signs)
    found = mesh_read(tmp_path, '<mesh filename="part.stl" scale="{} {} {}"/>'.format(*scale))
    part = found.description.limbs["body_shape"]
    assert part.shape.mirrored == (np.prod(signs) < 0)
    known = part.shape.numbers
    place = np.array(from_rpy(part.rotation)) @ known.centre + part.offset
    expected = np.array(from_rpy((0.3, -0.7, 1.9))) @ (scale * wedge.center_mass) + (0.5, 0.6, 0.7)
    assert place == pytest.approx(expected, abs=1e-9)
    surface = part.shape.surface.corners.reshape(-1, 3) @ np.array(from_rpy(part.rotation)).T + part.offset
    whole = (scale * wedge.vertices) @ np.array(from_rpy((0.3, -0.7, 1.9))).T + (0.5, 0.6, 0.7)
    assert np.linalg.norm(surface[:, None] - whole, axis=-1).min(axis=1).max() < 1e-5
    assert parse_robot(found.text) == found.description


def test_meshes_of_one_name_are_told_apart(tmp_path):
    """By their folders; one that two links share is one file."""
    names = ("arm/link.stl", "leg/link.stl", "arm/fin.stl", "leg/../leg/link.stl")
    for k, name in enumerate(names[:3], 1):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        trimesh.creation.box((0.1 * k, 0.1, 0.1)).export(tmp_path / name)
    shapes = "".join(f"<visual><geometry><mesh filename='{name}'/></geometry></visual>" for name in names)
    (tmp_path / "arm.urdf").write_text(ARM.replace("</link>", f"{shapes}</link>", 1))
    found = import_urdf(tmp_path / "arm.urdf")
    shapes = [found.description.limbs[f"body_shape{k}"].shape for k in (1, 2, 3, 4)]
    assert [shape.mesh for shape in shapes] == ["arm_link.stl", "leg_link.stl", "fin.stl", "leg_link.stl"]
    assert [shape.numbers.volume for shape in shapes] == pytest.approx([1e-3, 2e-3, 3e-3, 2e-3], rel=1e-6)
    files = {name: path.resolve().relative_to(tmp_path.resolve()).as_posix() for name, path in found.meshes.items()}
    assert files == {"arm_link.stl": names[0], "leg_link.stl": names[1], "fin.stl": names[2]}
