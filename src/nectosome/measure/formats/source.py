"""What the reader of a file hands over: columns, and their numbers in pieces that fit into memory."""

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np
from jaxtyping import Float, Int


@dataclass(frozen=True)
class Column:
    """A column as its file has it."""

    name: str  # "column 3" where the file says none
    unit: str = ""  # as it is written there


class Piece(NamedTuple):
    """Consecutive rows."""

    rows: Int[np.ndarray, "n"]  # where they are in the file, from 1: lines of a text, else samples
    values: Float[np.ndarray, "n k"]  # nan where a cell is empty or says so


@dataclass(frozen=True)
class Options:
    """What a reader is to take for granted instead of finding out; None: find out."""

    encoding: str | None = None
    delimiter: str | None = None
    decimal: str | None = None
    header: int | None = None  # line with the names, from 1; 0: there is none
    table: str | None = None  # worksheet, group or variable


class Source(ABC):
    """An opened file with one table of numbers; to be used in a `with` statement.

    - columns: in the order of the values.
    - found: what the reader found out about the file, a phrase each: "delimiter: tab", "no header".
    - repairs: what was mended, a sentence each with its row; filled while pieces are read.
    - reader: name of the format, "text", "tdms".
    """

    reader: str
    columns: tuple[Column, ...]
    found: tuple[str, ...]
    repairs: list[str]

    @abstractmethod
    def pieces(self, rows: int) -> Iterator[Piece]:
        """All rows in order, so many at a time; may be called again. Raises InputError that names file, row, column."""

    @abstractmethod
    def close(self) -> None:
        """Let go of the file."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
