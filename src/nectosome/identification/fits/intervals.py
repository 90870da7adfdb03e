"""Intervals of fitted parameters that need no linear model: by the likelihood's profile, refitting, the posterior."""

import math
from collections.abc import Callable
from concurrent.futures import Executor
from operator import itemgetter
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.optimize import brentq
from scipy.special import chdtri

from nectosome.io.extras import package
from nectosome.search.executors.spread import spread
from nectosome.units import InputError, check_share, check_whole
from nectosome.units.ranges import Ranges

from .identifiability import Interval, identifiability, intervals_of
from .misfit import Fit, Misfit

_STEP, _LARGEST, _GROWTH = 0.5, 0.1, 1.25  # of a profile: in standard errors, at most in ranges, from one to the next
_FINE = 1e-2  # of a step: how closely an end is found
_BETTER = 1e-3  # a fit with so much less chi2 is another one
_FITTED, _REFITTED = 1e-7, 1e-2  # gain of chi2 by a step that is the last: to rounding, rough residuals have no end
_MET = 1e-6  # of the range: as near is on the bound
_SPLIT = 1.01  # chains that differ by more are not of one distribution (Vehtari et al. 2021)
_FEW = 400  # draws in effect, below which quantiles are rough (same)
_INSIDE = 2.0  # times further inside than the range alone would put it an end is known by the data
_NEAR, _EDGE = 0.05, 1e-3  # of the ranges: how far chains begin from the start, and from the bounds at least


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
    misfit: Misfit,
    theta: Float[np.ndarray, "n"],
    draws: int = 200,
    seed: int = 0,
    coverage: float = 0.95,
    executor: Executor | None = None,
) -> Bootstrap:
    """Fits to data that the fitted model would give, with other noise (parametric bootstrap, Efron 1979).

    Residuals are those of theta's own data plus normal noise of size 1, which is what a standard error says. Intervals
    are between quantiles of the draws; an end on a bound is not identifiable.

    - executor: where the fits are made, of a misfit of module functions where that is in other processes; unless given
      they are made here, one after another. Raises LostError where it ends before.
    """
    rng = np.random.default_rng(seed)
    own = misfit.at(misfit.places(theta)[None])[0]
    calls = ((k, _refitted, (misfit, theta, rng.normal(size=own.size) - own)) for k in range(draws))
    ended = spread(executor, calls, lambda: True) if executor else ((k, f(*args)) for k, f, args in calls)
    found = np.array([one for _, one in sorted(ended, key=itemgetter(0))])
    half = (1 - coverage) / 2
    ends = np.quantile(found, [half, 1 - half], axis=0)
    places = misfit.ranges.places(ends)
    return Bootstrap(found, intervals_of(ends.T, np.stack([places[0] > _MET, places[1] < 1 - _MET], axis=1)))


def _refitted(misfit: Misfit, theta: Float[np.ndarray, "n"], shift: Float[np.ndarray, "r"]) -> Float[np.ndarray, "n"]:
    """Parameters that a draw leads to, in a worker."""
    return misfit.fit(theta, shift=shift).theta


def _root(rise: float) -> float:
    """What grows evenly with the distance from the best."""
    return math.sqrt(max(rise, 0.0))


def stepwise_threshold(coverage: float = 0.95) -> float:
    r"""Rise of chi2 up to which a parameter may be, where chi2 goes in steps as the parameter goes over samples.

    Such a parameter tells times, and the likelihood ratio of a time is the largest of two random walks:
    $P(\text{rise} \le c) = (1 - e^{-c/2})^2$, so that c is 7.35 for 95 % (Hansen 2000, Econometrica 68, 575), not
    3.84. Between samples nothing is told, and so the interval holds the truth rather more often.
    """
    return -2.0 * math.log(1.0 - math.sqrt(coverage))


class Posterior(NamedTuple):
    """Draws of parameters, and how far they can be trusted."""

    draws: Float[np.ndarray, "c d n"]  # chain by chain
    intervals: tuple[Interval, ...]  # between quantiles; an end that the range alone makes is not identifiable
    split: Float[np.ndarray, "n"]  # split R-hat: 1 where the halves of all chains agree
    effective: Float[np.ndarray, "n"]  # number of independent draws worth as much
    warnings: tuple[str, ...]


