"""Options that `control ROBOT` and `control rig` share: the reference, and the names of options in messages."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from nectosome.cli.options import value
from nectosome.units import InputError, read_positive

if TYPE_CHECKING:
    from nectosome.controllers.robot_control import Shape

_FIELDS = (
    "amplitude",
    "column",
    "command",
    "controller",
    "delay",
    "frequency",
    "gains",
    "mean",
    "measure",
    "model",
    "noise",
    "rate",
    "reference",
    "time",
    "to",
)


@Parameter(name="*")
@dataclass(frozen=True)
class ReferenceOptions:
    """A reference as options of the command line."""

    reference: Annotated[
        str, value("A constant, such as 30deg; sine, triangle, chirp, varying; or a file with a recording.")
    ]
    amplitude: Annotated[str | None, value("Amplitude of a shape, such as 6mm; a list for varying.")] = None
    frequency: Annotated[str | None, value("Frequency of a shape, such as 0.04Hz; a list for varying.")] = None
    to: Annotated[str | None, value("Last frequency of a chirp.")] = None
    column: Annotated[str | None, Parameter(help="Quantity of the file, if several have the dimension.")] = None
    time: Annotated[str | None, value("Length; by default two periods, that of the file, or 10 s.")] = None

    def shape(self) -> "Shape":
        """Options that belong to the shape."""
        return {"amplitude": self.amplitude, "frequency": self.frequency, "to": self.to, "column": self.column}

    def seconds(self) -> float | None:
        """The length [s]. Raises InputError."""
        return None if self.time is None else read_positive(self.time, "time", "time")


@contextmanager
def named_options() -> Iterator[None]:
    """Errors of arguments name their options."""
    try:
        yield
    except InputError as error:
        if (error.field or "").partition(" ")[0] not in _FIELDS or error.file:
            raise
        raise InputError(error.message, field=f"--{error.field}") from None
