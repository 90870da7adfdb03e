"""Plans of runs on a rig: signals of its commands on a grid of conditions, checked before anything moves."""

import hashlib
import itertools
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from jaxtyping import Float
from pydantic import Field

from nectosome.description.fields import Duration, PositiveNumber, PositiveTime
from nectosome.io.file_system import is_file
from nectosome.io.schema.described import Described, OneOf
from nectosome.io.schema.structure import slot
from nectosome.io.schema.validate import validate_as
from nectosome.io.yaml_text import read_text, read_yaml
from nectosome.units import InputError, did_you_mean, format_quantity, shorten

from .channel_units import AnyQuantity
from .device_files import Count, FileFields
from .files import RigFile
from .played_signals import PlayedCopy, PlayedFile, PlayedSignal, PlayedWave, Playing

_MOST_RUNS = 100_000
_ROUNDING = 1e-9  # of a range or a rate


class PlanDescription(Described):
    """A plan of runs on a rig: signals that are played on its commands; lists of values make a grid of conditions.

    A run begins at rest, its signals grow within `ramp`, are played as they are for `time` or `periods`, and fall again
    within `ramp`: they are multiplied by a factor that goes from 0 to 1 as half a cosine.
    """

    about: str = ""
    """What is measured, in sentences."""
    signals: Annotated[dict[str, Annotated[PlayedSignal, OneOf()]], Field(min_length=1)]
    """Signals by command, as in `servos.left`; commands without one stay 0. A value may be a list."""
    time: PositiveTime | None = None
    """How long signals are played as they are; left out, `periods` say it, or the length of a file."""
    periods: PositiveNumber | None = None
    """The same in periods of the slowest signal."""
    ramp: Duration = 1.0
    """Time in which signals grow before, and fall behind."""
    settle: Duration = 0.5
    """Time at rest that is recorded at the beginning of each run."""
    rest: Duration = 0.0
    """Time between runs, without power, in which motors and water come to rest and cool down."""
    repeats: Count = 1
    """Number of runs of each condition."""
    order: Literal["as written", "random"] = "as written"
    """Order of the runs: the whole grid once, and again for each repeat; or all of them in a random order."""
    seed: Annotated[int, Field(ge=0, le=1_000_000)] = 1
    """Seed of the random order."""
    attempts: Count = 3
    """How often a run is tried that a guard ends, as for a measurement out of its range, until it is left out."""
    conditions: dict[str, AnyQuantity] = Field(default_factory=dict)
    """What else was the same in all runs, by name, as in `depth: 0.3 m`."""
    names: dict[str, str] = Field(default_factory=dict)
    """Names of conditions in the campaign, such as quantities of a robot, each with its field: `f: frequency`, or
    `A: servos.left.amplitude` where several signals have it; left out, they have the names of their fields."""
    columns: dict[str, str] = Field(default_factory=dict)
    """Names of quantities in the campaign, each with its column of the runs, as in `thrust: cell.thrust` or
    `pressure: valves.tail.command`; left out, all columns under their own names."""


@dataclass(frozen=True)
class PlannedRun:
    """A run: its name, the conditions that vary, as text, and the values of all fields of its signals, by command."""

    name: str
    conditions: Mapping[str, str]
    values: Mapping[str, Mapping[str, Any]]

    @property
    def words(self) -> str:
        """Its conditions, for people."""
        return ", ".join(f"{name} {value}" for name, value in self.conditions.items()) or "the only condition"


