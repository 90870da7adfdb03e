"""Steady swims of the flagellum, each found from the one before, and what it gives to its body over a turn.

Over a turn only thrust and axial torque remain (section II).
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import xarray as xr
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Bool, Float

from nectosome.core import State, Status
from nectosome.core.programs.remember import remembered
from nectosome.core.se3 import cross, dot
from nectosome.description import RobotDescription
from nectosome.designs import MotionDesign, shipped_problem
from nectosome.mechanism import Robot
from nectosome.model import build
from nectosome.solve import simulate

_COMPONENTS = ["moment x", "moment y", "moment z", "force x", "force y", "force z"]


class Swim(NamedTuple):
    """A steady swim."""

    speed: float  # forward [m/s]
    torque: float  # of the motor [N m]
    state: State


def design_task(base: RobotDescription) -> MotionDesign:
    """Design problem that ships for the flagellum: the paper's variables, bounds and limit of torque."""
    problem = shipped_problem("flagellum")
    if problem is None:
        raise RuntimeError("the design problem of the flagellum is not there")
    return problem.motion(base)


class Swimmer:
    """Swims of one robot, which may turn at other rates; all robots with the same strains share one program."""

    def __init__(self, description: RobotDescription):
        self._task = design_task(description)
        self._evaluate = self._task.prepare()
        self._place = self._task.box.design(description)
        self._unravel = ravel_pytree(build(description).initial())[1]
        self._memory = None

    def swim(self, rate: float | None = None) -> Swim:
        """Steady swim at a motor speed [rad/s], that of the description by default.

        Raises RuntimeError with the reason where there is none.
        """
        u = self._place.copy()
        if rate is not None:
            k = self._task.names.index("omega")
            low, high = self._task.box.ends[k]
            u[k] = (rate - low) / (high - low)
        e = self._evaluate(u, False, self._memory)
        if e.memory is None:
            raise RuntimeError(f"no steady swim of {self._task.description.name}: {e.reason}")
        self._memory = e.memory
        return Swim(e.outputs["speed"], e.outputs["torque"], self._unravel(jnp.asarray(e.memory)))


def reaction_over_a_turn(robot: Robot, x: State, rate: float, parts: tuple[str, ...]) -> xr.Dataset:
    """Wrench [N m, N] of turning parts on what carries them, about the body's first station, in the world's axes.

    The robot is simulated from x for one turn at `rate` [rad/s]; 200 equal intervals. Raises RuntimeError where
    the simulation fails.
    """
    run = simulate(robot, 2 * np.pi / rate, rtol=1e-8, atol=1e-10, initial=x)
    if int(run.status) != Status.SOLVED:
        raise RuntimeError(f"one turn of the flagellum: {Status(int(run.status)).reason}")
    carried = np.isin(robot.tree.names, parts)
    wrench = np.asarray(remembered(_wrenches, robot, run.value.time, run.value.state, carried))[:-1]
    time = np.asarray(run.value.time)[:-1]
    return xr.Dataset(
        {"wrench": (("time", "component"), wrench, {"units": "N m, N"})},
        coords={"time": ("time", time, {"units": "s"}), "component": _COMPONENTS},
    )


def _wrenches(robot: Robot, time: Array, x: State, carried: Bool[Array, "parts"]) -> Float[Array, "n 6"]:
    """Loads and inertia of the carried parts at all times, summed about the body's first station."""
    owner = robot.tree.indices.part_of_station

    def one(at: tuple[Array, State]) -> Array:
        t, x = at
        acting = robot.forces(t, x, robot.rates(t, x).v)
        wrench = acting.fluid - acting.inertia + robot.on_stations(acting.wrenches)
        R, p = acting.shape.rotation, acting.shape.position - acting.shape.position[0]
        moment, force = dot(R, wrench[:, :3]), dot(R, wrench[:, 3:])
        total = jnp.concatenate([moment + cross(p, force), force], axis=1)
        return jnp.sum(jnp.where(carried[owner][:, None], total, 0.0), axis=0)

    return jax.lax.map(one, (time, x))


def lateral_share(reaction: xr.Dataset) -> float:
    """Largest mean over the turn of the components across the axis, relative to the mean of the same kind along it."""
    mean = np.abs(reaction["wrench"].mean("time").values)
    return float(max(mean[1:3].max() / mean[0], mean[4:].max() / mean[3]))
