"""Stops push only inwards, smoothly, and with the stiffness they say."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nectosome.loads import LowerLimit, UpperLimit

K, C, D = 10.0, 0.01, np.radians(1.0)


def stop(kind, at=0.0, damping=C):
    return kind(*(jnp.asarray(x) for x in (at, K, damping, D)))


def push(load, angle, speed=0.0):
    return float(load.force(jnp.array([angle]), jnp.array([speed]))[0])


@given(st.floats(-3, 3), st.floats(-50, 50), st.floats(-1, 1))
def test_a_stop_pushes_back_or_not_at_all(angle, speed, at):
    assert push(stop(LowerLimit, at), angle, speed) >= 0
    assert push(stop(UpperLimit, at), angle, speed) <= 0
    if angle > at:
        assert push(stop(LowerLimit, at), angle, speed) == 0


@given(st.floats(-3, 3), st.floats(-50, 50), st.floats(-1, 1))
def test_an_upper_stop_is_a_lower_one_seen_from_the_other_side(angle, speed, at):
    assert push(stop(UpperLimit, at), angle, speed) == -push(stop(LowerLimit, -at), -angle, -speed)


def test_the_law_is_that_of_its_formula():
    """Half way in: x = 1/2, x^3 - x^4/2 = 3/32, smoothstep 1/2; far in: a spring that begins half a softness in."""
    assert push(stop(LowerLimit), -0.5 * D) == pytest.approx(K * D * 3 / 32)
    assert push(stop(LowerLimit), -0.5 * D, -2.0) == pytest.approx(K * D * 3 / 32 + 0.5 * C * 2)
    assert push(stop(LowerLimit), -5 * D) == pytest.approx(K * (5 * D - 0.5 * D))
    assert push(stop(LowerLimit), -0.5 * D, 50.0) == 0  # it does not hold what leaves it


@pytest.mark.parametrize("x", [0.0, 1.0])
def test_force_and_stiffness_are_continuous(x):
    load = stop(LowerLimit)
    force = lambda angle: load.force(angle[None], jnp.zeros(1))[0]  # noqa: E731
    for f in (force, jax.grad(force)):
        inside, outside = (float(f(jnp.asarray(-D * (x + e)))) for e in (1e-9, -1e-9))
        assert inside == pytest.approx(outside, abs=1e-7)


def test_without_its_damper_a_stop_gives_back_what_it_took():
    angles = jnp.linspace(0, -3 * D, 4001)
    load = stop(LowerLimit, damping=0.0)
    forces = jax.vmap(lambda a: load.force(a[None], jnp.zeros(1))[0])(angles)
    work = -np.trapezoid(forces, angles)
    assert work == pytest.approx(K * D**2 * (1 / 4 - 1 / 10 + (3**2 - 1) / 2 - 0.5 * 2), rel=1e-6)
