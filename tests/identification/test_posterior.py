"""Draws of posteriors: closed forms of normal ones, cut by their ranges or not; what is refused, what is warned of."""

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.stats import truncnorm

from nectosome.identification.fits.intervals import posterior
from nectosome.units import InputError
from nectosome.units.ranges import Ranges

BOX = Ranges(("a", "b"), [-10, -10], [10, 10])


def test_uncertain_runs_of_a_linear_model_have_its_covariance():
    """r = A theta - y: normal around A^-1 y with (A^T A)^-1."""
    A, y = np.array([[2.0, 1.0], [0.5, 3.0], [1.0, -1.0]]), np.array([1.0, 2.0, 0.3])
    centre = np.linalg.lstsq(A, y)[0]
    found = posterior(lambda theta: jnp.asarray(A) @ theta - y, BOX, centre, seed=1)
    draws = found.draws.reshape(-1, 2)
    error = np.sqrt(np.diag(np.linalg.inv(A.T @ A)))
    few = error / np.sqrt(found.effective)
    assert np.all(np.abs(draws.mean(axis=0) - centre) < 4 * few)
    np.testing.assert_allclose(np.cov(draws.T), np.linalg.inv(A.T @ A), rtol=0.15, atol=0.02)
    for interval, middle, half in zip(found.intervals, centre, 1.96 * error, strict=True):
        assert (interval.low, interval.high) == pytest.approx((middle - half, middle + half), abs=0.15 * half)
        assert interval.below
        assert interval.above
    assert found.warnings == ()


def test_a_bound_cuts_and_what_data_do_not_tell_is_even():
    """a: normal around 0 with error 1, cut at 0; b: in no residual, even over its logarithm."""
    ranges = Ranges(("a", "b"), [0, 1e-2], [10, 1e2], log=("b",))
    found = posterior(lambda theta: theta[:1], ranges, np.array([1.0, 1.0]), draws=2000, seed=2)
    a, b = found.draws.reshape(-1, 2).T
    assert np.quantile(a, [0.25, 0.5, 0.9]) == pytest.approx(truncnorm(0, 10).ppf([0.25, 0.5, 0.9]), rel=0.12)
    assert np.quantile(np.log10(b), [0.25, 0.5, 0.75]) == pytest.approx([-1, 0, 1], abs=0.25)
    assert (found.intervals[0].below, found.intervals[0].above) == (False, True)
    assert found.intervals[1].text == "not identifiable"


def test_the_same_seed_draws_the_same_and_too_few_draws_are_told():
    one, other = (posterior(lambda theta: theta, BOX, np.zeros(2), draws=50, warmup=50, chains=1) for _ in range(2))
    np.testing.assert_array_equal(one.draws, other.draws)
    assert any("Draw more" in warning for warning in one.warnings)


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        ({"draws": 0}, 'draws: "0" must be a whole number of at least 4.'),
        ({"chains": 0}, 'chains: "0" must be a whole number of at least 1.'),
        ({"coverage": 1.0}, 'coverage: "1.0" is out of range: it must be more than 0 and less than 1.'),
        ({"theta": np.array([11.0, 0.0])}, "a: 11 is not between -10 and 10."),
        ({"residuals": lambda theta: theta / 0}, "the residuals are NaN or infinite at a = 0, b = 0."),
    ],
)
def test_what_makes_no_sense_is_refused(asked, message):
    known = {"residuals": lambda theta: theta, "theta": np.zeros(2)} | asked
    with pytest.raises(InputError) as caught:
        posterior(known.pop("residuals"), BOX, known.pop("theta"), **known)
    assert str(caught.value) == message
