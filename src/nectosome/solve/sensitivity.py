r"""Forward sensitivities: derivatives of the states by some parameters, integrated in the same steps.

The sensitivities of a step are its derivatives at the solution of its stages; or, of implicit steps, differences of
solutions that are $10^{-6}$ of the parameters apart at the start of each step, by one Jacobian of each stage: a
fraction of the cost, to as many digits of the parameters' scale. The embedded error estimate is linear in
the stages, so its derivative estimates the error of the sensitivities. Both errors control the step size: near
equations of low smoothness, such as a joint limit, sensitivities need shorter steps than the state.

Time may scale with the parameters, $dt = p\,t$ with a relative rate p. A sensitivity is then that of the state at a
scaled time, with the rate $d(\dot x) + p\,\dot x$. This keeps sensitivities right for jumps at a fixed fraction of the
period.

Where sampled loops update, the sensitivities jump as the state does, by the derivative of the update. The instants are
those of the state, but for the scaling of time: derivatives by an update rate are not those of the motion.

Where a signal jumps, at a time T, the rate jumps from $f^-$ to $f^+$, and sensitivities of a state jump by
$(f^- - f^+)(dT - p\,T)$. A step from there begins at T as it moves: at the state $x + f^-(dT - p\,T)$.
"""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import Gaps, Mechanical, State

from .runge_kutta import Step
from .stage import Neighbours

APART = 1e-6  # of the parameters: distance of solutions whose differences are sensitivities
_SHARE = 1e-6  # least scale of one kind over the largest sensitivity of all kinds [by kind: 1, 1/s]


class SensitivityState(eqx.Module):
    """A state (or its rate, error or tolerance) and its sensitivities."""

    x: State
    derivatives: State  # leaves [p, ...]


class SensitivitySystem(eqx.Module):
    """A system and its derivatives by p parameters."""

    system: Mechanical
    tangents: Any  # derivatives of the system's numbers, leaves [p, ...] or None
    time_scaling: Float[Array, "p"]  # relative derivative of all times; 0 where `near`
    near: Any = None  # numbers of systems whose solutions' differences are the sensitivities, as in `Neighbours`

    @property
    def update_rates(self) -> Float[Array, "k"] | None:
        """Those of the system; they scale with the times, and are no parameters."""
        return self.system.update_rates

    def next_jump(self, t: Array) -> Float[Array, ""] | None:
        """That of the system; None of systems `near` each other, whose signals jump at times of their own."""
        return self.system.next_jump(t) if self.near is None else None

    def moves(self, t: Array) -> Float[Array, "p"]:
        """How the next jump of a signal after t moves, by the scaled time."""

        def along(tangent: Any, scaling: Array) -> Array:
            jump, change = eqx.filter_jvp(lambda system: system.next_jump(t), (self.system,), (tangent,))
            return (0.0 if change is None else change) - scaling * jump

        return jax.vmap(along)(self.tangents, self.time_scaling)

    def gaps(self, t: Array, x: SensitivityState) -> Gaps | None:
        """Those of the system."""
        return self.system.gaps(t, x.x)

    def updated(self, t: Array, x: SensitivityState) -> SensitivityState:
        """State and sensitivities after the updates that are due at t."""

        def along(tangent: Any, scaling: Array, dx: State) -> State:
            update = lambda system, t, x: system.updated(t, x)  # noqa: E731
            return eqx.filter_jvp(update, (self.system, t, x.x), (tangent, scaling * t, dx))[1]

        derivatives = jax.vmap(along)(self.tangents, self.time_scaling, x.derivatives)
        return SensitivityState(self.system.updated(t, x.x), derivatives)


def by_differences(system: Mechanical, tangents: Any, x: State, derivatives: State) -> "SensitivitySystem":
    """A system whose sensitivities from x are differences of solutions of systems close by."""
    own = eqx.filter(system, eqx.is_inexact_array)
    count = 1 + sum(leaf.size for leaf in jax.tree.leaves((x.v, x.z)))

    def stacked(own: Array, change: Array) -> Array:
        others = own + APART * change
        return jnp.concatenate([jnp.broadcast_to(own, (count, *own.shape)), others])

    parameters = jax.tree.leaves(derivatives)[0].shape[0]
    return SensitivitySystem(system, tangents, jnp.zeros(parameters), jax.tree.map(stacked, own, tangents))


