"""Friction and hysteresis of rods and springs: limits, work, agreement with SciPy."""

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from nectosome.drives import BoucWen, Dahl, Integrated, respond

LIMIT, STIFFNESS = 8.0, 1.6e4
RUBBING = Dahl(jnp.asarray(LIMIT), jnp.asarray(STIFFNESS))


def test_it_begins_stiff_and_ends_sliding():
    x = np.linspace(0, 0.02, 2001)
    force = np.asarray(respond(RUBBING, x, 0.1))
    assert force[1] / x[1] == pytest.approx(STIFFNESS, rel=0.02)
    assert force[-1] == pytest.approx(LIMIT, rel=1e-12)
    np.testing.assert_allclose(force, LIMIT * (1 - np.exp(-STIFFNESS * x / LIMIT)), rtol=1e-12)


def test_a_long_way_to_and_fro_costs_the_limit_twice():
    """Work of a loop: 4 F_c A less what turning saves, 4 F_c (F_c/sigma) for two turns (as A goes to infinity)."""
    A, turns = 0.05, np.array([0.05, -0.05, 0.05])
    x = np.concatenate([[0.0], np.interp(np.linspace(0, 2, 40001), [0, 1, 2], turns)])
    force = np.asarray(respond(RUBBING, x, 0.1))
    work = np.trapezoid(force[1:], x[1:])
    assert work == pytest.approx(4 * LIMIT * A - 4 * LIMIT * LIMIT / STIFFNESS, rel=1e-4)


def test_an_oscillator_is_that_of_scipy():
    """The same equations by another integrator; a sine that is straight within samples is too small by (w dt)^2/12."""
    m, c, k, a, b, g, n = numbers = (1.3, 2.0, 80.0, 0.3, 40.0, -15.0, 1.4)

    def rates(t, y):
        x, v, z = y
        pull = 4 * np.sin(3 * t)
        return [
            v,
            (pull - c * v - k * (a * x + (1 - a) * z)) / m,
            v - b * abs(v) * abs(z) ** (n - 1) * z - g * v * abs(z) ** n,
        ]

    t = np.linspace(0, 8, 8001)
    wanted = solve_ivp(rates, (0, 8), [0, 0, 0], rtol=1e-10, atol=1e-12, t_eval=t).y[0]
    system = BoucWen(*(jnp.asarray(x) for x in numbers))
    found = respond(Integrated(system), 4 * np.sin(3 * t), 1e-3)
    np.testing.assert_allclose(found, wanted, atol=3e-6 * np.abs(wanted).max())


def test_without_yielding_it_is_a_linear_oscillator():
    """The static displacement under a force is u/k."""
    system = BoucWen(*(jnp.asarray(float(x)) for x in (1.0, 8.0, 80.0, 0.3, 0.0, 0.0, 1.0)))
    assert float(respond(Integrated(system), np.full(2000, 4.0), 0.01)[-1]) == pytest.approx(0.05, rel=1e-6)
