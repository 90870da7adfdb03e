"""Contract of the readers (the columns of a file, its numbers in pieces that fit into memory), and their choice."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from pathlib import Path
from types import MappingProxyType, ModuleType
from typing import NamedTuple, Self

import numpy as np
from jaxtyping import Float, Int

from nectosome.io.discovery import load_modules
from nectosome.io.schema.kinds import kind_of_file, of_other_kind
from nectosome.io.yaml_text import read_text, read_yaml
from nectosome.measure.formats.file_errors import MEMORY, first_bytes
from nectosome.units import InputError


@dataclass(frozen=True)
class Column:
    """Name and unit of a column."""

    name: str  # "column 3" if the file gives none
    unit: str = ""  # as written in the file
    heading: str = field(default="", compare=False)  # the name as the file has it, unit included
    place: int = field(default=0, compare=False)  # from 1, among all columns of the file; 0 for a computed column
    start: str = field(default="", compare=False)  # date and time of its zero, in UTC
    daily: bool = field(default=False, compare=False)  # a time of day [s], which starts again at midnight


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
    table: str | None = None  # worksheet, group, variable or section
    day_first: bool | None = None  # order of dates such as 03/04/2024
    memory: int = MEMORY  # bytes that the contents of a file may take
    drop: bool = False  # lines that are no rows are left out
    labels: int | str | None = None  # place or name of a column that says what a row belongs to, as text


class TableSource(ABC):
    """An open file with one table of numbers, for use in a `with` statement.

    - columns: in the order of the values.
    - left_out: name and kind of the columns that are no numbers, by their place.
    - times: index of the column of times of each column, by its own index, where the file says it.
    - rate: samples per second if the file gives it and has no column of times [Hz].
    - found: properties that the reader found, one phrase each: "delimiter: tab", "no header".
    - repairs: repairs, one sentence with its row each; filled while pieces are read.
    - reader: name of the format: "text", "tdms".
    - labels: the texts that the numbers of the column `Options.labels` stand for, if they do; filled while pieces are
      read.
    """

    reader: str
    columns: tuple[Column, ...]
    found: tuple[str, ...]
    repairs: list[str]
    left_out: Mapping[int, tuple[str, str]] = MappingProxyType({})
    times: Mapping[int, int] = MappingProxyType({})
    rate: float | None = None
    labels: Sequence[str] | None = None

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


@cache
def _readers() -> dict[str, ModuleType]:
    """Modules that read a format: each has its `ENDINGS`, perhaps `BEGINNINGS`, and `excel` has `open_excel`."""
    modules = map(import_module, load_modules("nectosome.measure.formats"))
    return {module.__name__.rpartition(".")[2]: module for module in modules if hasattr(module, "ENDINGS")}


def endings() -> tuple[str, ...]:
    """Endings of the files that can be read."""
    return tuple(ending for module in _readers().values() for ending in module.ENDINGS)


def open_source(path: Path, options: Options) -> TableSource:
    """Open a file with the reader of its ending, else of its first bytes. Raises InputError if it cannot be read."""
    ending, readers = path.suffix.lower(), _readers()
    kind = next((kind for kind, module in readers.items() if ending in module.ENDINGS), None)
    if ending in (".yaml", ".yml") and (found := kind_of_file(read_yaml(read_text(path), str(path))[0])):
        raise of_other_kind(found, "a recording", str(path))
    if kind is None:
        first = first_bytes(path)
        if ending in (".xls", ".ods", ".mdf", ".mf4"):
            raise InputError(f"{path.suffix} files are not supported. Save it as .xlsx or .csv.", file=str(path))
        fitting = (kind for kind, module in readers.items() if first.startswith(getattr(module, "BEGINNINGS", ())))
        kind = next(fitting, "text")
    opens: Callable[[Path, Options], TableSource] = getattr(readers[kind], f"open_{kind}")
    return opens(path, options)