@dataclass(frozen=True)
class RunPlan:
    """A plan for a rig, with all runs in their order.

    - constants: conditions that are the same in all runs, as text.
    - contents: what a plan and its rig consist of, as JSON data: an interrupted series goes on only with the same.
    """

    description: PlanDescription
    rig: RigFile
    runs: tuple[PlannedRun, ...]
    constants: Mapping[str, str]
    contents: Mapping[str, Any]
    file: FileFields = field(repr=False)

    @property
    def columns(self) -> dict[str, str]:
        """Names of quantities in the campaign, each with its column of the runs."""
        commands = [f"{name}.command" for name in self.rig.rig.commands]
        return self.description.columns or {name: name for name in (*self.rig.rig.measurements, *commands)}

    def playing_time(self, run: PlannedRun) -> float:
        """How long the signals of a run are played as they are [s]. Raises InputError."""
        given = self.description
        if given.time is not None:
            return given.time
        if given.periods is not None:
            slowest = [
                run.values[name][signal.slowest] for name, signal in given.signals.items() if signal.slowest is not None
            ]
            if not slowest:
                raise self.file.wrong("only a sine and a multisine have periods: give a time.", "periods")
            return given.periods / min(slowest)
        files = [
            float(signal.recorded(self._playing(name, 0.0))[0][-1])
            for name, signal in given.signals.items()
            if isinstance(signal, PlayedFile)
        ]
        if not files:
            raise self.file.wrong("is missing: give time or periods.", "time")
        return max(files)

    def seconds(self, run: PlannedRun) -> float:
        """Length of a run [s]."""
        return self.description.settle + 2 * self.description.ramp + self.playing_time(run)

    @property
    def total(self) -> float:
        """Time of all runs, with the rest between them [s]."""
        return sum(map(self.seconds, self.runs)) + (len(self.runs) - 1) * self.description.rest

    def window(self, run: PlannedRun) -> tuple[float, float]:
        """When the signals of a run are played as they are, from its beginning [s]."""
        begin = self.description.settle + self.description.ramp
        return begin, begin + self.playing_time(run)

    def signals(self, run: PlannedRun) -> dict[str, Float[np.ndarray, "n"]]:
        """Samples of a run, by command. Raises InputError for one that the limits of its command would change."""
        given, dt, time = self.description, self.rig.dt, self.playing_time(run)
        count = round(self.seconds(run) / dt) + 1
        t = np.arange(count) * dt - given.settle - given.ramp
        factor = _grown(t, given.ramp, time)
        waves = {}
        for name, signal in given.signals.items():
            values, source = run.values[name], name
            phase, times = 0.0, 1.0
            if isinstance(signal, PlayedCopy):
                source, times, phase = signal.of, values["factor"], values["phase"]
                values, signal = dict(run.values[source]), given.signals[source]
                if phase:
                    values["phase"] = values["phase"] + phase
            assert isinstance(signal, PlayedWave)  # a copy is of no copy: `_check_names`
            try:
                wave = signal.wave(values, self._playing(source, time))
            except InputError as error:
                if error.file is not None:
                    raise
                raise self.file.wrong(error.message, "signals", source, *[error.field] if error.field else []) from None
            waves[name] = factor * times * wave(t)
            waves[name][-1] = 0.0
            self._check(run, name, waves[name])
        return waves

    def _playing(self, command: str, time: float) -> Playing:
        return Playing(self.rig.rig.commands[command], time, self.file.folder)

    def _check(self, run: PlannedRun, command: str, samples: Float[np.ndarray, "n"]) -> None:
        """Raise InputError for a signal beyond the range or the rate of its command."""
        limits, unit = self.rig.limits.commands[command], self.rig.rig.commands[command]
        room = _ROUNDING * (limits.high - limits.low)
        low, high = float(samples.min()), float(samples.max())
        rate = float(np.abs(np.diff(samples, prepend=0.0)).max()) / self.rig.dt
        why = ""
        if low < limits.low - room or high > limits.high + room:
            why = f"it goes from {low:.4g} to {high:.4g} {unit}, and {limits.low:.4g} to {limits.high:.4g} {unit} are "
            why += "allowed. Take less"
        elif rate > limits.slew * (1 + _ROUNDING):
            why = f"it changes by up to {rate:.4g} {unit}/s, and {limits.slew:.4g} {unit}/s are allowed. Take a longer "
            why += "ramp, a lower frequency, or less"
        if why:
            message = f"{f'{run.words}: ' if run.conditions else ''}{why}; nothing is limited silently."
            raise self.file.wrong(message, "signals", command)


def load_plan(path: str | Path, rig: RigFile) -> RunPlan:
    """Read a plan for a rig, with every signal checked. Raises InputError that names file, line and field."""
    data, lines = read_yaml(read_text(path), str(path))
    return read_plan(data, rig, FileFields(str(path), lines))


def read_plan(data: Any, rig: RigFile, file: FileFields) -> RunPlan:
    """Read what is written in a plan, as `load_plan` does; `file` is where it is from."""
    given = validate_as(PlanDescription, data, "plan", file=file.source, lines=dict(file.lines))
    _check_names(given, rig, file)
    axes, constants = _axes(given)
    grid = [dict(zip(axes, values, strict=True)) for values in itertools.product(*(axes[name][1] for name in axes))]
    if len(grid) * given.repeats > _MOST_RUNS:
        raise file.wrong(f"{len(grid) * given.repeats} runs; at most {_MOST_RUNS} are planned.", "repeats")
    order = [k for _ in range(given.repeats) for k in range(len(grid))]
    if given.order == "random":
        np.random.default_rng(given.seed).shuffle(order)
    width = max(3, len(str(len(order))))
    runs = tuple(_planned(f"run_{number:0{width}d}", given, axes, grid[k]) for number, k in enumerate(order, start=1))
    files = {
        name: hashlib.sha256((file.folder / signal.file).read_bytes()).hexdigest()
        for name, signal in given.signals.items()
        if isinstance(signal, PlayedFile) and is_file(file.folder / signal.file)
    }
    contents = {
        "plan": given.model_dump(mode="json", exclude={"about", "names", "columns"}),  # these are the campaign's alone
        "rig": rig.written.model_dump(mode="json", exclude={"about"}),
        "files": files,
    }
    plan = RunPlan(given, rig, runs, constants | given.conditions, contents, file)
    for run in {tuple(run.conditions.items()): run for run in runs}.values():
        plan.signals(run)
    return plan


