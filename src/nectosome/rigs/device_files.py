"""What a rig file says of its devices: a model of the fields of each one's settings, and errors with their lines."""

import inspect
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import MISSING, dataclass, fields
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

from pydantic import Field, create_model

from nectosome.io.schema.described import Described
from nectosome.io.schema.validate import line_of
from nectosome.io.yaml_text import Key
from nectosome.units import InputError

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
