"""Controllers of a robot on its rig: rehearsed on the model of the robot, under the guards of the rig, then run."""

import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from nectosome.controllers import BeatAveraged, Controller, smooth_pid
from nectosome.controllers.robot_control import ControlTask, LoopGains
from nectosome.units import InputError, unit_to_si

from .bench import Pair
from .experiment import Experiment, RigRun
from .guards import NOTHING, Limits
from .laws import Loop, Tracked
from .rig import Rig
from .sampling_loop import Progress
from .simulated_robot import ReadingSensor, SimulatedRobot

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class RobotBench:
    """A rig, loops, and the robot as a simulated rig, on which they are rehearsed first.

    - model: its channels have the names of the rig's, those of the loops at least.
    - loops: by the command that each sets.
    - name: of the references.
    """

    rig: Rig
    model: SimulatedRobot
    limits: Limits
    loops: Mapping[str, Loop]
    dt: float  # between samples [s]
    name: str

    @classmethod
    def of(cls, task: ControlTask, gains: LoopGains, time: float, rig: Rig, limits: Limits, pair: Pair) -> "RobotBench":
        """The PID of a task along `time` [s] of its reference, from the present measurement on.

        The PID begins without a bump at the first sample: this is the output of the model at its start, so that a
        constant reference is a step one sample later. Where the task averages over a beat, so does the controller,
        from samples. Raises InputError as `check_pair` does, and where the robot cannot begin with a command of 0.
        """
        check_pair(task, rig, limits, pair)
        reference, span, dt = task.samples(time), task.command, task.robot.dt
        reference[0] = task.start
        sensor = ReadingSensor(task.robot.reading.name, task.sensor.noise, delay=task.sensor.delay)
        channels = {pair.command: span.name}, {pair.measurement: sensor}
        model = SimulatedRobot(task.robot.description, *channels, dt, seed=task.sensor.seed)
        pid: Controller = smooth_pid(gains.values, span.low, span.high, dt, limits.commands[pair.command].slew)
        if task.sensor.beat is not None:
            pid = BeatAveraged(pid, task.sensor.beat.frequency)
        loops = {pair.command: Loop(pair.measurement, pid, reference)}
        return cls(rig, model, limits, loops, dt, task.reference.kind)

    def rehearse(self, progress: Progress | None = None) -> "xr.Dataset":
        """The run on the model, as `Experiment` logs it. Raises InputError where the guards of the rig would end it.

        It finds an unstable loop, gains that are too high and a reference out of reach, but no errors of the model.
        """
        with tempfile.TemporaryDirectory() as folder:
            run = self._experiment(self.model, self._limits_of_model()).run(Path(folder) / "rehearsal.nc", progress)
        if run.status == "interrupted":
            raise KeyboardInterrupt
        if run.status != "finished":
            raise InputError(f"on the model it would end, nothing was moved: {run.reason}")
        return run.data

    def run(self, log: Path, progress: Progress | None = None) -> RigRun:
        """The run on the rig."""
        return self._experiment(self.rig, self.limits).run(log, progress)

    def _experiment(self, rig: Rig, limits: Limits) -> Experiment:
        return Experiment(rig, Tracked(rig, self.loops, self.dt), limits, self.dt, self.name)

    def _limits_of_model(self) -> Limits:
        """Those of the channels that the model has."""
        known = {
            name: self.limits.measurements[name] for name in self.model.measurements if name in self.limits.measurements
        }
        return replace(
            self.limits,
            commands={name: self.limits.commands[name] for name in self.model.commands},
            measurements={
                name: one if one.follows in (None, NOTHING, *self.model.commands) else replace(one, follows=NOTHING)
                for name, one in known.items()
            },
        )


def check_pair(task: ControlTask, rig: Rig, limits: Limits, pair: Pair) -> None:
    """Raise InputError for a robot's command and reading of other quantities than the rig's, or beyond its limits."""
    span, reading = task.command, task.robot.reading
    for field, name, unit, channel, of in (
        ("command", span.name, task.robot.quantity.unit, pair.command, rig.commands[pair.command]),
        ("measure", reading.name, reading.unit, pair.measurement, rig.measurements[pair.measurement]),
    ):
        if unit_to_si(unit)[1] != unit_to_si(of)[1]:
            message = f"{name} of the robot is in {unit or 'no unit'}, and {channel} of the rig in {of or 'no unit'}."
            raise InputError(f"{message} Take the channel of the same quantity.", field=field)
    if task.sensor.beat is not None and task.sensor.beat.nominal:
        message = f"{span.name} changes the length of a beat, which a rig does not tell: there is no mean of it."
        raise InputError(message, field="mean")
    within = limits.commands[pair.command]
    if not within.low <= span.low < span.high <= within.high:
        ends = f"{span.show(within.low)} to {span.show(within.high)}"
        message = f"{span.show(span.low)} to {span.show(span.high)} is beyond the limits of the rig for {pair.command}"
        raise InputError(f"{message}, {ends}. Take a narrower range.", field=f"command {span.name}")


def tracked(data: "xr.Dataset", measurement: str) -> "tuple[Float[np.ndarray, 'n'], Float[np.ndarray, 'n']]":
    """Measurement and reference of a run, at the samples where there is a measurement."""
    measured, reference = data[measurement].values, data[f"{measurement}.reference"].values
    known = np.isfinite(measured)
    return measured[known], reference[known]
