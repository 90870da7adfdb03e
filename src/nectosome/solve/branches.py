r"""Where a robot comes to rest from a shape: off an unstable equilibrium, on either side of it, or from its start.

Newton's method with directions of negative stiffness turned round: with the residual r and the symmetric part
$V \Lambda V^T$ of its derivative, corrections are $-V |\Lambda|^{-1} V^T r$ until the stiffness is positive, where they
are those of Newton's method. Of conservative loads they go downhill in energy, and leave saddles (Dauphin et al. 2014).
"""

from typing import Literal, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree
from jaxtyping import Array

from nectosome.core import Solution, State, Status
from nectosome.core.programs.remember import remembered
from nectosome.description import Rod
from nectosome.mechanism import Robot
from nectosome.units import InputError

from .small_motions import SmallMotion, Stability, small_motion, spectrum

Branch = Literal["first", "plus", "minus"]
"""The shape under growing loads, stable or not; those into which it falls from there, along what grows fastest, its
largest coordinate towards plus or minus."""

_MOST = 200  # corrections
_FARTHEST = 0.2  # [rad, m, 1] in one correction
_ASIDE = 0.1  # the same, beside an unstable equilibrium
_BALANCED = 1e-10  # largest residual relative to the largest force in it
_STILL = 1e-12  # [rad, m, 1] correction that counts as converged
_LEAST = 1e-6  # [largest stiffness] of what a correction divides by


@eqx.filter_jit
def settle(robot: Robot, x: State) -> Solution:
    """Equilibrium with a positive stiffness into which the robot falls from a state, under its loads at t = 0.

    Load states stay as they are. Status SOLVED or NO_EQUILIBRIUM.
    """
    zero, t = jnp.zeros_like(x.v), jnp.zeros(())

    def linearised(q: Array) -> tuple[Array, Array, Array]:
        """Residual, the largest one relative to the largest force in it, and the stiffness."""

        def at(w: Array) -> tuple[Array, tuple[Array, Array]]:
            acting = robot.forces(t, State(robot.advance(q, w, jnp.ones(())), zero, x.z), zero)
            r = acting.residual[robot.tree.free_v]
            inner = (acting.elastic - acting.joint - acting.paired)[robot.tree.free_v]
            scale = jnp.maximum(jnp.max(jnp.abs(inner)), jnp.max(jnp.abs(r - inner)))
            return r, (r, jnp.max(jnp.abs(r)) / jnp.maximum(scale, 1e-30))

        K, (r, rest) = jax.jacfwd(at, has_aux=True)(zero)
        return r, rest, K

    def going(it):
        _, (_, rest, _), size, k = it
        return (rest > _BALANCED) & (size > _STILL) & (k < _MOST)

    def correct(it):
        """Forces are traced here and nowhere else: the first correction is none."""
        q, (r, _, K), _, k = it
        stiffness, V = jnp.linalg.eigh(0.5 * (K + K.T))
        size = jnp.maximum(jnp.abs(stiffness), _LEAST * jnp.max(jnp.abs(stiffness)))
        dq = -jnp.where(stiffness[0] > 0, jnp.linalg.solve(K, r), V @ ((V.T @ r) / size))
        dq = dq * jnp.minimum(1.0, _FARTHEST / jnp.maximum(jnp.max(jnp.abs(dq)), 1e-30))
        q = robot.advance(q, dq, jnp.ones(()))
        return q, linearised(q), jnp.where(k < 0, jnp.inf, jnp.max(jnp.abs(dq))), k + 1

    start = x.q, (zero, jnp.asarray(jnp.inf), jnp.eye(zero.size)), jnp.asarray(jnp.inf), jnp.full((), -1)
    q, (_, rest, _), size, k = jax.lax.while_loop(going, correct, start)
    there = (rest <= _BALANCED) | (size <= _STILL)
    status = jnp.where(there, int(Status.SOLVED), int(Status.NO_EQUILIBRIUM))
    return Solution(State(q, zero, x.z), status, {"load": jnp.ones(()), "iterations": k}, rest)


class Fallen(NamedTuple):
    """The shape at rest that was chosen, and what it fell from."""

    found: Solution
    stability: Stability
    left: Stability | None = None  # of the unstable shape under growing loads; None where that one was chosen


def fallen(robot: Robot, found: Solution, branch: Branch | None) -> Fallen:
    """Choose the shape at rest of a robot with `frozen_drives`, of which `load_stepping` found one.

    That is the one into which it falls from its start where that one diverges or the start is bent, and else that one;
    or the one of a branch. Where load states have their own equilibria, it is always that one. Raises InputError for a
    branch that is not there.
    """
    motion = small_motion(robot, found.value)
    first = Fallen(found, motion.stability)
    if ravel_pytree(found.value.z)[0].size:
        if branch in ("plus", "minus"):
            raise InputError(f"{branch}: with states of loads or drives there is the first alone.", field="branch")
        return first
    if branch in ("plus", "minus"):
        if first.stability.kind != "diverges":
            words = f"{branch}: the shape under growing loads does not diverge ({first.stability}), so nothing falls"
            raise InputError(f"{words} from it. Leave it out.", field="branch")
        start = _aside(robot, found.value, motion, 1 if branch == "plus" else -1)
    elif branch is None and (_starts_bent(robot) or first.stability.kind == "diverges"):
        start = robot.initial()
    else:
        return first
    there = remembered(settle, robot, start)
    if int(there.status) == Status.SOLVED:
        stability = small_motion(robot, there.value).stability
        if stability.stable:
            return Fallen(there, stability, None if first.stability.stable else first.stability)
    if branch is not None:
        raise InputError(f"{branch}: nothing stable to fall into from the shape under growing loads.", field="branch")
    return first


def _starts_bent(robot: Robot) -> bool:
    """Whether a rod starts with strains beyond those at rest."""
    parts = {} if robot.description is None else robot.description.parts
    return any(isinstance(part, Rod) and part.start.given for part in parts.values())


def _aside(robot: Robot, x: State, motion: SmallMotion, side: int) -> State:
    """State beside an unstable equilibrium, along what grows fastest there; side 1 or -1, of its largest coordinate."""
    values, shapes = spectrum(jax.tree.map(np.asarray, motion))
    shape = np.real(shapes[:, int(np.argmax(np.real(values)))])
    largest = shape[int(np.argmax(np.abs(shape)))]
    w = jnp.asarray(side * _ASIDE * shape / largest)
    return State(robot.advance(x.q, w, jnp.ones(())), x.v, x.z)
