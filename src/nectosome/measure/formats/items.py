"""What a file of named arrays holds, each thing as a vector, a matrix, or why it is neither."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from nectosome.measure.formats.arrays import ArrayRows, refusal
from nectosome.units import shorten


@dataclass(frozen=True)
class Item:
    """A vector or matrix of numbers with a name, samples first."""

    name: str
    array: ArrayRows
    unit: str = ""
    labels: Sequence[str] = ()  # of the columns of a matrix
    group: str = ""  # "" at the top
    along: str = ""  # what the samples are along, where the file says so: a dimension, a sampling interval
    first: bool = False  # a coordinate
    notes: Sequence[str] = ()  # what is to be said about it

    @property
    def path(self) -> str:
        """Its name with that of its group."""
        return join(self.group, self.name)

    @property
    def is_vector(self) -> bool:
        """Whether it is one column."""
        return len(self.array.shape) == 1 and self.array.dtype.names is None


@dataclass(frozen=True)
class Other:
    """Something with a name that is no column of numbers."""

    name: str
    what: str  # "text", "complex numbers", "scalar"
    group: str = ""
    value: str = ""  # as a person would write it, where it is short

    def __str__(self) -> str:
        value = f" = {self.value}" if self.value else ""
        return f"{shorten(join(self.group, self.name))}{value} ({self.what})"


def join(group: str, name: str) -> str:
    """Return the path of a name in a group, as it is told."""
    return f"{group}/{name}" if group else name or "the array"


def item_of(name: str, array: Any, group: str = "", **more: Any) -> Item | Other:
    """Return an array as it stands in a file as a vector or matrix, `more` as of an Item; Other where it is neither."""
    shape = tuple(array.shape)
    what = refusal(array.dtype)
    if array.dtype.names is None and what in ("", "text") and int(np.prod(shape)) == 1:
        return Other(name, what or "scalar", group, shown(array[0:1] if len(shape) == 1 else array[(0,) * len(shape)]))
    if what:
        return Other(name, what, group)
    if 0 in shape:
        return Other(name, "empty", group)
    if len(shape) == 0:
        return Other(name, "one record", group)
    if len(shape) > 2:
        return Other(name, f"{len(shape)} dimensions", group)
    return Item(name, Lane(array) if len(shape) == 2 and 1 in shape else array, group=group, **more)


def shown(value: Any) -> str:
    """Return a single value as a person would write it."""
    plain = np.asarray(value).item()
    if isinstance(plain, bytes):
        plain = plain.decode("utf-8", "replace")
    return f'"{shorten(plain)}"' if isinstance(plain, str) else shorten(plain).removesuffix(".0")


class Lane:
    """A matrix of one row or one column as a vector."""

    def __init__(self, array: Any):
        self.shape, self.dtype, self._array = (max(array.shape),), array.dtype, array
        self._lying = array.shape[0] == 1

    def __getitem__(self, rows: slice) -> np.ndarray:
        return self._array[0, rows] if self._lying else self._array[rows, 0]


class Turned:
    """A matrix whose samples run along its rows, turned upright."""

    def __init__(self, array: Any):
        self.shape, self.dtype, self._array = array.shape[::-1], array.dtype, array

    def __getitem__(self, rows: slice) -> np.ndarray:
        return self._array[:, rows].T
