r"""Robots in a stream: seen from the water, nothing changes (Galileo).

A robot that is free to go along with a uniform current c obeys the equations of still water in the frame that moves
with c: with the states x of a motion there, the motion seen from the ground has $p + c\,t$ and $\dot p + c$. Cycles and
steady motions are solved in still water, and moved; so Newton's method does not drift with the water.

Speeds that judge swimming are relative to the water. Legs on the floor carry a robot over the ground: its are those.
"""

from dataclasses import replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Float

from nectosome.core import State, UniformCurrent
from nectosome.core.programs.remember import remembered
from nectosome.core.rows import rows
from nectosome.core.se3 import dot, dot_t, matmul3
from nectosome.core.tracers import Untraced
from nectosome.loads import Leg
from nectosome.mechanism import SLIDES, Robot, continuous_loops, stand_in

_SAME = 1e-9  # relative difference that counts as equal
_SAMPLES = 3


def stands(robot: Robot) -> bool:
    """Whether legs carry a robot over the floor, so that it is judged by the ground, not by the water."""
    return robot.water.floor is not None and any(isinstance(g.load, Leg) for g in robot.load_groups.acting)


def water_velocity(robot: Robot, time: Float[Array, "n"], position: Float[Array, "n 3"]) -> Float[Array, "n 3"]:
    """Velocity [m/s] of what a robot is judged by, at points [m]: of the water; 0 where it `stands`."""
    if robot.water.current is None or stands(robot):
        return jnp.zeros(position.shape)
    return jax.vmap(lambda t, x: robot.water.flow(t, x[None])[0][0])(time, position)


def goes_along(robot: Robot) -> bool:
    """Whether a uniform current carries a robot along, so that its equations are those of still water beside it.

    Its one root slides freely along the current, and random states have the same forces and rates in both. Of a traced
    robot it is that of its `stand_in`.
    """
    roots = [part for part in robot.tree.structure if part.parent < 0]
    slides = len(roots) == 1 and not roots[0].prescribed and {*roots[0].joint.names} & SLIDES
    if not slides or not isinstance(robot.water.current, UniformCurrent) or stands(robot):
        return False
    return float(remembered(_difference, continuous_loops(stand_in(robot)))) < _SAME


def in_still_water(robot: Robot) -> Robot:
    """The robot without a current."""
    like = robot.example.value
    example = Untraced(like and in_still_water(like))
    return replace(robot, water=replace(robot.water, current=None), example=example)


def with_stream(robot: Robot, time: Float[Array, "n"], states: State) -> State:
    """States [n, ...] of a motion in still water as they are in the robot's current, seen from the ground."""
    return jax.vmap(lambda t, x: in_stream(robot, t, x))(time, states)


def in_stream(robot: Robot, t: Float[Array, ""], x: State, times: Any = 1.0) -> State:
    """A state of still water as it is in so many times the robot's current at t; with -1 back again."""
    drift = _drift(robot, x.q, times)
    return State(robot.advance(x.q, drift, t), x.v + drift, x.z)


def _drift(robot: Robot, q: Float[Array, "nq"], times: Any) -> Float[Array, "nv"]:
    """Unknown velocities of a robot that goes along with so many times the current."""
    current, root = robot.water.current, robot.tree.one(0)
    assert isinstance(current, UniformCurrent)
    motion = root.joint.motion(q[: root.joint.nq])
    slides = np.isin([*root.joint.names], [*SLIDES])
    along = motion.subspace[:, 3:] @ dot_t(matmul3(root.rotation, motion.rotation), times * current.velocity)
    return jnp.zeros(robot.tree.free_v.size).at[: root.joint.nv].set(jnp.where(slides, along, 0.0))


def _difference(robot: Robot) -> Float[Array, ""]:
    """Largest relative change, by the current, of forces, of rates of load states and of velocities in the water."""
    rest, one, current = robot.initial(), jnp.ones(()), robot.water.current
    assert isinstance(current, UniformCurrent)
    n = rest.v.shape[0]
    draws = 0.3 * jax.random.normal(jax.random.key(3), (_SAMPLES, 3, n))

    def seen(draw: Array, share: Any) -> tuple[Array, Array, Array]:
        q, v, a = draw
        there = replace(robot, water=replace(robot.water, current=UniformCurrent(share * current.velocity)))
        q, t = robot.advance(rest.q, q, one), 0.7 * one
        a += jax.jvp(lambda h: _drift(robot, robot.advance(q, v, h), share), (jnp.zeros(()),), (one,))[1]
        x = in_stream(robot, t, State(q, rest.v + v, rest.z), share)
        every = robot.tree.complete(t, x.q, x.v)
        shape = robot.tree.shape(every[0])
        twist, _ = there.relative(t, shape, *2 * [robot.tree.twists(shape, every[1])])
        moves = dot(rows(shape.rotation, np.zeros(1, int)), rows(twist[:, 3:], np.zeros(1, int)))
        return there.residual(t, x, a), ravel_pytree(there.state_rates(t, x))[0], moves

    both = jax.lax.map(lambda share: jax.vmap(lambda draw: seen(draw, share))(draws), jnp.array([0.0, 1.0]))
    sizes = (jnp.max(jnp.abs(x[0]), initial=0.0) for x in both)
    changes = (jnp.max(jnp.abs(x[1] - x[0]), initial=0.0) for x in both)
    return jnp.max(jnp.stack([a / jnp.maximum(b, 1e-12) for a, b in zip(changes, sizes, strict=True)]))
