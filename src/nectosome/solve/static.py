"""Static equilibrium of a robot: its shape under steady loads, with frozen drives."""

from typing import ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core import Constant, Solution, State, Status
from nectosome.core.remember import remembered
from nectosome.mechanism import Robot

from .load_stepping import load_stepping
from .results import Run, Trajectory

_NEUTRAL = 1e-9  # [largest stiffness] below, stiffness is rounding


class Static(Run):
    """Static equilibrium: a Run with one sample. `stats["load"]` is the fraction of the loads that was reached."""

    loose: tuple[str, ...] = eqx.field(static=True, kw_only=True)  # coordinates without stiffness, if unsolved
    title: ClassVar[str] = "at rest"


def static(robot: Robot) -> Static:
    """Static equilibrium under weight, buoyancy, a current and other steady loads.

    Prescribed joints and drives are frozen at t = 0. Status SOLVED; UNSTABLE if small disturbances grow (the shape is
    returned); NO_EQUILIBRIUM if there is none, with the coordinates without stiffness in `loose`. Raises ValueError for
    a robot without free coordinates.
    """
    if not robot.tree.free_v.size:
        raise ValueError("nothing of this robot is free to move: there is no shape to be found.")
    robot = frozen_drives(robot)
    found: Solution = remembered(_static_of, robot)
    status, loose = Status(int(found.status)), ()
    if status == Status.SOLVED and float(found.stats["stability"]) < -_NEUTRAL:
        status = Status.UNSTABLE
    if status == Status.NO_EQUILIBRIUM:
        stiffness = np.abs(np.asarray(remembered(_stiffness, robot, found.value)))
        free = stiffness.max(axis=0) <= _NEUTRAL * stiffness.max()
        loose = tuple(name for name, is_free in zip(robot.coordinate_names, free, strict=True) if is_free)
    trajectory = Trajectory(robot, jnp.zeros(1), jax.tree.map(lambda x: jnp.asarray(x)[None], found.value))
    return Static(trajectory, jnp.asarray(int(status)), found.stats, found.residual, loose=loose)


def frozen_drives(robot: Robot) -> Robot:
    """Robot with its prescribed joints fixed at their positions at t = 0."""
    parts = tuple(
        part
        if part.prescribed is None
        else eqx.tree_at(lambda p: p.prescribed, part, Constant(part.prescribed(jnp.zeros(()))[0]))
        for part in robot.tree.parts
    )
    return eqx.tree_at(lambda r: r.tree.parts, robot, parts)


def _static_of(robot: Robot) -> Solution:
    return load_stepping(robot)


def _stiffness(robot: Robot, x: State) -> Float[Array, "n n"]:
    """Derivative of the residual by the coordinates, under all loads."""
    zero = jnp.zeros_like(x.v)

    def residual(w: Array) -> Array:
        moved = State(robot.advance(x.q, w, jnp.ones(())), zero, x.z)
        return robot.residual(jnp.zeros(()), moved, zero)

    return jax.jacfwd(residual)(zero)