def posterior(
    residuals: Callable[[Float[Array, "n"]], Float[Array, "r"]],
    ranges: Ranges,
    theta: Float[np.ndarray, "n"],
    *,
    draws: int = 1000,
    warmup: int = 500,
    chains: int = 4,
    seed: int = 0,
    coverage: float = 0.95,
) -> Posterior:
    r"""Posterior of parameters, drawn by the No-U-Turn sampler (Hoffman and Gelman 2014, package numpyro).

    With residuals r in standard errors, a function for JAX, and ranges that know no more than that the parameters are
    in them,

    $$ p(\theta) \propto \exp\left(-\tfrac12 |r(\theta)|^2\right) $$

    evenly over the places u in the ranges, on a logarithmic scale where a range has one. Chains run side by side from
    near theta on, with derivatives forward. Where the residuals are NaN or infinite the density is 0. Raises
    InputError where numpyro is not installed, for numbers that make no sense, parameters outside of their ranges, and
    residuals that are NaN or infinite at theta.
    """
    package("numpyro", "posterior")
    for name, value, least in (("draws", draws, 4), ("warmup", warmup, 1), ("chains", chains, 1), ("seed", seed, 0)):
        check_whole(value, name, least)
    check_share(coverage, "coverage")
    u0 = ranges.places(np.asarray(theta, dtype=float))
    for k in np.flatnonzero(~((u0 >= 0) & (u0 <= 1))):
        low, high = ranges.bounds[k]
        raise InputError(f"{theta[k]:g} is not between {low:g} and {high:g}.", field=ranges.names[k])
    if not bool(jnp.isfinite(residuals(jnp.asarray(theta, dtype=float))).all()):
        raise InputError(f"the residuals are NaN or infinite at {ranges.text(np.asarray(theta))}.")
    from numpyro.diagnostics import effective_sample_size, split_gelman_rubin
    from numpyro.infer import MCMC, NUTS  # pyright: ignore[reportMissingImports]

    ends, log = jnp.asarray(ranges.ends), jnp.asarray(ranges.log)

    def potential(z: Array) -> Array:
        u = jax.nn.sigmoid(z)
        x = ends[:, 0] + u * (ends[:, 1] - ends[:, 0])
        r = residuals(jnp.where(log, jnp.exp(jnp.where(log, x, 0.0)), x))
        # du/dz = u (1 - u)
        energy = 0.5 * jnp.sum(r * r) - jnp.sum(jax.nn.log_sigmoid(z) + jax.nn.log_sigmoid(-z))
        return jnp.where(jnp.isfinite(energy), energy, jnp.inf)

    spread = _NEAR * np.random.default_rng(seed).uniform(-1, 1, (chains, u0.size))
    first = np.clip(u0 + spread, _EDGE, 1 - _EDGE)
    first[0] = np.clip(u0, _EDGE, 1 - _EDGE)
    kernel = NUTS(potential_fn=potential, forward_mode_differentiation=True)
    sizes: Any = {"num_warmup": warmup, "num_samples": draws, "num_chains": chains}
    sampler = MCMC(kernel, **sizes, chain_method="vectorized", progress_bar=False)
    begin = jnp.asarray(np.log(first / (1 - first)))
    sampler.run(jax.random.key(seed), init_params=begin if chains > 1 else begin[0], extra_fields=("diverging",))
    found = np.asarray(sampler.get_samples(group_by_chain=True)).reshape(chains, draws, u0.size)
    u = 1 / (1 + np.exp(-found))
    split, effective = np.asarray(split_gelman_rubin(u)), np.asarray(effective_sample_size(u))
    half = (1 - coverage) / 2
    low, high = np.quantile(u.reshape(-1, u0.size), [half, 1 - half], axis=0)
    known = np.stack([low > _INSIDE * half, high < 1 - _INSIDE * half], axis=1)
    ends_of = np.stack([ranges.values(low), ranges.values(high)], axis=1)
    diverged = int(np.asarray(sampler.get_extra_fields()["diverging"]).sum())
    warnings = _doubts(ranges, split, effective, diverged, chains * draws)
    return Posterior(ranges.values(u), intervals_of(ends_of, known), split, effective, warnings)


def _doubts(
    ranges: Ranges, split: Float[np.ndarray, "n"], effective: Float[np.ndarray, "n"], diverged: int, draws: int
) -> tuple[str, ...]:
    out = []
    for k, name in enumerate(ranges.names):
        if not split[k] < _SPLIT:
            out.append(f"{name}: the chains do not agree (split R-hat {split[k]:.3f}). Draw more")
        elif effective[k] < _FEW:
            out.append(f"{name}: its draws are worth {effective[k]:.0f} independent ones. Draw more")
    if diverged:
        out.append(f"{diverged} of {draws} draws diverged: intervals may be too short")
    return tuple(out)
