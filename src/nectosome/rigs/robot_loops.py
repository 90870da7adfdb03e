"""Several controllers of a robot at once on a rig; where there is no rig, on the robot itself, simulated."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

from nectosome.controllers import ControlTask, FoundController

from .bench import Pair
from .guards import NOTHING, CommandLimits, Limits, MeasurementLimits
from .rig import Rig
from .robot_bench import RobotBench, model_of

SIMULATED = "simulated"
"""What stands in place of a rig file for the rig of `own_rig`."""
_FREE = 2.0  # times the whole range in one sample: a slew limit that is none
_FAR = 1e12  # in SI: a measurement beyond it is no motion
_SEED = 1  # of the noise of the rig; the rehearsal has another one


class OwnRig(NamedTuple):
    """A robot as its own rig, with limits, and the pair of each of its loops."""

    rig: Rig
    limits: Limits
    pairs: tuple[Pair, ...]


def own_rig(tasks: Sequence[ControlTask], time: float) -> OwnRig:
    """The robot of some tasks as a simulated rig in virtual time, for a run `time` [s] long.

    Channels are called as the commands and readings of the robot. Nothing can break, so commands are limited to the
    ranges of the tasks, and to 0 where a rig begins and ends, and have no slew limit; they may stay at the ends of
    their ranges. Measurements need only be finite. Raises InputError as `model_of` does.
    """
    pairs = tuple(Pair(task.command.name, task.robot.reading.name) for task in tasks)
    rig = model_of(tasks, pairs, _SEED)
    commands = {task.command.name: _limits(task) for task in tasks}
    measurements = dict.fromkeys(rig.measurements, MeasurementLimits(-_FAR, _FAR, _FAR, follows=NOTHING))
    return OwnRig(rig, Limits(commands, measurements, saturated_time=2 * time), pairs)


def _limits(task: ControlTask) -> CommandLimits:
    low, high = min(task.command.low, 0.0), max(task.command.high, 0.0)
    return CommandLimits(low, high, _FREE * (high - low) / task.robot.dt)


def bench_of_loops(
    tasks: Sequence[ControlTask],
    laws: Sequence[FoundController],
    time: float,
    rig: Rig,
    limits: Limits,
    pairs: Sequence[Pair],
) -> RobotBench:
    """A rig under the controllers of several tasks of one robot, which are rehearsed together.

    Each is that of `RobotBench.of`. Raises InputError as this does, and for a quantity that two tasks command.
    """
    each = zip(tasks, laws, pairs, strict=True)
    ones = [RobotBench.of(task, law, time, rig, limits, pair) for task, law, pair in each]
    loops = {command: loop for one in ones for command, loop in one.loops.items()}
    name = ", ".join(dict.fromkeys(one.name for one in ones))
    learners = {command: learner for one in ones for command, learner in one.learners.items()}
    beats = {command: beat for one in ones for command, beat in one.beats.items()}
    model = model_of(tasks, pairs, tasks[0].sensor.seed)
    return replace(ones[0], model=model, loops=loops, name=name, learners=learners, beats=beats)
