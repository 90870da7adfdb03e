"""Webs between limbs: their kinematics, closed forms of plates, balances, and derivatives."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.core import State
from nectosome.core.se3 import dot
from nectosome.description import parse_robot
from nectosome.loads import Membrane
from nectosome.loads.foil_theory import plate_strip_share
from nectosome.mechanism.robot import start_shape
from nectosome.mechanism.webs import APART, sheet_reach
from nectosome.model import bind, build
from nectosome.solve import simulate
from nectosome.units import InputError

RING = """
name: ring
water: {gravity: 0 m/s2}
body: {kind: rigid, shape: point, mass: 50 g, inertia: [1e-5 kg m2, 1e-5 kg m2, 1e-5 kg m2], joint: {kind: free}}
limbs:
  arm:
    kind: rod
    section: circle
    length: 60 mm
    radius: 3 mm
    young: 0.3 MPa
    damping: 1 kPa s
    density: 1000 kg/m3
    strains: {bending_y: 0, bending_z: 0}
    start: {bending_y: [4 1/m]}
    points: 3
    offset: [0 mm, 0 mm, 20 mm]
    rotation: [0 deg, -120 deg, 0 deg]
    repeat: {count: 3, around: x}
webs:
  bell:
    between: arm
    thickness: 1 mm
    young: 20 kPa
    density: 1100 kg/m3
    loads: {drag: {kind: plate_drag, normal: 1.2}, water: {kind: sheet_added_mass}}
"""
# two stiff bars side by side on a slide across them, and a web between
PLATE = """
name: plate
water: {gravity: 0 m/s2}
body: {kind: rigid, shape: point, mass: 1 kg, joint: {kind: prismatic, axis: z, velocity: 0.5 m/s}}
limbs:
  bar:
    kind: rigid
    shape: cylinder
    length: 0.3 m
    radius: 1 mm
    density: 1000 kg/m3
    offset: [0 m, -0.1 m, 0 m]
    repeat: {count: 2, along: [0 m, 0.2 m, 0 m]}
webs:
  sheet:
    between: bar
    thickness: 2 mm
    young: 1 MPa
    density: 1100 kg/m3
    loads: {drag: {kind: plate_drag, normal: 1.2, start_up: none}, water: {kind: sheet_added_mass}}
