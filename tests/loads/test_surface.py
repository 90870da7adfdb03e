"""Bodies at the surface: draughts, metacentres, heaving, what a body gives to water it meets, and the account of it."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from nectosome.core import State
from nectosome.core.se3 import dot, rotation_from_quaternion
from nectosome.description import parse_robot
from nectosome.loads.foil_theory import plate_added_mass_share
from nectosome.mechanism import Robot, in_plane
from nectosome.model import bind, build
from nectosome.solve import forces, simulate

RHO, G = 1000.0, 9.81
WATER = "{density: 1000 kg/m3, gravity: 9.81 m/s2, surface: 0 m}"
NO_GRAVITY = "{density: 1000 kg/m3, gravity: 0 m/s2, surface: 0 m}"
BOX = "kind: rigid, shape: box, length: 1 m, width: 400 mm, height: 200 mm"
LYING = "section: circle, length: 0.5 m, radius: 0.1 m"
SPHERE = "kind: rigid, shape: spheroid, length: 0.4 m, radius: 0.2 m"
FREE = "joint: {kind: free}"


def robot(body: str, water: str = WATER) -> Robot:
    return build(parse_robot(f"{{name: float, water: {water}, body: {{{body}}}}}"))


def rod(sizes: str, density: str) -> str:
    return f"kind: rod, {sizes}, young: 1e12 Pa, density: {density}, strains: {{bending_y: 1}}, points: 6"


@eqx.filter_jit
def accelerations(system, x: State):
    return system.rates(jnp.zeros(()), x).v


@eqx.filter_jit
def heaving(floating: Robot, height):
    """Forces that are left at rest over the mass, and their slopes by the height: the square of the frequency."""
    x = floating.initial()
    mass = floating.mass_bias(jnp.zeros(()), x)[0][0, 0]

    def at(height):
        return floating.residual(jnp.zeros(()), State(x.q.at[0].set(height), x.v, x.z), 0 * x.v)

    found, slope = jax.jvp(at, (height,), (jnp.ones(()),))
    return found / mass, slope / mass


@pytest.mark.parametrize(("body", "middle", "stiffness"), [
    (f"{BOX}, density: 300 kg/m3", 0.04, G / 0.06),
    ("kind: rigid, shape: cylinder, length: 0.5 m, radius: 0.1 m, density: 500 kg/m3", 0.0, 4 * G / (np.pi * 0.1)),
    (f"{SPHERE}, density: 500 kg/m3", 0.0, 1.5 * G / 0.2),
    ("kind: rigid, shape: point, mass: 1 kg, volume: 2 L", 0.0, 1.5 * G / np.cbrt(0.75 * 2e-3 / np.pi)),
    (rod(LYING, "500 kg/m3"), 0.0, 4 * G / (np.pi * 0.1)),
    (rod("section: rectangle, length: 1 m, width: 0.4 m, height: 0.2 m", "300 kg/m3"), 0.04, G / 0.06),
])  # fmt: skip
def test_a_body_floats_where_it_displaces_its_weight_and_heaves_with_its_waterplane(body, middle, stiffness):
    """A box of 0.3 of the water's density with its middle 0.2 h over the surface; w^2 = rho g A / m; so do rods."""
    left, slopes = heaving(robot(f"{body}, joint: {{kind: prismatic, axis: z}}"), jnp.asarray(middle))
    np.testing.assert_allclose(left, 0.0, atol=1e-9)
    assert float(slopes[0]) == pytest.approx(stiffness, rel=1e-9)


@pytest.mark.parametrize("strips", [5, 9])
def test_a_half_sunk_ball_heaves_with_its_waterplane_whatever_its_strips(strips: int):
    """w^2 = rho g pi r^2 / (m + m_a) with half of its added mass, rho 2/3 pi r^3 / 2: g / r."""
    push = "push: {kind: distributed_force, force: [0 N/m, 0 N/m, 0 N/m]}"
    loads = f"strips: {strips}, loads: {{am: {{kind: spheroid_added_mass}}, {push}}}"
    upright = "rotation: [0 deg, -90 deg, 0 deg], offset: [0 m, 0 m, -0.2 m]"
    floating = robot(f"{SPHERE}, density: 500 kg/m3, {upright}, {loads}, joint: {{kind: prismatic, axis: x}}")
    np.testing.assert_allclose(np.ravel(heaving(floating, jnp.zeros(()))), [0.0, G / 0.2], rtol=1e-9, atol=1e-9)


