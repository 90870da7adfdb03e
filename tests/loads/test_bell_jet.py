"""Bells: the water that a ring of limbs encloses, its pressure, its thrust and its momentum, by closed forms."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from nectosome.core import State, Strips
from nectosome.description import parse_robot
from nectosome.loads import BellJet
from nectosome.mechanism import Robot
from nectosome.mechanism.load_groups import strips_of
from nectosome.model import build
from nectosome.solve import periodic, simulate

N, LONG, RING, THIN = 6, 0.1, 0.05, 1e-3  # limbs, their length, radius of the ring, radius of a limb
# bars around a hub on a rail, which slide outward and back with 1 cm, and point backward
BELL = f"""
name: bell
water: {{gravity: 0 m/s2}}
body: {{kind: rigid, shape: point, mass: 300 g, joint: {{kind: prismatic, axis: x}}}}
limbs:
  bar:
    kind: rigid
    shape: cylinder
    length: {LONG} m
    radius: {THIN} m
    density: 1000 kg/m3
    offset: [0 m, 0 m, {RING} m]
    rotation: [0 deg, 180 deg, 0 deg]
    repeat: {{count: {N}, around: x}}
    joint: {{kind: prismatic, axis: z, motion: {{kind: sine, amplitude: 10 mm, frequency: 1 Hz}}}}
webs:
  bell:
    between: bar
    thickness: 0.1 mm
    young: 1 Pa
    density: 1000 kg/m3
    loads: {{jet: {{kind: bell_jet}}}}
"""
RHO = 1025.0


@pytest.fixture(scope="module")
def robot() -> Robot:
    return build(parse_robot(BELL.replace("gravity", f"density: {RHO} kg/m3, gravity")))


def water(robot: Robot, t=0.0, v=0.0):
    """The water in the bell at a time and a speed of the hub, and what acts."""
    (group,) = (g for g in robot.load_groups.on_bodies if isinstance(g.load, BellJet))

    @eqx.filter_jit
    def at(t, v):
        x = State(robot.start.q, v[None], robot.start.z)
        q, v, _ = robot.tree.complete(t, x.q, x.v)
        shape = robot.tree.shape(q)
        every = strips_of(robot.tree, shape, robot.tree.twists(shape, v))
        strips = jax.tree.map(lambda a: a[0], group.here(robot.tree, every))
        load = jax.tree.map(lambda a: a[0], group.load)
        return load, strips, load.water(strips), load.force(t, strips, (), robot.water)[0]

    return at(jnp.asarray(t), jnp.asarray(v))


def prism(t):
    """Area [m2] that sheets and limbs enclose at t, and its rate: a polygon with its corners cut by the limbs."""
    out, rate = RING - 0.01 * np.sin(2 * np.pi * t), -0.01 * 2 * np.pi * np.cos(2 * np.pi * t)
    half = np.pi / N  # limbs face their neighbours at right angles to the way to these
    chord, cut = 2 * out * np.sin(half), THIN
    area = 0.5 * N * out**2 * np.sin(2 * half) - 0.5 * N * cut**2 * np.sin(np.pi - 2 * half)
    return area, N * out * np.sin(2 * half) * rate, chord


@pytest.mark.parametrize("t", [0.05, 0.3, 0.6, 0.9])
def test_a_prism_of_bars_is_a_slug(robot, t):
    """Volume, flow, jet and thrust rho Q^2/A; water that leaves has the hub's speed, what enters has none."""
    _, strips, now, wrench = water(robot, t, 0.2)
    area, rate, _ = prism(t)
    flat = 1e-3 * LONG**3
    volume = np.sqrt((area * LONG) ** 2 + flat**2) - flat
    outflow = -rate * LONG * area * LONG / (volume + flat)
    assert now.volume == pytest.approx(volume, rel=1e-10)
    assert now.outflow == pytest.approx(outflow, rel=1e-10)
    assert now.jet_speed == pytest.approx(outflow / area, rel=1e-10)
    force = np.sum(np.einsum("nij,nj->ni", strips.rotation, wrench[:, 3:]), axis=0)
    pushed = RHO * outflow * (outflow / area * area * LONG / (volume + flat) - 0.2) if outflow > 0 else 0.0
    np.testing.assert_allclose(force, [pushed, 0, 0], rtol=0, atol=1e-10)
    power = float(np.sum(wrench[:, 3:] * strips.velocity) + np.sum(wrench[:, :3] * strips.angular_velocity))
    # the water moves with the roots, which here slide outward, too
    beside = float(np.sum(np.mean(strips.velocity.reshape(N, -1, 2, 3)[:, 0] ** 2, axis=(0, 1)))) - 0.2**2
    lost = 0.5 * RHO * (outflow / area) ** 2 * abs(outflow) + RHO * max(outflow, 0.0) * beside
    assert power == pytest.approx(pushed * 0.2 - lost, rel=1e-10)


