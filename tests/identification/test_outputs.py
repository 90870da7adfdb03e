"""Parameters of any block from what went in and came out: of a Bouc-Wen oscillator, of friction (synthetic)."""

import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.drives import BoucWen, Chain, Curve, Dahl, Gain, Integrated, Parallel, Polynomial, respond
from nectosome.identification import identifiability
from nectosome.identification.fits.misfit import Response, output_misfit
from nectosome.units import InputError
from nectosome.units.ranges import Ranges

DT = 0.01
NAMES = ("mass", "damping", "stiffness", "elastic", "beta", "gamma")
TRUTH = np.array([1.3, 2.0, 80.0, 0.3, 40.0, -15.0])
RANGES = Ranges(NAMES, [0.5, 0.2, 30, 0.05, 5, -40], [4, 10, 200, 0.9, 150, 40], log=NAMES[:3])


def oscillator(theta):
    return Integrated(BoucWen(*theta, jnp.asarray(1.0)))


def shaken(seed, noise):
    """A sum of sines that makes it yield."""
    rng, t = np.random.default_rng(seed), DT * np.arange(1500)
    u = np.array([4, 3, 2]) @ np.sin(rng.uniform(1, 9, (3, 1)) * t + rng.uniform(0, 6, (3, 1)))
    y = np.asarray(respond(oscillator(jnp.asarray(TRUTH)), u, DT))
    return Response(f"run {seed}", DT, u, y + noise * rng.normal(size=len(t)), noise)


def test_an_oscillator_with_hysteresis_is_found_and_predicts():
    """Six parameters within four standard errors; runs held out to the noise."""
    misfit = output_misfit(oscillator, RANGES, [shaken(0, 1e-3), shaken(1, 1e-3)])
    found = misfit.fit(RANGES.values(np.full(6, 0.5)))
    error = identifiability(misfit, found.theta).errors * RANGES.derivatives(found.theta)
    assert np.all(np.abs(found.theta - TRUTH) < 4 * error)
    assert np.all(error < 0.05 * np.abs(TRUTH))
    other = shaken(2, 1e-3)
    left = np.asarray(respond(oscillator(jnp.asarray(found.theta)), other.input, DT)) - other.output
    assert np.std(left) == pytest.approx(1e-3, rel=0.05)


def rubbing(theta):
    """Offset, slope, friction, its stiffness."""
    straight = Curve(Polynomial(theta[:2]))
    return Chain((Gain(jnp.ones(2)), Parallel((straight, Dahl(theta[2], theta[3])))))


def test_friction_is_found_from_a_way_out_and_back():
    """148 N with 20 N/m, and +-8 N of friction that takes 0.5 mm to turn; where it began does not count."""
    x = 0.03 * np.abs((np.arange(900) / 150 + 0.3) % 2 - 1)
    truth = np.array([148.0, 20.0, 8.0, 1.6e4])
    rng = np.random.default_rng(0)
    y = np.asarray(respond(rubbing(jnp.asarray(truth)), x, DT)) + 0.1 * rng.normal(size=900)
    names = ("offset", "slope", "friction", "stiffness")
    ranges = Ranges(names, [0, -100, 1, 1e3], [300, 100, 50, 1e6], log=("stiffness",))
    misfit = output_misfit(rubbing, ranges, [Response("pull", DT, x, y, 0.1, 100)])
    found = misfit.fit(np.array([100.0, 0.0, 3.0, 5e3]))
    error = identifiability(misfit, found.theta).errors * ranges.derivatives(found.theta)
    assert np.all(np.abs(found.theta - truth) < 4 * error)
    assert found.chi2 == pytest.approx(800, rel=0.15)


def test_slopes_are_exact():
    """Against central differences."""
    misfit = output_misfit(oscillator, RANGES, [shaken(0, 1e-3)])
    theta = RANGES.values(np.full(6, 0.5))
    exact = misfit.jacobian(theta)
    for k in range(6):
        h = 1e-6 * np.eye(6)[k] * abs(theta[k] or 1.0)
        ends = misfit.residuals(np.stack([theta + h, theta - h]))
        np.testing.assert_allclose(exact[:, k], (ends[0] - ends[1]) / (2 * h[k]), atol=1e-5 * np.abs(exact[:, k]).max())


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"output": np.zeros(3)}, "1500 inputs and 3 outputs"),
        ({"standard_error": 0.0}, "standard error is 0"),
        ({"begin": 1500}, "counts from sample 1500 on"),
        ({"output": np.full(1500, np.nan)}, "NaN or infinite"),
    ],
)
def test_recordings_that_are_none_are_refused(change, told):
    with pytest.raises(InputError, match=told):
        output_misfit(oscillator, RANGES, [shaken(0, 1e-3)._replace(**change)])
    with pytest.raises(InputError, match="no recording"):
        output_misfit(oscillator, RANGES, [])
