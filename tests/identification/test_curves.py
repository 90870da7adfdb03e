"""Curves fitted to arrays: known parameters, scipy's covariance, intervals that cover, warnings, mistakes."""

import numpy as np
import pytest
from scipy.optimize import curve_fit

from nectosome.identification import fit
from nectosome.units import InputError

T = np.linspace(0, 3, 60)
TRUTH = {"a": 1.3, "tau": 0.7, "c": 0.2}
RANGES = {"a": (0.0, 5.0), "tau": "0.05..10 log", "c": (-1, 1)}


def decay(t, a, tau, c):
    return a * np.exp(-t / tau) + c


def noisy(seed: int, size: float = 0.03) -> np.ndarray:
    return decay(T, **TRUTH) + size * np.random.default_rng(seed).normal(size=T.size)


def test_known_parameters_are_recovered():
    found = fit(decay, T, decay(T, **TRUTH), RANGES)
    assert found.values == pytest.approx(TRUTH, rel=1e-6)
    assert found.warnings == ()
    np.testing.assert_allclose(found(T), decay(T, **TRUTH), rtol=1e-6)


@pytest.mark.parametrize("errors", [None, 0.03, np.linspace(0.02, 0.05, T.size)])
def test_estimate_and_covariance_are_those_of_scipy(errors):
    y = noisy(1)
    sigma = None if errors is None else np.broadcast_to(errors, T.shape)
    theirs, covariance = curve_fit(
        decay, T, y, [1, 1, 0], sigma, errors is not None, ftol=1e-14, xtol=1e-14, gtol=1e-14
    )
    found = fit(decay, T, y, RANGES, errors=errors)
    np.testing.assert_allclose(found.theta, theirs, rtol=1e-6)
    np.testing.assert_allclose(found.covariance, covariance, rtol=1e-6)
    assert found.errors["tau"] == pytest.approx(np.sqrt(covariance[1, 1]), rel=1e-6)


def test_a_jacobian_of_one_s_own_gives_the_same():
    def jacobian(t, a, tau, c):
        e = np.exp(-t / tau)
        return np.stack([e, a * t / tau**2 * e, np.ones_like(t)], axis=-1)

    ours, theirs = fit(decay, T, noisy(1), RANGES, jacobian=jacobian), fit(decay, T, noisy(1), RANGES)
    np.testing.assert_allclose(ours.covariance, theirs.covariance, rtol=1e-6)


@pytest.mark.parametrize("errors", [None, 0.03])
def test_intervals_cover(errors):
    """95 % of 400 intervals of each parameter, within three standard errors of that share; few values count too."""
    some = slice(None, None, 8)
    held = []
    for seed in range(400):
        found = fit(decay, T[some], noisy(seed)[some], RANGES, errors=errors, starts=1)
        held.append([one.low <= TRUTH[name] <= one.high for name, one in found.intervals.items()])
    assert np.all(np.mean(held, axis=0) > 0.95 - 3 * np.sqrt(0.05 * 0.95 / 400))


def test_several_inputs_missing_values_and_a_shape_of_one_s_own():
    x, z = np.meshgrid(np.linspace(0, 1, 8), np.linspace(-1, 1, 9))
    y = 2 * x - 3 * z
    y[3, 4] = np.nan
    found = fit(lambda xz, p, q: p * xz[0] + q * xz[1], (x, z), y, {"p": (-9, 9), "q": "-9..9"}, start={"p": 1.0})
    assert found.values == pytest.approx({"p": 2, "q": -3}, rel=1e-7)
    assert found.residuals.size == 71


def test_what_makes_a_fit_doubtful_is_told():
    waves = noisy(2) + 0.1 * np.sin(4 * T)
    assert any("residuals are correlated" in x for x in fit(decay, T, waves, RANGES).warnings)
    assert any("times their standard errors" in x for x in fit(decay, T, waves, RANGES, errors=0.003).warnings)
    warnings = fit(decay, T, noisy(2), RANGES | {"c": (0.4, 1)}).warnings
    assert "c is at the lower end of its range, 0.4: widen it, or the model lacks something" in warnings
    both = fit(lambda t, p, q: p * q * t, T, 2 * T + 0.01 * np.sin(50 * T), {"p": "0.1..10 log", "q": "0.1..10 log"})
    assert any(words.startswith("p and q: only in combination, p q.") for words in both.warnings)
    none = fit(lambda t, p, q: p * t, T, T, {"p": (0, 2), "q": (0, 1)})
    assert any(words.startswith("q: not identifiable: ") for words in none.warnings)
    assert none.intervals["q"].text == "not identifiable"


def test_a_fit_is_data():
    found = fit(decay, T, noisy(3), RANGES).to_dataset()
    assert found["parameter"].values.tolist() == ["a", "tau", "c"]
    assert np.all((found["low"] < found["value"]) & (found["value"] < found["high"]) & found["identifiable"])
    np.testing.assert_allclose(np.sqrt(np.diagonal(found["covariance"])), found["error"])


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"vary": {}}, "vary: is empty"),
        ({"vary": {"a": "1", "tau": (1, 2), "c": (0, 1)}}, "a: .* is no range"),
        ({"vary": {"a": (2, 1), "tau": (1, 2), "c": (0, 1)}}, "a: 2 to 1 is empty"),
        ({"vary": RANGES | {"tau": "0..1 log"}}, "tau: 0 has no logarithm"),
        ({"y": T[:5]}, "curve: gives the shape"),
        ({"y": np.full(T.size, np.inf)}, "y: has values that are infinite"),
        ({"y": np.where(T < 0.1, T, np.nan)}, "y: has 2 values, too few for 3 parameters"),
        ({"errors": 0.0}, "errors: must be finite and more than 0"),
        ({"start": {"b": 1.0}}, "b: there is no such parameter"),
        ({"start": {"a": 7.0}}, "a: 7 is not between 0 and 5"),
        ({"curve": lambda t, a, tau, c: t * np.nan}, "curve: is NaN or infinite"),
        ({"jacobian": lambda t, a, tau, c: t}, "jacobian: gives the shape"),
    ],
)
def test_mistakes_are_told_in_a_sentence(changes, said):
    asked = {"curve": decay, "x": T, "y": decay(T, **TRUTH), "vary": RANGES} | changes
    with pytest.raises(InputError, match=said):
        fit(**asked)
