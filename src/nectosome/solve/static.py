"""Static equilibrium of a robot: its shape under steady loads, with frozen drives."""

from collections.abc import Iterable
from typing import ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core import Constant, Solution, State, Status
from nectosome.core.remember import remembered
from nectosome.mechanism import Robot
from nectosome.model import RobotLike, robot_of
from nectosome.units import InputError

from .load_stepping import load_stepping
from .results import Run, Trajectory

_NEUTRAL = 1e-9  # [largest stiffness] below, stiffness is rounding


class Static(Run):
    """Static equilibrium: a Run of one instant. `stats["load"]` is the share of the loads it was followed to."""

    loose: tuple[str, ...] = eqx.field(static=True, kw_only=True)  # coordinates without stiffness, if unsolved
    title: ClassVar[str] = "at rest"

    @property
    def state(self) -> State:
        """State at rest."""
        return jax.tree.map(lambda x: x[0], self.value.state)


def static(robot: RobotLike, *, settings: Iterable[str] = ()) -> Static:
    """Static equilibrium of a robot under weight, buoyancy, a current and other steady loads, by `load_stepping`.

    The robot is given by name, path, description or built, with `settings` such as "E=3MPa". Prescribed joints are held
    where they are at t = 0; drives push as they do then. Status SOLVED; UNSTABLE where small disturbances grow (the
    equilibrium is handed over all the same); NO_EQUILIBRIUM where there is none, with the coordinates in `loose` that
    no load, spring or rod holds. Raises InputError for what is no robot, and where nothing is free to move.
    """
    robot = robot_of(robot, settings)
    if not robot.tree.free_v.size:
        raise InputError("nothing of this robot is free to move: there is no shape to be found.")
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
    """Robot whose prescribed joints stay where they are at t = 0; its description stays that of the moving one."""
    parts = tuple(
        part
        if part.prescribed is None
        else eqx.tree_at(lambda p: p.prescribed, part, Constant(part.prescribed(jnp.zeros(()))[0]))
        for part in robot.tree.parts
    )
    return eqx.tree_at(lambda r: r.tree.parts, robot, parts).described(robot.description)


def _static_of(robot: Robot) -> Solution:
    return load_stepping(robot)


def _stiffness(robot: Robot, x: State) -> Float[Array, "n n"]:
    """Derivative of the residual by the coordinates, under all loads."""
    zero = jnp.zeros_like(x.v)

    def residual(w: Array) -> Array:
        moved = State(robot.advance(x.q, w, jnp.ones(())), zero, x.z)
        return robot.residual(jnp.zeros(()), moved, zero)

    return jax.jacfwd(residual)(zero)