def test_the_flow_of_a_jet_is_its_speed_by_its_diameter(robot):
    load, strips, now, _ = water(robot, 0.3)
    (speed,), (length,), (jet,) = (np.asarray(getattr(load.flow(strips), name)) for name in ("speed", "length", "jet"))
    diameter = np.sqrt(4 / np.pi * prism(0.3)[0])
    assert length == pytest.approx(diameter, rel=1e-10)
    assert (speed, jet) == pytest.approx((abs(float(now.jet_speed)), float(now.jet_speed) / diameter), rel=1e-10)


@pytest.mark.slow
def test_the_jet_has_a_formation_number(robot):
    """Its length over the diameter of its opening, in a beat: the integral of u/D by 2000 times; Re of the fastest."""
    cycle = periodic(robot)
    assert np.isfinite(cycle.mean_results().arrays["cost_of_transport"])  # whose power the drives give
    found = cycle.to_dataset()["flow_number"].sel(part="bell", load="jet")
    area, rate, _ = prism((np.arange(2000) + 0.5) / 2000)
    speed = -rate * LONG / area
    assert float(found.sel(number="formation")) == pytest.approx(
        np.mean(np.maximum(speed, 0) / np.sqrt(4 / np.pi * area)), rel=1e-3
    )
    expected = RHO / float(robot.water.viscosity) * np.max(np.abs(speed) * np.sqrt(4 / np.pi * area))
    assert float(found.sel(number="reynolds")) == pytest.approx(expected, rel=1e-3)


def random_strips(robot: Robot) -> tuple[BellJet, Strips]:
    load, strips, *_ = water(robot)
    r = np.random.default_rng(0)
    place = strips.position + 0.01 * r.normal(size=strips.position.shape)
    return load, eqx.tree_at(
        lambda s: (s.position, s.velocity), strips, (place, jnp.asarray(r.normal(size=place.shape)))
    )


def test_pressure_within_has_no_force_and_no_moment_as_a_whole(robot):
    """Of any shape: the volume does not change as it moves and turns."""
    load, strips = random_strips(robot)
    slope = load.water(strips).slope
    size = float(jnp.max(jnp.abs(slope)))
    np.testing.assert_allclose(jnp.sum(slope, axis=0), 0, atol=1e-12 * size)
    np.testing.assert_allclose(jnp.sum(jnp.cross(strips.position, slope), axis=0), 0, atol=1e-13 * size)


def test_the_thrust_goes_through_the_middle_of_the_opening(robot):
    """Of any shape: no moment about it but that of the water which leaves with the velocity of the roots."""
    load, strips = random_strips(robot)
    still = eqx.tree_at(lambda s: s.angular_velocity, strips, jnp.zeros_like(strips.velocity))
    now = load.water(still)
    wrench = load.force(jnp.zeros(()), still, (), robot.water)[0]
    roots = np.asarray(load._roots(still))[:, None]
    leaving = -RHO * max(float(now.outflow), 0.0) * roots * np.asarray(still.velocity)
    own = np.asarray(wrench) - np.concatenate([np.zeros_like(leaving), leaving], axis=1)
    f, m = (np.einsum("nij,nj->ni", still.rotation, x) for x in (own[:, 3:], own[:, :3]))
    about = np.sum(m + np.cross(np.asarray(still.position - now.middle), f), axis=0)
    np.testing.assert_allclose(about, 0, atol=1e-12 * np.abs(f).max())


def test_a_bell_on_a_rail_goes_as_its_momentum_says(robot):
    """m dv/dt + rho d(V v)/dt = rho Q (u - v) as it closes, 0 as it opens; by another integrator."""
    run = simulate(robot, 0.6, samples=4, rtol=1e-6, atol=1e-9)
    flat, body = 1e-3 * LONG**3, float(jnp.sum(robot.weight()))

    def rate(t, v):
        area, growth, _ = prism(t)
        whole = np.hypot(area * LONG, flat)
        share = area * LONG / whole
        outflow = -share * growth * LONG
        leaving = RHO * outflow * (outflow / area * share - v) if outflow > 0 else 0.0
        return (leaving + RHO * outflow * v) / (body + RHO * (whole - flat))

    found = solve_ivp(rate, (0, 0.6), [0.0], rtol=1e-10, atol=1e-12, max_step=0.01)
    data = run.to_dataset()
    speed = float(data["velocity"].sel(part="body", axis="x")[-1])
    assert speed == pytest.approx(found.y[0, -1], rel=1e-5)
    assert speed > 0.01
    assert np.abs(data["power_balance"]).max() < 1e-12
