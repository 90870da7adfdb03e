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
from jaxtyping import Array, Bool, Float

from nectosome.core import Solution, State, Status
from nectosome.core.linear_algebra import generalised_inverse
from nectosome.core.programs.remember import remembered
from nectosome.description import PrismaticJoint, RevoluteJoint, RobotDescription, Rod
from nectosome.description.parts import Limb
from nectosome.loads import Spring
from nectosome.mechanism import Robot
from nectosome.units import InputError

from .equilibrium import changed, no_change, solvable
from .small_motions import SmallMotion, Stability, small_motion, spectrum

Branch = Literal["first", "plus", "minus"]
"""The shape under growing loads, stable or not; those into which it falls from there, along what grows fastest, its
largest coordinate towards plus or minus. Of one that does not diverge: that itself, and what its image falls into."""

_MOST = 200  # corrections
_FARTHEST = 0.2  # [rad, m, 1] in one correction
_ASIDE = 0.1  # the same, beside an unstable equilibrium
_BALANCED = 1e-10  # largest residual relative to the largest force in it
_STILL = 1e-12  # [rad, m, 1] correction that counts as converged
_LEAST = 1e-12  # [largest stiffness] of what a correction divides by
_LOOSE = 1e-12  # [largest stiffness] below, a stiffness is rounding
_SAME = 1e-6  # [displacement from no loads] change below which a shape is the same
_NEUTRAL = 1e-9  # [largest stiffness] below, that of a coordinate is rounding
_NAMED, _SHARE = 4, 1e-6  # coordinates of a direction that are named, and [largest] the least that counts
RUNS_ON = 1e-9  # [1/s] rate of a load state that nothing brings to 0


class _Fall(NamedTuple):
    """Corrections on the way into an equilibrium."""

    q: Array
    z: Array  # load states
    r: Array  # unbalanced forces, and rates of load states
    rest: Array  # largest of these forces relative to the largest one in it
    scale: Array  # that one
    K: Array  # derivatives of r
    size: Array  # of the last correction
    moved: Array  # the same of the load states, relative
    firm: Array  # whether it was held in all directions before the last correction
    k: Array


def with_states_at_rest(K: Float[Array, "m m"], n: int) -> tuple[Float[Array, "n n"], Float[Array, "k k"]]:
    """Stiffness of n displacements with load states at rest with them, and the inverse of what these states follow."""
    (A, B), (C, D) = (jnp.split(rows, [n], axis=1) for rows in jnp.split(K, [n]))
    follows = generalised_inverse(D)
    return A - B @ follows @ C, follows


def stiffnesses(K: Float[Array, "n n"]) -> tuple[Float[Array, "n"], Float[Array, "n n"], Bool[Array, "n"]]:
    """Singular values of a stiffness, the largest first, their directions, and which have none but by rounding."""
    _, size, V = jnp.linalg.svd(K)
    return size, V, size <= _LOOSE * size[0]