@eqx.filter_jit
def righting(floating: Robot):
    """Minus the slopes of the angular accelerations by rolling and pitching about the start, at rest."""
    x = floating.initial()

    def at(turn):
        q = x.q.at[3:].set(jnp.stack([1 - turn @ turn / 8, *(0.5 * turn)]))
        q = q.at[:3].add(dot(rotation_from_quaternion(q[3:]), jnp.array([-0.5, 0.0, 0.0])) + jnp.array([0.5, 0.0, 0.0]))
        return floating.rates(jnp.zeros(()), State(q, x.v, x.z)).v[:2]

    return -jax.jacfwd(at)(jnp.zeros(3))[:, :2]


def test_a_free_box_rolls_and_pitches_with_its_metacentric_frequency():
    """w^2 = m g GM / I, GM = B^2/(12 T) + T/2 - h/2, in roll 7.00 rad/s, about its middle."""
    h, T = 0.2, 0.1
    exact = [12 * G * (b**2 / (12 * T) + T / 2 - h / 2) / (b**2 + h**2) for b in (0.4, 1.0)]
    found = righting(robot(f"{BOX}, density: 500 kg/m3, {FREE}"))
    np.testing.assert_allclose(found, np.diag(exact), rtol=1e-9, atol=1e-7)
    assert np.sqrt(exact[0]) == pytest.approx(7.0036, abs=1e-4)


def turned(shape: str, angle: float) -> Robot:
    """A free body half sunk, its axis turned up from the horizon, with its middle in the surface."""
    up = Rotation.from_euler("y", -angle).as_matrix()
    x, y, z = -0.2 * up[:, 0]
    start = f"{{position: [{x} m, {y} m, {z} m], orientation: [0 rad, {-angle} rad, 0 rad]}}"
    return robot(f"{shape}, density: 500 kg/m3, joint: {{kind: free, start: {start}}}")


def test_a_disc_upright_rights_itself_by_its_waterplane():
    """Wall-sided: m g sin(a) (GM + BM tan(a)^2 / 2) at 1 deg, GM = T/2 + BM - L/2 = 12.5 mm, BM = r^2/(4 T)."""
    disc, tilt = "kind: rigid, shape: cylinder, length: 0.4 m, radius: 0.3 m", np.radians(1.0)
    floating = turned(disc, np.pi / 2 - tilt)
    lever = 0.1 + 0.09 / 0.8 - 0.2 + 0.5 * 0.09 / 0.8 * np.tan(tilt) ** 2
    exact = -G * np.sin(tilt) * lever / (0.09 / 4 + 0.16 / 12)  # about y, which lowers the axis
    assert exact == pytest.approx(-0.0597, abs=2e-4)
    assert float(accelerations(floating, floating.initial())[1]) == pytest.approx(exact, rel=1e-9)


def polygon_under_water(corners: np.ndarray) -> tuple[float, float]:
    """Area of a polygon below z = 0, and its first moment of depth, by clipping and the shoelace formula."""
    kept = []
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        if a[1] <= 0:
            kept.append(a)
        if (a[1] < 0) != (b[1] < 0):
            kept.append(a + (b - a) * a[1] / (a[1] - b[1]))
    if len(kept) < 3:
        return 0.0, 0.0
    (x0, z0), (x1, z1) = np.array(kept).T, np.roll(kept, -1, axis=0).T
    across = x0 * z1 - x1 * z0
    return 0.5 * across.sum(), -np.sum((z0 + z1) * across) / 6


