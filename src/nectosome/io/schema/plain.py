"""Models back to plain data: text with units, lists and groups of fields, as a file has them."""

import math
from typing import Any

from pydantic import BaseModel

from nectosome.io.schema.described import Described, Shorthand
from nectosome.io.schema.quantity import Si
from nectosome.io.schema.structure import Slot, items, slot
from nectosome.units import format_quantity


def to_plain(value: Any, here: Slot | None = None, *, si: bool = False) -> Any:
    """Return the plain data that reads back as exactly `value`, without what is at its default.

    `here` is the slot of the value. With `si`, quantities stay numbers, in SI units.
    """
    here = here or slot(type(value))
    plain = _plain(value, here, si)
    short = next((m for m in here.metadata if isinstance(m, Shorthand)), None)
    return plain if short is None else short.shorten(plain)


def _plain(value: Any, here: Slot, si: bool) -> Any:
    if isinstance(value, BaseModel):
        fields = type(value).model_fields
        told = value.beside_defaults if isinstance(value, Described) else frozenset[str]()
        shown = [
            (key, to_plain(item, here.child(key, value), si=si))
            for key, item in items(value)
            if fields[key].is_required() or item != fields[key].get_default(call_default_factory=True) or key in told
        ]
        return dict(sorted(shown, key=lambda pair: 0 if pair[0] == "kind" else 1 + isinstance(pair[1], dict)))
    if here.quantity is not None and si:
        return Si(value)
    if here.quantity is not None:
        return format_quantity(value, here.quantity.dimension) if here.quantity.unit else _short_number(value)
    if isinstance(value, dict):
        return {k: to_plain(v, here.child(k, value), si=si) for k, v in value.items()}
    if isinstance(value, tuple):
        return [to_plain(v, here.child(i, value), si=si) for i, v in enumerate(value)]
    return value


def _short_number(value: float) -> float:
    """Return a whole number without its `.0`, where nothing is lost (not -0.0)."""
    whole = value.is_integer() and abs(value) < 1e15 and (value != 0 or math.copysign(1, value) > 0)
    return int(value) if whole else value