@eqx.filter_jit
def settle(robot: Robot, x: State, falls: Bool[Array, ""] | bool = True) -> Solution:
    """Equilibrium with a positive stiffness into which the robot falls from a state, under its loads at t = 0.

    Or the nearest one, of any stiffness, where it does not fall: Newton's method alone. Load states are at rest with
    it; the stiffness is that with them. Status SOLVED, or NO_EQUILIBRIUM, as where it has no stiffness along something.
    """
    t, still, (z0, unravel) = jnp.zeros(()), jnp.zeros_like(x.v), ravel_pytree(x.z)
    z0, n = jnp.asarray(z0, float), still.size
    weight = jnp.sum(robot.weight()) * robot.water.gravity

    def linearised(q: Array, z: Array) -> tuple[Array, Array, Array, Array]:
        """Residual, the largest one relative to the largest force in it, that force, and the derivatives."""
        here = State(q, still, unravel(z))

        def at(y: Array) -> tuple[Array, tuple[Array, Array, Array]]:
            there = changed(robot, here, y)
            acting = robot.forces(t, there, still)
            r = acting.residual[robot.tree.free_v]
            inner = (acting.elastic - acting.joint - acting.paired)[robot.tree.free_v]
            scale = jnp.maximum(jnp.max(jnp.abs(inner)), jnp.max(jnp.abs(r - inner)))
            every = jnp.concatenate([r, ravel_pytree(robot.state_rates(t, there))[0]])
            return every, (every, jnp.max(jnp.abs(r)) / jnp.maximum(scale, 1e-30), scale)

        J, (r, rest, scale) = jax.jacfwd(at, has_aux=True)(no_change(here))
        K, rates, free = solvable(J, r, n)
        return rates, jnp.where(jnp.any(free[n:] & (jnp.abs(r[n:]) > RUNS_ON)), jnp.inf, rest), scale, K

    def balanced(it: _Fall) -> Array:
        still = (it.rest <= _BALANCED) | ((it.size <= _STILL) & jnp.isfinite(it.rest))
        return still & (it.moved <= _BALANCED) & it.firm

    def correct(it: _Fall) -> _Fall:
        """Forces are traced here and nowhere else: the first correction is none."""
        K, follows = with_states_at_rest(it.K, n)
        B, C = it.K[:n, n:], it.K[n:, :n]
        r = it.r[:n] - B @ follows @ it.r[n:]
        # on what is loose nothing depends; where nothing pushes it either, it stays where it is
        size, V, loose = stiffnesses(K)
        idle = loose & (jnp.abs(V @ r) <= _BALANCED * jnp.maximum(it.scale, weight))
        stays = V.T @ jnp.where(idle[:, None], V, 0.0)
        moves = jnp.eye(n) - stays
        K, r = moves @ K @ moves + jnp.maximum(size[0], 1e-30) * stays, moves @ r
        stiffness, V = jnp.linalg.eigh(0.5 * (K + K.T))
        size, largest = jnp.abs(stiffness), jnp.max(jnp.abs(stiffness))
        firm = (jnp.min(size) > _LOOSE * largest) | ~jnp.asarray(falls)
        size = jnp.maximum(size, jnp.maximum(_LEAST * largest, 1e-30))
        dq = -jnp.where((stiffness[0] > 0) | ~jnp.asarray(falls), jnp.linalg.solve(K, r), V @ ((V.T @ r) / size))
        dq = moves @ dq
        dq = dq * jnp.minimum(1.0, _FARTHEST / jnp.maximum(jnp.max(jnp.abs(dq)), 1e-30))
        dz = -follows @ (it.r[n:] + C @ dq)
        q, z = robot.advance(it.q, dq, jnp.ones(())), it.z + dz
        moved = jnp.max(jnp.abs(dz), initial=0.0) / (1 + jnp.max(jnp.abs(z), initial=0.0))
        r, rest, scale, K = linearised(q, z)
        size = jnp.where(it.k < 0, jnp.inf, jnp.max(jnp.abs(dq)))
        return _Fall(q, z, r, rest, scale, K, size, moved, firm & (it.k >= 0) | ~jnp.asarray(falls), it.k + 1)

    m, far = n + z0.size, jnp.asarray(jnp.inf)
    start = _Fall(x.q, z0, jnp.zeros(m), far, far, jnp.eye(m), far, jnp.zeros(()), jnp.asarray(False), jnp.full((), -1))
    it = jax.lax.while_loop(lambda it: ~balanced(it) & (it.k < _MOST), correct, start)
    turning = jnp.any(jnp.concatenate([jnp.zeros(1), *robot.load_groups.crank_speeds]) != 0)
    status = jnp.where(balanced(it) & ~turning, int(Status.SOLVED), int(Status.NO_EQUILIBRIUM))
    stats = {"load": 1.0 * balanced(it), "iterations": it.k}
    return Solution(State(it.q, still, unravel(it.z)), status, stats, it.rest)


def hangs(robot: Robot) -> bool:
    """Whether a joint is free that no spring, drive, tendon or other part holds: it has no shape under no loads."""
    tree, loads = robot.tree, robot.load_groups
    if loads.pairs or loads.tendons:
        return False
    held = {i for g in loads.on_joints if isinstance(g.load, Spring) for i in g.parts}
    held |= {i for g in robot.powered.groups for i in g.parts}
    return any(part.joint.nv and not part.prescribed and i not in held for i, part in enumerate(tree.structure))


def loose_directions(robot: Robot, motion: SmallMotion) -> tuple[str, ...]:
    """Coordinates that have no stiffness about a state at rest, and combinations of others that have none.

    Those are "first.position and second.position together (1 : -0.5)", with the largest displacements [rad, m, 1].
    """
    n, names = motion.mass.shape[0], robot.coordinate_names
    at, speeds, states = np.split(motion.jacobian[n:], [n, 2 * n], axis=1)
    J = jnp.concatenate([at, states, speeds] if states.size else [at], axis=1)
    K = np.asarray(with_states_at_rest(solvable(J, jnp.zeros(len(J)), n)[0], n)[0])
    if not np.isfinite(K).all():  # no state was found, as of what sinks
        return ()
    free = np.abs(K).max(axis=0) <= _NEUTRAL * np.abs(K).max()
    own, (_, size, V) = np.flatnonzero(~free), np.linalg.svd(K[:, ~free])
    rows = V[size <= _LOOSE * size.max(initial=0.0)]
    for i in range(len(rows)):  # each has a coordinate of its own: Gauss-Jordan elimination, with the largest pivots
        k, j = np.unravel_index(np.argmax(np.abs(rows[i:])), rows[i:].shape)
        rows[[i, k + i]] = rows[[k + i, i]]
        rows[i] /= rows[i, j]
        rows -= np.where(np.arange(len(rows)) == i, 0.0, rows[:, j])[:, None] * rows[i]
    return (*(names[i] for i in np.flatnonzero(free)), *(_combined([names[i] for i in own], row) for row in rows))


