"""Symmetry of a robot's equations: the directions along which a steady motion may drift."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Float

from nectosome.core import State
from nectosome.core.programs.remember import remembered
from nectosome.core.rows import on_device
from nectosome.core.se3 import dot_t, matmul3
from nectosome.core.tracers import without_derivatives
from nectosome.mechanism import Free, InPlane, Robot, Spherical, continuous_loops, stand_in

_SAME = 1e-9  # relative difference of residuals that counts as equal
_SAMPLES = 3
_SHARES = 1e-3, 0.29, 0.58, 0.87  # of a period, at which it is tried

Model = Robot | InPlane


class Symmetry(eqx.Module):
    """Directions of the unknown velocities along which the equations are invariant.

    `drift`: velocities along invariant directions. `spin`: the first three velocities are the angular velocity of a
    root, invariant about the vertical only. `steady`: drives and loads do not depend on time. `turns`: angles of joints
    that may go on by whole turns, such as those of cranks. `crank`: the one of them whose turn is a cycle of a robot
    that finds its own period (see `turns.with_crank`).
    """

    drift: tuple[int, ...] = eqx.field(static=True)
    spin: bool = eqx.field(static=True)
    steady: bool = eqx.field(static=True)
    turns: tuple[int, ...] = eqx.field(static=True, default=())
    crank: int | None = eqx.field(static=True, default=None)

    def rates(self, n: int) -> np.ndarray:
        """Mask of the unknowns that are rates; the others are displacements."""
        return np.isin(np.arange(n), [*self.drift, *([2] if self.spin else [])])

    def velocities(self, robot: Robot, q: Float[Array, "nq"], rates: Float[Array, "nv"]) -> Float[Array, "nv"]:
        """Velocities of the motion with these rates: along the drift, rates[2] [rad/s] about the vertical, else 0."""
        v = jnp.where(np.isin(np.arange(rates.shape[0]), self.drift), rates, 0.0)
        return v.at[:3].set(_in_root_frame(robot, q, rates[2] * _UP)) if self.spin else v

    def along(self, robot: Robot, x: State) -> Float[Array, "nv"]:
        """Rates of a state: its velocities along the symmetry, else 0."""
        rates = jnp.where(self.rates(x.v.shape[0]), x.v, 0.0)
        if not self.spin:
            return rates
        up = _in_root_frame(robot, x.q, jnp.asarray(_UP))
        return rates.at[2].set(jnp.sum(up * x.v[:3]))

    def displace(self, robot: Robot, q: Float[Array, "nq"], by: Float[Array, "nv"]) -> Float[Array, "nq"]:
        """Coordinates displaced by the components of `by` that are not rates; by[:2] tilts a spinning root [rad]."""
        by = jnp.where(self.rates(by.shape[0]), 0.0, by)
        if self.spin:
            by = by.at[:3].set(_in_root_frame(robot, q, by[:3]))
        return robot.advance(q, by, jnp.ones(()))

    def tilt(self, robot: Robot, a: Float[Array, "nq"], b: Float[Array, "nq"]) -> Float[Array, "3"]:
        """Tilt of a spinning root from a to b: the cross product of the verticals in its own frame."""
        up = jnp.asarray(_UP)
        return jnp.cross(_in_root_frame(robot, b, up), _in_root_frame(robot, a, up))


_UP = np.array([0.0, 0.0, 1.0])


def near(robot: Model, x: State, y: Float[Array, "m"]) -> State:
    """State displaced by y: coordinates along the velocities, velocities, load states."""
    n = x.v.shape[0]
    z, unravel = ravel_pytree(x.z)
    return State(robot.advance(x.q, y[:n], jnp.ones(())), x.v + y[n : 2 * n], unravel(z + y[2 * n :]))


def find_symmetry(robot: Robot) -> Symmetry:
    """Symmetry of a robot, found numerically: random states must have the same residual after a displacement.

    A robot without free coordinates has no symmetry and no steady motion. Loops of servos count as continuous: what
    they hold between updates depends on neither place nor time. Of a traced robot it is that of its `stand_in`.
    """
    like = stand_in(robot)
    robot = continuous_loops(like)
    if not robot.tree.free_v.size:
        return Symmetry((), False, False)
    coordinates, turned, heading, time, _ = (np.asarray(x) < _SAME for x in remembered(_changes, like, on_device(1.0)))
    drift = set(np.flatnonzero(coordinates).tolist())
    turning = {0, 1, 2} if _turns(robot) else set()
    spin = bool(turning) and not turning <= drift and bool(heading)
    if not turning <= drift:
        drift -= turning
    hinged = [name.endswith(".angle") for name in robot.coordinate_names]
    turns = set(np.flatnonzero(turned & np.array(hinged)).tolist()) - drift
    return Symmetry(tuple(sorted(drift)), spin, bool(time), tuple(sorted(turns)))


def change_over(robot: Robot, period: Any) -> Array:
    """Relative change of the residual over a period [s], at a few random states, by the program of `find_symmetry`."""
    return remembered(_changes, *without_derivatives((robot, period)))[-1]


def _turns(robot: Robot) -> bool:
    root = robot.tree.structure[0]
    return issubclass(root.joint, Free | Spherical) and not root.prescribed


def _in_root_frame(robot: Robot, q: Array, vector: Array) -> Array:
    """Vector of the world in the root frame."""
    root = robot.tree.one(0)
    turned = root.joint.motion(q[: root.joint.nq]).rotation
    return dot_t(matmul3(root.rotation, turned), vector)


def _changes(robot: Robot, period: Array) -> tuple[Array, Array, Array, Array, Array]:
    """Relative changes of the residual with each coordinate [nv], by a turn of each, with the heading, with time, and
    over a period.

    A turn is 2 pi of any coordinate, also of a slide, where it means nothing. The first time of a period is just after
    the start, at the beginning of a recording.
    """
    robot = continuous_loops(robot)
    rest, one = robot.initial(), jnp.ones(())
    n = rest.v.shape[0]
    draws = 0.3 * jax.random.normal(jax.random.key(1), (_SAMPLES, 3, n))
    shares = jnp.array(_SHARES)

    def residuals(draw: Array) -> Array:
        """At a state, with each coordinate displaced, and by a turn, with a new heading, later, and a period apart."""
        q, v, a = draw
        q = robot.advance(rest.q, q, one)
        turn = (
            jnp.zeros(n).at[:3].set(_in_root_frame(robot, q, jnp.asarray(0.7 * _UP))) if _turns(robot) else jnp.zeros(n)
        )
        each = [size * jnp.eye(n) for size in (0.7, 2 * jnp.pi)]
        moves = jnp.concatenate([jnp.zeros((1, n)), *each, turn[None], jnp.zeros((1 + 2 * shares.size, n))])
        times = jnp.concatenate([jnp.zeros(2 * n + 2), jnp.array([0.37]), shares * period, (shares + 1) * period])

        def one_place(place: tuple[Array, Array]) -> Array:
            move, t = place
            return robot.residual(t, State(robot.advance(q, move, one), rest.v + v, rest.z), a)

        return jax.lax.map(one_place, (moves, times))

    r = jax.lax.map(residuals, draws)
    now, later = jnp.split(r[:, 2 * n + 3 :], 2, axis=1)
    over = jnp.max(jnp.max(jnp.abs(later - now), axis=2) / jnp.max(jnp.abs(now), axis=2))
    change = jnp.max(jnp.abs(r[:, 1:] - r[:, :1]), axis=2) / jnp.max(jnp.abs(r[:, :1]), axis=2)
    change = jnp.max(change, axis=0)
    return change[:n], change[n : 2 * n], change[2 * n], change[2 * n + 1], over
