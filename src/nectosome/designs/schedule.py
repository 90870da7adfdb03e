"""The schedule of a mission as a design task: what its modes set and how long they last, so that it is over soonest."""

import hashlib
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from jaxtyping import Float

from nectosome.description import RobotDescription, dump_robot
from nectosome.description.mission import Mission, dump_mission, get_schedule, with_schedule
from nectosome.description.variables import Variable
from nectosome.search import Evaluate, Evaluation
from nectosome.solve import run_mission
from nectosome.units import InputError

from .design_task import DesignTask

_UPRIGHT = np.deg2rad(60)


@dataclass(frozen=True)
class ScheduleDesign(DesignTask):
    """Bring a mission to its end in the shortest time, within ranges of its numbers.

    A mission that does not come to its end, or on which the robot tilts by more than 60 degrees, counts as unsolved.
    It has no derivatives: modes begin and end with events.

    - variables: named as in `description.mission`.

    Raises InputError for no variable, or for two that stand for the same number.
    """

    mission: Mission
    variables: tuple[Variable, ...]
    objective_name: ClassVar[str] = "time"  # pyright: ignore[reportIncompatibleVariableOverride]

    def __post_init__(self) -> None:
        """Check what can be checked before anything is computed."""
        self._check_variables()
        self.mission_at(np.zeros(len(self.variables)))

    @property
    def description(self) -> RobotDescription:  # pyright: ignore[reportIncompatibleVariableOverride]
        """The robot."""
        return self.mission.robot

    @property
    def units(self) -> dict[str, str]:
        """Units of the quantities that describe a design."""
        return {"time": "s"}

    @property
    def own(self) -> Float[np.ndarray, "n"]:
        """The mission's own numbers, as places in the ranges."""
        return self.box.places(np.array([get_schedule(self.mission, name) for name in self.names]))

    def check_derivatives(self) -> None:
        """Raise InputError: there are none."""
        raise InputError("a mission has no derivatives. Take cmaes or pattern.", field="optimiser")

    def key(self) -> str:
        """Text of all that the numbers depend on."""
        ranges = "; ".join(f"{v.name} {v.text()}" for v in self.variables)
        texts = dump_robot(self.description), dump_mission(self.mission)
        robot, mission = (hashlib.sha256(text.encode()).hexdigest()[:16] for text in texts)
        return f"time over {ranges}; robot {robot}; mission {mission}"

    def mission_at(self, u: Float[np.ndarray, "n"]) -> Mission:
        """Mission of a design."""
        return with_schedule(self.mission, self.values(u))

    def chosen(self, u: Float[np.ndarray, "n"]) -> str:
        """File of the mission of a design."""
        return self.mission_at(u).text

    def prepare(self) -> Evaluate:
        """Return evaluate(u, derivatives, memory), which needs no memory."""

        def evaluate(u: np.ndarray, derivatives: bool, memory: np.ndarray | None) -> Evaluation:
            if derivatives:
                self.check_derivatives()
            record = run_mission(self.mission_at(u))
            fallen = np.asarray(record.measures.tilt) > _UPRIGHT
            if fallen.any():
                k = int(np.argmax(fallen))
                mode = self.mission.modes[record.mode[k]].name
                return Evaluation.unsolved(u, 0, f"it tilts by more than 60 deg in {mode}")
            if record.reason:
                return Evaluation.unsolved(u, 0, record.reason)
            time = float(record.time[-1])
            return Evaluation(u, time, np.zeros(0), outputs={"time": time})

        return evaluate
