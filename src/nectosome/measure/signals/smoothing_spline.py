r"""Smoothing splines with a stated cut-off, for times that need not be even.

$$ \min_f \sum_i h\, (y_i - f(t_i))^2 + \frac{\sqrt 2 - 1}{(2 \pi f_c)^6} \int f'''^2\, dt $$

with h the median of the steps of time: a spline of degree 5 (Schoenberg 1964), whose gain away from the ends is
$1 / (1 + (\sqrt 2 - 1) (f / f_c)^6)$, $1/\sqrt 2$ at the cut-off, without delay; less beyond it, since pieces of the
spline are a quarter of a period of the cut-off long.
"""

import numpy as np
from jaxtyping import Float
from scipy.interpolate import BSpline
from scipy.sparse import diags_array, eye_array
from scipy.sparse.linalg import spsolve

_DEGREE = 5
_TRIED = 24  # cut-offs
_NORMAL = 0.6745  # median magnitude of normal noise over its standard deviation
_FAST = 0.25  # of the sampling rate: what is faster is noise
_LEAST, _MOST = 2.0, 0.5  # cut-offs: periods in the whole time at least, and a share of the sampling rate at most


def cutoffs(time: Float[np.ndarray, "n"]) -> tuple[float, float]:
    """Least and largest cut-off that samples at these times allow [Hz]."""
    return _LEAST / float(time[-1] - time[0]), _MOST / float(np.median(np.diff(time)))


def smoothing_spline(time: Float[np.ndarray, "n"], values: Float[np.ndarray, "n"], cutoff: float) -> BSpline:
    """The smoothing spline with a cut-off [Hz] through samples at increasing times."""
    step, length = float(np.median(np.diff(time))), float(time[-1] - time[0])
    spans = int(np.ceil(length / max(0.25 / cutoff, step)))
    span = length / spans
    knots = time[0] + span * np.arange(-_DEGREE, spans + _DEGREE + 1)
    at, weights = (0.5 + np.sqrt(0.6) / 2 * np.array([-1.0, 0.0, 1.0])), np.array([5.0, 8.0, 5.0]) / 18  # Gauss
    places = (time[0] + span * (np.arange(spans)[:, None] + at)).ravel()
    count = spans + _DEGREE
    thirds = sum(x * eye_array(count - 3, count, k=k) for k, x in enumerate((-1.0, 3.0, -3.0, 1.0)))
    bent = BSpline.design_matrix(places, knots[3:-3], _DEGREE - 3) @ thirds / span**3
    near = BSpline.design_matrix(np.minimum(time, knots[-_DEGREE - 1]), knots, _DEGREE)
    penalty = (np.sqrt(2) - 1) / (2 * np.pi * cutoff) ** 6 / step * span
    square = near.T @ near + penalty * (bent.T @ diags_array(np.tile(weights, spans)) @ bent)
    return BSpline(knots, spsolve(square.tocsc(), near.T @ values), _DEGREE)


def cutoff_of(
    time: Float[np.ndarray, "n"], values: Float[np.ndarray, "n"], noise: float, independent: int | None = None
) -> float:
    r"""The cut-off that comes closest to what values without their noise are, by Stein's unbiased estimate [Hz].

    $$ \overline{(f - y)^2} + 2 \sigma^2 \frac{n}{m} \overline H $$

    with noise of the standard deviation $\sigma$, of which m values are `independent` (all unless given), and the mean
    H of the gain over frequencies (Stein 1981, Annals of Statistics 9, 1135).
    """
    step, shares = float(np.median(np.diff(time))), values.size / max(independent or values.size, 1)

    def risk(cutoff: float) -> float:
        left = np.mean((smoothing_spline(time, values, cutoff)(time) - values) ** 2)
        return float(left + 2 * noise**2 * shares * np.mean(_gain(cutoff * step)))

    low, high = cutoffs(time)
    return min(np.geomspace(low, high, _TRIED).tolist(), key=risk)


def noise_of(time: Float[np.ndarray, "n"], values: Float[np.ndarray, "n"]) -> float:
    """Standard deviation of white noise, by what is faster than a quarter of the sampling rate."""
    left = values - smoothing_spline(time, values, _FAST / float(np.median(np.diff(time))))(time)
    return float(np.median(np.abs(left)) / _NORMAL / np.sqrt(np.mean((1 - _gain(_FAST)) ** 2)))


def _gain(cutoff: float) -> Float[np.ndarray, "f"]:
    """Gain at frequencies up to half the sampling rate, with a cut-off as a share of that rate."""
    return 1 / (1 + (np.sqrt(2) - 1) * (np.linspace(0.0, 0.5, 501) / cutoff) ** 6)