def _combined(names: list[str], row: Float[np.ndarray, "n"]) -> str:
    largest = [i for i in np.argsort(-np.abs(row), kind="stable") if abs(row[i]) > _SHARE * np.abs(row).max()]
    shown, more = largest[:_NAMED], len(largest) - _NAMED
    *first, last = [names[i] for i in shown] + [f"{more} more"] * (more > 0)
    ratio = " : ".join(f"{row[i]:.3g}" for i in shown)
    return f"{', '.join(first)} and {last} together ({ratio})" if first else last


class Fallen(NamedTuple):
    """The shape at rest that was chosen, and what it fell from."""

    found: Solution
    stability: Stability
    left: Stability | None = None  # of the unstable shape under growing loads; None where that one was chosen


def fallen(robot: Robot, found: Solution, branch: Branch | None) -> Fallen:
    """Choose the shape at rest of a robot with `frozen_drives`, of which `load_stepping` found one.

    That is the one into which it falls from its start where that one diverges or the start is bent, and else that one;
    or the one of a branch. Raises InputError for a branch that is not there.
    """
    motion = small_motion(robot, found.value)
    first = Fallen(found, motion.stability)
    if branch in ("plus", "minus"):
        if first.stability.kind != "diverges":
            return _across(robot, first, branch)
        start = _aside(robot, found.value, motion, 1 if branch == "plus" else -1)
    elif branch is None and leaves_first(robot.description, first.stability):
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


def _across(robot: Robot, first: Fallen, branch: str) -> Fallen:
    """The shape on a side of one that does not diverge: that itself, or the one into which its mirror image falls.

    Sides are those of its largest coordinate, and the image is that in the shape under no loads. Raises InputError
    where it falls back, or to nothing stable.
    """
    x, name = first.found.value, robot.coordinate_names
    at = np.asarray(robot.displacements(x.q))
    w = at - np.asarray(remembered(_unloaded, robot))
    k = int(np.argmax(np.abs(w)))
    if (w[k] > 0) == (branch == "plus"):
        return first
    there = remembered(settle, robot, State(robot.coordinates(jnp.asarray(at - 2 * w)), x.v, x.z))
    falls = "falls into nothing stable"
    if int(there.status) == Status.SOLVED:
        stability = small_motion(robot, there.value).stability
        if float(robot.displacements(there.value.q)[k] - at[k]) * w[k] < -_SAME * w[k] ** 2:
            if stability.stable:
                return Fallen(there, stability)
        else:
            falls = "falls back to it"
    part, own, *order = name[k].split(".")
    limb, here, there = "body" if part == "body" else f"limbs.{part}", f"{at[k]:.3g}", f"{at[k] - 2 * w[k]:.3g}"
    shape = f"the shape under growing loads, with {name[k]} at {here}, does not diverge ({first.stability})"
    how = f"{limb}.start={{{own}: {there}rad/m}}" if order else f"{limb}.joint.position={there}rad"
    tried = f"{branch}: {shape}. Its mirror image, at {there}, {falls}"
    raise InputError(f'{tried}. Other starts may not: --set "{how}" with other numbers.', field="branch")


def _unloaded(robot: Robot) -> Array:
    """Displacements of the shape under no loads, as springs and rods alone have it, from the start on."""
    t, x = jnp.zeros(()), robot.initial()
    still, at = jnp.zeros_like(x.v), robot.displacements(x.q)

    def inner(w: Array) -> Array:
        acting = robot.forces(t, State(robot.coordinates(w), still, x.z), still)
        return (acting.elastic - acting.joint - acting.paired)[robot.tree.free_v]

    return at - generalised_inverse(jax.jacfwd(inner)(at)) @ inner(at)


def leaves_first(robot: RobotDescription | None, first: Stability) -> bool:
    """Whether a robot leaves the shape under growing loads: that one diverges, or a rod or a spring starts bent."""
    parts = {} if robot is None else robot.parts
    return first.kind == "diverges" or any(map(_starts_bent, parts.values()))


def _starts_bent(part: Limb) -> bool:
    j = part.joint
    off = isinstance(j, RevoluteJoint | PrismaticJoint) and j.motion is None and j.position != j.rest
    return off or (isinstance(part, Rod) and part.start.given)


def _aside(robot: Robot, x: State, motion: SmallMotion, side: int) -> State:
    """State beside an unstable equilibrium, along what grows fastest there; side 1 or -1, of its largest coordinate."""
    values, shapes = spectrum(jax.tree.map(np.asarray, motion))
    shape = np.real(shapes[:, int(np.argmax(np.real(values)))])
    largest = shape[int(np.argmax(np.abs(shape)))]
    w = jnp.asarray(side * _ASIDE * shape / largest)
    return State(robot.advance(x.q, w, jnp.ones(())), x.v, x.z)
