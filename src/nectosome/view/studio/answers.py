"""What the studio shows of a robot: the motion that it keeps, as moments of one period, and its numbers."""

from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core import State, Status
from nectosome.core.remember import remembered
from nectosome.design.quantities import QUANTITIES, Stroke
from nectosome.io import InputError, RobotDescription, drive_period
from nectosome.mechanism import Robot
from nectosome.robots import build
from nectosome.solve import CycleMeans, Run, Trajectory, cycle_means, find_symmetry, periodic, resting, simulate, steady

if TYPE_CHECKING:
    import xarray as xr

MOMENTS = 65  # of a period
_BEGINNING = 5.0  # s, of a robot that keeps no motion
_STANDS = 1e-8  # m/s: what is left of a body that is held
_SHOWN = (Status.SOLVED, Status.SETTLED, Status.UNSTABLE)


class Answer(NamedTuple):
    """A motion to look at.

    It repeats itself after `period` [s], but for the way that the body comes in it; 0 where it does not. `numbers` are
    of `QUANTITIES` [SI], and none of a run. The run does not carry its robot: writing that down takes longer than all
    else. `warning` is empty, or says why not to trust the motion.
    """

    run: "xr.Dataset"
    robot: RobotDescription
    kind: str
    period: float
    numbers: dict[str, float]
    warning: str


class Solver:
    """Answers for one robot after another, each begun where the last one ended."""

    def __init__(self):
        self._last: State | None = None

    def __call__(self, description: RobotDescription) -> Answer:
        """The motion that a robot keeps: steady, or periodic with its drives, or none, at rest.

        Of one that keeps none by its nature, as it sinks, walks or begins slowly, its first seconds. Raises InputError
        with the reason where a motion cannot be found.
        """
        robot = build(description)
        if not robot.tree.free_v.size:
            raise InputError("nothing of this robot is free to move.", field=description.name)
        try:
            period = drive_period(description)
        except InputError as error:
            if find_symmetry(robot).steady:
                return self._kept(robot, description, 0.0)
            return _begun(robot, description, str(error))
        if find_symmetry(robot).steady:
            return self._kept(robot, description, period)
        found = periodic(robot, period, samples=MOMENTS)
        return _answer(found, description, "periodic motion", period, found.means())

    def _kept(self, robot: Robot, description: RobotDescription, period: float) -> Answer:
        """Steady motion over a turn of its drives; without any, the shape at rest."""
        if period == 0:
            found = resting(robot)
            status = Status(int(found.status))
            if status not in _SHOWN:
                return _begun(robot, description, f"{status.reason}.")
            return _answer(found, description, "at rest", 0.0, None)
        found = steady(robot, guess=self._last)
        if Status(int(found.status)) not in _SHOWN and self._last is not None:
            found = steady(robot)
        self._last = found.state if Status(int(found.status)) in _SHOWN else None
        times = jnp.linspace(0.0, period, MOMENTS)
        turn = Run(
            Trajectory(robot, times, remembered(going_on, robot, found.state, times)), found.status, {}, found.residual
        )
        means = remembered(cycle_means, robot, times, turn.value.state)
        return _answer(turn, description, "steady motion", period, means)


def going_on(robot: Robot, x: State, times: Float[Array, "n"]) -> State:
    """States of a steady motion at times [s] after x: velocities stay, what is displaced goes on evenly."""
    return jax.vmap(lambda t: State(robot.advance(x.q, x.v, t), x.v, x.z))(times)


def _begun(robot: Robot, description: RobotDescription, why: str) -> Answer:
    """What a robot does at first, from its start, where it keeps no motion."""
    found = simulate(robot, _BEGINNING, samples=MOMENTS)
    answer = _answer(found, description, f"the first {_BEGINNING:g} s", 0.0, None)
    place = answer.run["position"].values[:, 0]  # the first part is the body
    # over what is no cycle the mean of a force or power tells nothing that lasts
    speed = float(np.linalg.norm(place[-1] - place[0])) / _BEGINNING
    return answer._replace(numbers={"speed": speed}, warning=f"{why} The speed is the mean over them.")


def _answer(found: Run, description: RobotDescription, kind: str, period: float, means: CycleMeans | None) -> Answer:
    status = Status(int(found.status))
    if status not in _SHOWN:
        raise InputError(f"{status.reason}.", field=description.name)
    numbers = {} if means is None else numbers_of(means)
    warning = f"{status.reason}." if status == Status.UNSTABLE else ""
    return Answer(found.to_dataset(), description, kind, period, numbers, warning)


def numbers_of(means: CycleMeans) -> dict[str, float]:
    """All `QUANTITIES` of a cycle [SI]; NaN where one makes no sense.

    Forward is where the body goes; of one that is held, where the water pushes it.
    """
    goes = float(means.speed) > _STANDS
    there = np.asarray(means.velocity[0] if goes else means.force)
    stroke = Stroke(means, jnp.asarray(there / max(float(np.linalg.norm(there)), 1e-300)))
    found = {name: float(quantity.of_cycle(stroke)) for name, quantity in QUANTITIES.items()}
    return found if goes else found | dict.fromkeys(("speed", "efficiency", "cost_of_transport"), np.nan)
