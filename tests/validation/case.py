"""What a validation case is, and short ways to describe the robots the cases need."""

from collections.abc import Callable
from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from nectosome.core import State, Status
from nectosome.description import RobotDescription
from nectosome.mechanism import Robot
from nectosome.model import build
from nectosome.solve import load_stepping


class Case(NamedTuple):
    """One number to reach; `tolerance` is absolute, in the unit of the quantity."""

    name: str
    source: str
    quantity: str
    unit: str
    expected: float
    tolerance: float
    compute: Callable[[], float]


class Omitted(NamedTuple):
    """A case that does not apply, and why."""

    name: str
    why: str


def robot(body: dict[str, Any], limbs: dict[str, Any] | None = None, **water) -> Robot:
    """Robot from plain SI numbers; no gravity unless `gravity` is given."""
    plain = {"name": "case", "water": {"gravity": 0.0, **water}, "body": body, "limbs": limbs or {}}
    return build(RobotDescription.model_validate(plain))


def solve(robot: Robot) -> State:
    """State of the static equilibrium under the full loads."""
    solution = load_stepping(robot)
    if int(solution.status) != Status.SOLVED:
        raise AssertionError(Status(int(solution.status)).reason)
    return solution.value


@eqx.filter_jit
def _tip(robot: Robot, x: State) -> tuple[jnp.ndarray, jnp.ndarray]:
    q, *_ = robot.tree.complete(jnp.zeros(()), x.q, x.v)
    shape = robot.tree.shape(q)
    return shape.position[-1], shape.rotation[-1]


def tip(robot: Robot, x: State) -> tuple[np.ndarray, np.ndarray]:
    """Position [m] and rotation of the last station."""
    p, R = _tip(robot, x)
    return np.asarray(p), np.asarray(R)
