r"""Steps that end where contacts begin and end, so that none passes over one.

A gap g is the distance to a contact over the softness of its law (`Mechanical.gaps`). The law is smooth between its
kinks: at g = 0, where its spring begins, at g = -1, from where on it is as stiff as it gets, and where its damper lets
go of what leaves. g, g + 1 and `damper_slack` are guards. Each has its values and rates at `SHARES` of a step, by the
step's cubic.

- A guard that changes sign is located on a cubic of its own; the step is repeated up to just before that. From further
  away than `_FAR` it is repeated up to half of that first: stages of a long step, which are less accurate than its end,
  may lie beyond the kink.
- Between times apart by $\Delta$, with |rate| at most L, a gap stays above $(c_0 + c_1 - L \Delta)/2$. If that is in
  the contact, and the gap did not change evenly, it may have been there and out again. The step is repeated up to
  the first time at which the gap can be 0 (conservative advancement, Mirtich 1996).
- At a kink of a damper or of a ramp, derivatives of the force jump, or change at once. Stages on the wrong side would
  make derivatives of a step wrong. A short step goes over such a kink: the weights of its stages before the kink add up
  to the share of the step before it (`Tableau.kink_share`).

Guards that change by less than `_SLOW` or `_SLOW_JUMP` in a step are left to the error control. From the end of a
contact step on, the next one is as long as the guard needs for half a softness. While a damper sets in, steps are as
long as the gap needs for a quarter: the error control does not see what they make of derivatives, which later bounces
multiply.
"""

from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from nectosome.core.one_sided import damper_slack

_PIECES = 4
SHARES = np.linspace(0.0, 1.0, _PIECES + 1)  # of a step, at which guards are evaluated
_IMPACT = 0.01  # tolerance in an impact: its errors are those of the whole motion after it
_SETTING_IN = 1e-3  # the same while a damper sets in
_BAND = 1e-3  # [softness] a guard this close to 0 stands at it
_LEAST_CROSSING = 1e-5  # [softness] distance to a kink that a step over it takes at least
_ON_IT = 1e-9  # [softness] a guard this close to 0 is on neither side
_FAR = 2.0  # [softness] from which on a step to a kink is made in two
_GRAZE = 0.1  # [softness] depth that may be passed over: 1/500 of the force at one softness
_LEAST = 1 / 16  # of a piece, by which a step comes closer at least
_SLOW = 0.5  # [softness] change over a step that the error control sees
_SLOW_JUMP = 0.2  # [softness] the same where a derivative of the force jumps
_USUAL = 1e-4  # relative tolerance of these; of a smaller one they have its square root
_BRAKES = 0.1  # change of the rate over a step in which a damper stops what comes
_PACE = 0.5  # [softness] change over the step that follows a contact step
_SETS_IN = 0.25  # [softness] the same, and over all that follow, while a damper sets in
_HALVINGS = 40


class ContactStep(NamedTuple):
    """What contacts say of an attempted step. Times are over the step, and inf for none."""

    passes: Bool[Array, ""]  # it passes a kink
    share: Float[Array, ""]  # of the step up to there; 1 if it passes none
    across: Float[Array, ""]  # time to the kink that it begins (if it passes) or ends at, to be gone over
    toward: Float[Array, "m"]  # time to kinks that are near at its end
    slow: Float[Array, "m"]  # steps from there, over it, in which their guards change too little to be looked at
    after: Float[Array, ""]  # time in which a guard that it ends at moves by `_PACE`
    sets_in: Float[Array, ""]  # time in which a gap whose damper sets in closes by `_SETS_IN`
    enters: Bool[Array, ""]  # that guard closes
    tolerance: Float[Array, ""]  # over the usual: less in a contact that it changes, or whose damper brakes, much


class _Guards(NamedTuple):
    """Guards at the starts and ends of the pieces of a step, with their rates by the piece."""

    a: Float[Array, "p m"]
    b: Float[Array, "p m"]
    ra: Float[Array, "p m"]
    rb: Float[Array, "p m"]
    holds: Bool[Array, "p m"]  # it has a meaning in the piece
    gap: Bool[Array, "m"]  # g or g + 1
    sharp: Bool[Array, "m"]  # its kink takes a short step
    slow: Float[Array, "m"]  # change over a step that is left to the error control


