"""Bodies near the floor: what moves past it keeps momentum and energy, and drag comes on with it."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import brentq

from nectosome.core import State
from nectosome.description import parse_robot
from nectosome.mechanism import in_plane
from nectosome.model import build
from nectosome.robots import describe
from nectosome.solve import simulate

_n = jnp.asarray
BODY = """
name: diver
water: {{density: 1000 kg/m3, gravity: 0 m/s2, floor: -1 m}}
body:
  kind: rigid
  shape: point
  mass: 2 kg
  inertia: [0.01 kg m2, 0.02 kg m2, 0.03 kg m2]
  joint: {joint}
  loads:
    water: {{kind: given_added_mass, mass: [0.5 kg, 0.5 kg, 0.5 kg]}}
    ground: {{kind: near_floor, mass: [3 kg, 4 kg, {across} kg], full: 0.3 m, none: 0.8 m}}
"""
FREE = (
    "{kind: free, start: {velocity: [0.3 m/s, 0.1 m/s, -0.5 m/s], angular_velocity: [0.1 rad/s, 2 rad/s, 0.3 rad/s]}}"
)
PLANAR = "{kind: planar, axis: [0, -1, 0], start: {velocity: [0.3 m/s, 0 m/s, -0.5 m/s]}}"


def test_a_body_that_passes_into_thicker_water_keeps_energy_and_what_is_level_of_its_momentum():
    """(m + s m_a) v_x stays as it is, and T = (m + s m_a) v^2/2; there is nothing that pushes along x."""
    run = simulate(
        build(parse_robot(BODY.format(joint=PLANAR, across=3))), 1.8, rtol=1e-10, atol=1e-12, method="explicit"
    )
    q, v = np.asarray(run.value.state.q), np.asarray(run.value.state.v)
    x = np.clip((q[:, 1] + 1 - 0.3) / 0.5, 0, 1)
    mass = 2.5 + 3 * (1 - 3 * x**2 + 2 * x**3)
    assert mass[0] == 2.5
    assert mass[-1] > 5.4
    np.testing.assert_allclose(mass * v[:, 0], 2.5 * 0.3, rtol=1e-7)
    np.testing.assert_allclose(mass * (v[:, 0] ** 2 + v[:, 1] ** 2), 2.5 * (0.3**2 + 0.5**2), rtol=1e-7)


def test_powers_balance_of_a_body_that_tumbles_towards_the_floor():
    """Added mass that differs by direction and turns with the body: energy to 1e-7, at every moment to rounding."""
    run = simulate(
        build(parse_robot(BODY.format(joint=FREE, across=1))), 1.5, rtol=1e-10, atol=1e-12, method="explicit"
    )
    ds = run.to_dataset()
    energy = ds["energy"].sum("form").values
    assert ds["energy"].sel(form="water").values[-1] > 2 * ds["energy"].sel(form="water").values[0]
    np.testing.assert_allclose(energy, energy[0], rtol=1e-7)
    power = ds["load_power"].sum("part")
    assert np.abs(power.sel(load="ground").values).max() > 0.1
    np.testing.assert_allclose(power.sel(load="ground").values, -power.sel(load="shape_change").values, atol=1e-12)


@jax.jit
def accelerations(robot, q, v):
    """Of a robot in the plane: along x, along z, of its pitch."""
    return in_plane(robot).rates(_n(0.0), State(_n(q), _n(v), robot.initial().z)).v


def test_on_the_floor_the_mission_s_robot_is_the_crawler():
    """The same accelerations at any state up to 15 cm over the floor; 14 cm further up they are others."""
    mission = build(describe("poseidrone", ["volume=0.609854604 L", "legs=12.4602 rad/s"]))
    crawler, r = build(describe("poseidrone_crawl")), np.random.default_rng(0)
    for height in (0.12, 0.13, 0.149, 0.29):
        q, v = _n([0.5, height, 0.2]), _n(0.1 * r.normal(size=3))
        mine, its = accelerations(mission, q, v), accelerations(crawler, q, v)
        assert np.allclose(mine, its, rtol=1e-6, atol=1e-8) == (height < 0.15)


def test_in_open_water_it_is_the_swimmer():
    """(M + m_as) dv/dt = -Lambda |v| v in surge, but for its feet, which scull: 0.755 + 2.768 kg, 5.094 kg/m."""
    robot = build(describe("poseidrone", ["body.loads.front.count=1e-12", "body.loads.rear.count=1e-12"]))
    found = accelerations(robot, _n([0.5, 0.3, 0.0]), _n([-0.08, 0.0, 0.0]))
    assert float(found[0]) == pytest.approx(5.094 * 0.08**2 / (0.755 + 2.768), rel=1e-6)


def test_it_floats_with_97_percent_of_its_volume_in_the_water():
    """An ellipsoid stands out by the share (1 - d)^2 (2 + d)/4, its centre d half heights under the surface."""
    robot, tilt = build(describe("poseidrone")), np.radians(12.6)
    d = brentq(lambda d: (1 - d) ** 2 * (2 + d) / 4 - 0.03, 0.0, 1.0)
    half = np.hypot(0.08 * np.sin(tilt), 0.0475982 * np.cos(tilt))
    low, high = (
        accelerations(robot, _n([0.5, 0.5 - d * half - 0.09 + off, tilt]), jnp.zeros(3)) for off in (-5e-4, 5e-4)
    )
    assert low[1] > 0 > high[1]
