"""A simulated rig in real time: a robot under a controller, which goes on as the clock does, and is seen meanwhile."""

import time
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from jaxtyping import Float

from nectosome.controllers import ClosedLoopRecord, ClosedLoopRun, Controller, SensorModel
from nectosome.core import Status
from nectosome.mechanism import Diagnosis
from nectosome.model import build
from nectosome.solve import SampledPlant
from nectosome.studio.work import Progress
from nectosome.view.start import standing

if TYPE_CHECKING:
    import xarray as xr

FRAME = 0.05  # s between pictures at least
LONGEST = 600.0  # s of a run
_WAY = 120  # pictures whose way is drawn
_LATE = 0.25  # s, which are made up for; the clock of the robot is put back where it is later than that


class Pace(NamedTuple):
    """How well the clock was kept."""

    time: float  # of the robot [s]
    taken: float  # of the clock [s]
    frames: int
    late: float  # by which a picture came after its time, median [s]

    def __str__(self) -> str:
        share, rate = self.time / max(self.taken, 1e-9), self.frames / max(self.taken, 1e-9)
        words = "real time" if share > 0.98 else f"{share:.2f} x real time: this machine is too slow for it"
        return f"{words}; {rate:.0f} pictures a second"


class LiveRig:
    """A robot from its start on, under a controller of a reference that is known sample by sample."""

    def __init__(self, robot: SampledPlant, controller: Controller, first: float, measuring: SensorModel):
        self.going = ClosedLoopRun(robot, controller.planned(np.array([first]), robot.dt), first, measuring)
        self.reference: list[float] = []
        self._controller, self._found = controller, list[Diagnosis]()
        self._stands = standing(robot.description, build(robot.description))
        self._lates: list[float] = []
        self._began = time.perf_counter()
        place = self._stands["position"].values[0, 0]
        self._way = deque([place] * _WAY, _WAY)

    def begin(self) -> "xr.Dataset":
        """What stands on the stage at first: as many moments as the way has places."""
        still = self._stands.isel(time=[0] * _WAY)
        return still.assign_coords(time=FRAME * np.arange(_WAY))

    def step(self, wanted: float) -> Status:
        """One sample with this reference."""
        dt, before = self.going.robot.dt, self.going.standing
        self.reference.append(wanted)
        self.going.sample(self._controller.planned(np.array([wanted]), dt))
        status = self.going.hold()
        if status == Status.SOLVED:
            self._found.append(self.going.robot.diagnosis(before, self.going.standing, self.going.pieces[-1]))
        return status

    def run(
        self,
        wanted: Callable[[int], float],
        show: Callable[["xr.Dataset", Float[np.ndarray, "n 3"]], None],
        progress: Progress,
    ) -> Status:
        """Go on by the clock until `progress` returns False, each sample after its `wanted(k)`.

        The motion of a sample is worked out when it begins, and seen as the clock comes to its moments. Pictures that
        are late are left out; where the robot is late by a quarter of a second, its clock is put back.
        """
        self._began = begin = time.perf_counter()
        while (t := self.going.standing.sample * self.going.robot.dt) < LONGEST:
            late = time.perf_counter() - begin - t
            begin += late if late > _LATE else 0.0
            status = self.step(wanted(self.going.standing.sample))
            if status != Status.SOLVED:
                return status
            for k in _frames(self.going.pieces[-1].time, t):
                now = float(self.going.pieces[-1].time[k])
                left = begin + now - time.perf_counter()
                if left > 0:
                    time.sleep(left)
                if left > -FRAME:
                    show(*self._moment(k))
                    self._lates.append(time.perf_counter() - begin - now)
                if not progress(now / LONGEST, f"{now:.1f} s, {self.pace}"):
                    return Status.SOLVED
        return Status.SOLVED

    @property
    def pace(self) -> Pace:
        """How well the clock has been kept so far."""
        t = self.going.standing.sample * self.going.robot.dt
        late = float(np.median(self._lates)) if self._lates else 0.0
        return Pace(t, max(time.perf_counter() - self._began, t), len(self._lates), late)

    def _moment(self, k: int) -> tuple["xr.Dataset", Float[np.ndarray, "n 3"]]:
        found = self._found[-1]
        self._way.append(found.position[k, 0])
        dims = {"position": ("station", "axis"), "rotation": ("station", "row", "axis")}
        dims["line_force"] = ("load", "station", "axis")
        now = self._stands.assign({name: (("time", *of), getattr(found, name)[k : k + 1]) for name, of in dims.items()})
        return now.assign_coords(load=[str(i) for i in range(found.line_force.shape[1])]), np.array(self._way)

    @property
    def followed(self) -> ClosedLoopRecord:
        """All of it so far: what was wanted of samples that were taken is known."""
        return self.going.followed(np.array(self.reference), Status.SOLVED)

    def kept(self, status: Status) -> "xr.Dataset":
        """All of it as a run like any."""
        run = replace(self.followed, status=status)
        return run.to_dataset(diagnoses=self._found).assign_attrs(title=f"{run.title}, on a simulated rig")


def _frames(time: np.ndarray, begin: float) -> list[int]:
    """Which moments of a sample are seen: those after FRAME each, and the last one."""
    each = max(len(time) * FRAME / (time[-1] - begin), 1.0)
    return sorted({min(round(k * each), len(time)) - 1 for k in range(1, int(len(time) / each + 0.5) + 1)} - {-1})
