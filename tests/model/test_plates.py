"""Plates by their outlines in robots: those of a rectangle are boxes, others weigh and lie as their corners say."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import trimesh

import nectosome as ns
from nectosome.description import load_robot, parse_robot, with_values
from nectosome.loads import RigidFoil
from nectosome.model import bind, build

PADDLE = """
name: paddle
water: {gravity: 0 m/s2WATER}
body:
  kind: rigid
  shape: point
  mass: 0.2 kg
  inertia: [1e-3 kg m2, 1e-3 kg m2, 1e-3 kg m2]
  volume: 0 m3
  joint: {kind: free}
limbs:
  fin:
    kind: rigid
    SHAPE
    density: 1100 kg/m3
    strips: 4
    joint: {kind: revolute, axis: AXIS, motion: {kind: sine, amplitude: 30 deg, frequency: 1 Hz}}
    loads:
      LOADS
"""
STRIPS = (
    "drag: {kind: plate_drag, normal: 1.5}",
    "water: {kind: added_mass, normal: 1}",
    "skin: {kind: skin_friction}",
    "push: {kind: distributed_force, force: [1 N/m, 0.3 N/m, -0.2 N/m]}",
)
FOIL = "lift: {kind: foil, span_along: SPAN, ahead: AHEAD, thickness: 3 mmCHORD}"
BOX = {
    "xy": "shape: box\n    length: 80 mm\n    width: 40 mm\n    height: 3 mm",
    "xz": "shape: box\n    length: 80 mm\n    width: 3 mm\n    height: 40 mm",
}
CORNERS = "[[80 mm, 20 mm], [0 mm, 20 mm], [0 mm, -20 mm], [80 mm, -20 mm]]"


def plate(plane: str, corners: str = CORNERS) -> str:
    return f"shape: {{outline: {corners}, thickness: 3 mm, plane: {plane}}}"


def paddle(shape: str, plane: str, loads: tuple[str, ...], water: str = ""):
    text = PADDLE.replace("SHAPE", shape).replace("LOADS", "\n      ".join(loads)).replace("WATER", water)
    return parse_robot(text.replace("AXIS", "y" if plane == "xy" else "z"))


def foil_on(span: str, ahead: str, chord: str = "") -> str:
    return FOIL.replace("SPAN", span).replace("AHEAD", ahead).replace("CHORD", chord)


def difference(one, other, time: float = 0.4) -> float:
    """Largest difference between the places of two robots that are simulated from rest [m]."""
    places = [ns.simulate(robot, time=time).to_dataset()["position"].values for robot in (one, other)]
    assert np.abs(places[0] - places[0][:1]).max() > 1e-3
    return float(np.abs(places[0] - places[1]).max())


@pytest.mark.parametrize("plane", ["xy", "xz"])
def test_a_rectangle_moves_as_the_box_of_its_sizes(plane: str):
    box, outline = paddle(BOX[plane], plane, STRIPS), paddle(plate(plane), plane, STRIPS)
    ours, theirs = (build(robot).tree.stations for robot in (outline, box))
    for name in ("x", "weight", "half_width", "half_length", "round_axes", "inertia"):
        np.testing.assert_allclose(getattr(ours, name), getattr(theirs, name), rtol=1e-13, atol=1e-19)
    assert float(ours.volume.sum()) == pytest.approx(float(theirs.volume.sum()), rel=1e-14)
    assert difference(box, outline) < 1e-14


@pytest.mark.parametrize(("plane", "span", "ahead", "chord"), [("xy", "x", "-y", 40), ("xz", "z", "x", 80)])
def test_a_foil_has_the_planform_of_the_plate_that_it_acts_on(plane: str, span: str, ahead: str, chord: int):
    box = paddle(BOX[plane], plane, (foil_on(span, ahead, f", chord: {chord} mm"),))
    assert difference(box, paddle(plate(plane), plane, (foil_on(span, ahead),))) < 1e-13


def foil_of(robot) -> RigidFoil:
    (load,) = (at.load for at in build(robot).load_groups.one_by_one() if at.name == "lift")
    assert isinstance(load, RigidFoil)
    return load


def test_a_swept_fin_has_the_sections_of_its_own_corners():
    """Chords from 40 to 20 mm along a span of 80 mm, the leading edge swept back by 30 mm, as places and numbers."""
    corners = "[[0 mm, 25 mm], [80 mm, -5 mm], [80 mm, -25 mm], [0 mm, -15 mm]]"
    load = foil_of(paddle(plate("xy", corners), "xy", (foil_on("x", "y"),)))
    s = 0.5 * (np.polynomial.legendre.leggauss(4)[0] + 1)
    np.testing.assert_allclose(2 * load.half_chord, 0.04 - 0.02 * s, rtol=1e-12)
    # a trapezoid of parallel sides a, b over h: centre at h (a + 2 b)/(3 (a + b)) from a
    x = 0.08 * (40 + 2 * 20) / (3 * 60)
    place = np.asarray(load.place)
    np.testing.assert_allclose(place[:, 0], 0.08 * s - x, rtol=1e-12, atol=1e-16)
    np.testing.assert_allclose(np.diff(place[:, 1]), np.diff(-0.02 * s), rtol=1e-12)  # mid-chords from 5 to -15 mm
    width, ahead = np.asarray(load.width), place[:, 1]
    assert np.sum(width * (0.04 - 0.02 * s) * ahead) == pytest.approx(0, abs=1e-18)  # the centre is that of the area
    assert float(load.aspect_ratio) == pytest.approx(0.08**2 / (0.08 * 0.03), rel=1e-12)
    given = ", chord: [40 mm, 20 mm]"
    assert float(load.aspect_ratio) == pytest.approx(
        float(foil_of(paddle(BOX["xy"], "xy", (foil_on("x", "y", given),))).aspect_ratio), rel=1e-12
    )


def test_strips_of_a_triangle_have_its_area_and_its_first_moment():
    """Linear chords are integrated exactly by the strips, whatever their number."""
    corners = "[[10 mm, 0 mm], [70 mm, 0 mm], [70 mm, 40 mm]]"
    stations = build(paddle(plate("xy", corners), "xy", STRIPS[:1])).tree.stations
    fin = np.s_[1:]  # after the body's
    weight, half = np.asarray(stations.weight)[fin], np.asarray(stations.half_width)[fin]
    assert np.sum(weight * 2 * half[:, 0]) == pytest.approx(1.2e-3, rel=1e-12)
    x = np.asarray(stations.x)[fin]
    assert np.sum(weight * 2 * half[:, 0] * x) == pytest.approx(1.2e-3 * 0.04, rel=1e-12)
    assert float(np.asarray(stations.inertia)[1, 3, 3]) == pytest.approx(1100 * 1.2e-3 * 0.003, rel=1e-12)


def test_a_plate_falls_about_the_centre_of_its_area_and_hangs_below_its_hinge():
    """A right triangle on a hinge at its root comes to rest with its centre, (2/3 60, 1/3 40) mm, straight below."""
    fin = f"""
