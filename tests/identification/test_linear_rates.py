"""Parameters of a rate, from recordings of a body that a pulsed jet drives through water. Synthetic."""

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from nectosome.identification.fits.linear import (
    Trial,
    finite_differences,
    instrumental_variables,
    integral_windows,
    output_error,
)

MASS, ADDED, DRAG = 0.755, 2.768, 5.094  # kg, kg, kg/m
TRUE = np.array([-DRAG / (MASS + ADDED), 1 / (MASS + ADDED)])
OMEGA, NOISE = 11.47, 5e-3  # rad/s, m/s
PERIOD = 2 * np.pi / OMEGA
TIME = np.arange(0.0, 12.0, 0.01)
LENGTHS = (PERIOD / 2, PERIOD)


def thrust(t):
    """Positive when the crank has pulled for half a turn, negative in the refill [N]."""
    push = jnp.exp(4 * (jnp.cos(OMEGA * t - 0.92 * jnp.pi) - 1))
    return 0.7975 * (push - 0.3952 * jnp.exp(1.2 * (jnp.cos(OMEGA * t - 1.45 * jnp.pi) - 1)))


def surge(t, v):
    """v' = alpha v|v| + gamma tau."""
    return jnp.stack([v * jnp.abs(v), thrust(t)])


def physical(theta):
    """Added mass [kg] and drag [kg/m]."""
    return jnp.stack([1 / theta[1] - MASS, -theta[0] / theta[1]])


@pytest.fixture(scope="module")
def speed():
    """The settled speed [m/s], by an integrator of its own."""
    start = -200 * PERIOD

    def rate(t, v):
        push = np.exp(4 * (np.cos(OMEGA * t - 0.92 * np.pi) - 1))
        pull = 0.3952 * np.exp(1.2 * (np.cos(OMEGA * t - 1.45 * np.pi) - 1))
        return TRUE[0] * v * abs(v) + TRUE[1] * 0.7975 * (push - pull)

    found = solve_ivp(rate, (start, TIME[-1]), [0.08], t_eval=TIME, rtol=1e-9, atol=1e-12, max_step=0.05)
    return found.y[0]


@pytest.mark.parametrize("way", [integral_windows, instrumental_variables])
def test_windows_find_parameters_again_without_noise(speed, way):
    """To the error of trapezoids at 55 samples a period."""
    found = way([Trial(TIME, speed, surge)], LENGTHS)
    np.testing.assert_allclose(found.values, TRUE, rtol=2e-3)
    assert found.warnings == ()


def test_output_error_is_exact_without_noise(speed):
    found = output_error([Trial(TIME, speed, surge)], 0.5 * TRUE)
    np.testing.assert_allclose(found.values, TRUE, rtol=1e-6)
    np.testing.assert_allclose(found.of(physical).values, [ADDED, DRAG], rtol=1e-6)


def test_several_recordings_are_one_fit(speed):
    """Halves as trials of their own: the errors are those of the whole, but for one more first state."""
    rng = np.random.default_rng(2)
    noisy, half = speed + NOISE * rng.normal(size=TIME.size), TIME.size // 2
    parts = [Trial(TIME[:half], noisy[:half], surge), Trial(TIME[half:], noisy[half:], surge)]
    one, two = output_error([Trial(TIME, noisy, surge)], TRUE), output_error(parts, TRUE)
    assert np.all(np.abs(two.values - one.values) < one.errors)
    np.testing.assert_allclose(two.errors, one.errors, rtol=0.2)
    both = integral_windows(parts, LENGTHS)
    np.testing.assert_allclose(both.values, integral_windows([Trial(TIME, noisy, surge)], LENGTHS).values, rtol=0.05)


def draws(way, speed, count):
    """Bias of the physical parameters, relative, and the share of 95 % intervals that hold them."""
    rng = np.random.default_rng(0)
    found = [way([Trial(TIME, speed + NOISE * rng.normal(size=TIME.size), surge)]).of(physical) for _ in range(count)]
    bias = np.mean([one.values for one in found], axis=0) / [ADDED, DRAG] - 1
    ends = np.stack([one.interval() for one in found])
    inside = (ends[..., 0] <= [ADDED, DRAG]) & (ends[..., 1] >= [ADDED, DRAG])
    return bias, inside.mean(axis=0)


def test_the_recommended_way_has_no_bias_and_honest_intervals(speed):
    """200 draws of 5 mm/s: bias below 2 %, 95 % intervals hold the truth in 90 to 98 % of them."""
    bias, inside = draws(lambda trials: output_error(trials, TRUE), speed, 200)
    assert np.all(np.abs(bias) < 0.02)
    assert np.all((inside >= 0.9) & (inside <= 0.98))


@pytest.mark.parametrize("way", [integral_windows, instrumental_variables])
def test_windows_have_little_bias_and_fair_intervals(speed, way):
    """60 draws: bias below 2 %, intervals hold the truth in 85 % of them or more."""
    bias, inside = draws(lambda trials: way(trials, LENGTHS), speed, 60)
    assert np.all(np.abs(bias) < 0.02)
    assert np.all(inside >= 0.85)


def test_increments_as_printed_are_biased_and_say_so(speed):
    """The square of the noise adds to that of the speed in every increment; errors are of no use."""
    noisy = Trial(TIME, speed + NOISE * np.random.default_rng(1).normal(size=TIME.size), surge)
    found = finite_differences([noisy])
    assert any(warning.startswith("biased") for warning in found.warnings)
    assert found.values[0] / TRUE[0] > 2
    assert abs(found.values[0] - TRUE[0]) > 3 * found.errors[0]
    assert not any(warning.startswith("biased") for warning in finite_differences([Trial(TIME, speed, surge)]).warnings)


def test_what_is_not_settled_or_does_not_fit_is_told(speed):
    rising = Trial(TIME, speed * (1 + TIME / 12), surge)
    assert any("not settled" in warning for warning in integral_windows([rising], LENGTHS).warnings)
    shaken = Trial(TIME, speed + 0.01 * np.sin(2 * TIME), surge)
    assert any("are correlated over" in warning for warning in output_error([shaken], TRUE).warnings)
    with pytest.raises(ValueError, match="does not fit into"):
        integral_windows([Trial(TIME, speed, surge)], [20.0])


def test_a_function_of_parameters_has_the_error_of_its_slope(speed):
    noisy = Trial(TIME, speed + NOISE * np.random.default_rng(3).normal(size=TIME.size), surge)
    found = output_error([noisy], TRUE)
    mass = found.of(lambda theta: 1 / theta[1:])
    assert mass.errors[0] == pytest.approx(found.errors[1] / found.values[1] ** 2)
    assert found.percent[0] == pytest.approx(100 * found.errors[0] / abs(found.values[0]))


def test_a_term_may_start_from_nothing(speed):
    """Drag in proportion to the speed, which is not there: found as 0 within its error."""
    noisy = Trial(
        TIME, speed + NOISE * np.random.default_rng(4).normal(size=TIME.size), lambda t, v: jnp.append(surge(t, v), v)
    )
    found = output_error([noisy], np.append(TRUE, 0.0))
    assert np.isfinite(found.covariance).all()
    assert abs(found.values[2]) < 3 * found.errors[2]
