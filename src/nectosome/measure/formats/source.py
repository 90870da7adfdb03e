"""Contract of the readers: the columns of a file, and their numbers in pieces that fit into memory."""

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np
from jaxtyping import Float, Int


@dataclass(frozen=True)
class Column:
    """Name and unit of a column."""

    name: str  # "column 3" if the file gives none
    unit: str = ""  # as written in the file


class Piece(NamedTuple):
    """Consecutive rows."""

    rows: Int[np.ndarray, "n"]  # line numbers of a text file, else sample numbers; from 1
    values: Float[np.ndarray, "n k"]  # NaN for an empty or missing cell


@dataclass(frozen=True)
class Options:
    """Given properties of a file; None: the reader finds the property out."""

    encoding: str | None = None
    delimiter: str | None = None
    decimal: str | None = None
    header: int | None = None  # line with the names, from 1; 0: there is none
    table: str | None = None  # worksheet, group or variable


class TableSource(ABC):
    """An open file with one table of numbers, for use in a `with` statement.

    - columns: in the order of the values.
    - found: properties that the reader found, one phrase each: "delimiter: tab", "no header".
    - repairs: repairs, one sentence with its row each; filled while pieces are read.
    - reader: name of the format: "text", "tdms".
    """

    reader: str
    columns: tuple[Column, ...]
    found: tuple[str, ...]
    repairs: list[str]

    @abstractmethod
    def pieces(self, rows: int) -> Iterator[Piece]:
        """Yield all rows in order, `rows` at a time; repeatable. Raises InputError that names file, row, column."""

    @abstractmethod
    def close(self) -> None:
        """Close the file."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
