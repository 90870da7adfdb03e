"""Plans of runs on a rig: signals of its commands on a grid of conditions, checked before anything moves."""

import hashlib
import itertools
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from jaxtyping import Float
from pydantic import Field, field_validator

from nectosome.core import sampled
from nectosome.description.fields import Duration, PositiveNumber, PositiveTime
from nectosome.description.signal_contract import SignalDescription
from nectosome.io.schema.described import Described
from nectosome.io.schema.validate import validate_as
from nectosome.io.yaml_text import read_text, read_yaml
from nectosome.units import InputError, did_you_mean, shorten, show_span, show_value

from .device_files import AnyQuantity, Count, FileFields
from .planned_signals import Axis, CopySignal, PlannedKinds, PlannedSignal, axes_of, signal_at
from .rig_file import RigFile

_MOST_RUNS = 100_000
_ROUNDING = 1e-9  # of a range or a rate


class PlanDescription(Described):
    """A plan of runs on a rig: signals that are played on its commands; lists of values make a grid of conditions.

    A run begins at rest, its signals grow within `ramp`, are played as they are for `time` or `periods`, and fall again
    within `ramp`: they are multiplied by a factor that goes from 0 to 1 as half a cosine.
    """

    about: str = ""
    """What is measured, in sentences."""
    signals: Annotated[dict[str, Annotated[PlannedSignal, PlannedKinds()]], Field(min_length=1)]
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

    @field_validator("signals", mode="before")
    @classmethod
    def _recordings(cls, signals: Any) -> Any:
        """Let `file` stand for a recording."""
        if not isinstance(signals, dict):
            return signals
        old = {name: one for name, one in signals.items() if isinstance(one, dict) and one.get("kind") == "file"}
        return signals | {name: {**one, "kind": "recording"} for name, one in old.items()}


@dataclass(frozen=True)
class PlannedRun:
    """A run: its name, the conditions that vary, as text, and its signals, by command."""

    name: str
    conditions: Mapping[str, str]
    signals: Mapping[str, tuple[SignalDescription, float]]  # each with a factor
    time: float  # for which they are played as they are [s]

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

    def seconds(self, run: PlannedRun) -> float:
        """Length of a run [s]."""
        return self.description.settle + 2 * self.description.ramp + run.time

    @property
    def total(self) -> float:
        """Time of all runs, with the rest between them [s]."""
        return sum(map(self.seconds, self.runs)) + (len(self.runs) - 1) * self.description.rest

    def window(self, run: PlannedRun) -> tuple[float, float]:
        """When the signals of a run are played as they are, from its beginning [s]."""
        begin = self.description.settle + self.description.ramp
        return begin, begin + run.time

    def signals(self, run: PlannedRun) -> dict[str, Float[np.ndarray, "n"]]:
        """Samples of a run, by command. Raises InputError for one that the limits of its command would change."""
        given, dt = self.description, self.rig.dt
        t = np.arange(round(self.seconds(run) / dt) + 1) * dt - given.settle - given.ramp
        grown = _grown(t, given.ramp, run.time)
        waves = {}
        for name, (signal, factor) in run.signals.items():
            waves[name] = grown * factor * sampled(signal, t)
            waves[name][-1] = 0.0
            self._check(run, name, waves[name])
        return waves

    def _check(self, run: PlannedRun, command: str, samples: Float[np.ndarray, "n"]) -> None:
        """Raise InputError for a signal beyond the range or the rate of its command."""
        limits, unit = self.rig.limits.commands[command], self.rig.rig.commands[command]
        room = _ROUNDING * (limits.high - limits.low)
        low, high = float(samples.min()), float(samples.max())
        rate = float(np.abs(np.diff(samples, prepend=0.0)).max()) / self.rig.dt
        why = ""
        if low < limits.low - room or high > limits.high + room:
            ends = show_span(limits.low, limits.high, unit)
            why = f"it goes from {show_span(low, high, unit)}, and {ends} are allowed. Take less"
        elif rate > limits.slew * (1 + _ROUNDING):
            most = f"it changes by up to {show_value(rate, unit, per='/s')}"
            most = f"{most}, and {show_value(limits.slew, unit, per='/s')} are allowed"
            why = f"{most}. Take a longer ramp, a lower frequency, or less"
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
    grid = [
        dict(zip(axes, values, strict=True)) for values in itertools.product(*(row.values for _, row in axes.values()))
    ]
    if len(grid) * given.repeats > _MOST_RUNS:
        raise file.wrong(f"{len(grid) * given.repeats} runs; at most {_MOST_RUNS} are planned.", "repeats")
    order = [k for _ in range(given.repeats) for k in range(len(grid))]
    if given.order == "random":
        np.random.default_rng(given.seed).shuffle(order)
    width = max(3, len(str(len(order))))
    kinds = [_kind_of_run(given, rig, file, axes, at) for at in grid]
    runs = tuple(replace(kinds[k], name=f"run_{number:0{width}d}") for number, k in enumerate(order, start=1))
    files = {
        name: hashlib.sha256((file.folder / path).read_bytes()).hexdigest()
        for name, signal in given.signals.items()
        if (path := getattr(signal, "file", None)) is not None
    }
    contents = {
        "plan": given.model_dump(mode="json", exclude={"about", "names", "columns"}),  # these are the campaign's alone
        "rig": rig.written.model_dump(mode="json", exclude={"about"}),
        "files": files,
    }
    plan = RunPlan(given, rig, runs, constants | given.conditions, contents, file)
    for run in kinds:
        plan.signals(run)
    return plan


