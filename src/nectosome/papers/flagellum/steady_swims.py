"""Steady swims of designs of the flagellum, each found from the one before."""

from typing import NamedTuple

import jax.numpy as jnp
from jax.flatten_util import ravel_pytree

from nectosome.core import State
from nectosome.description import RobotDescription
from nectosome.designs import MotionDesign, shipped_problem
from nectosome.model import build


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
