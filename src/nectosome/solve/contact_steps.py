r"""Steps that end where contacts begin and end, so that none passes over one.

A gap g is the distance to a contact over the softness of its law (`Mechanical.gaps`). The law is smooth between its
kinks at g = 0, where its spring begins, and g = -1, from where on it is as stiff as it gets: c = g and c = g + 1 are
guards. Each has its values and rates at `SHARES` of a step, by the step's cubic.

- A guard that changes sign is located on a cubic of its own; the step is repeated up to there.
- Between times apart by $\Delta$, with |rate| at most L, a guard stays above $(c_0 + c_1 - L \Delta)/2$. If that is in
  the contact, and the guard did not change evenly, it may have been there and out again. The step is repeated up to
  the first time at which the guard can be 0 (conservative advancement, Mirtich 1996).

Guards that change by less than `_SLOW` are left to the error control, which sees the law then. From the end of a
contact step on, the next one is as long as the guard needs for one softness.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

_PIECES = 4
SHARES = np.linspace(0.0, 1.0, _PIECES + 1)  # of a step, at which guards are evaluated
IMPACT = 0.01  # tolerance in an impact: its errors are those of the whole motion after it
_BAND = 1e-3  # [softness] a guard this close to 0 stands at it
_GRAZE = 0.1  # [softness] depth that may be passed over: 1/500 of the force at one softness
_LEAST = 1 / 16  # of a piece, by which a step comes closer at least
_SLOW = 0.5  # [softness] change over a step that the error control sees
_HALVINGS = 40


class ContactStep(NamedTuple):
    """What contacts say of an attempted step."""

    passes: Bool[Array, ""]  # it passes one
    share: Float[Array, ""]  # of the step up to there; 1 if it passes none
    after: Float[Array, ""]  # time in which a guard that the step ends at moves by a softness, over the step; inf: none
    enters: Bool[Array, ""]  # that guard closes
    impact: Bool[Array, ""]  # it is within a contact, whose depth it changes by more than a softness


def contact_step(c: Float[Array, "k n"], rate: Float[Array, "k n"]) -> ContactStep:
    """Of guards c and their rates at evenly spaced shares of a step."""
    length = 1.0 / (c.shape[0] - 1)
    a, b, ra, rb = c[:-1], c[1:], rate[:-1] * length, rate[1:] * length
    fast, moves = jnp.maximum(jnp.abs(ra), jnp.abs(rb)), jnp.max(c, axis=0) - jnp.min(c, axis=0) > _SLOW

    above, below = jax.lax.cummax(a, axis=0) > _BAND, jax.lax.cummin(a, axis=0) < -_BAND
    side = jnp.where(above & (b < -_BAND), 1.0, jnp.where(below & (b > _BAND), -1.0, 0.0))
    root = _root(side * a, side * b, side * ra, side * rb)

    even = (ra * rb > 0) & ((b - a) * ra > 0) & (jnp.abs(b - a) > 0.5 * fast)
    dips = (a > _BAND) & (b > _BAND) & ~even & (fast - a - b > 2 * _GRAZE)
    # from 0 it went one way, and came out on the other side
    turned = (jnp.abs(a) <= _BAND) & (jnp.abs(b) > 1.0) & (ra * b < 0)
    first = jnp.where(dips, jnp.maximum(a / jnp.where(dips, fast, 1.0), _LEAST), _LEAST)

    share = jnp.where(side != 0, root, jnp.where(dips | turned, first, jnp.inf))
    start = length * jnp.arange(c.shape[0] - 1)[:, None]
    until = jnp.min(jnp.where(moves, start + length * share, jnp.inf), initial=jnp.inf)

    stands = moves & (jnp.abs(c[-1]) <= _BAND)
    after = jnp.min(jnp.where(stands, 1.0 / jnp.maximum(jnp.abs(rate[-1]), 1e-2), jnp.inf), initial=jnp.inf)
    enters = jnp.any(stands & (rate[-1] < 0))
    passes = until < 1.0
    gaps = c[:, : c.shape[1] // 2]
    impact = jnp.any((jnp.min(gaps, axis=0) < -_BAND) & (jnp.max(gaps, axis=0) - jnp.min(gaps, axis=0) > _SLOW))
    return ContactStep(passes, jnp.where(passes, until, 1.0), after, enters, impact)


def _root(a: Array, b: Array, ra: Array, rb: Array) -> Array:
    """Share at which the cubic from a > 0 to b < 0 crosses 0."""

    def halve(_: Any, ends: tuple[Array, Array]) -> tuple[Array, Array]:
        low, high = ends
        s = 0.5 * (low + high)
        cubic = (1 - s) ** 2 * ((1 + 2 * s) * a + s * ra) + s**2 * ((3 - 2 * s) * b + (s - 1) * rb)
        return jnp.where(cubic > 0, s, low), jnp.where(cubic > 0, high, s)

    low, high = jax.lax.fori_loop(0, _HALVINGS, halve, (jnp.zeros_like(a), jnp.ones_like(a)))
    return 0.5 * (low + high)
