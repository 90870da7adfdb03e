"""One cycle from a given state: how far it is from closing, and so for states close by."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Bool, Float

from nectosome.core import State, Status
from nectosome.core.linear_algebra import generalised_inverse
from nectosome.mechanism import Robot

from .integrate import Settings, begin, beside_at, integrate, interpolate
from .runge_kutta import rms
from .symmetry import Model, Symmetry, near

FIRST_STEP = 1e-4  # [s] of a cycle
_NOTHING = 1e-9  # elements of the gap's exact derivative below this are rounding errors
_SINGULAR = 1e-7  # singular values of a gap's derivative below this, over 1 or the largest: errors of differences


class CycleAttempt(NamedTuple):
    """One cycle from a given state."""

    states: State  # at the given times
    gap: Float[Array, "m"]  # between its ends, modulo the symmetry
    allowed: Float[Array, "m"]  # tolerance at the largest magnitudes of the cycle
    size: Float[Array, ""]  # of the gap over the tolerance; at most 1: closed
    flow: Float[Array, "m"]  # rates at the end, as displacements [1/s]
    status: Array  # of the time integration
    steps: Array  # that were accepted
    gaps: Float[Array, "p m"] | None = None  # of cycles from states close by

    @property
    def end(self) -> State:
        """State at the end."""
        return jax.tree.map(lambda x: x[-1], self.states)


def between(robot: Model, symmetry: Symmetry, a: State, b: State) -> Float[Array, "m"]:
    """Displacement from a to b, 0 along the symmetry and without whole turns of cranks."""
    displacement = robot.displacements(b.q) - robot.displacements(a.q)
    if symmetry.turns:
        turning = np.isin(np.arange(displacement.shape[0]), symmetry.turns)
        turns = jnp.round(displacement / (2 * jnp.pi))
        if symmetry.crank is not None:  # one turn, no more and no less, also of another period
            turns = turns.at[symmetry.crank].set(jnp.sign(displacement[symmetry.crank]))
        displacement -= jnp.where(turning, 2 * jnp.pi * turns, 0.0)
    displacement = jnp.where(symmetry.rates(displacement.shape[0]), 0.0, displacement)
    if symmetry.spin and isinstance(robot, Robot):
        displacement = displacement.at[:3].set(symmetry.tilt(robot, a.q, b.q))
    return jnp.concatenate([displacement, b.v - a.v, ravel_pytree(b.z)[0] - ravel_pytree(a.z)[0]])


def cycle(
    robot: Model,
    symmetry: Symmetry,
    x: State,
    times: Float[Array, "n"],
    settings: Settings,
    beside: State | None = None,
    with_them: Bool[Array, ""] | bool = True,
) -> CycleAttempt:
    """States at times that increase from 0 to the period, and the gap between the last and the first.

    So, if `with_them`, the gaps of cycles from states `beside` x, leaves [p, ...].
    """
    start = begin(jnp.zeros(()), x, settings, jnp.asarray(FIRST_STEP), beside)
    m, later = integrate(robot, start, times[1:], settings, with_them=with_them)
    states = jax.tree.map(lambda a, b: jnp.concatenate([a[None], b]), x, later)
    end = jax.tree.map(lambda x: x[-1], later)
    gap = between(robot, symmetry, x, end)
    allowed = tolerances(robot, states, settings)
    rate = jax.jvp(lambda t: interpolate(m, t), (times[-1],), (jnp.ones(()),))[1]
    flow = ravel_pytree((end.v, rate.v, rate.z))[0]
    gaps = None
    if m.beside is not None:
        gaps = jax.vmap(lambda a, b: between(robot, symmetry, a, b))(beside, beside_at(m, times[-1]))
    return CycleAttempt(states, gap, allowed, rms(gap / allowed), flow, m.status, m.steps - m.rejected, gaps)


def tolerances(robot: Model, states: State, settings: Settings) -> Float[Array, "m"]:
    """Tolerance of a time step, at the largest magnitudes of states [n, ...]."""
    numbers = jax.vmap(lambda x: ravel_pytree((robot.displacements(x.q), x.v, x.z))[0])(states)
    return settings.atol + settings.rtol * jnp.max(jnp.abs(numbers), axis=0)


def before_any(x: State, times: Float[Array, "n"], near: int | None = None) -> CycleAttempt:
    """Placeholder for the cycle before the first; it ends at x."""
    states = jax.tree.map(lambda x: jnp.broadcast_to(x, (times.shape[0], *x.shape)), x)
    gap = jnp.full(ravel_pytree((x.v, x.v, x.z))[0].shape, jnp.inf)
    solved, gaps = jnp.asarray(int(Status.SOLVED)), None if near is None else jnp.zeros((near, gap.size))
    return CycleAttempt(states, gap, jnp.ones(gap.shape), jnp.asarray(jnp.inf), gap, solved, jnp.zeros((), int), gaps)


def along_velocities(robot: Model, symmetry: Symmetry, x: State) -> Float[Array, "m m"]:
    """What makes displacements along the velocities of a gap, which is in coordinates."""
    nothing = jnp.zeros(ravel_pytree((x.v, x.v, x.z))[0].shape)
    return pseudo_inverse(jax.jacfwd(lambda y: between(robot, symmetry, x, near(robot, x, y)))(nothing))


def gap_inverse(J: Float[Array, "m m"]) -> Float[Array, "m m"]:
    """Generalised inverse of DPhi - 1, with rounding errors set to 0."""
    return generalised_inverse(jnp.where(jnp.abs(J) > _NOTHING, J, 0.0))


def pseudo_inverse(J: Float[Array, "m m"]) -> Float[Array, "m m"]:
    """Pseudoinverse; what changes a gap by no more than errors of differences is undetermined."""
    left, sizes, right = jnp.linalg.svd(J)
    known = sizes > _SINGULAR * jnp.maximum(jnp.max(sizes, initial=0.0), 1.0)
    return right.T @ jnp.where(known[:, None], left.T / jnp.where(known, sizes, 1.0)[:, None], 0.0)
