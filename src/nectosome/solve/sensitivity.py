r"""A motion together with its slopes: the derivatives of its states by some numbers, carried through the same steps.

The slopes of a step are its derivatives at the solution of its stages. An embedded estimate of the error is linear in
the stages, so that its derivative estimates the error of the slopes. They take part in the choice of the steps: those
short enough for the state alone are too long for its slopes where the equations are hardly smooth, as at a stop.

Times may move with the numbers, all at one relative pace p: $dt = p\,t$. A slope is then that of the state at a moving
time, and its rate is $d(\dot x) + p\,\dot x$. Where the equations jump at a share of the period, its slopes stay right.
"""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import Mechanical, State

from .stages import Step

_SHARE = 1e-6  # of the largest slope of all kinds [by kind: 1, 1/s]


class SensitivityState(eqx.Module):
    """A state, or its rate, error or allowed error, and the slopes of it."""

    x: State
    slopes: State  # leaves [p, ...]


class SensitivitySystem(eqx.Module):
    """A system, and what becomes of it with each of p numbers."""

    system: Mechanical
    tangents: Any  # derivatives of the system's numbers, leaves [p, ...] or None
    pace: Float[Array, "p"]  # of all times, relative to them


def with_sensitivity(step: Callable[..., Step]) -> Callable[..., Step]:
    """A time step that carries slopes along, made of one that does not."""

    def attempt(
        s: SensitivitySystem,
        t: Array,
        h: Array,
        x: SensitivityState,
        rate: SensitivityState,
        known: Array,
        memory: Any,
        allowed: SensitivityState,
    ) -> Step:
        def bare(system: Mechanical, t: Array, h: Array, x: State, rate: State) -> Step:
            return step(system, t, h, x, rate, known, memory, allowed.x)

        def along(tangent: Any, pace: Array, dx: State, slope_of_rate: State) -> tuple[Step, tuple[State, ...]]:
            def paced(d: State, rate: State, pace: Array = pace) -> State:
                return jax.tree.map(lambda d, k: d + pace * k, d, rate)

            tangents = (tangent, pace * t, pace * h, dx, paced(slope_of_rate, rate.x, -pace))
            done, d = eqx.filter_jvp(bare, (s.system, t, h, x.x, rate.x), tangents)
            return done, (d.x, paced(d.first, done.first), paced(d.rate, done.rate), d.error)

        done, slopes = jax.vmap(along, out_axes=(None, 0))(s.tangents, s.pace, x.slopes, rate.slopes)
        both = map(SensitivityState, (done.x, done.first, done.rate, done.error), slopes)
        return done._replace(**dict(zip(("x", "first", "rate", "error"), both, strict=True)))

    return attempt


def allowed_sensitivity(rtol: Array, atol: Array | float, a: State, b: State) -> State:
    """Error allowed in slopes from a to b: atol, and rtol of the largest of one kind.

    Kinds are coordinates, velocities and load states. Where one kind is next to nothing beside the others a small share
    of these counts: the velocities of a robot that is moved aside change by rounding errors only.
    """
    whole = _largest((a, b))
    assert whole is not None

    def of_kind(a: Any, b: Any) -> Any:
        kind = _largest((a, b))
        if kind is None:
            return a
        allowed = rtol * jnp.maximum(kind, _SHARE * whole) + atol
        return jax.tree.map(lambda x: jnp.broadcast_to(allowed.reshape(-1, *[1] * (x.ndim - 1)), x.shape), a)

    return State(of_kind(a.q, b.q), of_kind(a.v, b.v), of_kind(a.z, b.z))


def _largest(slopes: Any) -> Float[Array, "p"] | None:
    """Largest magnitude of each of p slopes; None where there are no numbers."""
    leaves = [jnp.abs(leaf).reshape(leaf.shape[0], -1) for leaf in jax.tree.leaves(slopes) if leaf.size]
    return jnp.max(jnp.concatenate(leaves, axis=1), axis=1) if leaves else None
