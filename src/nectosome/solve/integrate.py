"""Time integration with adaptive steps (saved states, a terminal event) or fixed ones; works under jit and vmap.

An integration can stop after any saved time and resume from there, so that long runs report progress and can be
cancelled. It includes sensitivities for a `SensitivitySystem` and a `SensitivityState`.

Steps end where a sampled loop of the system updates, and states are those before the update: the next step begins with
it. So whoever goes on from a state at such a time makes the update, once. Steps end where a signal jumps, too: they see
it as it is just before, and the next ones as it is just after.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any, Literal, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Bool, Float, Int

from nectosome.core import Gaps, Mechanical, State, Status, System
from nectosome.core.rows import all_on_device
from nectosome.core.updates import due, next_update, rounding

from .contact_steps import SHARES, ContactStep, contact_step
from .runge_kutta import ESDIRK4, TSIT5, Step, explicit_step, implicit_step, newton_memory, rms
from .sensitivity import (
    SensitivityState,
    SensitivitySystem,
    after_jump,
    allowed_sensitivity,
    with_differences,
    with_sensitivity,
)
from .stage import Neighbours

Method = Literal["implicit", "explicit"]
Guard = Callable[[Array, State], Array]

_SAFETY, _SHRINK, _GROW = 0.9, 0.2, 4.0
_LEAST = 1e-4  # least error over the tolerance in the step size control
# I control, for explicit steps PI control, since stability limits these (Gustafsson 1991).
_CONTROL = {"implicit": (1.0, 0.0), "explicit": (0.7, 0.4)}
_JUMP = 1e-9  # [s] length of a step from which on down sensitivities do not count; of later times, relative
STEPS = 256  # most attempts at steps in a call of `steps_until`
_BLOCK = 16  # saved times between synchronisations of a batch


class Integration(eqx.Module):
    """State of an integration: the last accepted step from (t0, x0) to (t, x), and the next step."""

    t0: Float[Array, ""]
    x0: Any  # a State or a SensitivityState
    rate0: Any
    t: Float[Array, ""]
    x: Any
    rate: Any  # dx/dt at x; unknown before the first attempt
    h: Float[Array, ""]  # size of the next step [s]
    memory: Any
    after_rejection: Bool[Array, ""]  # the last attempt was rejected
    across: Float[Array, ""]  # size of a step before that, over the kink of a contact [s]; 0: none
    error: Float[Array, ""]  # of the last accepted step over the tolerance
    status: Int[Array, ""]  # SOLVED while it runs
    end: Float[Array, ""]  # time of the event or of the failure [s]; inf while it runs
    steps: Int[Array, ""]
    rejected: Int[Array, ""]
    beside0: Neighbours | None = None  # solutions that are taken along, by implicit steps: at t0
    beside: Neighbours | None = None  # and at t


class Settings(eqx.Module):
    """Settings of an integration."""

    method: Method = eqx.field(static=True)
    rtol: Float[Array, ""]
    atol: Float[Array, ""]
    max_steps: Int[Array, ""]
    longest: Float[Array, ""] | float = np.inf  # largest step [s]
    stop: Float[Array, ""] | None = None  # time [s] at which a step ends
    # above 0, since sensitivities may start at 0, also within a step; far below those to moduli [1/Pa]
    sensitivity_atol: Float[Array, ""] | float = 1e-26


def begin(
    t: Array, x: State | SensitivityState, settings: Settings, h: Array, beside: State | None = None
) -> Integration:
    """Integration that starts at (t, x) with a first step of size h; the first attempt computes the rate there.

    `beside`: states close to x, leaves [p, ...], that are taken along.
    """
    bare = x.x if isinstance(x, SensitivityState) else x
    n = bare.v.size + sum(leaf.size for leaf in jax.tree.leaves(bare.z))
    memory = newton_memory(n) if settings.method == "implicit" else None
    after_rejection, across, error, solved, end, none = all_on_device(False, 0.0, 1.0, int(Status.SOLVED), np.inf, 0)
    near = None
    if beside is not None:
        near = Neighbours(beside, jax.tree.map(jnp.zeros_like, beside))
    return Integration(t, x, x, t, x, x, h, memory, after_rejection, across, error, solved, end, none, none, near, near)


def _attempts(
    system: Mechanical | SensitivitySystem, settings: Settings, guard: Guard | None, with_them: Bool[Array, ""] | bool
) -> Callable[[Integration], Integration]:
    """One attempt at a step, accepted where its time is later than before."""
    plain: Callable[..., Step] = implicit_step if settings.method == "implicit" else explicit_step
    tableau = ESDIRK4 if settings.method == "implicit" else TSIT5
    order = tableau.order
    proportional, integral = _CONTROL[settings.method]
    rates, stop = system.update_rates, settings.stop
    jumps = system.next_jump(jnp.zeros(())) is not None
    cut = rates is not None or stop is not None or jumps

    def attempt(m: Integration) -> Integration:
        begins = _up_to(system, m, rates, stop, jumps) if cut else _Begins(m.x, m.steps > 0, m.t, m.h, m.t + m.h)
        crosses = m.across > 0
        short = crosses & (m.across < begins.h)
        h, end = (jnp.where(short, m.across, begins.h), jnp.where(short, m.t + m.across, begins.end))
        begins = begins._replace(h=h, end=end)
        allowed, near = _allowed(settings, m.x, m.x), m.beside
        if near is not None and rates is not None:
            near = near._replace(x=jax.vmap(lambda x: system.updated(m.t, x))(near.x))
        them = () if near is None else (near, with_them)
        step, x0 = plain, begins.x
        if isinstance(system, SensitivitySystem):
            step = with_sensitivity(plain, begins.moved) if system.near is None else with_differences(plain)
        s = step(system, begins.t, begins.h, begins.x, m.rate, begins.known, m.memory, allowed, *them)
        if begins.moved is not None:
            first: Any = s.first
            x0 = after_jump(x0, m.rate.x, first.x, begins.moved)
        # derivatives are those of the steps taken, not of the step size control
        bounds = _allowed(settings, m.x, s.x)
        error = jax.lax.stop_gradient(_size(s.error, bounds))
        if isinstance(s.error, SensitivityState):
            # rates of sensitivities may jump, where a step of any length has too large an error of what starts at 0
            brief = begins.h < _JUMP * jnp.maximum(1.0, jnp.abs(m.t))
            error = jnp.where(brief, jax.lax.stop_gradient(_size(s.error.x, bounds.x)), error)
        error = jnp.where(jnp.isfinite(error) & s.converged, error, jnp.inf)
        moved = m.t, x0, s.first, begins.end, s.x, s.rate
        contact = _contacts(system, m, moved, settings.rtol)
        if contact is not None:
            error = jnp.where(crosses, error, error / contact.tolerance)
        within = error <= 1.0
        accepted = within if contact is None else within & (crosses | ~contact.passes)
        error = jnp.maximum(error, _LEAST)
        factor = error ** (-proportional / order) * m.error ** (integral / order)
        factor = jnp.clip(_SAFETY * jnp.where(accepted, factor, error ** (-1 / order)), _SHRINK, _GROW)
        if settings.method == "implicit":
            # an unchanged step keeps the Jacobian
            factor = jnp.where((factor > 1.0) & (factor < 1.2), 1.0, factor)
        factor = jnp.where(accepted, factor, jnp.minimum(factor, 0.9))
        factor = jnp.where(s.converged, factor, 0.5)
        # no growth right after a rejection
        factor = jnp.where(m.after_rejection, jnp.minimum(factor, 1.0), factor)
        h, before = begins.h * factor, s.first
        if cut:
            # a step that is cut short says nothing against one as long as was planned
            h = jnp.where((begins.h < m.h) & (factor >= 1.0), jnp.maximum(h, m.h), h)
        if rates is not None or jumps:
            # the last step, of which states may still be asked, ends with the rate before the update or the jump
            before = jax.tree.map(lambda a, b: jnp.where(begins.known, a, b), s.first, m.rate)
        across = m.across
        if contact is not None:
            # anew from where a contact begins or ends, and from there by its softness, whatever the steps before
            pace = begins.h * contact.after
            landed = accepted & ~crosses & jnp.isfinite(pace)
            h = jnp.where(landed, jnp.where(contact.enters, pace, jnp.maximum(h, pace)), h)
            comes = jnp.where(accepted & (h > begins.h * contact.slow), begins.h * contact.toward, jnp.inf)
            soft = jnp.where(accepted, begins.h * contact.sets_in, jnp.inf)
            h = jnp.minimum(jnp.minimum(h, soft), jnp.min(comes, initial=jnp.inf))
            over = jnp.isfinite(contact.across)
            again = within & contact.passes & ~crosses
            h = jnp.where(again, begins.h * jnp.where(over, 1.0, contact.share), h)
            # a step over a kink leaves the next one as it was planned
            h = jnp.where(crosses & accepted, m.h, h)
            across = jnp.where((landed | again) & over, begins.h * contact.across / tableau.kink_share, 0.0)
            across = jnp.where(crosses & ~accepted, 0.5 * m.across, across)
        h = jnp.minimum(h, settings.longest)
        if s.stable is not None:
            h = jnp.minimum(h, jnp.where(accepted & ~crosses, jnp.maximum(s.stable, _SHRINK * begins.h), jnp.inf))
        kept = replace(m, rate=before, h=h, memory=s.memory, after_rejection=~accepted, across=across)
        new = eqx.tree_at(lambda m: (*_last(m), m.error), kept, (*moved, jnp.where(crosses, m.error, error)))
        if m.beside is not None and near is not None:
            new = replace(new, beside0=near._replace(rate=s.beside_first), beside=s.beside)
            kept = replace(kept, beside=m.beside._replace(rate=s.beside_first))
        old, m = m, jax.tree.map(lambda a, b: jnp.where(accepted, a, b), new, kept)
        steps, rejected = m.steps + 1, m.rejected + ~accepted
        tiny = m.h < 1e-13 * jnp.maximum(1.0, jnp.abs(m.t))
        status = jnp.where(steps >= settings.max_steps, int(Status.STEP_LIMIT), m.status)
        status = jnp.where(tiny, int(Status.STEP_TOO_SMALL), status)
        status = jnp.where(jnp.all(jnp.isfinite(ravel_pytree(s.first)[0])), status, int(Status.NOT_FINITE))
        end = jnp.where(status != int(Status.SOLVED), m.t, jnp.inf)
        if guard is not None:
            happened, when = _crossing(m, guard, old.x)
            happened &= accepted
            status = jnp.where(happened, int(Status.EVENT), status)
            end = jnp.where(happened, when, end)
        return eqx.tree_at(lambda m: (m.status, m.end, m.steps, m.rejected), m, (status, end, steps, rejected))

    return attempt


def integrate(
    system: Mechanical | SensitivitySystem,
    state: Integration,
    times: Float[Array, "n"],
    settings: Settings,
    guard: Guard | None = None,
    with_them: Bool[Array, ""] | bool = True,
) -> tuple[Integration, Any]:
    """Integrate to the last of `times`; also return the states at all of them (NaN after an early end).

    Integration ends early with status EVENT at a sign change of guard(t, x), located on the step's cubic to 1e-12 of
    it. States beside the integrated one stay as they are, at little cost, where not `with_them`.
    """
    attempt, rates = _attempts(system, settings, guard, with_them), system.update_rates

    def passed(m: Integration, block: Array, found: Any) -> Any:
        """Add to the saved states of a block those at times within the last step."""

        def one(time: Array, old: Any) -> Any:
            first, last = m.t0, m.t
            if rates is not None:  # an update, before which the state was saved, is at the start
                first, last = jnp.where(last > first, first + rounding(first), first), last + rounding(last)
            here = (first <= time) & (time <= jnp.minimum(last, m.end))
            return jax.tree.map(lambda new, old: jnp.where(here, new, old), interpolate(m, time), old)

        return jax.vmap(one)(block, found)

    def reach(m: Integration, block: Array) -> tuple[Integration, Any]:
        def more(carry: tuple[Integration, Any]) -> tuple[Integration, Any]:
            m = attempt(carry[0])
            return m, passed(m, block, carry[1])

        def going(carry: tuple[Integration, Any]) -> Array:
            return (carry[0].t < block[-1]) & (carry[0].status == int(Status.SOLVED))

        blank = jax.tree.map(lambda x: jnp.full((block.shape[0], *x.shape), jnp.nan), m.x)
        return jax.lax.while_loop(going, more, (m, passed(m, block, blank)))

    n = times.shape[0]
    size = min(n, _BLOCK)
    count = -(-n // size)
    blocks = jnp.pad(times, (0, count * size - n), mode="edge").reshape(count, size)
    state, found = jax.lax.scan(reach, state, blocks)
    return state, jax.tree.map(lambda x: x.reshape(count * size, *x.shape[2:])[:n], found)


class AcceptedSteps(NamedTuple):
    """Accepted steps from (t0, x0) to (t, x) with the rates at both ends, leaves [n, ...]."""

    t0: Float[Array | np.ndarray, "n"]
    x0: Any
    rate0: Any
    t: Float[Array | np.ndarray, "n"]
    x: Any
    rate: Any


def steps_until(
    system: Mechanical, state: Integration, until: Array, most: Array, settings: Settings, guard: Guard | None = None
) -> tuple[Integration, AcceptedSteps, Int[Array, ""]]:
    """Integrate to a time, by `most` attempts at most; also return the steps, and how many of its rows they are."""
    attempt = _attempts(system, settings, guard, True)

    def more(carry: tuple[Integration, AcceptedSteps, Array]) -> tuple[Integration, AcceptedSteps, Array]:
        before, kept, k = carry
        m = attempt(before)
        last = AcceptedSteps(m.t0, m.x0, m.rate0, m.t, m.x, m.rate)
        kept = jax.tree.map(lambda all, one: all.at[k].set(one), kept, last)  # a rejected one is written over
        return m, kept, k + (m.t > before.t)

    def going(carry: tuple[Integration, AcceptedSteps, Array]) -> Array:
        m, _, _ = carry
        tried = m.steps - state.steps
        return (m.t < until) & (m.status == int(Status.SOLVED)) & (tried < jnp.minimum(most, STEPS))

    x = state.x
    blank = jax.tree.map(lambda x: jnp.zeros((STEPS, *x.shape), x.dtype), AcceptedSteps(state.t, x, x, state.t, x, x))
    return jax.lax.while_loop(going, more, (state, blank, jnp.zeros((), int)))


class _Begins(NamedTuple):
    """How a step begins."""

    x: Any
    known: Bool[Array, ""]  # the rate there is
    t: Array  # where it sees the system first
    h: Array
    end: Array
    moved: Float[Array, "p"] | None = None  # by parameters of sensitivities, where a signal jumps


def _up_to(
    system: Mechanical | SensitivitySystem,
    m: Integration,
    rates: Float[Array, "k"] | None,
    stop: Array | None,
    jumps: bool,
) -> _Begins:
    """A step that begins with the updates due, and one of equal ones up to the next update, jump or stop."""
    x, known, until = m.x, m.steps > 0, jnp.inf if stop is None else stop
    if rates is not None:
        x, known = system.updated(m.t, m.x), known & ~jnp.any(due(m.t, rates))
        until = jnp.minimum(until, next_update(m.t, rates))
    begin = jump = jnp.zeros((), bool)
    moved, room = None, rounding(m.t)
    if jumps:
        before = m.t - 3 * room
        both: Any = jax.vmap(system.next_jump)(jnp.stack([before, m.t]))
        last, following = both
        begin, jump, until = last <= m.t + room, following <= until, jnp.minimum(until, following)
        if isinstance(system, SensitivitySystem):
            moved = jnp.where(begin & known, system.moves(before), 0.0)
        known &= ~begin
    until = jnp.where(jnp.isfinite(until), until, m.t + m.h)
    count = jnp.maximum(jnp.ceil((until - m.t) / m.h), 1.0)
    h = (until - m.t) / count
    first, last = jnp.where(begin, room, 0.0), jnp.where(jump & (count <= 1), room, 0.0)
    return _Begins(x, known, m.t + first, h - first - last, jnp.where(count > 1, m.t + h, until), moved)


def _allowed(settings: Settings, a: Any, b: Any) -> Any:
    """Tolerance of each component of a step from a to b."""
    if isinstance(a, SensitivityState):
        tolerances = settings.rtol, settings.sensitivity_atol
        derivatives = allowed_sensitivity(*tolerances, a.derivatives, b.derivatives)
        return SensitivityState(_allowed(settings, a.x, b.x), derivatives)
    return jax.tree.map(lambda a, b: settings.atol + settings.rtol * jnp.maximum(jnp.abs(a), jnp.abs(b)), a, b)


def _size(error: Any, allowed: Any) -> Array:
    """Root mean square of the error over the tolerance; the largest one of the state and its sensitivities."""
    if isinstance(error, SensitivityState):
        sensitivities = jnp.max(jax.vmap(_size)(error.derivatives, allowed.derivatives))
        return jnp.maximum(_size(error.x, allowed.x), sensitivities)
    return rms(ravel_pytree(jax.tree.map(jnp.divide, error, allowed))[0])


def interpolate(m: "Integration | AcceptedSteps", time: Array) -> Any:
    """State at a time within the last step, by cubic Hermite interpolation."""
    return _cubic(m, time, m.x0, m.rate0, m.x, m.rate)


def beside_at(m: Integration, time: Array) -> Any:
    """States that are taken along, at a time within the last step."""
    assert m.beside0 is not None and m.beside is not None
    return _cubic(m, time, m.beside0.x, m.beside0.rate, m.beside.x, m.beside.rate)


def _cubic(m: "Integration | AcceptedSteps", time: Array, x0: Any, rate0: Any, x: Any, rate: Any) -> Any:
    h = m.t - m.t0
    s = jnp.where(h > 0, (time - m.t0) / jnp.where(h > 0, h, 1.0), 1.0)
    a, b = (1 + 2 * s) * (1 - s) ** 2, s * (1 - s) ** 2
    c, d = s**2 * (3 - 2 * s), s**2 * (s - 1)
    return jax.tree.map(lambda x0, k0, x1, k1: a * x0 + b * h * k0 + c * x1 + d * h * k1, x0, rate0, x, rate)


def _last(m: Integration) -> tuple[Any, ...]:
    """The last step."""
    return m.t0, m.x0, m.rate0, m.t, m.x, m.rate


def _contacts(
    system: Mechanical | SensitivitySystem, m: Integration, moved: tuple[Any, ...], rtol: Array
) -> ContactStep | None:
    """What contacts say of an attempted step of m; None of a system without any."""
    m = jax.lax.stop_gradient(eqx.tree_at(_last, m, moved))
    length = m.t - m.t0

    def gaps(share: Array) -> tuple[Array, Gaps] | None:
        time = m.t0 + share * length
        found = jax.lax.stop_gradient(system).gaps(time, interpolate(m, time))
        return None if found is None else (found.gap, found)

    if eqx.filter_eval_shape(gaps, jnp.zeros(())) is None:
        return None
    along = lambda s: jax.jvp(gaps, (s,), (jnp.ones(()),), has_aux=True)  # noqa: E731
    gap, rate, found = jax.vmap(along)(SHARES)
    return contact_step(gap, rate, found.lag[-1] / length, found.ramp[-1], rtol)


def _crossing(m: Integration, guard: Guard, x: Any) -> tuple[Array, Array]:
    """Whether the guard changed sign over the last step, from a state x before its updates; the time, by bisection."""
    first, last = guard(m.t0, x), guard(m.t, m.x)
    happened = (m.t > m.t0) & (jnp.sign(first) != jnp.sign(last)) & (first != 0)

    def halve(_, ends):
        low, high = ends
        middle = 0.5 * (low + high)
        before = jnp.sign(guard(middle, interpolate(m, middle))) == jnp.sign(first)
        return jnp.where(before, middle, low), jnp.where(before, high, middle)

    low, high = jax.lax.fori_loop(0, 40, halve, (m.t0, m.t))
    return happened, 0.5 * (low + high)


_NODES, _WEIGHTS = (0.0, 0.5, 0.5, 1.0), (1 / 6, 1 / 3, 1 / 3, 1 / 6)


def fixed_step(
    system: System,
    t: Float[Array, ""],
    x: State,
    step: Float[Array, ""],
    count: int,
    keep: Callable[[State], Any] | None = None,
) -> tuple[State, Any]:
    """State after `count` steps from (t, x) by the classical Runge-Kutta method, and `keep(state)` after each step.

    For batches, whose members stay in step. Works under jit, vmap and forward derivatives. There is no error control,
    and neither contacts nor jumps of signals are located: halve the step to estimate the error. A step in which sampled
    loops update is made in parts.
    """
    rates = system.update_rates

    def over(x: State, time: Callable[[Array], Array], step: Array) -> State:
        def stage(carry: tuple[State, State], at: Array) -> tuple[tuple[State, State], None]:
            rate, new = carry
            rate = system.rates(time(at[0]), _ahead(x, rate, at[0] * step))
            return (rate, _ahead(new, rate, at[1] * step)), None

        none = jax.tree.map(jnp.zeros_like, x)
        (_, new), _ = jax.lax.scan(stage, (none, x), jnp.stack([jnp.array(_NODES), jnp.array(_WEIGHTS)], axis=1))
        return new

    def part(end: Array, now: tuple[Array, State]) -> tuple[Array, State]:
        assert rates is not None
        until = jnp.minimum(next_update(now[0], rates), end)
        h = until - now[0]
        return until, over(system.updated(*now), lambda share: now[0] + share * h, h)

    def one(x: State, k: Array) -> tuple[State, Any]:
        if rates is None:
            new = over(x, lambda share: t + (k + share) * step, step)
        else:
            end = t + (k + 1) * step
            going = lambda now: now[0] + rounding(end) < end  # noqa: E731
            _, new = jax.lax.while_loop(going, partial(part, end), (t + k * step, x))
        return new, None if keep is None else keep(new)

    return jax.lax.scan(one, x, jnp.arange(count, dtype=float))


def _ahead(x: State, rate: State, h: Array) -> State:
    return jax.tree.map(lambda a, b: a + h * b, x, rate)
