"""Dry friction that holds: its limits, what it stores, and what a cycle loses."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.core.described import number
from nectosome.core.dry_friction import DryFriction

C, S = 0.2, 2e-3  # limit and slip
FRICTION = DryFriction(number(C), number(S))
SHARES = np.linspace(-1.0, 1.0, 20001)
SHARES = 0.5 * (SHARES[1:] + SHARES[:-1])


def test_it_is_never_more_than_its_limit_and_gives_nothing_but_what_it_has_stored():
    w, v = jnp.meshgrid(jnp.linspace(-1, 1, 41), jnp.array([-9.0, -0.3, -1e-3, 0.0, 1e-4, 0.05, 2.0]))
    force, rate = FRICTION.force(w, v), FRICTION.rate(w, v)
    assert np.max(np.abs(force)) <= C * (1 + 1e-12)
    stored = jax.jvp(FRICTION.energy, (w,), (rate,))[1]
    assert np.min(force * v - stored) >= 0
    assert np.all(w * np.sign(rate) * (np.abs(w) == 1) <= 0)  # w stays between -1 and 1


@jax.jit
def lost(slip, period):
    """Work of a cycle X sin(2 pi t / period), the second one [J], with X = 3e-2."""
    n, omega = 8000, 2 * jnp.pi / period
    friction, h, speed = DryFriction(number(C), slip), period / n, lambda t: 3e-2 * omega * jnp.cos(omega * t)

    def step(carry, t):
        w, work = carry
        middle = w + 0.5 * h * friction.rate(w, speed(t))
        later = speed(t + 0.5 * h)
        return (w + h * friction.rate(middle, later), work + h * friction.force(middle, later) * later), None

    once, _ = jax.lax.scan(step, (number(0.0), number(0.0)), h * jnp.arange(n))
    return jax.lax.scan(step, (once[0], number(0.0)), h * jnp.arange(n))[0][1]


def test_a_cycle_loses_the_area_of_its_loop():
    """4 F X - 2 F s int (1 - w)/(1 - w^9) dw where it is slow, with its derivative by s; more where it is quick."""
    shape = np.mean((1 - SHARES) / (1 - SHARES**9)) * 2
    closed = 4 * C * 3e-2 - 2 * C * S * shape
    found, change = jax.value_and_grad(lost)(number(S), number(100.0))
    assert float(found) == pytest.approx(closed, rel=2e-4)
    assert float(change) == pytest.approx(-2 * C * shape, rel=2e-2)
    assert closed < float(lost(number(S), number(0.5))) < 4 * C * 3e-2
