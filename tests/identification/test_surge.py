"""Added mass and drag of a body in surge, from synthetic recordings whose truth is known."""

import numpy as np
import pytest

from nectosome.identification.fits.errors import deviation
from nectosome.identification.fits.linear import follow_recording, integral_windows
from nectosome.identification.surge.estimators import BIASED, METHODS, STATIC, fit_surge
from nectosome.identification.surge.files import SurgeFit
from nectosome.units import InputError
from nectosome_studies.poseidrone.recordings import body, recording

MASS, *TRUTH = body()


def made(name="train", seed=0, noise=0.005):
    return recording(name, np.random.default_rng(seed), noise)


@pytest.mark.parametrize(
    ("method", "within"), [("output_error", 1e-6), ("instrumental_variables", 0.01), ("integral_windows", 0.01)]
)
def test_without_noise_parameters_are_found_again(method, within):
    """Trapezoids at 27 samples a period are off by 0.6 % in the added mass, motions by nothing."""
    found = fit_surge([made(noise=0.0)], MASS, method)
    np.testing.assert_allclose(found.physical.values, TRUTH, rtol=within)
    assert found.warnings == ()


def test_two_recordings_are_one_fit_and_tell_more():
    """Of other lengths too: errors fall by the root of the number of samples."""
    long, short = made("train"), made("test", 1)
    half = short._replace(time=short.time[:300], speed=short.speed[:300])
    one, both = fit_surge([long], MASS), fit_surge([long, half], MASS)
    np.testing.assert_allclose(both.physical.values, TRUTH, atol=2 * both.physical.errors.max())
    np.testing.assert_allclose(both.physical.errors, np.sqrt(600 / 900) * one.physical.errors, rtol=0.15)


def test_the_printed_estimator_is_biased_and_says_so():
    found = fit_surge([made()], MASS, "finite_differences", smooth=0.22)
    assert BIASED in found.warnings
    assert found.physical.values[1] > 1.15 * TRUTH[1]


def test_errors_of_parameters_are_those_of_the_linear_model_through_the_slope():
    """sigma(m_as) = sigma(gamma) / gamma^2."""
    found = fit_surge([made()], MASS)
    gamma, error = found.rate.values[1], found.rate.errors[1]
    assert found.physical.errors[0] == pytest.approx(error / gamma**2)
    assert found.physical.percent[0] == pytest.approx(100 * error / gamma**2 / found.physical.values[0])


def test_signals_filtered_alike_have_honest_errors():
    """100 draws of noise on windows behind a filter: they scatter as their errors say, to 25 %; bias below 2 %."""
    draws = [fit_surge([made(seed=k)], MASS, "integral_windows", smooth=0.14).physical for k in range(100)]
    values = np.array([one.values for one in draws])
    np.testing.assert_allclose(values.mean(axis=0), TRUTH, rtol=0.02)
    np.testing.assert_allclose(values.std(axis=0), np.mean([one.errors for one in draws], axis=0), rtol=0.25)


def test_a_filter_that_does_nothing_changes_nothing():
    trial, lengths = made().trial, (0.27, 0.55)
    padded = integral_windows([trial], lengths, np.array([0.0, 1.0, 0.0]))
    np.testing.assert_allclose(padded.covariance, integral_windows([trial], lengths).covariance, rtol=1e-10)


def test_a_model_is_held_against_a_recording_that_it_has_not_seen():
    """The error's standard deviation is that of the noise; the mean is told in percent of the measured speed."""
    found, other = fit_surge([made()], MASS), made("test", 1)
    data = SurgeFit(found, (made(),), (other,)).to_dataset()
    rms = np.sqrt(np.mean(other.speed**2))
    assert data["used"].values.tolist() == ["train", "test"]
    assert float(data["deviation_std"][1]) == pytest.approx(100 * 0.005 / rms, rel=0.1)
    assert abs(float(data["deviation_mean"][1])) < 1.0
    computed = data["computed"].values[data["of"].values == 1]
    np.testing.assert_allclose(computed, made("test", noise=0.0).speed, atol=1e-3)
    np.testing.assert_allclose(data["value"].sel(parameter=["added_mass", "drag"]), found.physical.values)


def test_the_first_state_of_a_prediction_is_that_of_least_squares():
    """Not the first sample, whose noise would last for seconds."""
    clean = made(noise=0.0)
    off = clean._replace(speed=clean.speed + np.where(clean.time == 0.0, 0.05, 0.0))
    np.testing.assert_allclose(
        follow_recording(off.trial, fit_surge([clean], MASS).rate.values), clean.speed, atol=1e-3
    )


def test_deviations_are_percent_of_the_root_mean_square():
    assert deviation(np.array([1.0, -1.0, 1.0, -1.0]), np.array([0.9, -1.1, 0.8, -1.0])) == pytest.approx(
        (10.0, 100 * np.std([0.1, 0.1, 0.2, 0.0]), 20.0)
    )


def test_what_is_wrong_is_told():
    clean = made(noise=0.0)
    assert STATIC in fit_surge([clean._replace(static=True)], MASS).warnings
    assert any("negative" in warning for warning in fit_surge([clean], 4.0).warnings)
    hidden = fit_surge([made(noise=0.1)], MASS)
    assert any("hardly follows" in warning for warning in hidden.warnings)
    shaken = clean._replace(speed=np.random.default_rng(0).normal(size=clean.time.size))
    with pytest.raises(InputError, match="does not follow the thrust"):
        fit_surge([shaken], MASS, "integral_windows")
    with pytest.raises(InputError, match="other sign"):
        fit_surge([clean._replace(thrust=-clean.thrust)], MASS)
    with pytest.raises(InputError, match="no method"):
        fit_surge([clean], MASS, "output error")
    with pytest.raises(InputError, match="leave it out"):
        fit_surge([clean], MASS, smooth=0.2)
    with pytest.raises(InputError, match="5 to 600 will do"):
        fit_surge([clean], MASS, "integral_windows", smooth=30.0)


def test_a_thrust_without_a_period_will_do():
    """A strong and then a weak push from rest, in closed form: v = w tanh(t / s + c), then v = w coth(t / s + c)."""
    clean = made(noise=0.0)
    total, drag = MASS + TRUTH[0], TRUTH[1]
    (w1, s1), (w2, s2) = ((np.sqrt(push / drag), total / np.sqrt(push * drag)) for push in (0.1, 0.02))
    met = w1 * np.tanh(3.0 / s1)
    speed = np.where(
        clean.time < 3.0,
        w1 * np.tanh(clean.time / s1),
        w2 / np.tanh(np.maximum(clean.time - 3.0, 0.0) / s2 + np.arctanh(w2 / met)),
    )
    started = clean._replace(speed=speed, thrust=np.where(clean.thrust_time < 3.0, 0.1, 0.02))
    for method in METHODS[:3]:
        found = fit_surge([started], MASS, method)
        np.testing.assert_allclose(found.physical.values, TRUTH, rtol=0.02)
        assert any("not settled" in warning for warning in found.warnings)
    assert any("no period" in warning for warning in found.warnings)
