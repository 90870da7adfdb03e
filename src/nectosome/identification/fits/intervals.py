"""Intervals of fitted parameters that need no linear model: by the profile of the likelihood, and by refitting."""

import math
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.optimize import brentq
from scipy.special import chdtri

from .identifiability import Interval, identifiability, intervals_of
from .misfit import Fit, Misfit

_STEP, _LARGEST, _GROWTH = 0.5, 0.1, 1.25  # of a profile: in standard errors, at most in ranges, from one to the next
_FINE = 1e-2  # of a step: how closely an end is found
_BETTER = 1e-3  # a fit with so much less chi2 is another one
_FITTED, _REFITTED = 1e-7, 1e-2  # gain of chi2 by a step that is the last: to rounding, rough residuals have no end
_MET = 1e-6  # of the range: as near is on the bound


class Profile(NamedTuple):
    """The best that can be done at each value of a parameter."""

    name: str
    values: Float[np.ndarray, "k"]  # of the parameter, increasing
    rise: Float[np.ndarray, "k"]  # of chi2 above its least
    fits: Float[np.ndarray, "k n"]  # all parameters, fitted again
    best: Fit
    interval: Interval


class Bootstrap(NamedTuple):
    """Parameters fitted to data as they might have come out."""

    draws: Float[np.ndarray, "d n"]
    intervals: tuple[Interval, ...]


def profile(misfit: Misfit, theta: Float[np.ndarray, "n"], name: str, coverage: float = 0.95) -> Profile:
    r"""Interval of one parameter from its profile likelihood (Raue et al. 2009), from a fit near theta on.

    $$ \{ x : \min_{\theta, \theta_k = x} \chi^2 - \min_\theta \chi^2 \le c \} $$

    with the quantile c of a chi-squared variable of one degree of freedom, 3.84 for 95 %.

    Steps of half a standard error and more lead to both sides as far as the first rise to that threshold, each fit
    starting from the nearest one. Where the bound comes first the end is not identifiable. Where a better fit is
    found meanwhile, all begins anew from it. Raises InputError for an unknown parameter.
    """
    k, threshold = misfit.index(name), float(chdtri(1, 1 - coverage))
    best = misfit.fit(theta, gain=_FITTED)
    start = misfit.places(best.theta)[k]
    first = min(_STEP * float(identifiability(misfit, best.theta).errors[k]), _LARGEST)
    found: dict[float, Fit] = {start: best}

    def rise_at(place: float) -> float:
        """Rise of chi2 with the parameter held at a place, all others fitted from the nearest place on."""
        if place not in found:
            u = misfit.places(found[min(found, key=lambda other: abs(other - place))].theta)
            u[k] = place
            found[place] = misfit.fit(misfit.ranges.values(u), fixed=(name,), gain=_REFITTED)
        return found[place].chi2 - best.chi2

    def end(bound: float) -> float:
        """Place where the rise is the threshold, between the best fit and a bound; the bound where there is none."""
        place, step = start, first
        while place != bound:
            before = place
            place = min(before + step, bound) if bound > start else max(before - step, bound)
            if rise_at(place) > threshold:
                found_at: Any = brentq(lambda x: _root(rise_at(x)) - _root(threshold), before, place, xtol=_FINE * step)
                return found_at
            step = min(_GROWTH * step, _LARGEST)
        return bound

    low, high = end(0.0), end(1.0)
    least = min(found.values(), key=lambda one: one.chi2)
    if least.chi2 < best.chi2 - _BETTER:
        return profile(misfit, least.theta, name, coverage)
    places = np.array(sorted(found))
    fits = np.array([found[place].theta for place in places])
    rise = np.array([found[place].chi2 - best.chi2 for place in places])
    u = np.repeat(misfit.places(best.theta)[None], 2, axis=0)
    u[:, k] = low, high
    ends = misfit.ranges.values(u)[:, k]
    return Profile(name, fits[:, k], rise, fits, best, *intervals_of(ends[None], np.array([[low > 0, high < 1]])))


def bootstrap(
    misfit: Misfit, theta: Float[np.ndarray, "n"], draws: int = 200, seed: int = 0, coverage: float = 0.95
) -> Bootstrap:
    """Fits to data that the fitted model would give, with other noise (parametric bootstrap, Efron 1979).

    Residuals are those of theta's own data plus normal noise of size 1, which is what a standard error says. Intervals
    are between quantiles of the draws; an end on a bound is not identifiable.
    """
    rng = np.random.default_rng(seed)
    own = misfit.at(misfit.places(theta)[None])[0]
    found = np.array([misfit.fit(theta, shift=rng.normal(size=own.size) - own).theta for _ in range(draws)])
    half = (1 - coverage) / 2
    ends = np.quantile(found, [half, 1 - half], axis=0)
    places = misfit.ranges.places(ends)
    return Bootstrap(found, intervals_of(ends.T, np.stack([places[0] > _MET, places[1] < 1 - _MET], axis=1)))


def _root(rise: float) -> float:
    """What grows evenly with the distance from the best."""
    return math.sqrt(max(rise, 0.0))
