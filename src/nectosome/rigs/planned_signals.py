"""Signals of a plan: those of robot files, in the units of a rig's commands; a list of values is an axis of a grid."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, TypeVar, get_args, get_origin

from pydantic import BaseModel, Field, create_model

from nectosome.description.fields import Angle, Number
from nectosome.description.signal_contract import S, SignalDescription, T, read_signal, signal_kinds
from nectosome.io.schema.described import Described, OneOf, OneOrMany
from nectosome.io.schema.structure import slot
from nectosome.units import InputError, dimension_of, format_quantity

from .device_files import AnyQuantity, same_unit

_MOST_ROWS = 10_000_000  # of a recording that is played


def _axis(item: Any) -> Any:
    return Annotated[tuple[item, ...], Field(min_length=1), OneOrMany()]


class PlannedSignal(Described):
    """A signal of a command."""

    kind: Any  # its name in a file, a literal of each class


class CopySignal(PlannedSignal):
    """The signal of another command, multiplied by a factor, such as -1 for muscles that work against each other."""

    kind: Literal["copy"]
    of: str
    """The other command."""
    factor: _axis(Number) = (1.0,)  # pyright: ignore[reportInvalidTypeForm]
    """What it is multiplied by."""
    phase: _axis(Angle) = (0.0,)  # pyright: ignore[reportInvalidTypeForm]
    """By how much it is ahead of the other one, which has a phase."""


@dataclass(frozen=True)
class PlannedKinds(OneOf):
    """Marks `PlannedSignal` in a field: each kind of signal, and copies; among `terms` of a sum neither."""

    terms: bool = False

    def kinds(self, base: type[BaseModel]) -> dict[str, type[BaseModel]]:
        """Return the kinds of a plan's signals."""
        kinds = {kind: cls for kind, cls in signal_kinds().items() if not (self.terms and "terms" in cls.model_fields)}
        planned: dict[str, type[BaseModel]] = {kind: _planned(cls) for kind, cls in kinds.items()}
        return planned if self.terms else {**planned, "copy": CopySignal}


@cache
def _planned(cls: type[SignalDescription]) -> type[PlannedSignal]:
    """The fields of a kind of signal in a plan: its numbers are axes, and a time left out is that of the run."""
    fields = dict[str, Any]()
    for name, field in cls.model_fields.items():
        hint, quantity = field.annotation, slot(field.annotation, tuple(field.metadata)).quantity
        default = ... if field.is_required() else field.default
        if get_origin(hint) is tuple:
            (item, _) = get_args(hint)
            item = Annotated[PlannedSignal, PlannedKinds(terms=True)] if item is T else item
            item = AnyQuantity if isinstance(item, TypeVar) else item
            fields[name] = Annotated[tuple[item, ...], *field.metadata], default
        elif isinstance(hint, TypeVar):
            fields[name] = _axis(AnyQuantity), default if default is ... else (f"{default:g}",)
        elif quantity is not None:
            default = None if name == "time" else default
            axis = _axis(Annotated[float, quantity])
            fields[name] = (axis | None, None) if default is None else (axis, default if default is ... else (default,))
        else:
            fields[name] = Annotated[hint, *field.metadata] if field.metadata else hint, default
    model = create_model(f"Planned{cls.__name__}", __base__=PlannedSignal, __doc__=cls.__doc__, **fields)
    model.described_in = cls
    return model


Place = tuple[str, ...]
"""Where a field of a signal is: its name, for that of a sum's term behind `terms` and a number."""


class Axis(NamedTuple):
    """Values of a field of a signal that are written."""

    at: Place
    values: tuple[Any, ...]
    dimension: str | None  # None for text with a unit

    def text(self, value: Any) -> str:
        """A value with its unit."""
        return value if self.dimension is None else format_quantity(value, self.dimension)


def axes_of(signal: PlannedSignal, inside: Place = ()) -> Iterator[Axis]:
    """The fields of a signal that are written and may have several values, terms of a sum included."""
    for name, field in type(signal).model_fields.items():
        value, at = getattr(signal, name), (*inside, name)
        here = slot(field.annotation, tuple(field.metadata))
        if name in signal.model_fields_set and any(isinstance(mark, OneOrMany) for mark in here.metadata):
            item = here.child(0, value)
            yield Axis(at, value, None if item is None or item.quantity is None else item.quantity.dimension)
        for k, term in enumerate(value if name == "terms" else ()):
            yield from axes_of(term, (*at, str(k)))


def signal_at(
    signal: PlannedSignal, chosen: Mapping[Place, Any], unit: str, time: float, folder: Path
) -> SignalDescription:
    """The signal with one value of each field, in the SI `unit` of its command, `time` [s] long.

    Raises InputError that names the field.
    """
    return read_signal(_fields(signal, chosen, unit, time, ()), dimension_of(unit), folder, _MOST_ROWS)


def _fields(
    signal: PlannedSignal, chosen: Mapping[Place, Any], unit: str, time: float, inside: Place
) -> dict[str, Any]:
    described = type(signal).described_in
    assert described is not None and issubclass(described, SignalDescription)
    fields_ = {"kind": signal.kind} | ({"time": time} if "time" in described.model_fields else {})
    for name in signal.model_fields_set - {"kind"}:
        hint, at = described.model_fields[name].annotation, (*inside, name)
        value: Any = getattr(signal, name)
        row = get_origin(hint) is tuple
        item = get_args(hint)[0] if row else hint
        if isinstance(value, tuple) and not row:
            value = chosen.get(at, value[0])
        if item is T:
            value = [_fields(term, chosen, unit, time, (*at, str(k))) for k, term in enumerate(value)]
        elif isinstance(item, TypeVar):
            one = f"{unit}/s" if item is S else unit
            try:
                numbers = [same_unit(str(x), one) for x in (value if row else (value,))]
            except ValueError as error:
                raise InputError(str(error), field=".".join(at)) from None
            value = numbers if row else numbers[0]
        fields_[name] = value
    return fields_