name: pendulum
body:
  kind: rigid
  {plate("xz", "[[0 mm, 0 mm], [60 mm, 0 mm], [60 mm, 40 mm]]")}
  density: 1500 kg/m3
  joint: {{kind: revolute, axis: y, damping: 1e-5 N m s/rad}}
"""
    angle = float(np.asarray(ns.static(parse_robot(fin)).state.q)[0])
    # the turn about y takes (x, z) to (x cos + z sin, -x sin + z cos)
    assert 40 * np.cos(angle) + 40 / 3 * np.sin(angle) == pytest.approx(0, abs=1e-6)


def test_a_level_plate_at_the_surface_carries_what_of_it_is_under_water():
    """An upright triangle with its edge of 60 mm down, 40 mm high, of which 10 mm are under water: 1 - (30/40)^2."""
    text = f"""
name: float
water: {{surface: 10 mm}}
body:
  kind: rigid
  {plate("xz", "[[-30 mm, 0 mm], [30 mm, 0 mm], [0 mm, 40 mm]]")}
  density: 400 kg/m3
  strips: STRIPS
  joint: {{kind: free}}
"""
    errors = []
    for strips in (10, 100):
        run = ns.simulate(parse_robot(text.replace("STRIPS", str(strips))), time=1e-3).to_dataset()
        force = run["load_force"].sel(load="buoyancy").values[0, 0]
        expected = 1000 * 9.80665 * 1.2e-3 * 0.003 * (1 - 0.75**2)
        np.testing.assert_allclose(force[:2], 0, atol=1e-12)
        errors.append(abs(force[2] / expected - 1))
    assert errors[0] < 2e-2 and errors[1] < 2e-4  # strips are upright boxes


def test_a_mirrored_flipper_is_the_image_of_the_other_one():
    text = f"""
