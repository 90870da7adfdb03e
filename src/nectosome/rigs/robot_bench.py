"""Controllers of a robot on its rig: rehearsed on the model of the robot, under the guards of the rig, then run."""

import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from nectosome.controllers import Beat, BeatAveraged, BeatMean, Controller, ControlTask, FoundController, Learner
from nectosome.units import InputError, unit_to_si

from .bench import Pair, record_of
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
    - loops: by the command that each sets, in their first run.
    - name: of the references.
    - learners: by the command, what makes the loop's next controller.
    - beats: by the command, over which the controller averages its measurement.
    """

    rig: Rig
    model: SimulatedRobot
    limits: Limits
    loops: Mapping[str, Loop]
    dt: float  # between samples [s]
    name: str
    learners: Mapping[str, Learner] = field(default_factory=dict)
    beats: Mapping[str, Beat] = field(default_factory=dict)

    @classmethod
    def of(
        cls, task: ControlTask, law: FoundController, time: float, rig: Rig, limits: Limits, pair: Pair
    ) -> "RobotBench":
        """The controller of a task along `time` [s] of its reference, from the present measurement on.

        It begins without a bump at the first sample: this is the output of the model at its start, so that a constant
        reference is a step one sample later. Where the task averages over a beat, so does the controller, from samples.
        Raises InputError as `check_pair` does, and where the robot cannot begin with a command of 0.
        """
        check_pair(task, rig, limits, pair)
        reference, beat = task.samples(time), task.sensor.beat
        reference[0] = task.start
        model = model_of([task], [pair], task.sensor.seed)
        learners = {pair.command: law.controller} if isinstance(law.controller, Learner) else {}
        beats = {} if beat is None else {pair.command: beat}
        loops = {pair.command: Loop(pair.measurement, _averaged(law.first, beat), reference)}
        return cls(rig, model, limits, loops, task.robot.dt, task.reference.kind, learners, beats)

    def rehearse(self, rounds: int = 1, progress: Progress | None = None) -> "list[xr.Dataset]":
        """The runs on the model, as `Experiment` logs them. Raises InputError where the guards of the rig would end it.

        It finds an unstable loop, gains that are too high, a reference out of reach and learning that does not
        converge, but no errors of the model.
        """
        with tempfile.TemporaryDirectory() as folder:
            logs = [Path(folder) / f"rehearsal_{k}.nc" for k in range(rounds)]
            runs: list[xr.Dataset] = []
            for run in self._rounds(self.model, self._limits_of_model(), logs, progress):
                if run.status == "interrupted":
                    raise KeyboardInterrupt
                if run.status != "finished":
                    raise InputError(f"on the model it would end, nothing was moved: {run.reason}")
                runs.append(run.data)
        return runs

    def runs(self, logs: Sequence[Path], progress: Progress | None = None) -> Iterator[RigRun]:
        """A run on the rig for each log, until one ends otherwise; what learns has learned from those before."""
        return self._rounds(self.rig, self.limits, logs, progress)

    def _rounds(self, rig: Rig, limits: Limits, logs: Sequence[Path], progress: Progress | None) -> Iterator[RigRun]:
        loops = dict(self.loops)
        for k, log in enumerate(logs):
            report = None if progress is None else lambda share, k=k: progress((k + share) / len(logs))
            run = Experiment(rig, Tracked(rig, loops, self.dt), limits, self.dt, self.name).run(log, report)
            yield run
            if run.status != "finished":
                return
            for command, learner in self.learners.items():
                record, beat = record_of(run.data, Pair(command, loops[command].measurement)), self.beats.get(command)
                if beat is not None:
                    record = record._replace(measured=BeatMean.of_samples(beat, np.asarray(record.measured), self.dt))
                loops[command] = replace(loops[command], controller=_averaged(learner.after(record), beat))

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


def _averaged(controller: Controller, beat: Beat | None) -> Controller:
    return controller if beat is None else BeatAveraged(controller, beat.frequency)


def model_of(tasks: Sequence[ControlTask], pairs: Sequence[Pair], seed: int) -> SimulatedRobot:
    """The robot of some tasks as a simulated rig, with a command and a measurement for each; `seed` is of the noise.

    Raises InputError where the robot cannot begin with a command of 0, and for a quantity that two tasks command.
    """
    commands = {pair.command: task.command.name for task, pair in zip(tasks, pairs, strict=True)}
    sensors = {
        pair.measurement: ReadingSensor(task.robot.reading.name, task.sensor.noise, delay=task.sensor.delay)
        for task, pair in zip(tasks, pairs, strict=True)
    }
    robot = tasks[0].robot
    return SimulatedRobot(robot.description, commands, sensors, robot.dt, seed=seed)


def check_pair(task: ControlTask, rig: Rig, limits: Limits, pair: Pair) -> None:
    """Raise InputError for a robot's command and reading of other quantities than the rig's, or beyond its limits."""
    span, reading = task.command, task.robot.reading
    for argument, name, unit, channel, of in (
        ("command", span.name, task.robot.quantity.unit, pair.command, rig.commands[pair.command]),
        ("measure", reading.name, reading.unit, pair.measurement, rig.measurements[pair.measurement]),
    ):
        if unit_to_si(unit)[1] != unit_to_si(of)[1]:
            message = f"{name} of the robot is in {unit or 'no unit'}, and {channel} of the rig in {of or 'no unit'}."
            raise InputError(f"{message} Take the channel of the same quantity.", field=argument)
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
