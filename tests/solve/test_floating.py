"""How robots float and hang: boxes and meshes in closed form, angles of loll, what sinks, levers when heeled."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import trimesh
from tests.geometry import closed_surfaces as made

from nectosome.description import load_robot, parse_robot
from nectosome.geometry.triangles import joined
from nectosome.model import bind, build
from nectosome.solve import floating, righting_curve
from nectosome.solve.floating import arm, float_freely, smaller_arm

L, B, H, T = 2.0, 0.8, 0.5, 0.2  # a barge and its draught
G, RHO = 9.81, 1000.0
MASS = RHO * L * B * T
KEEL = -H / 2


def water(surface=True, density=RHO):
    return f"{{density: {density} kg/m3, gravity: {G} m/s2{', surface: 0 m' if surface else ''}}}"


def robot(shape, folder=None, mass=MASS, com=(0.0, 0.0, 0.0), limbs="", start="", surface=True, density=RHO):
    """A free body of these sides [m], or of a mesh in a folder, with the origin of its frame in its rear."""
    if folder is None:
        sizes = "shape: box, " + ", ".join(
            f"{k}: {v} m" for k, v in zip(("length", "width", "height"), shape, strict=True)
        )
    else:
        trimesh.Trimesh(shape.vertices, shape.faces, process=False).export(folder / "hull.stl")
        sizes = "shape: {mesh: hull.stl, unit: m}"
    text = f"""
name: hull
water: {water(surface, density)}
body:
  {{kind: rigid, {sizes}, mass: {mass} kg, centre_of_mass: {[f"{x} m" for x in com]}, joint: {{kind: free{start}}}}}
{limbs}
"""
    if folder is None:
        return parse_robot(text)
    (folder / "hull.yaml").write_text(text)
    return load_robot(folder / "hull.yaml")


def barge(tmp_path, kind, **more):
    return robot((L, B, H), **more) if kind == "box" else robot(made.box(L, B, H), tmp_path, **more)


def metacentric(draught, breadth, height_of_mass):
    """KB + BM - KG."""
    return draught / 2 + breadth**2 / (12 * draught) - height_of_mass


def arms(robot, found, heels):
    """Righting arms, of one program for up to eight heels."""
    return righting_curve(robot, found, np.resize(heels, 8))[: len(heels)]


def both(test):
    return pytest.mark.parametrize("kind", ["box", "mesh"])(test)


@both
def test_a_barge_on_even_keel(tmp_path, kind):
    """A mesh is kept to 1/65535 of its size."""
    found = floating(build(barge(tmp_path, kind, com=(0, 0, KEEL + 0.15))))
    assert bool(found.solved) and bool(found.afloat)
    assert float(found.draught) == pytest.approx(T, rel=1e-6)
    assert (float(found.trim), float(found.heel)) == pytest.approx((0, 0), abs=1e-8)
    assert float(found.waterplane) == pytest.approx(L * B, rel=1e-6)
    expected = metacentric(T, B, 0.15), metacentric(T, L, 0.15)
    assert np.asarray(found.metacentric_heights) == pytest.approx(expected, rel=1e-6)
    assert float(found.net_weight) == pytest.approx((MASS - RHO * L * B * H) * G, rel=1e-6)


def test_rows_of_balls_float_each_where_it_is(tmp_path):
    """Two rows 2 b apart, half under: with N pi r^2 of waterplane GM = (b^2 + r^2/4) 3/(2 r) - 3 r/8 against heel.

    r is that of balls of the volume that their triangles have, which the waterplane and so GM keep to 1e-3.
    """
    r, b, each = 0.02, 0.25, 6
    places = [(0.05 * k, side, 0.0) for k in range(each) for side in (-b, b)]
    rows = joined([made.turned(made.spheroid(r, r, 3), np.eye(3), place) for place in places])
    found = floating(build(robot(rows, tmp_path, mass=0.5 * RHO * rows.volume)))
    assert bool(found.solved)
    assert r <= float(found.draught) < 1.01 * r
    r = (rows.volume / (2 * each) * 0.75 / np.pi) ** (1 / 3)
    assert float(found.waterplane) == pytest.approx(2 * each * np.pi * r**2, rel=1e-3)
    assert float(found.metacentric_heights[0]) == pytest.approx((b**2 + r**2 / 4) * 1.5 / r - 0.375 * r, rel=1e-3)


@pytest.mark.parametrize("height", [4.0, -6.0])
def test_it_is_found_from_the_air_and_from_deep_water(height):
    start = f", start: {{position: [1 m, 2 m, {height} m], orientation: [20 deg, 30 deg, 70 deg]}}"
    found = floating(build(robot((L, B, H), com=(0, 0, KEEL + 0.15), start=start)))
    assert float(found.draught) == pytest.approx(T, rel=2e-8)
    assert (float(found.trim), float(found.heel)) == pytest.approx((0, 0), abs=1e-8)


def test_denser_water_lifts_it():
    assert float(floating(build(robot((L, B, H), density=1025.0))).draught) == pytest.approx(T / 1.025, rel=2e-8)


@both
@pytest.mark.parametrize("side", [-1, 1])
def test_a_weight_to_one_side_heels_it_there(tmp_path, kind, side):
    """Wall-sided: (GM + BM tan^2 / 2) tan = e for a centre of mass e to the side; to port is a heel below 0."""
    kg, e = 0.15, 0.03
    found = floating(build(barge(tmp_path, kind, com=(0, side * e, KEEL + kg))))
    t = np.tan(float(found.heel))
    gm, bm = metacentric(T, B, kg), B**2 / (12 * T)
    assert (gm + 0.5 * bm * t**2) * t == pytest.approx(-side * e, rel=1e-6)
    assert float(found.trim) == pytest.approx(0, abs=1e-8)


@both
def test_a_weight_ahead_puts_the_bow_down(tmp_path, kind):
    kg, e = 0.15, 0.05
    found = floating(build(barge(tmp_path, kind, com=(e, 0, KEEL + kg))))
    t = np.tan(float(found.trim))
    assert (metacentric(T, L, kg) + 0.5 * L**2 / (12 * T) * t**2) * t == pytest.approx(-e, rel=1e-6)
    assert float(found.heel) == pytest.approx(0, abs=1e-8)


def test_a_robot_whose_tail_points_along_x_trims_the_other_way(tmp_path):
    text = barge(tmp_path, "mesh", com=(0.05, 0.01, KEEL + 0.15))
    ahead = floating(build(text))
    back = floating(build(text.model_copy(update={"forward": "-x"})))
    assert float(back.trim) == pytest.approx(-float(ahead.trim), rel=1e-9)
    assert float(back.heel) == pytest.approx(-float(ahead.heel), rel=1e-9)


def test_a_top_heavy_barge_lolls():
    """tan^2 = -2 GM / BM, to either side; upright it is unstable."""
    bm = B**2 / (12 * T)
    kg = T / 2 + bm + 0.004
    found = floating(build(robot((L, B, H), com=(0, 0, KEEL + kg))))
    assert bool(found.solved)
    assert np.tan(float(found.heel)) ** 2 == pytest.approx(2 * 0.004 / bm, rel=1e-6)
    assert float(found.metacentric_heights[0]) > 0


def test_a_square_log_of_half_the_density_floats_on_its_edge():
    found = floating(build(robot((3, 0.2, 0.2), mass=RHO * 3 * 0.04 / 2)))
    assert abs(float(found.heel)) % (np.pi / 2) == pytest.approx(np.pi / 4, abs=1e-7)
    assert float(found.draught) == pytest.approx(0.2 / np.sqrt(2), rel=2e-8)


def test_a_bottle_with_its_weight_at_the_end_stands_on_it(tmp_path):
    """A polygon of 48 corners, along z of its mesh."""
    start = ", start: {orientation: [0 deg, -80 deg, 0 deg]}"
    found = floating(build(robot(made.cylinder(1.0, 0.1), tmp_path, mass=15.0, com=(0, 0, -0.45), start=start)))
    assert (float(found.trim), float(found.heel)) == pytest.approx((0, 0), abs=1e-8)
    section = 24 * np.sin(2 * np.pi / 48) * 0.1**2
    assert float(found.draught) == pytest.approx(15.0 / RHO / section, rel=1e-4)


def test_a_level_cylinder_has_its_metacentre_on_its_axis():
    """Round about x: GM is the depth of the centre of mass below the axis, however deep it floats."""
    text = f"""