name: pair
body: {{kind: rigid, shape: spheroid, length: 20 cm, radius: 3 cm, density: 1000 kg/m3, joint: {{kind: free}}}}
limbs:
  flipper:
    kind: rigid
    rotation: [0 deg, 0 deg, 70 deg]
    offset: [-10 cm, 25 mm, 0 mm]
    repeat: {{mirror: y}}
    {plate("xy", "[[0 mm, 10 mm], [60 mm, 0 mm], [70 mm, -15 mm], [0 mm, -10 mm]]")}
    density: 1200 kg/m3
    joint: {{kind: revolute, axis: x, motion: {{kind: sine, amplitude: 20 deg, frequency: 1 Hz}}}}
    loads: {{lift: {{kind: foil, span_along: x, ahead: y}}}}
"""
    run = ns.simulate(parse_robot(text), time=0.4).to_dataset()
    place, part = run["position"].values, list(run["station_part"].values)
    one, other = place[:, part.index("flipper1")], place[:, part.index("flipper2")]
    np.testing.assert_allclose(one * [1, -1, 1], other, atol=1e-12)
    assert np.abs(place[:, 0, 1]).max() < 1e-12 and np.ptp(one[:, 2]) > 1e-4


@pytest.mark.parametrize("corners", [4, 20])
def test_masses_follow_the_corners_that_are_traced(corners: int):
    """Few corners are filled in one by one, many at once; the derivative of the mass is that of the area."""
    angle = 2 * np.pi * (np.arange(corners) + 0.3) / corners
    outline = ", ".join(f"[{30 + 30 * np.cos(x)} mm, {20 * np.sin(x)} mm]" for x in angle)
    robot = paddle(plate("xy", f"[{outline}]"), "xy", (foil_on("x", "y"),))
    path = "limbs.fin.shape.outline.1.1"
    theta, robot_of = bind(robot, (path, "limbs.fin.shape.thickness"))

    def mass(theta):
        return jnp.sum(robot_of(theta).tree.stations.inertia[1:, 3, 3])

    area = 0.5 * corners * np.sin(2 * np.pi / corners) * 0.03 * 0.02
    assert float(mass(theta)) == pytest.approx(1100 * area * 0.003, rel=1e-12)
    before, after = (0.03 + 0.03 * np.cos(angle[k]) for k in (0, 2))
    slope = 1100 * 0.003 * 0.5 * (before - after)
    np.testing.assert_allclose(jax.grad(mass)(theta), [slope, 1100 * area], rtol=1e-11)
    other = build(with_values(robot, {path: 0.012}))
    found = float(jnp.sum(other.tree.stations.inertia[1:, 3, 3]))
    assert found == pytest.approx(float(mass(theta.at[0].set(0.012))), rel=1e-12)


@pytest.mark.parametrize("plane", ["xy", "xz"])
def test_a_section_of_a_mesh_is_the_plate_of_the_outline_by_hand(tmp_path, plane):
    """A tapered fin, its sections across the plane all alike: mass, strips, foil and motion are the same."""
    corners = np.array([[0, -20], [60, -8], [80, 4], [50, 16], [0, 20]], float)
    away = np.full((5, 1), 5.0)
    low, high = np.concatenate([corners, -away], axis=1), np.concatenate([corners, away], axis=1)
    faces = [[0, k + 1, k] for k in range(1, 4)] + [[5, 5 + k, 6 + k] for k in range(1, 4)]
    faces += [row for k in range(5) for j in [(k + 1) % 5] for row in ([k, j, 5 + j], [k, 5 + j, 5 + k])]
    vertices = np.concatenate([low, high])
    if plane == "xz":
        vertices, faces = vertices[:, [0, 2, 1]], [row[::-1] for row in faces]
    trimesh.Trimesh(vertices, faces, process=False).export(tmp_path / "fin.stl")
    by_hand = str([[f"{x:g} mm" for x in row] for row in corners]).replace("'", "")
    loads = (*STRIPS, foil_on("x", "y" if plane == "xy" else "z"))
    hand = paddle(plate(plane, by_hand), plane, loads)
    text = PADDLE.replace(
        "SHAPE", f"shape: {{section_of: fin.stl, unit: mm, across: 1 mm, thickness: 3 mm, plane: {plane}}}"
    )
    text = (
        text.replace("LOADS", "\n      ".join(loads))
        .replace("WATER", "")
        .replace("AXIS", "y" if plane == "xy" else "z")
    )
    (tmp_path / "robot.yaml").write_text(text)
    section = load_robot(tmp_path / "robot.yaml")
    assert difference(section, hand) < 1e-9
    assert section.limbs["fin"].shape.area == pytest.approx(hand.limbs["fin"].shape.area, rel=1e-7)
