"""What every signal is described by, and which kinds there are of each quantity."""

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar, Self, TypeVar, get_args

from pydantic import BaseModel

from nectosome.description.mirror import opposite
from nectosome.io.discovery import classes_below
from nectosome.io.schema.described import Described, OneOf
from nectosome.io.schema.quantity import Quantity, Si
from nectosome.io.schema.validate import validate_as
from nectosome.units import DIMENSIONS, InputError, did_you_mean, dimension_of, shorten

Q = TypeVar("Q", bound=float)
"""The quantity of a signal, such as `Angle`."""
S = TypeVar("S", bound=float)
"""Its rate, such as `AngularSpeed`."""
T = TypeVar("T", bound="SignalDescription")
"""Signals of the same quantity."""


class SignalDescription(Described):
    """A function of time. `signed` are the fields that change their sign with it."""

    kind: Any  # its name in a file, a literal of each class
    dimension: ClassVar[str] = ""
    signed: ClassVar[tuple[str, ...]] = ()
    smooth: ClassVar[bool] = True  # whether its rate is continuous, as a prescribed motion needs
    everywhere: ClassVar[bool] = True  # whether it is one number at a time, and not a row along a rod
    once: ClassVar[tuple[str, str]] = "", ""  # of what has no period: the field, and the sentence, that say so

    @classmethod
    def model_parametrized_name(cls, params: tuple[Any, ...]) -> str:
        """Return a name such as `SineAngle`, for `SineSignal[Angle]`."""
        return f"{cls.__name__.removesuffix('Signal')}{_quantity(params[0]).dimension.capitalize()}"

    @classmethod
    def __pydantic_init_subclass__(cls, **kwargs: Any) -> None:
        made: Mapping[str, Any] = cls.__pydantic_generic_metadata__
        if made["args"] and not made["parameters"]:
            cls.dimension = _quantity(made["args"][0]).dimension
            kind = DIMENSIONS[cls.dimension]
            about = (made["origin"].__doc__ or "").replace("SI", kind.unit)
            cls.__doc__ = about.replace("quantity", "displacement" if cls.dimension == "length" else kind.name)

    def opposite(self) -> Self:
        """Return the signal with the other sign."""
        return self.model_copy(update={name: opposite(getattr(self, name)) for name in self.signed})

    def least(self) -> float:
        """Return a lower bound of its values."""
        return getattr(self, "offset", 0.0) - abs(getattr(self, "amplitude", 0.0))

    @property
    def moves(self) -> bool:
        """Whether its value goes to and fro, or is recorded and changes."""
        return bool(getattr(self, "amplitude", 0.0)) or len(set(getattr(self, "values", ()))) > 1

    @property
    def period(self) -> float | None:
        """Time after which it repeats itself [s]; None for what does not, or is constant."""
        frequency = 0.0 if self.once[0] else getattr(self, "frequency", 0.0)
        return 1 / frequency if frequency else None

    @property
    def length(self) -> float | None:
        """Time in which all of it has passed [s]; None for what has no end."""
        return None


def _quantity(hint: Any) -> Quantity:
    return next(mark for mark in get_args(hint) if isinstance(mark, Quantity))


def signal_kinds(motion: bool = False) -> dict[str, type[SignalDescription]]:
    """Return the kinds of signals, generic over their quantity; for a `motion` those whose rate is continuous."""
    kinds = dict[str, type[SignalDescription]]()
    for cls in classes_below(SignalDescription):
        kind = get_args(cls.model_fields["kind"].annotation)
        if kind and cls.__pydantic_generic_metadata__["parameters"] and cls.everywhere and (cls.smooth or not motion):
            kinds.setdefault(kind[0], cls)
    return kinds


def of_quantity(kind: type[SignalDescription], quantity: Any, motion: bool = False) -> Any:
    """Return a kind of signal of a quantity such as `Angle`."""
    rate = Annotated[float, Quantity(dimension_of(f"{_quantity(quantity).unit or '1'}/s"))]
    known = {
        Q: quantity,
        S: rate,
        T: Annotated[SignalDescription, SignalOf(quantity=quantity, motion=motion, sum=False)],
    }
    model: Any = kind[*(known[one] for one in kind.__pydantic_generic_metadata__["parameters"])]  # pyright: ignore
    vars(sys.modules[model.__module__]).setdefault(model.__name__, model)  # where pickle looks for it
    return model


@dataclass(frozen=True)
class SignalOf(OneOf):
    """Marks `SignalDescription` in a field: each kind of signal of a quantity."""

    quantity: Any = None
    motion: bool = False
    sum: bool = True  # whether it may be a sum of others

    def kinds(self, base: type[BaseModel]) -> dict[str, type[BaseModel]]:
        """Return the kinds of signals of the quantity."""
        known = signal_kinds(self.motion)
        generic = {kind: cls.__pydantic_generic_metadata__["parameters"] for kind, cls in known.items()}
        return {
            kind: of_quantity(cls, self.quantity, self.motion)
            for kind, cls in known.items()
            if self.sum or T not in generic[kind]
        }


def read_signal(fields: Mapping[str, Any], dimension: str, folder: Path, most_rows: int) -> SignalDescription:
    """Return the signal of a dimension with these fields, text with units or numbers in SI; files are in `folder`.

    Raises InputError that names the field.
    """
    kinds, kind = signal_kinds(), str(fields.get("kind"))
    if kind not in kinds:
        raise InputError(f'there is no kind "{shorten(kind)}".{did_you_mean(kind, kinds, len(kinds))}', field="kind")
    model = of_quantity(kinds[kind], Annotated[float, Quantity(dimension)])
    return validate_as(model, _in_si(dict(fields)), "plan", folder=folder, most_rows=most_rows)


def _in_si(value: Any) -> Any:
    """Plain data with all their numbers in SI."""
    if isinstance(value, dict):
        return {key: _in_si(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_in_si(item) for item in value]
    return Si(value) if isinstance(value, float) else value
