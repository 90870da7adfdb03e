"""Predictive control against dense solutions of what it promises to make small."""

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import lsq_linear
from scipy.signal import cont2discrete, tf2ss

from nectosome.controllers import ActuatorLimits, Predictive, eased, hysteretic, margins, open_loop, wave
from nectosome.controllers.predictive import _first
from nectosome.drives import Chain, Curve, Polynomial
from nectosome.units import InputError

from .simple_loops import DT, around, commands, dynamics, integrator, late, linear, model, of, plays

H, RHO = 20, 0.1
WIDE = ActuatorLimits(*of(-50.0, 50.0, 1e5))
TIGHT = ActuatorLimits(*of(-1.5, 1.6, 8.0))


def predictive(known, reach=WIDE):
    return Predictive(known, reach, H, RHO, 0.01, 0.01, 0.08)


def straight(delay):
    return hysteretic(linear(2.0), dynamics(), delay)


def samples(count):
    """Outputs by inputs of the dynamics, each held over a sample, from rest: rows 1 to count."""
    A, B, C, _, _ = cont2discrete(tf2ss([400.0], [1.0, 36.0, 400.0]), DT)
    markov = [(C @ np.linalg.matrix_power(A, k) @ B).item() for k in range(count)]
    return np.array([[markov[i - j] if j <= i else 0.0 for j in range(count)] for i in range(count)])


@pytest.mark.parametrize("late_by", [0, 2])
def test_without_limits_it_is_the_least_squares_solution(late_by):
    """Of the first sample from rest: dense, with what a cubic reference needs by its own derivatives."""
    r = np.polynomial.Polynomial([0.3, 0.5, -1.0, 2.0])
    t = np.arange(100) * DT + 0.5
    law = predictive(straight(late_by * DT)).planned(r(t), DT)
    needed = (r.deriv(2)(t) + 36 * r.deriv()(t) + 400 * r(t)) / 400
    needed = 0.5 * (needed[:-1] + needed[1:])  # over a sample
    F = samples(H)
    at = slice(late_by + 10, late_by + 10 + H)
    wanted, v = r(t)[late_by + 11 : late_by + 11 + H], needed[at]
    stacked = np.vstack([F, np.sqrt(RHO) * np.eye(H)])
    best = np.linalg.lstsq(stacked, np.concatenate([wanted, np.sqrt(RHO) * v]), rcond=None)[0]
    state = law.initial()._replace(k=jnp.asarray(10))  # where the window of its derivatives is full
    _, command = law.step(state, jnp.zeros(()))
    assert float(command) == pytest.approx(best[0] / 2.0, rel=1e-9)


REFERENCE = eased(wave("sine", 1.2, DT, amplitude=1.0, frequency=1.2), 0.4, DT)


@pytest.fixture(scope="module")
def limited():
    """A linear actuator whose commands are too slow for the reference, and what is best of all that they can do."""
    reach = ActuatorLimits(*of(-50.0, 50.0, 2.6))
    track = around(dynamics(), substeps=1).run(
        Predictive(hysteretic(linear(), dynamics(), 0.0), reach, 80, RHO, 0.01, 0.01, 0.08), REFERENCE
    )
    n = len(REFERENCE) - 1
    sums = np.tril(np.ones((n, n)))
    r = np.concatenate([REFERENCE, np.full(5, REFERENCE[-1])])
    v = np.gradient(np.gradient(r, DT), DT) / 400 + 36 / 400 * np.gradient(r, DT) + r
    v = 0.5 * (v[:n] + v[1 : n + 1])
    A = np.vstack([samples(n) @ sums, np.sqrt(RHO) * sums])
    b = np.concatenate([REFERENCE[1:], np.sqrt(RHO) * v])
    most = 2.6 * DT
    best = lsq_linear(A, b, (-most, most), tol=1e-12)
    return np.asarray(track.command), A, b, most, best


def test_with_slew_it_does_nearly_as_well_as_what_knows_everything(limited):
    """The whole course as one problem, of bounded differences of commands: would cost at most 0.5 % less."""
    command, A, b, most, best = limited
    steps = np.diff(command[:-1], prepend=0.0)
    assert np.mean(np.abs(steps) > 0.999 * most) > 0.3
    cost = 0.5 * np.sum((A @ steps - b) ** 2)
    assert best.cost * (1 - 1e-6) <= cost < 1.005 * best.cost