name: log
water: {water()}
body:
  {{kind: rigid, shape: cylinder, length: 1 m, radius: 0.1 m, mass: 10 kg, centre_of_mass: [0 m, 0 m, -0.02 m],
   joint: {{kind: free}}}}
"""
    found = floating(build(parse_robot(text)))
    assert float(found.metacentric_heights[0]) == pytest.approx(0.02, rel=1e-9)


def test_two_bodies_float_as_one(tmp_path):
    """A barge of two halves, the fore one heavier: the sum of masses at their common centre."""
    half = "kind: rigid, shape: {mesh: hull.stl, unit: m}, centre_of_mass: [0 m, 0 m, -0.1 m]"
    fore = f"limbs: {{fore: {{{half}, offset: [1 m, 0 m, 0 m], mass: 165 kg}}}}"
    found = floating(build(robot(made.box(L / 2, B, H), tmp_path, mass=155, com=(0, 0, -0.1), limbs=fore)))
    whole = floating(build(barge(tmp_path, "mesh", com=(0.5 * 10 / 320, 0, -0.1))))
    for name in ("draught", "trim", "waterplane"):
        assert float(getattr(found, name)) == pytest.approx(float(getattr(whole, name)), rel=1e-8)
    assert float(found.trim) < -0.005
    assert np.asarray(found.metacentric_heights) == pytest.approx(np.asarray(whole.metacentric_heights), rel=1e-8)


@pytest.mark.parametrize("surface", [True, False])
def test_what_is_all_under_water_hangs_below_its_centre_of_buoyancy(surface):
    """Righting moment rho g V BG sin, also where weight and buoyancy differ: about the centre of mass."""
    mass, com = 1000.0, (0.02, 0.0, -0.1)
    made = build(robot((L, B, H), mass=mass, com=com, surface=surface))
    found = floating(made)
    uplift, bg = RHO * G * L * B * H, np.hypot(0.02, 0.1)
    assert bool(found.solved) and not bool(found.afloat) and np.isnan(float(found.draught))
    assert float(found.net_weight) == pytest.approx(mass * G - uplift, rel=1e-12)
    assert float(found.trim) == pytest.approx(-np.arctan2(0.02, 0.1), rel=1e-12)
    assert np.asarray(found.metacentric_heights) == pytest.approx(2 * [uplift * bg / (mass * G)], rel=1e-9)
    heels = np.radians([0, 30, 90, 180])
    curve = arms(made, found, heels)  # about its own axis, whose trim is held
    assert curve == pytest.approx(uplift * 0.1 * np.sin(heels) / (mass * G), abs=1e-12)


def test_what_is_upside_down_under_water_turns_over():
    found = floating(build(robot((L, B, H), mass=1000, com=(0, 0, 0.1), surface=False)))
    assert abs(float(found.heel)) == pytest.approx(np.pi, abs=1e-9)
    assert float(found.metacentric_heights[0]) > 0


@both
def test_righting_arms_of_a_wall_sided_barge(tmp_path, kind):
    """GZ = sin (GM + BM tan^2 / 2) until its deck or its bottom comes to the water; odd in the heel."""
    kg, bm = 0.15, B**2 / (12 * T)
    heels = np.radians([-20, -5, 0, 1, 5, 10, 20, 25])
    assert np.tan(heels.max()) < 2 * T / B
    expected = np.sin(heels) * (metacentric(T, B, kg) + 0.5 * bm * np.tan(heels) ** 2)
    made = build(barge(tmp_path, kind, com=(0, 0, KEEL + kg)))
    assert arms(made, floating(made), heels) == pytest.approx(expected, abs=1e-10 if kind == "box" else 1e-6)


TILT = np.radians(20)
smaller = eqx.filter_jit(lambda robot, found: smaller_arm(robot, found, TILT))


@pytest.mark.parametrize("side", [-1, 1])
def test_the_smaller_righting_arm_is_to_the_side_of_the_weight(tmp_path, side):
    """Wall-sided, with a centre of mass e to one side: GZ = sin (GM + BM tan^2 / 2) - e cos to that side."""
    kg, e, heel = 0.15, 0.03, TILT
    made = build(barge(tmp_path, "mesh", com=(0, side * e, KEEL + kg)))
    found = floating(made)
    upright = np.sin(heel) * (metacentric(T, B, kg) + 0.5 * B**2 / (12 * T) * np.tan(heel) ** 2)
    starboard, port = arms(made, found, np.array([heel, -heel])) * (1, -1)
    assert (starboard, port) == pytest.approx((upright + side * e * np.cos(heel), upright - side * e * np.cos(heel)))
    assert float(smaller(made, found)) == pytest.approx(min(starboard, port), rel=1e-12)


def test_upside_down_a_barge_is_a_barge():
    up, down = (build(robot((L, B, H), com=(0, 0, z))) for z in (0.05, -0.05))
    curve = arms(down, floating(down), np.array([np.pi + 0.1]))
    assert curve == pytest.approx(arms(up, floating(up), np.array([0.1])), abs=1e-10)


def test_a_flooded_hull_floats_by_the_volume_of_its_walls(tmp_path):
    """Half of the volume is flooded: twice as deep."""
    whole = barge(tmp_path, "mesh", com=(0, 0, KEEL + 0.15))
    half = build(whole.with_part("body", volume=0.5 * L * B * H))
    assert float(floating(half).draught) == pytest.approx(2 * T, rel=1e-6)


_n = jnp.asarray


def test_derivatives_are_those_of_finite_differences(tmp_path):
    """Also of what Newton's method finds; afloat and, by its mass, deep."""
    afloat = barge(tmp_path, "mesh", com=(0.03, 0.02, KEEL + 0.15))
    theta, make = bind(afloat, ("body.mass", *(f"body.centre_of_mass.{k}" for k in range(3))))

    def judged(theta):
        robot = make(theta)
        found = float_freely(robot)
        first = jnp.where(found.afloat, found.draught, found.net_weight)
        return jnp.stack([first, found.trim, found.heel, *found.metacentric_heights, arm(robot, found, _n(0.3))])

    varied = jax.jit(lambda theta, direction: jax.jvp(judged, (theta,), (direction,)))
    for place in (theta, _n([1000.0, 0.02, 0.01, -0.1])):
        for k, step in enumerate((1e-2, 1e-5, 1e-5, 1e-5)):
            h = _n(np.eye(4)[k])
            found = np.asarray(varied(place, h)[1])
            ahead, back = (np.asarray(varied(place + side * step * h, h)[0]) for side in (1, -1))
            assert found == pytest.approx((ahead - back) / (2 * step), rel=2e-5, abs=1e-6 * np.abs(found).max())
