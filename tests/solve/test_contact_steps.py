"""No step of the integration passes over a contact; impacts keep their energy."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from nectosome.core import State
from nectosome.description import parse_robot
from nectosome.model import bind, build
from nectosome.solve import simulate
from nectosome.solve.contact_steps import SHARES, contact_step

G, METHODS = 9.81, ("explicit", "implicit")
BALL = """
name: ball
water: {gravity: 9.81 m/s2, density: 1 kg/m3}
body:
  kind: rigid
  shape: point
  mass: 0.4 kg
  volume: 0 m3
  inertia: [1e-4 kg m2, 1e-4 kg m2, 1e-4 kg m2]
  joint:
    {kind: prismatic, axis: z, position: 200 mm, lower: {at: 0 mm, stiffness: 50 kN/m, softness: 0.1 mm}}
"""
STICK = """
name: stick
water: {gravity: 9.81 m/s2, density: 1 kg/m3}
limbs:
  bar:
    {on: world, kind: rigid, shape: cylinder, radius: 10 mm, length: 400 mm, mass: 1 kg,
     offset: [0 m, -0.2 m, 0 m], rotation: [0 deg, 0 deg, 90 deg]}
  stick:
    {on: world, kind: rigid, shape: cylinder, radius: 5 mm, length: 300 mm, mass: 0.1 kg, strips: 7,
     offset: [-0.15 m, 0 m, 0 m], joint: {kind: prismatic, axis: z, position: 0.5 m}}
pairs:
  touch: {kind: contact, between: [stick, bar], stiffness: 2 MN/m, damping: 500 N s/m}
"""


def seen(g):
    """What a step says of one gap, a function of its share."""
    c, rate = jax.vmap(lambda s: jax.jvp(lambda s: jnp.stack([g(s), g(s) + 1]), (s,), (jnp.ones(()),)))(
        jnp.asarray(SHARES)
    )
    return contact_step(c, rate)


def test_a_gap_that_closes_is_located_on_its_cubic():
    step = seen(lambda s: 8 - 27 * s**3)
    assert bool(step.passes)
    assert float(step.share) == pytest.approx(2 / 3, abs=1e-9)


@pytest.mark.parametrize("at", [0.05, 0.31, 0.62, 0.97])
def test_a_body_that_is_thinner_than_what_is_looked_at_is_not_passed(at):
    """A gap of |x - at|, 300 softnesses long and less than 1 deep: free at every time that is looked at."""
    step = seen(lambda s: 300 * jnp.abs(s - at) - 0.9)
    assert bool(step.passes)
    assert 0 < float(step.share) <= at


@pytest.mark.parametrize(
    "free", [lambda s: 300 * jnp.abs(s - 0.4) + 40.0, lambda s: 100.0 - 99 * s, lambda s: 100 * s, lambda s: 3 + s * s]
)
def test_steps_that_only_come_near_are_not_cut(free):
    assert not bool(seen(free).passes)


def test_a_contact_within_a_softness_is_left_to_the_error_control():
    assert not bool(seen(lambda s: 0.2 - 0.4 * s).passes)


@pytest.mark.parametrize("method", METHODS)
def test_an_undamped_bounce_keeps_its_energy_for_20_s(method):
    """m g 0.2 m = 0.7848 J, at default tolerances, in 48 bounces."""
    run = simulate(build(parse_robot(BALL)), 20.0, samples=4001, method=method)
    z, v = np.asarray(run.value.state.q)[:, 0], np.asarray(run.value.state.v)[:, 0]
    energy = (0.4 * G * z + 0.2 * v**2)[z > 0]
    assert energy.max() == pytest.approx(0.7848, rel=1e-3)
    assert energy.min() == pytest.approx(0.7848, rel=1e-3)
    assert np.max(z[-200:]) == pytest.approx(0.2, rel=1e-3)


def _fallen(height: float, times) -> np.ndarray:
    """Heights of the stick by another integrator, whose steps are too short to pass the bar."""
    s, w = np.polynomial.legendre.leggauss(7)
    x, w, k, c, d = 0.15 * s, 0.5 * w, 2e6, 500.0, 1e-4

    def rate(t, y):
        far = np.hypot(x, y[0])
        depth, up = 0.015 - far, y[0] / far
        xi = np.clip(depth / d, 0, 1)
        spring = k * d * (xi**3 - 0.5 * xi**4 + np.maximum(depth / d - 1, 0))
        push = np.maximum(spring - c * xi**2 * (3 - 2 * xi) * up * y[1], 0)
        return [y[1], -G + np.sum(w * push * up) / 0.1]

    return solve_ivp(rate, (0, times[-1]), [height, 0.0], rtol=1e-8, atol=1e-10, max_step=1e-3, t_eval=times).y[0]


@pytest.mark.parametrize("method", ["explicit", pytest.param("implicit", marks=pytest.mark.slow)])
def test_a_stick_that_falls_across_a_bar_is_stopped_from_any_height(method):
    """One batch, at default tolerances; a whole free fall is a step or two."""
    robot, heights = build(parse_robot(STICK)), np.array([0.1, 0.5, 1.2])
    start, times = robot.initial(), np.linspace(0, 0.6, 61)

    def fall(z):
        x = State(z[None], start.v, start.z)
        return simulate(robot, 0.6, samples=61, method=method, initial=x).value.state.q[:, 0]

    found = np.asarray(jax.jit(jax.vmap(fall))(jnp.asarray(heights)))
    for own, height in zip(found, heights, strict=True):
        np.testing.assert_allclose(own, _fallen(height, times), atol=1e-3)


@pytest.mark.parametrize("method", ["explicit", pytest.param("implicit", marks=pytest.mark.slow)])
def test_a_motion_has_derivatives_through_a_touch(method):
    """Height after the first bounce by the height at the start, against finite differences."""
    theta0, make = bind(parse_robot(BALL), ("body.joint.position",))

    def height(theta):
        run = simulate(make(theta), 0.5, samples=2, method=method, rtol=1e-8, atol=1e-10)
        return run.value.state.q[-1, 0]

    program = jax.jit(lambda theta: jax.jvp(height, (theta,), (jnp.ones_like(theta),)))
    value, slope = program(theta0)
    step = 2e-4
    apart = program(theta0 + step)[0] - program(theta0 - step)[0]
    assert 0.0 < float(value) < 0.2
    assert float(slope) == pytest.approx(float(apart) / (2 * step), rel=1e-3)