"""


@pytest.fixture(scope="module")
def ring():
    return build(parse_robot(RING))


def moved(robot, seed=0):
    """Some state away from the start, and its velocities."""
    r = np.random.default_rng(seed)
    q, v = robot.start.q, jnp.asarray(0.5 * r.normal(size=robot.start.v.shape))
    return robot.advance(q, jnp.asarray(0.3 * r.normal(size=v.shape)), jnp.ones(())), v


def test_twists_and_their_rates_are_those_of_the_poses(ring):
    """Central differences of positions and of twists along a motion."""
    tree, (q, v), h = ring.tree, moved(ring), 1e-5
    a = jnp.asarray(np.random.default_rng(1).normal(size=v.shape))

    @jax.jit
    def at(s):
        shape = tree.shape(tree.complete(jnp.zeros(()), ring.advance(q, v + 0.5 * s * a, s), v)[0])
        twist = tree.twists(shape, v + s * a)
        split = (tree.split(x, "v") for x in (v + s * a, a))
        return shape, twist, tree.rates_of(shape, tree.added(shape, tree.split(v + s * a, "v")), *split)

    (shape, twist, rate), (ahead, faster, _), (behind, slower, _) = at(0.0), at(h), at(-h)
    web = np.s_[tree.solid :]
    velocity = (ahead.position - behind.position) / (2 * h)
    np.testing.assert_allclose(dot(shape.rotation, twist[:, 3:])[web], velocity[web], rtol=0, atol=1e-8)
    turning = jnp.einsum("nji,njk->nik", shape.rotation, (ahead.rotation - behind.rotation) / (2 * h))
    spin = jnp.stack([turning[:, 2, 1], turning[:, 0, 2], turning[:, 1, 0]], axis=-1)
    np.testing.assert_allclose(twist[web, :3], spin[web], rtol=0, atol=1e-6)
    np.testing.assert_allclose(rate[web], ((faster - slower) / (2 * h))[web], rtol=0, atol=1e-6)


@pytest.fixture(scope="module")
def plate():
    return build(parse_robot(PLATE))


def test_a_web_between_stiff_bars_is_a_plate(plate):
    """Across itself at 0.5 m/s: drag rho C A v^2/2 and mass; the added mass of a rectangle (Pabst 1930)."""
    robot = plate
    long, wide, v = 0.3, 0.2 - 2e-3, 0.5

    @eqx.filter_jit
    def at(robot, v):
        x = State(robot.start.q, v[None], robot.start.z)
        forces = robot.forces(jnp.zeros(()), x, jnp.zeros(1))
        return forces.residual[0], robot.mass(forces.shape, forces.added)[0, 0]

    (drag, mass), (still, _) = at(robot, v * jnp.ones(())), at(robot, jnp.zeros(()))
    assert drag - still == pytest.approx(0.5 * 1000 * 1.2 * long * wide * v**2, rel=1e-12)
    assert robot.weight()[-1] == pytest.approx(1100 * 2e-3 * long * wide, rel=1e-12)
    expected = 1000 * np.pi / 4 * 0.202**2 * long * float(plate_strip_share(jnp.asarray(0.202 / long)))
    assert mass - jnp.sum(robot.weight()) == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize("ratio", [0.1, 0.3, 0.5, 1.0, 2.0, 5.0])
def test_the_reach_of_a_rectangle_gives_its_added_mass(ratio):
    """Within 2 % of Pabst (1930), by 400 x 400 places."""
    s = (jnp.arange(400) + 0.5) / 400
    half = jnp.sqrt(s * (1 - s))
    long, wide = jnp.broadcast_arrays(half[:, None], ratio * half[None])
    mass = ratio * float(jnp.mean(2 * sheet_reach(long, wide)))
    assert mass == pytest.approx(np.pi / 4 * ratio**2 * float(plate_strip_share(jnp.asarray(ratio))), rel=0.02)


WIDE = """
name: wide
water: {gravity: 0 m/s2}
body: {kind: rigid, shape: point, mass: 1 kg}
limbs:
  rod: {kind: rod, length: 0.2 m, young: 1 MPa, density: 1 g/cm3, strains: {bending_y: 1}, points: 5, section: SECTION}
"""
SHEET = "{drag: {kind: plate_drag, normal: 1.2, start_up: none}}"


def bending_drag(text):
    """Drag along the coordinates of bending, of all rods together, bent and bending alike."""
    robot = build(parse_robot(text))
    rods = robot.start.q.shape[0] // 2
    q, v = jnp.tile(jnp.array([0.9, -0.4]), rods), jnp.tile(jnp.array([1.5, 0.8]), rods)

    @eqx.filter_jit
    def at(robot, v):
        return robot.residual(jnp.zeros(()), State(q, v, robot.start.z), jnp.zeros(2 * rods))

    # gyroscopic forces are even in the velocity, drag is odd
    return 0.5 * np.asarray(at(robot, v) - at(robot, -v)).reshape(rods, 2).sum(axis=0)


def test_a_web_on_rods_that_move_alike_is_a_wide_rod():
    place = ", offset: [0 m, -30 mm, 0 m], repeat: {count: 2, along: [0 m, 60 mm, 0 m]}"
    web = "webs: {sheet: {between: rod, thickness: 1 mm, young: 1 Pa, density: 1000 kg/m3, loads: " + SHEET + "}}\n"
    pair = WIDE.replace("SECTION", "circle, radius: 2 mm" + place) + web
    wide = "rectangle, width: 56 mm, height: 1 mm, loads: " + SHEET
    one = WIDE.replace("SECTION", wide)
    np.testing.assert_allclose(bending_drag(pair), bending_drag(one), rtol=1e-3)


@pytest.fixture(scope="module")
def swum(ring):
    q, v = moved(ring)
    return simulate(ring, 0.05, samples=6, rtol=1e-6, atol=1e-8, initial=State(q, v, ring.start.z))


def test_power_and_momentum_balance(swum):
    """All that the water does to a web goes to its limbs, also as it stretches."""
    data = swum.to_dataset()
    assert int(swum.status) == 0
    web = data["load_power"].sel(part="bell")
    assert {name for name in web["load"].values if np.abs(web.sel(load=name)).max() > 1e-6} >= {"drag", "membrane"}
    assert float(data["power_balance"].max()) < 1e-11
    assert float(data["momentum_balance"].max()) < 1e-11


PAIR = """
name: pair
water: {gravity: 0 m/s2}
limbs:
  left:
    {BAR, joint: {kind: free, start: {angular_velocity: [3 rad/s, 1 rad/s, -2 rad/s]}}}
  right: {BAR, offset: [0 m, 60 mm, 0 m], joint: {kind: free, start: {velocity: [0.1 m/s, 0.3 m/s, 0.3 m/s]}}}
