"""A simulated rig in real time: a robot under a controller, simulated by the clock and shown meanwhile."""

import time
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import xarray as xr
from jaxtyping import Float

from nectosome.controllers import ClosedLoopRecord, ClosedLoopRun, Controller, RobotLoop
from nectosome.core import Status
from nectosome.mechanism import Diagnosis
from nectosome.model import build
from nectosome.studio.work import Progress
from nectosome.view.still import standing

FRAME = 0.05  # s between pictures at least
LONGEST = 600.0  # s of a run
_PATH = 120  # pictures whose path is drawn
_LATE = 0.25  # s; the clock of the robot is set back where it is later than that


class ClockReport(NamedTuple):
    """How closely a run kept to the clock."""

    time: float  # of the robot [s]
    taken: float  # of the clock [s]
    frames: int
    late: float  # delay of a picture, median [s]

    def __str__(self) -> str:
        share, rate = self.time / max(self.taken, 1e-9), self.frames / max(self.taken, 1e-9)
        words = "real time" if share > 0.98 else f"{share:.2f} x real time: this machine is too slow for it"
        return f"{words}; {rate:.0f} pictures a second"


class LiveRig:
    """A robot under a controller, with a reference that is given sample by sample."""

    def __init__(self, loop: RobotLoop, controller: Controller, first: float):
        self.run = ClosedLoopRun(loop, controller.planned(np.array([first]), loop.dt), first)
        self.reference: list[float] = []
        self._controller, self._diagnoses = controller, list[Diagnosis]()
        self._still = standing(loop.robot.description, build(loop.robot.description))
        self._delays: list[float] = []
        self._began = time.perf_counter()
        position = self._still["position"].values[0, 0]
        self._path = deque([position] * _PATH, _PATH)

    def begin(self) -> xr.Dataset:
        """The stage at first: the robot at rest, for as many instants as its path has points."""
        still = self._still.isel(time=[0] * _PATH)
        return still.assign_coords(time=FRAME * np.arange(_PATH))

    def step(self, reference: float) -> Status:
        """One sample and its hold interval, with this reference."""
        dt, before = self.run.robot.dt, self.run.state
        self.reference.append(reference)
        self.run.sample(self._controller.planned(np.array([reference]), dt))
        status = self.run.hold()
        if status == Status.SOLVED:
            self._diagnoses.append(self.run.robot.diagnosis(before, self.run.state, self.run.intervals[-1]))
        return status

    def run_by_clock(
        self,
        reference: Callable[[int], float],
        show: Callable[[xr.Dataset, Float[np.ndarray, "n 3"]], None],
        progress: Progress,
    ) -> Status:
        """Run by the clock until `progress` returns False, with `reference(k)` for sample k.

        The motion of a hold interval is simulated at its start, and shown as the clock comes to its instants. Late
        pictures are left out; where the robot is late by a quarter of a second, its clock is set back.
        """
        self._began = begin = time.perf_counter()
        while (t := self.run.state.sample * self.run.robot.dt) < LONGEST:
            late = time.perf_counter() - begin - t
            begin += late if late > _LATE else 0.0
            status = self.step(reference(self.run.state.sample))
            if status != Status.SOLVED:
                return status
            for k in _frames(self.run.intervals[-1].time, t):
                now = float(self.run.intervals[-1].time[k])
                left = begin + now - time.perf_counter()
                if left > 0:
                    time.sleep(left)
                if left > -FRAME:
                    show(*self._frame(k))
                    self._delays.append(time.perf_counter() - begin - now)
                if not progress(f"{now:.1f} s, {self.clock}", 0.0):  # its user ends it
                    return Status.SOLVED
        return Status.SOLVED

    @property
    def clock(self) -> ClockReport:
        """How closely the clock has been kept so far."""
        t = self.run.state.sample * self.run.robot.dt
        late = float(np.median(self._delays)) if self._delays else 0.0
        return ClockReport(t, max(time.perf_counter() - self._began, t), len(self._delays), late)

    def _frame(self, k: int) -> tuple[xr.Dataset, Float[np.ndarray, "n 3"]]:
        diagnosis = self._diagnoses[-1]
        self._path.append(diagnosis.position[k, 0])
        dims = {"position": ("station", "axis"), "rotation": ("station", "row", "axis")}
        dims["line_force"] = ("load", "station", "axis")
        now = self._still.assign(
            {name: (("time", *of), getattr(diagnosis, name)[k : k + 1]) for name, of in dims.items()}
        )
        return now.assign_coords(load=[str(i) for i in range(diagnosis.line_force.shape[1])]), np.array(self._path)

    @property
    def record(self) -> ClosedLoopRecord:
        """The record so far."""
        return self.run.record(np.array(self.reference), Status.SOLVED)

    def to_dataset(self, status: Status) -> xr.Dataset:
        """The record as a dataset like that of `simulate`."""
        run = replace(self.record, status=status)
        return run.to_dataset(diagnoses=self._diagnoses).assign_attrs(title=f"{run.title}, on a simulated rig")


def _frames(time: np.ndarray, begin: float) -> list[int]:
    """Instants of a hold interval that are shown: one after each FRAME, and the last one."""
    each = max(len(time) * FRAME / (time[-1] - begin), 1.0)
    return sorted({min(round(k * each), len(time)) - 1 for k in range(1, int(len(time) / each + 0.5) + 1)} - {-1})