def test_a_box_that_tumbles_in_the_surface_keeps_its_energy():
    """Kinetic, of its weight and of the displaced water, which is that of a polygon; its corners come and go."""
    start = "start: {position: [0 m, 0 m, 5 cm], angle: 40 deg, angular_speed: 3 rad/s}"
    floating = robot(f"{BOX}, density: 500 kg/m3, joint: {{kind: planar, axis: x, {start}}}")
    run = simulate(floating, 20.0, rtol=1e-11, atol=1e-13, method="explicit", samples=101)
    kinetic = run.to_dataset()["energy"].sel(form="kinetic").values
    _, z, angle = np.asarray(run.value.state.q).T
    corners = np.array([[-0.2, -0.1], [0.2, -0.1], [0.2, 0.1], [-0.2, 0.1]])
    potential = []
    for up, turn in zip(z, angle, strict=True):
        c, s = np.cos(turn), np.sin(turn)
        area, depth = polygon_under_water(corners @ np.array([[c, s], [-s, c]]) + [0.0, up])
        assert 0 <= area <= 0.08
        potential.append(RHO * G * (0.5 * 0.08 * up + depth))
    total = kinetic + np.array(potential)
    assert np.ptp(kinetic) > 10.0
    np.testing.assert_allclose(total, total[0], atol=1e-5)


def test_a_ball_over_the_water_falls_as_in_a_vacuum_until_it_meets_it():
    """0.5 g t^2 = 1.226 m in 0.5 s: neither the water's added mass nor its drag is up there."""
    start = "joint: {kind: free, start: {position: [0 m, 0 m, 3 m]}}"
    loads = "loads: {am: {kind: spheroid_added_mass}, drag: {kind: lumped_drag, drag_area: [0.1 m2, 0.1 m2, 0.1 m2]}}"
    run = simulate(robot(f"{SPHERE}, mass: 30 kg, {start}, {loads}"), 0.5, samples=3)
    assert 3 - float(run.value.state.q[-1, 2]) == pytest.approx(0.5 * G * 0.25, rel=1e-9)
    assert float(run.value.state.v[-1, 5]) == pytest.approx(-0.5 * G, rel=1e-9)


def meeting(height: float, speed: float):
    """A ball of 20 kg that goes through the surface without gravity, in 0.5 s."""
    joint = f"joint: {{kind: prismatic, axis: z, position: {height} m, velocity: {speed} m/s}}"
    ball = robot(f"{SPHERE}, mass: 20 kg, {joint}, loads: {{am: {{kind: spheroid_added_mass}}}}", NO_GRAVITY)
    return simulate(ball, 0.5, rtol=1e-10, atol=1e-12, method="explicit", samples=401)


def test_a_ball_that_meets_the_water_shares_its_momentum_with_it():
    """M V0 = (M + s A) V at each depth (von Karman 1929), A = 2/3 rho pi r^3; the lost energy goes into the spray."""
    run = meeting(0.25, -2.0)
    z, V = np.asarray(run.value.state.q[:, 0]), np.asarray(run.value.state.v[:, 0])
    d, A = np.clip(-z / 0.2, -1, 1), 2 / 3 * RHO * np.pi * 0.2**3
    share = (2 + 3 * d - d**3) / 4
    np.testing.assert_allclose((20 + share * A) * V, -40.0, rtol=1e-7)
    assert share[0] == 0
    assert share[-1] == 1
    data = run.to_dataset()
    energy, lost = data["energy"].sum("form").values, data["load_power"].sel(load="slamming").sum("part").values
    np.testing.assert_allclose(energy, 0.5 * 20 * 2.0 * np.abs(V), rtol=1e-7)
    assert np.trapezoid(lost, data["time"].values) == pytest.approx(energy[-1] - energy[0], rel=1e-3)


def test_a_ball_that_leaves_the_water_keeps_its_speed():
    """The water stays behind with the velocity that it has; nothing else acts."""
    run = meeting(-0.25, 2.0)
    np.testing.assert_allclose(run.value.state.v[:, 0], 2.0, rtol=1e-10)
    carried = run.to_dataset()["energy"].sel(form="water").values
    assert carried[0] == pytest.approx(0.5 * 4 * 2 / 3 * RHO * np.pi * 0.2**3, rel=1e-9)
    assert carried[-1] == 0


def entering(load: str):
    """A point of 20 kg and 20 L that goes into the water at 2 m/s over a floor, with this load alone."""
    joint = "joint: {kind: prismatic, axis: z, position: 0.25 m, velocity: -2 m/s}"
    water = NO_GRAVITY.replace("}", ", floor: -1 m}")
    point = robot(f"kind: rigid, shape: point, mass: 20 kg, volume: 20 L, {joint}, loads: {{one: {load}}}", water)
    return simulate(point, 0.4, rtol=1e-10, atol=1e-12, method="explicit", samples=201)


