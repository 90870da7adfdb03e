"""A signal that goes over into another."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.core import Handover, Sine

SINCE, SECONDS = 0.7, 0.4


def sine(amplitude: float, frequency: float, phase: float) -> Sine:
    return Sine(*map(jnp.asarray, (amplitude, frequency, phase, 0.1)))


@pytest.fixture(scope="module")
def over():
    before, after = sine(1.0, 1.3, 0.2), sine(-0.6, 0.9, 1.0)
    return before, after, Handover(before, after, jnp.asarray(SINCE), jnp.asarray(SECONDS))


def test_its_rates_are_the_derivatives_of_its_value(over):
    value = lambda t: over[2](t)[0]  # noqa: E731
    rates = jax.jit(jax.vmap(lambda t: (over[2](t), jax.grad(value)(t), jax.grad(jax.grad(value))(t))))
    (_, du, ddu), first, second = rates(jnp.linspace(0.5, 1.3, 41))
    np.testing.assert_allclose(du, first, atol=1e-12)
    np.testing.assert_allclose(ddu, second, atol=1e-10)


def test_nothing_jumps_where_it_begins_and_ends(over):
    before, after, both = over
    for own, t in ((before, SINCE), (after, SINCE + SECONDS)):
        for step in (-1e-9, 1e-9):
            np.testing.assert_allclose(both(jnp.asarray(t + step)), own(jnp.asarray(t + step)), atol=1e-5)
