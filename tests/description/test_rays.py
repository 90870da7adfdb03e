"""Rays in robot files: the limbs and webs that they stand for, their mirror images, and what is refused."""

import numpy as np
import pytest

from nectosome.core import sampled
from nectosome.description import dump_robot, get_value, parse_robot, with_values
from nectosome.description.orientation import from_rpy
from nectosome.robots import describe
from nectosome.units import InputError

TEXT = """
name: ribbon
body: {kind: rigid, shape: point, mass: 1 kg}
rays:
  fin:
    count: 10
    roots: [[-240 mm, 0 mm, -25 mm], [-60 mm, 0 mm, -25 mm]]
    tips: [[-240 mm, 0 mm, -65 mm], [-60 mm, 0 mm, -65 mm]]
    radius: 1 mm
    density: 1000 kg/m3
    motion: {amplitude: 30 deg, frequency: 2 Hz, waves: -1}
    web: {thickness: 0.5 mm, young: 50 kPa, density: 1000 kg/m3, loads: {drag: {kind: plate_drag, normal: 1.8}}}
aliases:
  waves: rays.fin.motion.waves
  thickness: rays.fin.web.thickness
  f: limbs.fin1.joint.motion.frequency
"""
WRITTEN_OUT = """
name: ribbon
body: {kind: rigid, shape: point, mass: 1 kg}
limbs:
  ray:
    kind: rigid
    shape: cylinder
    length: 40 mm
    radius: 1 mm
    density: 1000 kg/m3
    offset: [-240 mm, 0 mm, -25 mm]
    rotation: [0 deg, 90 deg, 0 deg]
    repeat: {count: 10, along: [20 mm, 0 mm, 0 mm], phase: 40 deg}
    joint: {kind: revolute, axis: z, motion: {kind: sine, amplitude: 30 deg, frequency: 2 Hz}}
"""
CURVED = (
    TEXT.replace("[-240 mm, 0 mm, -65 mm], [-60", "[-240 mm, 20 mm, -65 mm], [-150 mm, 60 mm, -80 mm], [-60")
    .replace("    radius", "    mirror: y\n    radius")
    .replace("  f: limbs.fin1", "  left: rays.fin1.motion.waves\n  f: limbs.fin1_1")
)
TIMES = np.linspace(0.0, 0.4, 7)


def frame(limb):
    return np.array(from_rpy(limb.rotation))


def test_rays_stand_for_limbs_in_a_row_and_a_web():
    short, long = parse_robot(TEXT), parse_robot(WRITTEN_OUT)
    for k, limb in enumerate(long.limbs.values()):
        ray = short.limbs[f"fin{k + 1}"]
        np.testing.assert_allclose(ray.offset, limb.offset, atol=1e-15)
        np.testing.assert_allclose(frame(ray), frame(limb), atol=1e-15)
        a, b = (sampled(one.joint.motion, TIMES) for one in (ray, limb))
        np.testing.assert_allclose(a, b, atol=1e-12)
        assert (ray.length, ray.radius, ray.density) == pytest.approx((limb.length, limb.radius, limb.density))
    assert short.webs["fin"].between == tuple(short.limbs)
    assert (short.webs["fin"].thickness, short.webs["fin"].root) == (5e-4, "open")
    assert parse_robot(dump_robot(short)) == short


def test_waves_and_the_web_are_set_together():
    d = with_values(parse_robot(TEXT), {"waves": 0.5, "thickness": 1e-3})
    assert {get_value(d, f"limbs.fin{k + 1}.joint.motion.waves") for k in range(10)} == {0.5}
    assert d.webs["fin"].thickness == 1e-3


def test_the_amplitude_follows_the_envelope():
    """From 10 deg at the first ray through 30 deg in the middle; the ray at 2/9 of the way is between them."""
    text = TEXT.replace("waves: -1", "waves: 0, phase: 90 deg, envelope: [0.3333333333333333, 1, 0.5]")
    angles = [sampled(ray.joint.motion, TIMES)[0] for ray in parse_robot(text).limbs.values()]
    s = np.arange(10) / 9
    np.testing.assert_allclose(np.degrees(angles), np.interp(s, [0, 0.5, 1], [10, 30, 15]), rtol=1e-12)


def test_a_mirrored_fin_moves_as_its_image():
    d, flip = parse_robot(CURVED), np.diag([1.0, -1.0, 1.0])
    assert {*d.webs} == {"fin1", "fin2"}
    assert d.aliases["thickness"] == ("webs.fin1.thickness", "webs.fin2.thickness")
    assert d.aliases["left"] == tuple(f"limbs.fin1_{k + 1}.joint.motion.waves" for k in range(10))
    for k in range(10):
        one, other = d.limbs[f"fin1_{k + 1}"], d.limbs[f"fin2_{k + 1}"]
        assert one.joint == other.joint
        np.testing.assert_allclose(other.offset, flip @ one.offset, atol=1e-15)
        (x, y), (u, v) = (frame(limb).T[:2] for limb in (one, other))
        np.testing.assert_allclose(u, flip @ x, atol=1e-12)  # from root to tip
        np.testing.assert_allclose(v, flip @ y, atol=1e-12)  # where the tip goes as the angle grows
        assert np.linalg.det(frame(other)) == pytest.approx(1)
        tip = np.array(one.offset) + one.length * x
        assert k or tip == pytest.approx([-0.24, 0.02, -0.065])


@pytest.mark.parametrize(
    ("old", "new", "field", "words"),
    [
        ("-65 mm]]", "-65 mm], [-60 mm, 0 mm, -65 mm]]", "rays.fin.tips", "in one place"),
        ("tips: [[-240 mm, 0 mm, -65 mm]", "tips: [[-250 mm, 0 mm, -25 mm]", "rays.fin.tips", "ray 1 has no length"),
        ("rays:", "limbs: {fin3: {kind: rigid, shape: point, mass: 1 g}}\nrays:", "limbs.fin3", "rays have a part of"),
        ("count: 10", "count: 1", "rays.fin.count", "from 2 to 100"),
        (
            "rays:\n  fin:",
            "limbs: {leg: {kind: rigid, shape: point, mass: 1 g, repeat: {mirror: y}}}\nrays:\n  fin:\n    on: leg",
            "rays.fin.on",
            "comes several times",
        ),
    ],
)
def test_rays_that_cannot_be_are_refused(old, new, field, words):
    assert old in TEXT
    with pytest.raises(InputError, match=words) as told:
        parse_robot(TEXT.replace(old, new, 1))
    assert told.value.field == field


def test_rays_whose_parts_would_have_one_name_are_refused():
    one = CURVED[CURVED.index("  fin:") : CURVED.index("aliases:")]
    with pytest.raises(InputError, match="called as those of other rays") as told:
        parse_robot(CURVED.replace("aliases:", one.replace("fin:", "fin1:").replace("mirror: y\n", "\n") + "aliases:"))
    assert told.value.field == "rays.fin1"


def test_a_setting_says_how_many_rays_a_fin_has():
    d = describe("ray", ["rays.fin.count=4"])
    assert len(d.limbs) == 8
    assert d.limbs["fin1_4"].offset == pytest.approx(describe("ray").limbs["fin1_12"].offset)