def with_differences(step: Callable[..., Step]) -> Callable[..., Step]:
    """Extend an implicit time step to sensitivities that are differences."""

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
        begin, slope = (jax.tree.map(lambda x, d: x + APART * d, one.x, one.derivatives) for one in (x, rate))
        near = Neighbours(begin, slope, s.near)
        done = step(s.system, t, h, x.x, rate.x, known, memory, allowed.x, near)
        assert done.beside is not None
        pairs = {
            "x": (done.x, done.beside.x),
            "first": (done.first, done.beside_first),
            "rate": (done.rate, done.beside.rate),
            "error": (done.error, done.beside_error),
        }
        apart = lambda own, near: jax.tree.map(lambda a, b: (b - a) / APART, own, near)  # noqa: E731
        both = {name: SensitivityState(own, apart(own, near)) for name, (own, near) in pairs.items()}
        return done._replace(**both, beside=None, beside_first=None, beside_error=None)

    return attempt


def with_sensitivity(step: Callable[..., Step], moved: Float[Array, "p"] | None) -> Callable[..., Step]:
    """Extend a time step to sensitivities. Its start moves by the parameters, where signals jump there, else by 0."""

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

        def along(
            tangent: Any, scaling: Array, dx: State, d_rate: State, moved: Array
        ) -> tuple[Step, tuple[State, ...]]:
            def scaled(d: State, rate: State, scaling: Array = scaling) -> State:
                return jax.tree.map(lambda d, k: d + scaling * k, d, rate)

            there = scaled(dx, rate.x, moved), scaled(d_rate, rate.x, -scaling)
            tangents = (tangent, scaling * t + moved, scaling * h - moved, *there)
            done, d = eqx.filter_jvp(bare, (s.system, t, h, x.x, rate.x), tangents)
            d = jax.tree.map(_or_zero, d, done, is_leaf=lambda x: x is None)
            # the rate at the start where that does not move, by how much rates change over the step
            change = jax.tree.map(lambda a, b: (b - a) / h, done.first, done.rate)
            first = scaled(scaled(d.first, change, -moved), done.first)
            return done, (d.x, first, scaled(d.rate, done.rate), d.error)

        moves = jnp.zeros_like(s.time_scaling) if moved is None else moved
        changes = s.tangents, s.time_scaling, x.derivatives, rate.derivatives, moves
        done, derivatives = jax.vmap(along, out_axes=(None, 0))(*changes)
        both = map(SensitivityState, (done.x, done.first, done.rate, done.error), derivatives)
        return done._replace(**dict(zip(("x", "first", "rate", "error"), both, strict=True)))

    return attempt


def after_jump(x: SensitivityState, before: State, after: State, moved: Float[Array, "p"]) -> SensitivityState:
    """State and sensitivities after a jump from one rate to another, at a time that moves by the parameters."""
    jumped = lambda d, a, b: d + jnp.multiply.outer(moved, a - b)  # noqa: E731
    return SensitivityState(x.x, jax.tree.map(jumped, x.derivatives, before, after))


def _or_zero(change: Array | None, value: Array | None) -> Array | None:
    """A change, 0 where nothing depends on what changes: the coordinates of a robot that has none."""
    return jnp.zeros_like(value) if change is None and value is not None else change


def allowed_sensitivity(rtol: Array, atol: Array | float, a: State, b: State) -> State:
    """Tolerance of sensitivities from a to b: atol, and rtol of the largest of one kind.

    Kinds are coordinates, velocities and load states. A kind that is negligible against the others has a small fraction
    of these as its scale: the velocities of a displaced robot, for instance, change by rounding errors only.
    """
    whole = _largest((a, b))
    if whole is None:  # nothing of the robot is unknown
        return a

    def of_kind(a: Any, b: Any) -> Any:
        kind = _largest((a, b))
        if kind is None:
            return a
        allowed = rtol * jnp.maximum(kind, _SHARE * whole) + atol
        return jax.tree.map(lambda x: jnp.broadcast_to(allowed.reshape(-1, *[1] * (x.ndim - 1)), x.shape), a)

    return State(of_kind(a.q, b.q), of_kind(a.v, b.v), of_kind(a.z, b.z))


def _largest(derivatives: Any) -> Float[Array, "p"] | None:
    """Largest magnitude of each of p sensitivities; None for an empty tree."""
    leaves = [jnp.abs(leaf).reshape(leaf.shape[0], -1) for leaf in jax.tree.leaves(derivatives) if leaf.size]
    return jnp.max(jnp.concatenate(leaves, axis=1), axis=1) if leaves else None
