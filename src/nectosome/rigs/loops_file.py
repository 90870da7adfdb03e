"""Files of loops: what several controllers of a robot command and measure, and the references that they follow."""

import json
import math
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import BeforeValidator, Field, WithJsonSchema

from nectosome.controllers import controllers
from nectosome.controllers.robot_control import ControlTask
from nectosome.description.fields import Name, PositiveFrequency, PositiveTime
from nectosome.description.signal_contract import signal_kinds
from nectosome.io.file_system import exists
from nectosome.io.schema.described import Described, Text
from nectosome.io.schema.validate import validate_as
from nectosome.io.yaml_text import read_text, read_yaml
from nectosome.model.inputs import RobotLike, description_of
from nectosome.units import InputError, show_quantity

from .bench import Pair
from .device_files import FileFields
from .rig import Rig

_Word = Annotated[str, Field(min_length=1)]
_ReferenceText = Annotated[
    Text,
    BeforeValidator(lambda value: json.dumps(value) if isinstance(value, dict) else value),
    WithJsonSchema({"type": ["string", "number", "object"]}),
]
if TYPE_CHECKING:
    _ControllerName = str
else:
    _ControllerName = Literal[tuple(controllers())]


class LoopDescription(Described):
    """A loop: a controller that sets a quantity of a robot so that a reading tracks a reference."""

    command: _Word
    """Quantity that the controller sets, and its range: `bias=-8..8 mN m`."""
    measure: _Word
    """Reading that is measured, such as `heading` or `arm.angle`."""
    reference: _ReferenceText
    """A constant, such as `30 deg`; a kind of signal, such as `sine`; a signal with its fields, as in a robot file; or
    a recording, relative to this file."""
    amplitude: Text | None = None
    """Amplitude of the signal; a list for `varying`, as in `4 mm, 6 mm`."""
    frequency: Text | None = None
    """Frequency of the signal; a list for `varying`."""
    to: Text | None = None
    """Last frequency of a chirp."""
    column: str | None = None
    """Quantity of a recording, if several have the dimension."""
    controller: _ControllerName = "pid"
    """What it is: a PID, alone, with gains by frequency, beside a model's inverse, learning; or predictive."""
    rounds: Annotated[int, Field(strict=True, ge=1, le=100)] | None = None
    """Runs of `ilc`, 5 if left out; all loops run as often."""
    gains: Text | None = None
    """K_p, K_i, K_d in the units of command and reference, and s, as in `-0.18, -0.08, -0.03`, or such rows by
    frequency; left out, found on the model."""
    mean: bool = False
    """Whether the measurement is averaged over the last beat of the drives."""
    noise: Text | None = None
    """Standard deviation of a measurement on the model."""
    delay: Text | None = None
    """Delay of measurements on the model."""
    rig_command: str | None = None
    """Command of a rig that is this command; may be left out where the rig has one."""
    rig_measure: str | None = None
    """Measurement of a rig that is this reading; may be left out where the rig has one."""


class LoopsDescription(Described):
    """Loops of one robot, which run at once."""

    about: str = ""
    """What they are for, in sentences."""
    rate: PositiveFrequency | None = None
    """Sampling rate of all loops; left out, 20 Hz, or four a beat with `mean`. On a rig its dt says it."""
    time: PositiveTime | None = None
    """Length of the run; left out, that of the longest reference: two periods, a recording's own, or 10 s."""
    loops: Annotated[dict[Name, LoopDescription], Field(min_length=1)]
    """The loops, by names of their own."""