def contact_step(
    g: Float[Array, "k n"], rate: Float[Array, "k n"], lag: Float[Array, "n"], ramp: Bool[Array, "n"], rtol: Array
) -> ContactStep:
    """Of gaps and their rates at evenly spaced shares of a step, and their `Gaps`; rates and lags are by the step."""
    pieces = g.shape[0] - 1
    a, b, ra, rb, holds, gap, sharp, slow = _guards(g, rate / pieces, lag * pieces, ramp)
    slow *= jnp.sqrt(jnp.minimum(rtol / _USUAL, 1.0))

    change = jnp.max(jnp.maximum(a, b), axis=0) - jnp.min(jnp.minimum(a, b), axis=0)
    seen = holds & (change > slow)

    far, near = jnp.abs(a[0]) > _FAR, jnp.where(sharp, _ON_IT, _BAND)
    above, below = jax.lax.cummax(a, axis=0) > near, jax.lax.cummin(a, axis=0) < -near
    least = jnp.where(far, 0.125 * _FAR, -_ON_IT)
    side = jnp.where(seen & above & (b < least), 1.0, jnp.where(seen & below & (b > -least), -1.0, 0.0))
    before = jnp.where(far, 0.5 * _FAR, 0.5 * _BAND)
    root = _root(side * a - before, side * b - before, side * ra, side * rb)

    fast = jnp.maximum(jnp.abs(ra), jnp.abs(rb))
    even = (ra * rb > 0) & ((b - a) * ra > 0) & (jnp.abs(b - a) > 0.5 * fast)
    dips = seen & gap & (a > _BAND) & (b > _BAND) & ~even & (fast - a - b > 2 * _GRAZE)
    # from 0 it went one way, and came out on the other side
    turned = seen & gap & (jnp.abs(a) <= _BAND) & (jnp.abs(b) > 1.0) & (ra * b < 0)
    first = jnp.where(dips, jnp.maximum(a / jnp.where(dips, fast, 1.0), _LEAST), _LEAST)

    share = jnp.where(side != 0, root, jnp.where(dips | turned, first, jnp.inf))
    until = jnp.min(jnp.arange(pieces)[:, None] + share, initial=jnp.inf) / pieces
    passes = until < 1.0

    def soonest(at: Array, distance: Array, rate: Array) -> Array:
        return jnp.where(at, distance / jnp.abs(rate), jnp.inf) / pieces

    def across(at: Array, c: Array, rate: Array) -> Array:
        at &= sharp & (jnp.abs(c) <= _BAND) & (c * rate < 0)
        return jnp.min(soonest(at, jnp.maximum(jnp.abs(c), _LEAST_CROSSING), rate), initial=jnp.inf)

    fastest = jnp.max(fast, axis=0)
    left, speed = jnp.abs(b[-1]), jnp.abs(rb[-1])
    stands = holds[-1] & (jnp.abs(a[0]) > _BAND) & (left <= _BAND)
    comes = holds[-1] & (b[-1] * rb[-1] < 0) & (left > _BAND) & (left < _FAR)
    sets_in = gap & jnp.tile(lag > 0, 3) & (jnp.tile(b[-1, : lag.size], 3) > _BAND - 1) & (rb[-1] < 0)
    distance = jnp.where(sets_in, _SETS_IN, _PACE)
    brakes = jnp.tile(lag * pieces, 3) * fastest > _SLOW  # by half of the force of a softness
    inside = gap & (jnp.min(jnp.minimum(a, b), axis=0) < -_BAND)
    impact = (change > _SLOW) | brakes & (jnp.abs(rb[-1] - ra[0]) > _BRAKES * fastest)
    tolerance = jnp.where(brakes & sets_in, _SETTING_IN, jnp.where(impact, _IMPACT, 1.0))
    pace = soonest(stands, distance, jnp.maximum(speed, 1e-2 / pieces))
    return ContactStep(
        passes=passes,
        share=jnp.where(passes, until, 1.0),
        across=jnp.where(passes, across(side[0] != 0, a[0], ra[0]), across(stands, b[-1], rb[-1])),
        toward=soonest(comes, left - 0.5 * _BAND, speed),
        slow=soonest(comes, slow, speed),
        after=jnp.min(pace, initial=jnp.inf),
        sets_in=jnp.min(soonest(sets_in & (b[-1] < 0), distance, speed), initial=jnp.inf),
        enters=jnp.any(stands & (rb[-1] < 0)),
        tolerance=jnp.min(jnp.where(inside, tolerance, 1.0), initial=1.0),
    )


def _guards(g: Array, rate: Array, lag: Array, ramp: Array) -> _Guards:
    """Guards of gaps; rates and lags are by the piece. Rates of the slack are those of the cubic of its gap."""
    a, b, ra, rb = g[:-1], g[1:], rate[:-1], rate[1:]
    holds = (lag > 0) & (jnp.maximum(a, b) < 2 * _BAND)
    bends = 6 * (b - a) - 4 * ra - 2 * rb, 2 * ra + 4 * rb - 6 * (b - a)
    slack = partial(damper_slack, lag=lag, ramp=ramp)
    (sa, sra), (sb, srb) = (
        [jnp.where(holds, x, 0.0) for x in jax.jvp(slack, now, change)]
        for now, change in (((a, ra), (ra, bends[0])), ((b, rb), (rb, bends[1])))
    )
    each = (a, a + 1, sa), (b, b + 1, sb), (ra, ra, sra), (rb, rb, srb)
    a, b, ra, rb = (jnp.concatenate(one, axis=1) for one in each)

    all_gaps = jnp.ones_like(ramp)
    gap, jumps = jnp.concatenate([all_gaps, all_gaps, ~all_gaps]), jnp.concatenate([ramp, ramp, all_gaps])
    always, sharp = jnp.ones_like(holds), jumps | jnp.tile(lag > 0, 3)
    holds = jnp.concatenate([always, always, holds], axis=1)
    return _Guards(a, b, ra, rb, holds, gap, sharp, jnp.where(sharp, _SLOW_JUMP, _SLOW))


def _root(a: Array, b: Array, ra: Array, rb: Array) -> Array:
    """Share at which the cubic from a > 0 to b < 0 crosses 0."""

    def halve(_: Any, ends: tuple[Array, Array]) -> tuple[Array, Array]:
        low, high = ends
        s = 0.5 * (low + high)
        cubic = (1 - s) ** 2 * ((1 + 2 * s) * a + s * ra) + s**2 * ((3 - 2 * s) * b + (s - 1) * rb)
        return jnp.where(cubic > 0, s, low), jnp.where(cubic > 0, high, s)

    low, high = jax.lax.fori_loop(0, _HALVINGS, halve, (jnp.zeros_like(a), jnp.ones_like(a)))
    return 0.5 * (low + high)