def test_a_clipped_solution_does_worse(limited):
    """What would be best without limits, cut off, costs more: the limits are in the problem."""
    command, A, b, most, _ = limited
    free = np.cumsum(np.linalg.lstsq(A, b, rcond=None)[0])
    sent, way = 0.0, []
    for wanted in free:
        sent += np.clip(wanted - sent, -most, most)
        way.append(sent)
    costs = [np.sum((A @ np.diff(x, prepend=0.0) - b) ** 2) for x in (command[:-1], way)]
    assert costs[1] > 1.2 * costs[0]


def test_constraints_hold_with_hysteresis_and_they_are_used():
    """Range and rate, along a reference out of reach, with plays and a delay; the output comes near it all the same."""
    reference = 1.5 * REFERENCE
    track = around(late(Chain((plays(), dynamics())), DT, 5), substeps=1).run(predictive(model(), TIGHT), reference)
    u = np.asarray(track.command)
    assert u.min() >= -1.5 - 1e-12
    assert u.max() <= 1.6 + 1e-12
    steps = np.abs(np.diff(u, prepend=0.0))
    assert steps.max() <= 8.0 * DT * (1 + 1e-9)
    assert np.mean(steps > 7.99 * DT) > 0.2
    assert np.sum(u > 1.599) >= 3


@pytest.mark.parametrize("disturbance", [-0.3, 0.4])
def test_no_constant_disturbance_leaves_an_error(disturbance):
    """Nor does a wrong gain: to 1e-6 within 4 s."""
    reference = np.concatenate([np.zeros(5), np.full(395, 0.5)])
    block = Chain((plays(), Curve(Polynomial(jnp.array([disturbance, 1.15]))), dynamics()))
    track = around(late(block, DT, 5), substeps=1).run(
        predictive(model(), ActuatorLimits(*of(-3.0, 3.0, 30.0))), reference
    )
    np.testing.assert_allclose(np.asarray(track.output)[-10:], 0.5, atol=1e-6)


def test_where_the_solver_fails_there_is_no_number():
    """Limits that exclude each other, and a measurement that is none: NaN, which the guards of a rig end on."""
    eye, pull, ways = jnp.eye(3), jnp.ones(3), jnp.ones(2)
    assert float(_first(eye, eye, pull, jnp.array([0.5, 0.6, -2.0, 2.0]), ways)) == pytest.approx(0.6, rel=1e-6)
    assert np.isnan(_first(eye, eye, pull, jnp.array([0.7, 0.6, -2.0, 2.0]), ways))
    assert np.isnan(_first(eye, eye, pull, jnp.array([0.5, 0.6, 0.9, 2.0]), 0.01 * ways))
    law = predictive(straight(0.0), TIGHT).planned(REFERENCE, DT)
    found = commands(law, np.where(np.arange(30) == 20, np.nan, 0.0))
    assert np.isfinite(found[:20]).all()
    assert np.isnan(found[20:]).all()


@pytest.mark.parametrize("delay", [0.013, 0.0049])
def test_a_delay_of_no_whole_samples_is_refused(delay):
    with pytest.raises(InputError, match="a whole number is needed"):
        predictive(straight(delay)).planned(REFERENCE, DT)


def test_it_has_margins():
    """As of any other loop: a delay just below it settles, one above it swings."""
    found = margins(*open_loop(around(late(dynamics(), DT)), predictive(hysteretic(linear(), dynamics(), DT)), 1.0))
    assert 0.1 < found.phase < np.pi
    law = predictive(hysteretic(linear(), dynamics(), DT), ActuatorLimits(*of(-1e9, 1e9, 1e12)))
    step = np.where(np.arange(1000) < 2, 0.0, 1.0)
    for share, steady in ((0.8, True), (1.2, False)):
        loop = around(late(dynamics(), DT + share * found.delay), substeps=4)
        error = np.asarray(loop.run(law, step).output) - 1.0
        assert (np.ptp(error[700:]) < np.ptp(error[300:600])) == steady


def test_dynamics_that_integrate_are_held_where_they_are():
    """At a command that keeps the output where it is, for a reference that is there: nothing moves."""
    law = predictive(hysteretic(linear(2.0), integrator(0.5), 2 * DT)).planned(np.full(100, 0.7), DT)
    held = np.asarray(commands(law, np.full(60, 0.7), command=0.3, first=0.7))
    np.testing.assert_allclose(held, 0.3, atol=1e-9)
