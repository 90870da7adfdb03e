"""Controllers of a robot on its rig, one or several at once; where there is no rig, on the robot itself, simulated."""

from collections.abc import Sequence
from typing import NamedTuple

from nectosome.controllers import BeatAveraged, ControlTask, FoundController
from nectosome.units import InputError, unit_to_si

from .bench import Bench, Pair
from .devices.simulated_robot import ReadingSensor, SimulatedRobot
from .guards import NOTHING, CommandLimits, Limits, MeasurementLimits
from .laws import Loop
from .rig import Rig

SIMULATED = "simulated"
"""What stands in place of a rig file for the rig of `own_rig`."""
_FREE = 2.0  # times the whole range in one sample: a slew limit that is none
_FAR = 1e12  # in SI: a measurement beyond it is no motion
_SEED = 1  # of the noise of the rig; the rehearsal has another one


def robot_bench(
    tasks: Sequence[ControlTask],
    laws: Sequence[FoundController],
    time: float,
    rig: Rig,
    limits: Limits,
    pairs: Sequence[Pair],
) -> Bench:
    """The controllers of some tasks of one robot along `time` [s] of their references, from the present measurement on.

    A loop begins without a bump at the first sample: this is the output of the model at its start, so that a constant
    reference is a step one sample later. Where a task averages over a beat, so does its controller, from samples.
    Raises InputError as `check_pair` does, where the robot cannot begin with a command of 0, and for a quantity that
    two tasks command.
    """
    loops = dict[str, Loop]()
    for task, law, pair in zip(tasks, laws, pairs, strict=True):
        check_pair(task, rig, limits, pair)
        reference, beat, controller = task.samples(time), task.sensor.beat, law.controller
        reference[0] = task.start
        if beat is not None:
            controller = BeatAveraged(controller, beat.frequency)
        loops[pair.command] = Loop(pair.measurement, controller, reference)
    name = ", ".join(dict.fromkeys(task.reference.kind for task in tasks))
    return Bench(rig, limits, tasks[0].robot.dt, loops, name, model_of(tasks, pairs))


def model_of(tasks: Sequence[ControlTask], pairs: Sequence[Pair], seed: int = 0) -> SimulatedRobot:
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