webs:
  sheet:
    between: [left, right]
    thickness: 1 mm
    young: 20 kPa
    density: 1100 kg/m3
    loads: {water: {kind: sheet_added_mass}}
""".replace("BAR", "kind: rigid, shape: cylinder, length: 80 mm, radius: 4 mm, density: 1000 kg/m3")


@pytest.mark.slow
def test_a_web_between_two_free_bodies_keeps_momentum_and_power():
    """Both tumble and part until it pulls them together; they and the water have one momentum throughout."""
    data = simulate(build(parse_robot(PAIR)), 0.2, samples=9, rtol=1e-8, atol=1e-10).to_dataset()
    momentum = data["momentum"] + data["water_momentum"]
    np.testing.assert_allclose(momentum, np.broadcast_to(momentum[0], momentum.shape), atol=1e-8)
    assert float(data["power_balance"].max()) < 1e-11
    assert float(np.abs(data["load_power"].sel(part="sheet", load="membrane")).max()) > 1e-4


def test_turned_robots_move_alike(ring, swum):
    """The motion of a ring does not know where the world's axes point, nor which limb is the first."""
    first = swum.to_dataset()["energy"].values
    q, v = moved(ring)
    turned = ring.advance(q, jnp.zeros_like(v).at[:3].set(jnp.array([0.4, -0.8, 0.3])), jnp.ones(()))
    again = simulate(ring, 0.05, samples=6, rtol=1e-6, atol=1e-8, initial=State(turned, v, ring.start.z))
    np.testing.assert_allclose(again.to_dataset()["energy"].values, first, rtol=2e-5)


def test_derivatives_are_those_of_differences():
    """Forces by the thickness of a web, its drag and the radius of a limb beside it."""
    theta, of = bind(parse_robot(PLATE), ("webs.sheet.thickness", "webs.sheet.loads.drag.normal", "limbs.bar1.radius"))

    def unbalanced(theta):
        robot = of(theta)
        return robot.residual(jnp.zeros(()), robot.start, jnp.array([3.0]))

    way = theta * jnp.array([0.5, 1.0, -0.3])
    along = jax.jit(lambda theta: jax.jvp(unbalanced, (theta,), (way,)))  # one program for values and derivatives
    slope, (ahead, behind) = along(theta)[1], (along(theta + h * way)[0] for h in (1e-4, -1e-4))
    np.testing.assert_allclose(slope, (ahead - behind) / 2e-4, rtol=1e-7)


def test_more_gaps_add_no_equations(ring):
    """Three gaps between the same limbs, and two."""
    fewer = build(parse_robot(RING.replace("between: arm", "between: arm, closed: false".replace(", ", "\n    "))))

    def equations(robot):
        x = robot.start
        return len(jax.make_jaxpr(lambda v: robot.residual(jnp.zeros(()), State(x.q, v, x.z), v))(x.v).jaxpr.eqns)

    assert abs(equations(fewer) - equations(ring)) < 5  # rows that stand together are cut out in one, not picked


def test_a_slack_web_pulls_nothing_and_a_wide_one_by_its_modulus(plate):
    """E t L strain, strain less half of the range over which it begins; both sides alike."""
    load = Membrane(jnp.array([2e3 * 1e-3 * 0.05]), jnp.array([0.1]))
    none = jnp.zeros_like(plate.tree.stations.inertia[:, 0])
    still = eqx.filter_jit(lambda robot: robot.strips(jnp.zeros(()), start_shape(robot), none))(plate)
    for strain in (0.3, -0.2):
        place = jnp.array([[0.0, 0.0, 0.0], [0.0, APART * 0.1 * (1 + strain), 0.0]])
        two = jax.tree.map(lambda x: x[-2:], still)
        two = eqx.tree_at(lambda s: (s.position, s.rotation), two, (place, jnp.stack([jnp.eye(3)] * 2)))
        force = load.force(jnp.zeros(()), two, (), plate.water)[0]
        pull = 0.1 * (strain - 5e-4) / APART if strain > 0 else 0.0
        np.testing.assert_allclose(force, jnp.zeros((2, 6)).at[:, 4].set(jnp.array([pull, -pull])), atol=1e-15)