@pytest.mark.parametrize(("load", "carried"), [
    ("{kind: near_floor, mass: [9 kg, 9 kg, 9 kg], full: 2 m, none: 3 m}", 9.0),
    ("{kind: jet, volume: [5 L, 5 L, 5 L, 5 L], nozzle: 1 cm2, inlet: 1 cm2, bell: 0.4, direction: z,"
     " crank: {kind: rate, rate: 1 rad/s}}", 7.0),
])  # fmt: skip
def test_what_changes_with_shape_and_place_ends_at_the_surface_as_well(load: str, carried: float):
    """M V0 = (M + s m) V of the water near the floor, and of a chamber of 5 L and its bell of 2 kg that fills."""
    run = entering(load)
    z, V = np.asarray(run.value.state.q[:, 0]), np.asarray(run.value.state.v[:, 0])
    d = np.clip(-z / np.cbrt(0.75 * 20e-3 / np.pi), -1, 1)
    share = (2 + 3 * d - d**3) / 4
    np.testing.assert_allclose((20 + share * carried) * V, -40.0, rtol=1e-7)
    assert (share[0], share[-1]) == (0, 1)
    data = run.to_dataset()
    energy, lost = data["energy"].sum("form").values, data["load_power"].sel(load="slamming").sum("part").values
    assert np.trapezoid(lost, data["time"].values) == pytest.approx(energy[-1] - energy[0], rel=1e-3)


FIN = "kind: rigid, shape: box, length: 5 cm, width: 2 mm, height: 40 cm, mass: 0.3 kg"


def test_a_fin_that_meets_the_water_carries_what_is_beside_its_span_under_it():
    """Upright, at 45 deg across itself: M V0 = (M + s A/2) V with the share s of its span, section by section."""
    foil = "{kind: foil, span_along: z, ahead: x, chord: 5 cm, sections: 5, broadside_drag: 0, profile_drag: 0}"
    joint = "joint: {kind: prismatic, axis: [0, 1, -1], position: -0.5 m, velocity: 2 m/s}"
    run = simulate(robot(f"{FIN}, {joint}, loads: {{fin: {foil}}}", NO_GRAVITY), 0.8, rtol=1e-10, atol=1e-12,
                   method="explicit", samples=401)  # fmt: skip
    q, V = np.asarray(run.value.state.q[:, 0]), np.asarray(run.value.state.v[:, 0])
    share = np.clip((q / np.sqrt(2) + 0.2) / 0.4, 0, 1)
    A = float(plate_added_mass_share(jnp.asarray(8.0))) * RHO * np.pi * 0.025**2 * 0.4
    assert (share[0], share[-1]) == (0, 1)
    np.testing.assert_allclose((0.3 + 0.5 * share * A) * V, 0.6, rtol=1e-6)
    data = run.to_dataset()
    energy, lost = data["energy"].sum("form").values, data["load_power"].sel(load="slamming").sum("part").values
    assert np.trapezoid(lost, data["time"].values) == pytest.approx(energy[-1] - energy[0], rel=1e-2)


PULSE = "volume: [3 L, 2 L, 3 L, 4 L], nozzle: 30 cm2, inlet: 20 cm2, bell: 0.4, wake: 0.3, elastance: 1 kPa/L"
JET = f"kind: jet, {PULSE}, direction: x, crank: {{kind: rate, rate: 3 rad/s}}"
THRUST = (
    "kind: pulsed_thrust, direction: z, rated: 2 rad/s, speed: 3 rad/s, start: 20 deg, values: [1 N, 4 N, 2 N, -1 N]"
)