def _check_names(given: PlanDescription, rig: RigFile, file: FileFields) -> None:
    """Raise InputError for commands and columns that the rig does not have, and for what cannot be copied."""
    commands, measurements = rig.rig.commands, rig.rig.measurements
    for name, signal in given.signals.items():
        if name not in commands:
            raise file.wrong(_unknown("command", name, commands), "signals", name)
        if isinstance(signal, CopySignal):
            copied = given.signals.get(signal.of)
            if copied is None or isinstance(copied, CopySignal):
                known = [key for key, one in given.signals.items() if not isinstance(one, CopySignal)]
                raise file.wrong(_unknown("signal", signal.of, known), "signals", name, "of")
            if commands[name] != commands[signal.of]:
                message = f"{signal.of} is in {commands[signal.of]}, and {commands[name]} is needed."
                raise file.wrong(message, "signals", name, "of")
            if any(signal.phase) and "phase" not in type(copied).model_fields:
                raise file.wrong("that signal has no phase.", "signals", name, "phase")
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


Axes = Mapping[str, tuple[str, Axis]]
"""Fields of signals that are quantities, by the names of conditions, with the command of each."""


def _fields(given: PlanDescription) -> dict[str, tuple[str, Axis]]:
    """All of them, by name: FIELD, or COMMAND.FIELD of several."""
    rows = [(command, ".".join(row.at), row) for command, signal in given.signals.items() for row in axes_of(signal)]
    shared = Counter(name for _, name, _ in rows)
    return {name if shared[name] == 1 else f"{command}.{name}": (command, row) for command, name, row in rows}


def _axes(given: PlanDescription) -> tuple[Axes, dict[str, str]]:
    """Axes of the grid; and what is constant, as text."""
    called = {condition: name for name, condition in given.names.items()}
    fields = {called.get(own, own): axis for own, axis in _fields(given).items()}
    axes = {name: axis for name, axis in fields.items() if len(axis[1].values) > 1}
    return axes, {name: row.text(row.values[0]) for name, (_, row) in fields.items() if name not in axes}


def _kind_of_run(
    given: PlanDescription, rig: RigFile, file: FileFields, axes: Axes, at: Mapping[str, Any]
) -> PlannedRun:
    """A run at a point of the grid. Raises InputError."""
    chosen = {(axes[name][0], axes[name][1].at): value for name, value in at.items()}

    def read(command: str, time: float) -> SignalDescription:
        own = {place: value for (of, place), value in chosen.items() if of == command}
        try:
            return signal_at(given.signals[command], own, rig.rig.commands[command], time, file.folder)
        except InputError as error:
            raise file.wrong(error.message, "signals", command, *[error.field] if error.field else []) from None

    copies = {name: one for name, one in given.signals.items() if isinstance(one, CopySignal)}
    time = given.time or 1.0
    signals = {name: read(name, time) for name in given.signals if name not in copies}
    if given.time is None:
        time = _time_of(given, signals, file)
        signals = {name: read(name, time) if one.kind != "recording" else one for name, one in signals.items()}
    played = {name: (signal, 1.0) for name, signal in signals.items()}
    for name, copy in copies.items():
        factor, ahead = (chosen.get((name, (field,)), getattr(copy, field)[0]) for field in ("factor", "phase"))
        signal = signals[copy.of]
        if ahead:
            signal = signal.model_copy(update={"phase": dict(signal)["phase"] + ahead})
        played[name] = signal, factor
    conditions = {name: axes[name][1].text(value) for name, value in at.items()}
    return PlannedRun("", conditions, {name: played[name] for name in given.signals}, time)


def _time_of(given: PlanDescription, signals: Mapping[str, SignalDescription], file: FileFields) -> float:
    """How long signals are played as they are [s]. Raises InputError."""
    periods = [signal.period for signal in signals.values() if signal.period is not None]
    lengths = [signal.length for signal in signals.values() if signal.length is not None]
    if given.periods is not None and not periods:
        raise file.wrong("none of these signals has periods: give a time.", "periods")
    if given.periods is None and not lengths:
        raise file.wrong("is missing: give time or periods.", "time")
    return max(lengths) if given.periods is None else given.periods * max(periods)


def _grown(t: Float[np.ndarray, "n"], ramp: float, time: float) -> Float[np.ndarray, "n"]:
    """Factor of the signals: 0 at rest, 1 for `time` [s] from t = 0 on, half a cosine within the ramps."""
    if ramp == 0:
        return np.where((t >= -1e-9) & (t <= time + 1e-9), 1.0, 0.0)
    share = np.clip(np.minimum(t / ramp + 1, (time - t) / ramp + 1), 0.0, 1.0)
    return 0.5 - 0.5 * np.cos(np.pi * share)