def _check_names(given: PlanDescription, rig: RigFile, file: FileFields) -> None:
    """Raise InputError for commands and columns that the rig does not have, and for what cannot be copied."""
    commands, measurements = rig.rig.commands, rig.rig.measurements
    for name, signal in given.signals.items():
        if name not in commands:
            raise file.wrong(_unknown("command", name, commands), "signals", name)
        if isinstance(signal, PlayedCopy):
            copied = given.signals.get(signal.of)
            if copied is None or isinstance(copied, PlayedCopy):
                known = [key for key, one in given.signals.items() if not isinstance(one, PlayedCopy)]
                raise file.wrong(_unknown("signal", signal.of, known), "signals", name, "of")
            if commands[name] != commands[signal.of]:
                message = f"{signal.of} is in {commands[signal.of]}, and {commands[name]} is needed."
                raise file.wrong(message, "signals", name, "of")
            if any(signal.phase) and "phase" not in type(copied).model_fields:
                raise file.wrong("only a sine has a phase.", "signals", name, "phase")
    columns = [*measurements, *(f"{name}.command" for name in commands)]
    for name, column in given.columns.items():
        if column not in columns:
            raise file.wrong(_unknown("column", column, columns), "columns", name)
    known = _fields(given)
    for name, condition in given.names.items():
        if condition not in known:
            raise file.wrong(_unknown("condition", condition, known), "names", name)
    twice = [name for name, n in Counter([*given.names.values()]).items() if n > 1]
    if twice:
        raise file.wrong(f"{twice[0]} has two names.", "names")
    if given.time is not None and given.periods is not None:
        raise file.wrong("give either time or periods.", "periods")


def _unknown(kind: str, name: str, known: Any) -> str:
    return f'there is no {kind} "{shorten(name)}": {", ".join(known) or "none"}.{did_you_mean(name, known, most=0)}'


def _fields(given: PlanDescription) -> dict[str, tuple[str, str, tuple[Any, ...]]]:
    """Command, field and values of all fields that are quantities, by name: FIELD, or COMMAND.FIELD of several."""
    rows: list[tuple[str, str, tuple[Any, ...]]] = [
        (command, name, value)
        for command, signal in given.signals.items()
        for name in type(signal).model_fields
        if isinstance(value := getattr(signal, name), tuple) and name in signal.model_fields_set
    ]
    shared = Counter(name for _, name, _ in rows)
    return {row[1] if shared[row[1]] == 1 else f"{row[0]}.{row[1]}": row for row in rows}


def _axes(given: PlanDescription) -> tuple[dict[str, tuple[tuple[str, str], tuple[Any, ...]]], dict[str, str]]:
    """Axes of the grid, by the names of conditions, with command, field and values; and what is constant, as text."""
    called = {condition: name for name, condition in given.names.items()}
    axes, constants = {}, {}
    for own, (command, name, values) in _fields(given).items():
        condition = called.get(own, own)
        first, *others = values
        if others:
            axes[condition] = (command, name), values
        else:
            constants[condition] = _text_of(given.signals[command], name, first)
    return axes, constants


def _planned(
    name: str,
    given: PlanDescription,
    axes: Mapping[str, tuple[tuple[str, str], tuple[Any, ...]]],
    at: Mapping[str, Any],
) -> PlannedRun:
    values: dict[str, dict[str, Any]] = {
        command: {
            field: value[0] if isinstance(value := getattr(signal, field), tuple) else value
            for field in type(signal).model_fields
        }
        for command, signal in given.signals.items()
    }
    conditions = {}
    for condition, value in at.items():
        command, field = axes[condition][0]
        values[command][field] = value
        conditions[condition] = _text_of(given.signals[command], field, value)
    return PlannedRun(name, conditions, values)


def _text_of(signal: PlayedSignal, name: str, value: Any) -> str:
    """A value of a field, with its unit."""
    if isinstance(value, str):
        return value
    field = type(signal).model_fields[name]
    here = slot(field.annotation, tuple(field.metadata)).child(0, [value])
    assert here is not None and here.quantity is not None
    return format_quantity(value, here.quantity.dimension)


def _grown(t: Float[np.ndarray, "n"], ramp: float, time: float) -> Float[np.ndarray, "n"]:
    """Factor of the signals: 0 at rest, 1 for `time` [s] from t = 0 on, half a cosine within the ramps."""
    if ramp == 0:
        return np.where((t >= -1e-9) & (t <= time + 1e-9), 1.0, 0.0)
    share = np.clip(np.minimum(t / ramp + 1, (time - t) / ramp + 1), 0.0, 1.0)
    return 0.5 - 0.5 * np.cos(np.pi * share)