@pytest.mark.parametrize("jet", [JET, THRUST])
def test_a_jet_in_the_air_pushes_nothing_and_one_under_water_knows_no_surface(jet: str):
    """Deep down as without a surface; up there the point of 20 kg falls freely."""
    loads = f"inertia: [1 kg m2, 1 kg m2, 1 kg m2], volume: 20 L, loads: {{jet: {{{jet}}}}}"

    def found(height: float, water: str) -> np.ndarray:
        start = f"start: {{position: [0 m, 0 m, {height} m], velocity: [0.4 m/s, 0 m/s, 0.2 m/s]}}"
        point = robot(f"kind: rigid, shape: point, mass: 20 kg, {loads}, joint: {{kind: free, {start}}}", water)
        return np.asarray(accelerations(point, point.initial()))[3:]

    np.testing.assert_allclose(found(2.0, WATER), [0.0, 0.0, -G], rtol=1e-12, atol=1e-12)
    deep = found(-2.0, WATER.replace(", surface: 0 m", ""))
    np.testing.assert_allclose(found(-2.0, WATER), deep, rtol=1e-12, atol=1e-12)
    assert np.abs(deep).max() > 0.05


LOADED = f"""{{
  name: two, water: {{density: 1000 kg/m3, gravity: 9.81 m/s2, surface: 0 m, floor: -0.4 m}},
  body: {{{BOX}, density: 500 kg/m3, strips: 2, joint: {{kind: planar, axis: y}},
    loads: {{am: {{kind: added_mass, normal: 1, tangential: 0.3}}, drag: {{kind: plate_drag, normal: 1.2}}}}}},
  limbs: {{
    arm: {{kind: rigid, shape: cylinder, length: 0.6 m, radius: 8 cm, density: 600 kg/m3,
      joint: {{kind: revolute, axis: y, position: 20 deg}},
      loads: {{am: {{kind: cylinder_added_mass}}, drag: {{kind: drag, normal: 1, tangential: 0.1}}}}}},
    ball: {{on: arm, {SPHERE}, mass: 12 kg, loads: {{am: {{kind: spheroid_added_mass}}, jet: {{{JET}}}, ground:
      {{kind: near_floor, mass: [9 kg, 9 kg, 5 kg], drag_area: [0.1 m2, 0 m2, 0 m2], full: 0.1 m, none: 1 m}}}}}}}}}}"""


def tossed(floating: Robot, seed: int) -> State:
    """A random state near the surface."""
    x, r = floating.initial(), np.random.default_rng(seed)
    return State(x.q + jnp.asarray(0.15 * r.normal(size=x.q.shape)), jnp.asarray(r.normal(size=x.v.shape)), x.z)


def test_the_equations_in_a_plane_are_those_in_space():
    floating = build(parse_robot(LOADED))
    plane = in_plane(floating)
    for seed in range(6):
        x = tossed(floating, seed)
        np.testing.assert_allclose(accelerations(plane, x), accelerations(floating, x), rtol=1e-9, atol=1e-9)


def test_powers_balance_while_added_mass_comes_and_goes():
    """d/dt of the energy of bodies and added mass is the sum of all powers, that of slamming among them."""
    floating, found = build(parse_robot(LOADED)), []
    for seed in range(6):
        x = tossed(floating, seed)
        data = forces(floating, np.asarray(floating.displacements(x.q)), np.asarray(x.v), None)
        assert float(data["power_balance"]) < 1e-12
        found.append(float(data["load_power"].sel(load="slamming").sum()))
    assert max(found) <= 0
    assert min(found) < -100


@pytest.mark.slow
def test_slopes_by_sizes_and_by_the_surface_are_those_of_finite_differences():
    """Of accelerations of a body in the surface, that sink and turn."""
    paths = ("body.width", "body.height", "body.length", "limbs.arm.radius", "limbs.ball.radius", "water.surface")
    theta, of = bind(parse_robot(LOADED), paths)
    x = tossed(build(parse_robot(LOADED)), 3)

    @jax.jit
    def at(theta):
        return of(theta).rates(jnp.zeros(()), x).v

    slopes, step = jax.jit(jax.jacfwd(at))(theta), 1e-6
    differences = np.stack([(at(theta + step * e) - at(theta - step * e)) / (2 * step) for e in np.eye(len(paths))]).T
    assert np.all(np.abs(slopes).max(axis=0) > 0.1)
    np.testing.assert_allclose(slopes, differences, rtol=1e-6, atol=1e-6 * np.abs(slopes).max())
