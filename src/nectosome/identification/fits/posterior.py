r"""The posterior of parameters, drawn by the No-U-Turn sampler (Hoffman and Gelman 2014, package numpyro).

With residuals r in standard errors, and ranges that know no more than that the parameters are in them,

$$ p(\theta) \propto \exp\left(-\tfrac12 |r(\theta)|^2\right) $$

evenly over the places u in the ranges, on a logarithmic scale where a range has one.
"""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.io.extras import package
from nectosome.units import InputError
from nectosome.units.ranges import Ranges

from .identifiability import Interval, intervals_of

_SPLIT = 1.01  # chains that differ by more are not of one distribution (Vehtari et al. 2021)
_FEW = 400  # draws in effect, below which quantiles are rough (same)
_INSIDE = 2.0  # times further inside than the range alone would put it an end is known by the data
_NEAR, _EDGE = 0.05, 1e-3  # of the ranges: how far chains begin from the start, and from the bounds at least


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
    """Posterior of parameters whose residuals, in standard errors, are a function for JAX; from near theta on.

    Chains run side by side, with derivatives forward. Where the residuals are NaN or infinite the density is 0. Raises
    InputError where numpyro is not installed, for numbers that make no sense, parameters outside of their ranges, and
    residuals that are NaN or infinite at theta.
    """
    package("numpyro", "numpyro")
    for name, value, least in (("draws", draws, 4), ("warmup", warmup, 1), ("chains", chains, 1), ("seed", seed, 0)):
        if value < least:
            raise InputError(f"is {value}; it must be at least {least}.", field=name)
    if not 0 < coverage < 1:
        raise InputError(f"is {coverage:g}; it must lie between 0 and 1.", field="coverage")
    u0 = ranges.places(np.asarray(theta, dtype=float))
    for k in np.flatnonzero(~((u0 >= 0) & (u0 <= 1))):
        low, high = ranges.bounds[k]
        raise InputError(f"{theta[k]:g} is not between {low:g} and {high:g}.", field=ranges.names[k])
    if not bool(jnp.isfinite(residuals(jnp.asarray(theta, dtype=float))).all()):
        raise InputError(f"the residuals are NaN or infinite at {ranges.text(np.asarray(theta))}.")
    from numpyro.diagnostics import (  # pyright: ignore[reportMissingImports]
        effective_sample_size,
        split_gelman_rubin,
    )
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
    sampler = MCMC(
        kernel,
        num_warmup=warmup,
        num_samples=draws,
        num_chains=chains,
        chain_method="vectorized",
        progress_bar=False,
    )
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
    warnings = _warnings(ranges, split, effective, diverged, chains * draws)
    return Posterior(ranges.values(u), intervals_of(ends_of, known), split, effective, warnings)


def _warnings(
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
