"""Entries of a file of named arrays: vectors and matrices of numbers, and entries to skip with the reason."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from nectosome.measure.formats.arrays import ArrayRows, refusal
from nectosome.units import shorten


@dataclass(frozen=True)
class NamedArray:
    """A vector or matrix of numbers with a name, samples first."""

    name: str
    array: ArrayRows
    unit: str = ""
    labels: Sequence[str] = ()  # of the columns of a matrix
    group: str = ""  # "" at the top
    along: str = ""  # dimension or sampling interval of the samples, if the file names one
    first: bool = False  # a coordinate
    notes: Sequence[str] = ()

    @property
    def path(self) -> str:
        """Group and name."""
        return join(self.group, self.name)

    @property
    def is_vector(self) -> bool:
        """Whether it is one column."""
        return len(self.array.shape) == 1 and self.array.dtype.names is None


@dataclass(frozen=True)
class SkippedEntry:
    """An entry that is not a column of numbers."""

    name: str
    what: str  # "text", "complex numbers", "scalar"
    group: str = ""
    value: str = ""  # as text, if it is short

    def __str__(self) -> str:
        value = f" = {self.value}" if self.value else ""
        return f"{shorten(join(self.group, self.name))}{value} ({self.what})"


def join(group: str, name: str) -> str:
    """Return the path of a name in a group."""
    return f"{group}/{name}" if group else name or "the array"


def classify(name: str, array: Any, group: str = "", **more: Any) -> NamedArray | SkippedEntry:
    """Return an array of a file as a vector or matrix with `more` fields, or as a skipped entry with the reason."""
    shape = tuple(array.shape)
    what = refusal(array.dtype)
    if array.dtype.names is None and what in ("", "text") and int(np.prod(shape)) == 1:
        return SkippedEntry(
            name, what or "scalar", group, shown(array[0:1] if len(shape) == 1 else array[(0,) * len(shape)])
        )
    if what:
        return SkippedEntry(name, what, group)
    if 0 in shape:
        return SkippedEntry(name, "empty", group)
    if len(shape) == 0:
        return SkippedEntry(name, "one record", group)
    if len(shape) > 2:
        return SkippedEntry(name, f"{len(shape)} dimensions", group)
    return NamedArray(name, SingleVector(array) if len(shape) == 2 and 1 in shape else array, group=group, **more)


def shown(value: Any) -> str:
    """Return a single value as text."""
    plain = np.asarray(value).item()
    if isinstance(plain, bytes):
        plain = plain.decode("utf-8", "replace")
    return f'"{shorten(plain)}"' if isinstance(plain, str) else shorten(plain).removesuffix(".0")


class SingleVector:
    """A matrix of one row or one column, as a vector."""

    def __init__(self, array: Any):
        self.shape, self.dtype, self._array = (max(array.shape),), array.dtype, array
        self._is_row = array.shape[0] == 1

    def __getitem__(self, rows: slice) -> np.ndarray:
        return self._array[0, rows] if self._is_row else self._array[rows, 0]


class Transposed:
    """A matrix whose samples run along its rows, transposed."""

    def __init__(self, array: Any):
        self.shape, self.dtype, self._array = array.shape[::-1], array.dtype, array

    def __getitem__(self, rows: slice) -> np.ndarray:
        return self._array[:, rows].T
