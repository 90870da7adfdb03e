"""Variable projection and Levenberg-Marquardt, on sums of exponentials whose parameters are known."""

import numpy as np
import pytest

from nectosome.identification.fits.misfit import Misfit
from nectosome.identification.fits.separable import Separable
from nectosome.units import InputError
from nectosome.units.ranges import Ranges
from nectosome_studies.fishtail.levenberg import levenberg

T = np.linspace(0, 5, 200)
TAU, W = np.array([0.4, 2.5]), np.array([3.0, 1.5])
RANGES = Ranges(["fast", "slow"], [0.05, 0.8], [0.8, 20.0], log=["fast", "slow"])


def basis(tau):
    return np.exp(-T[:, None] / tau)


def slopes(tau, w):
    return basis(tau) * w * T[:, None] / tau**2


def decays(data, standard_error=1.0):
    return Separable(basis, slopes, data, RANGES, standard_error)


EXACT = decays(basis(TAU) @ W)
NOISY = decays(basis(TAU) @ W + np.random.default_rng(0).normal(scale=0.02, size=200), 0.02)


@pytest.mark.parametrize("seed", range(5))
def test_what_made_the_data_is_found_from_anywhere(seed):
    found = EXACT.fit(RANGES.values(np.random.default_rng(seed).uniform(size=2)))
    np.testing.assert_allclose(found.theta, TAU, rtol=1e-6)
    np.testing.assert_allclose(found.weights, W, rtol=1e-6)
    assert found.chi2 < 1e-12


def test_it_is_the_fit_of_all_parameters_at_once():
    """Whole and projected problem have the same least."""
    start = np.array([0.3, 1.5])
    found = NOISY.fit(start)
    whole = NOISY.whole(10.0).fit(np.array([*start, 1.0, 1.0]))
    np.testing.assert_allclose(np.concatenate([found.theta, found.weights]), whole.theta, rtol=1e-5)
    assert found.chi2 == pytest.approx(whole.chi2, rel=1e-9)
    assert found.chi2 == pytest.approx(196, rel=0.25)


def test_kaufmans_slopes_have_the_whole_gradient():
    """Of the sum of squares, against central differences, away from the least."""
    misfit, u = NOISY.projected(), np.array([0.3, 0.6])
    r = misfit.at(u[None])[0]
    gradient = 2 * r @ misfit.derivatives(u)
    for k in range(2):
        h = 1e-6 * np.eye(2)[k]
        up, down = (np.sum(misfit.at((u + side * h)[None])[0] ** 2) for side in (1, -1))
        assert gradient[k] == pytest.approx((up - down) / 2e-6, rel=1e-6)


def test_weights_are_never_negative():
    """Data that only a negative weight explains: it ends on its bound, and the rest is the fit of the other alone."""
    found = decays(basis(TAU) @ np.array([-1.0, 2.0])).fit(np.array([0.4, 2.0]))
    assert found.weights[0] == 0
    alone = Separable(
        lambda tau: np.exp(-T[:, None] / tau),
        lambda tau, w: np.exp(-T[:, None] / tau) * w * T[:, None] / tau**2,
        basis(TAU) @ np.array([-1.0, 2.0]),
        Ranges(["slow"], 0.8, 20.0, log=["slow"]),
    ).fit(np.array([2.0]))
    assert found.chi2 == pytest.approx(alone.chi2, rel=1e-8)
    assert found.theta[1] == pytest.approx(alone.theta[0], rel=1e-5)


def test_levenberg_comes_to_the_same():
    ended = levenberg(NOISY.whole(10.0), np.array([0.2, 5.0, 1.0, 1.0]))
    assert ended.settled
    np.testing.assert_allclose(ended.theta, NOISY.whole(10.0).fit(ended.theta).theta, rtol=1e-5)
    assert ended.chi2 == pytest.approx(NOISY.fit(np.array([0.3, 1.5])).chi2, rel=1e-9)


def test_levenberg_stays_within_the_ranges_and_tells_when_it_is_not_done():
    """A least outside: it ends at a bound's inner side, never beyond; and with too few iterations it says so."""
    misfit = Misfit(lambda rows: rows - 3.0, Ranges(["x"], 0.0, 2.0), lambda x: np.eye(1))
    ended = levenberg(misfit, np.array([0.5]))
    assert 1.9 < ended.theta[0] <= 2.0
    assert not levenberg(NOISY.whole(10.0), np.array([0.2, 5.0, 1.0, 1.0]), iterations=2).settled
    with pytest.raises(InputError, match="is not between"):
        levenberg(misfit, np.array([5.0]))
    nothing = Misfit(lambda rows: rows * np.nan, Ranges(["x"], 0.0, 2.0), lambda x: np.eye(1))
    with pytest.raises(InputError, match=r"residuals are NaN or infinite at x = 0\.5"):
        levenberg(nothing, np.array([0.5]))
