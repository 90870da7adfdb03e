"""What a rig file says of its devices: models of their settings, quantities of any unit, errors with their lines."""

import inspect
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import MISSING, dataclass, fields
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

from pydantic import Field, PlainValidator, WithJsonSchema, create_model

from nectosome.io.schema.described import Described, unfit
from nectosome.io.schema.validate import line_of
from nectosome.io.yaml_text import Key
from nectosome.units import InputError, read_any, scale_to_si, shorten, split_unit, unit_to_si

_Created = TypeVar("_Created")
Word = Annotated[str, Field(min_length=1)]
Baud = Annotated[int, Field(ge=300, le=10_000_000)]
Count = Annotated[int, Field(ge=1, le=1_000_000)]


@dataclass(frozen=True)
class FileFields:
    """A file and a group of its fields, for the errors of what is made of them."""

    source: str
    lines: Mapping[Key, int]
    at: Key = ()

    @property
    def folder(self) -> Path:
        """The folder of the file."""
        return Path(self.source).parent

    def within(self, *steps: str | int) -> "FileFields":
        """A group further in."""
        return FileFields(self.source, self.lines, (*self.at, *steps))

    def wrong(self, message: str, *steps: str | int) -> InputError:
        """The error of a field."""
        at = (*self.at, *steps)
        return InputError(message, file=self.source, line=line_of(at, self.lines), field=".".join(map(str, at)) or None)

    def create(self, kind: Callable[..., _Created], group: Any, **given: Any) -> _Created:
        """A dataclass from the fields of a group, and others that are given; its errors are those of their fields."""
        names = [name for name in inspect.signature(kind).parameters if name not in given]
        with self.errors():
            return kind(**{name: getattr(group, name) for name in names}, **given)

    @contextmanager
    def errors(self) -> Iterator[None]:
        """Errors of what is made here are those of the fields that they name."""
        try:
            yield
        except InputError as error:
            raise self.wrong(error.message, *error.field.split(".") if error.field else ()) from None


class DeviceDescription(Described):
    """A device of a rig: what it is connected to, by its kind."""

    kind: Any  # its name in a file, a literal of each class


def model_of_settings(settings: type, base: type[Described] = Described, name: str = "", /, **types: Any) -> Any:
    """Model of a group of fields for a dataclass, with the same defaults; `types` has those of its fields.

    A type with another default is a pair; a field whose type is None is no field of the file.
    """
    known: dict[str, Any] = {}
    for field in fields(settings):
        of = types.pop(field.name, field.type)
        if of is not None:
            known[field.name] = of if isinstance(of, tuple) else (of, _default(field))
    model = create_model(name or settings.__name__, __base__=base, __doc__=settings.__doc__, **known, **types)
    model.described_in = settings
    return model


def _default(field: Any) -> Any:
    if field.default_factory is not MISSING:
        return Field(default_factory=field.default_factory)
    return ... if field.default is MISSING else field.default


def device_model(kind: str, settings: type, **types: Any) -> Any:
    """Model of a device of this kind, `described_by` of its class; types of fields are those of the dataclass."""
    return model_of_settings(settings, DeviceDescription, kind=(Literal[kind], ...), **types)


def outlasts(file: FileFields, watchdog: float, dt: float, *at: str) -> None:
    """Check that a watchdog waits longer than the time between samples. Raises InputError."""
    if watchdog <= dt:
        message = f"{watchdog:g} s, and dt is {dt:g} s: it would act between two samples. Take several times dt."
        raise file.wrong(message, *at)


def _text(value: Any) -> str:
    """The text of a quantity. A number without unit may be 0, or one of a channel that has no unit."""
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise unfit(f'"{shorten(value)}" is no quantity. A number with a unit expected, as in "20 deg" or "0.6 bar".')
    try:
        read_any(str(value))
    except ValueError as error:
        raise unfit(str(error)) from None
    return str(value)


AnyQuantity = Annotated[
    str, PlainValidator(_text), WithJsonSchema({"type": ["string", "number"], "examples": ["20 deg", "0.6 bar"]})
]
"""Text of a quantity of any unit."""


def slope_per(reading: str, text: str, expected: str) -> tuple[float, str]:
    """Slope in SI, and the SI unit of what is commanded or measured: (46.5, "N") of "46.5 N/V", where V is read.

    Raises InputError, which ends with what is expected, where it is not a number with a unit per unit of the reading.
    """
    try:
        number, unit = split_unit(text)
        above, slash, below = unit.rpartition("/")
        (factor, si), (readings, read) = unit_to_si(above.strip()), unit_to_si(below.strip())
    except ValueError as error:
        raise InputError(f"{' '.join(str(error).split()).rstrip('.')}. {expected}") from None
    if not slash or read != unit_to_si(reading)[1]:
        raise InputError(f'"{shorten(text)}" is not per {reading}. {expected}')
    return number * factor / readings, si


def same_unit(text: str, unit: str, *, difference: bool = False) -> float:
    """SI value of a quantity of a channel whose SI unit is `unit`; of a `difference` of two, temperatures are in K.

    Raises ValueError, a sentence for people, for another unit.
    """
    needed = unit_to_si(unit)[1]
    value, given = read_any(text)
    if value == 0 and not given:
        return 0.0
    if given != needed:
        what = f"is in {given}" if given else "has no unit"
        raise ValueError(f'"{shorten(text)}" {what}, and {needed or "a number without unit"} is needed.')
    if difference and scale_to_si(split_unit(text)[1])[1]:
        raise ValueError(f'"{shorten(text)}" is a temperature and not a difference of two. Write it in K.')
    return value


def unit_size(text: str) -> float | None:
    """Size in SI of the unit in which a quantity is written; None where it has none."""
    unit = split_unit(text)[1]
    return scale_to_si(unit)[0] if unit else None