RIBBON = """
name: ribbon
water: {gravity: 0 m/s2}
body: {kind: rigid, shape: point, mass: 1 kg, joint: {kind: prismatic, axis: x}}
limbs:
  ray:
    kind: rigid
    shape: cylinder
    length: 40 mm
    radius: 0.01 mm
    density: 1000 kg/m3
    rotation: [0 deg, 90 deg, 0 deg]
    repeat: {count: 9, along: [20 mm, 0 mm, 0 mm], phase: 45 deg}
    joint: {kind: revolute, axis: z, motion: {kind: sine, amplitude: 3 deg, frequency: 2 Hz}}
webs:
  fin:
    between: ray
    thickness: 0.1 mm
    young: 1 Pa
    density: 1000 kg/m3
    loads: {drag: {kind: plate_drag, normal: 1.8, start_up: none}}
"""


def resistive_thrust(rays):
    """Of one wave along rays that straight lines join, by velocity across and slope at two Gauss points across gaps."""
    angle, omega, h, long = np.radians(3.0), 4 * np.pi, 0.04, 0.16
    phase = omega * 0.1 + 2 * np.pi * np.arange(rays) / (rays - 1)
    (before, after), step = (np.roll(phase, -k)[:-1] for k in (0, 1)), long / (rays - 1)
    w = 0.5 + np.array([[-0.5], [0.5]]) / np.sqrt(3)
    across = angle * omega * ((1 - w) * np.cos(before) + w * np.cos(after))
    slope = angle * (np.sin(after) - np.sin(before)) / step
    return 0.5 * 1000 * 1.8 * h**4 / 4 * np.sum(0.5 * step * np.abs(across) * across * slope)


def test_a_wave_along_a_fin_of_rays_pushes_against_its_direction():
    r"""Resistive theory of a small angle $\theta$ along the length L of a fin of height h; the wave runs towards -x.

    With whole waves along the fin the mean over its length is that over time. Many rays have the thrust

    $$ T = \tfrac12 \rho C \omega^2 k \theta^3\, \tfrac{4}{3\pi}\, \tfrac{h^4}{4}\, L $$
    """
    smooth = 0.5 * 1000 * 1.8 * (4 * np.pi) ** 2 * 2 * np.pi * np.radians(3.0) ** 3 * 4 / (3 * np.pi) * 0.04**4 / 4
    assert resistive_thrust(400) == pytest.approx(smooth, rel=1e-3)
    robot = build(parse_robot(RIBBON))

    @eqx.filter_jit
    def at(robot, t):
        forces = robot.forces(t, robot.start, jnp.zeros(1))
        return forces.wrenches, forces.shape.rotation

    wrenches, rotation = at(robot, jnp.asarray(0.1))
    (drag,) = (w for g, w in zip(robot.load_groups.acting, wrenches, strict=True) if "drag" in g.names)
    push = dot(rotation[robot.tree.solid :], drag[:, 3:])[:, 0]
    assert float(jnp.sum(push)) == pytest.approx(resistive_thrust(9), rel=5e-3)


def test_limbs_that_overlap_leave_no_gap_for_a_sheet():
    """The first place along the arms, 6.8 mm from their roots, is 5.9 mm further out: 10.1 mm apart with roots at 0."""
    near = RING.replace("20 mm]", "0 mm]")
    build(parse_robot(near))
    with pytest.raises(InputError, match=r"between arm1 and arm2: they overlap at 6\.762 mm from"):
        build(parse_robot(near.replace("radius: 3 mm", "radius: 8 mm")))
    theta, make = bind(parse_robot(RING), tuple(f"limbs.arm{k}.radius" for k in (1, 2, 3)))
    shapes = [float(jnp.sum(jax.jit(make)(r * theta).tree.stations.volume)) for r in (1.0, 20.0)]
    assert np.isfinite(shapes[0]) and np.isnan(shapes[1])