@dataclass(frozen=True)
class LoopsFile:
    """Loops as their file describes them."""

    given: LoopsDescription
    file: FileFields

    def tasks(self, robot: RobotLike, settings: Iterable[str] = (), dt: float | None = None) -> dict[str, ControlTask]:
        """The tasks of a robot by the names of their loops; `dt` [s] is that of a rig.

        Raises InputError that names file, line and field, for loops that do not fit the robot or each other.
        """
        description, rate = description_of(robot, settings), self.given.rate
        if dt is not None and rate is not None and not math.isclose(rate * dt, 1, rel_tol=1e-6):
            at, of = show_quantity(rate, "frequency"), show_quantity(dt, "time")
            raise self.file.wrong(f"{at}, and dt of the rig is {of}, which is its sample time. Leave rate out.", "rate")
        tasks = dict[str, ControlTask]()
        for name, loop in self.given.loops.items():
            options = loop.model_dump(exclude={"rig_command", "rig_measure", "reference"})
            options |= {"reference": self._reference(loop.reference), "rate": rate if dt is None else 1 / dt}
            with self.errors_of(name):
                tasks[name] = ControlTask.parse(description, **options)
            self._check_apart(name, tasks)
        self._check_rates(tasks)
        return tasks

    def seconds(self, tasks: Mapping[str, ControlTask]) -> float:
        """Length of the run [s]. Raises InputError where a chirp needs it, and for too few or too many samples."""
        time = self.given.time
        for name, task in tasks.items():
            with self.errors_of(name):
                if self.given.time is None:
                    time = max(time or 0.0, task.reference.duration(task.robot.dt))
        assert time is not None
        for name, task in tasks.items():
            with self.errors_of(name):
                task.samples(time)
        return time

    def pairs(self, rig: Rig) -> dict[str, Pair]:
        """Command and measurement of a rig for each loop. Raises InputError for none, several, or those of another."""
        pairs = dict[str, Pair]()
        for name, loop in self.given.loops.items():
            fields = {"command": "rig_command", "measurement": "rig_measure"}
            try:
                pair = Pair.of(rig, loop.rig_command, loop.rig_measure)
            except InputError as error:
                raise self.file.wrong(error.message, "loops", name, f"rig_{error.field}") from None
            for other, before in pairs.items():
                for of, field in fields.items():
                    if getattr(pair, of) == getattr(before, of):
                        message = f"{getattr(pair, of)} is the {of} of {other}: each loop needs its own."
                        raise self.file.wrong(message, "loops", name, field)
            pairs[name] = pair
        return pairs

    @contextmanager
    def errors_of(self, name: str) -> Iterator[None]:
        """Errors of what is made of a loop are those of its fields; those of other files stay as they are."""
        try:
            yield
        except InputError as error:
            if error.file is not None:
                raise
            field = (error.field or "").partition(" ")[0]
            if field in ("rate", "time"):
                raise self.file.wrong(error.message, field) from None
            known = field in LoopDescription.model_fields
            words = error.message if known or not field else f"{error.field}: {error.message}"
            raise self.file.wrong(words, "loops", name, *([field] if known else [])) from None

    def _reference(self, text: str) -> str:
        """A recording is relative to the file."""
        if text.startswith("{"):
            fields = read_yaml(text, self.file.source)[0]
            own = {"file": str(self.file.folder / fields["file"])} if "file" in fields else {}
            return json.dumps({**fields, **own})
        beside = self.file.folder / text
        return str(beside) if text not in signal_kinds() and exists(beside) else text

    def _check_apart(self, name: str, found: Mapping[str, ControlTask]) -> None:
        """Raise InputError for a loop that commands or measures what one before it does."""
        task = found[name]
        for other, before in found.items():
            if other == name:
                continue
            shared = [path for path in task.command.paths if path in before.command.paths]
            if shared:
                message = f"{task.command.name} sets {shared[0]}, as the command of {other} does."
                raise self.file.wrong(f"{message} A quantity has one controller.", "loops", name, "command")
            if task.robot.reading.name == before.robot.reading.name:
                message = f"{task.robot.reading.name} tracks the reference of {other} already."
                raise self.file.wrong(f"{message} A reading has one reference.", "loops", name, "measure")

    def _check_rates(self, found: Mapping[str, ControlTask]) -> None:
        """Raise InputError where loops would have different rates by default."""
        rates = {name: show_quantity(1 / task.robot.dt, "frequency") for name, task in found.items()}
        if len(set(rates.values())) > 1:
            listed = ", ".join(f"{rate} of {name}" for name, rate in rates.items())
            raise self.file.wrong(f"is missing: loops have one rate, and by default they would have {listed}.", "rate")


def load_loops(path: str | Path) -> LoopsFile:
    """Read a file of loops. Raises InputError that names file, line and field."""
    source = str(path)
    data, lines = read_yaml(read_text(path), source)
    return LoopsFile(validate_as(LoopsDescription, data, "loops", file=source, lines=lines), FileFields(source, lines))
