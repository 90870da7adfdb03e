"""The filter against the recursion that it is the end of, and on data that are made as it supposes."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import cont2discrete, tf2ss

from nectosome.controllers import kalman
from nectosome.controllers.predictive import discrete
from nectosome.drives import TransferFunction, respond, second_order
from nectosome.units import InputError

from .simple_loops import DT, dynamics, lag, of

WANDER, NOISE = 0.05, 0.02


def test_the_model_is_that_of_held_inputs():
    """Poles, gain and the answer to a step are those of a zero-order hold."""
    found = discrete(dynamics(), DT)
    A, B, C, D, _ = cont2discrete(tf2ss([400.0], [1.0, 36.0, 400.0]), DT)
    np.testing.assert_allclose(np.sort(np.linalg.eigvals(found.A)), np.sort(np.linalg.eigvals(A)), rtol=1e-9)
    x, answers = np.zeros(2), []
    for _ in range(100):
        answers.append(found.C @ x)
        x = found.A @ x + found.B
    np.testing.assert_allclose(answers, respond(dynamics(), np.ones(100), DT, "zero"), rtol=1e-12, atol=1e-15)
    markov = [(C @ np.linalg.matrix_power(A, k) @ B).item() for k in range(5)]
    np.testing.assert_allclose(np.diff(answers)[:5], markov, rtol=1e-9)
    assert np.all(D == 0)


def test_dynamics_with_feedthrough_are_refused():
    with pytest.raises(ValueError, match="degree of the numerator must be lower"):
        discrete(TransferFunction(*of([1.0, 2.0], [1.0, 3.0])), DT)


@settings(max_examples=15)
@given(st.sampled_from([dynamics(), lag(3.0, 0.4)]), st.floats(1e-3, 1.0), st.floats(1e-3, 1.0))
def test_the_gain_is_the_end_of_the_recursion(block, wander, noise):
    """Covariances, by a measurement and a sample after the other, from far above."""
    found = kalman(discrete(block, DT), wander, noise)
    A, C = np.asarray(found.A), np.asarray(found.C)[None]
    n = len(A)
    Q = np.zeros((n, n))
    Q[-1, -1] = wander**2
    P, gain = np.eye(n), np.zeros((n, 1))
    for _ in range(20_000):
        before, gain = gain, P @ C.T / (C @ P @ C.T + noise**2)
        P = A @ (P - gain @ C @ P) @ A.T + Q
        P = 0.5 * (P + P.T)
        if np.abs(gain - before).max() < 1e-13:
            break
    np.testing.assert_allclose(found.gain, gain[:, 0], rtol=1e-6, atol=1e-9)


@pytest.fixture(scope="module")
def watched():
    """A long record of a disturbed input and a noisy output, and what the filter expects before each measurement."""
    model = discrete(dynamics(), DT)
    rng, count = np.random.default_rng(1), 20_000
    wander, noise = rng.normal(scale=WANDER, size=count), rng.normal(scale=NOISE, size=count)
    u, w = np.sin(0.03 * np.arange(count)), np.cumsum(wander)
    x, states = np.zeros(2), []
    for k in range(count):
        states.append(x)
        x = model.A @ x + model.B * (u[k] + w[k])
    y = np.array(states) @ model.C + noise

    def one(z, sample):
        after = filter_.corrected(z, sample[0])
        return filter_.predicted(after, sample[1]), (z, after)

    filter_ = kalman(model, WANDER, NOISE)
    before, after = jax.lax.scan(one, jnp.zeros(3), (jnp.asarray(y), jnp.asarray(u)))[1]
    truth = np.column_stack([states, w])
    return filter_, y, np.asarray(before), np.asarray(after), truth


def test_innovations_are_white(watched):
    """No two of the first 20 lags correlate by more than 4 standard errors; nor with the input."""
    filter_, y, before, _, _ = watched
    innovation = (y - before @ np.asarray(filter_.C))[500:]
    n = len(innovation)
    assert abs(innovation.mean()) < 4 * innovation.std() / np.sqrt(n)
    correlation = [np.dot(innovation[k:], innovation[: n - k]) / np.dot(innovation, innovation) for k in range(1, 21)]
    assert np.abs(correlation).max() < 4 / np.sqrt(n)


def test_a_filter_that_believes_too_little_has_coloured_innovations(watched):
    """What makes them white is the gain: with another one they are not."""
    y = watched[1]
    u = np.sin(0.03 * np.arange(len(y)))
    stiff = kalman(discrete(dynamics(), DT), WANDER / 10, NOISE)

    def one(z, sample):
        return stiff.predicted(stiff.corrected(z, sample[0]), sample[1]), sample[0] - jnp.sum(stiff.C * z)

    innovation = np.asarray(jax.lax.scan(one, jnp.zeros(3), (jnp.asarray(y), jnp.asarray(u)))[1])[500:]
    n = len(innovation)
    assert np.dot(innovation[1:], innovation[:-1]) / np.dot(innovation, innovation) > 20 / np.sqrt(n)


def test_a_measurement_makes_the_errors_smaller(watched):
    """And those of the disturbance are far smaller than what it wanders by."""
    _, _, before, after, truth = watched
    errors = [np.sqrt(np.mean((x - truth)[500:] ** 2, axis=0)) for x in (before, after)]
    assert np.all(errors[1] < errors[0])
    assert errors[1][2] < 0.1 * np.std(truth[:, 2])


def test_a_constant_disturbance_is_found():
    """To 1e-9, without noise, from a wrong state."""
    model = discrete(dynamics(), DT)
    filter_ = kalman(model, WANDER, NOISE)
    x, z = np.array([0.1, -0.2]), jnp.zeros(3)

    @jax.jit
    def step(z, y, u):
        return filter_.predicted(filter_.corrected(z, y), u)

    for k in range(1500):
        u = np.sin(0.05 * k)
        z = step(z, jnp.asarray(model.C @ x), jnp.asarray(u))
        x = model.A @ x + model.B * (u + 0.4)
    np.testing.assert_allclose(z, [*x, 0.4], atol=1e-9)


@pytest.mark.parametrize(("wander", "noise"), [(0.0, 1.0), (1.0, 0.0), (float("nan"), 1.0)])
def test_noise_and_wander_are_above_0(wander, noise):
    model = discrete(second_order(jnp.asarray(1.0), jnp.asarray(5.0), jnp.asarray(0.7)), 0.01)
    with pytest.raises(InputError, match="more than 0"):
        kalman(model, wander, noise)
