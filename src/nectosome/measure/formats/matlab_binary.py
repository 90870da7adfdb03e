"""Variables of MAT-files up to version 7.2 (MathWorks, "MAT-File Format", chapter 1).

Version 5 files are parsed here with every length and type checked: scipy crashes the interpreter on damaged ones.
"""

import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from math import prod
from pathlib import Path
from struct import unpack
from typing import TypeAlias

import numpy as np

from nectosome.measure.formats.arrays import ArrayRows
from nectosome.measure.formats.file_errors import check_memory

Value: TypeAlias = "ArrayRows | str | dict[str, Value] | list[dict[str, Value]] | Unread"
"""A dict is a struct, a list an array of structs."""

_AS_ARRAYS = {
    "timetable": "t = seconds({0}.Properties.RowTimes - {0}.Properties.RowTimes(1)); data = {0}.Variables; "
    "save('new.mat', 't', 'data')",
    "table": "s = table2struct({0}, 'ToScalar', true); save('new.mat', '-struct', 's')",
    "timeseries": "t = {0}.Time; data = {0}.Data; save('new.mat', 't', 'data')",
    "Simulink.SimulationData.Dataset": "t = {0}{{1}}.Values.Time; data = {0}{{1}}.Values.Data; "
    "save('new.mat', 't', 'data')",
    "datetime": "t = seconds({0} - {0}(1)); save('new.mat', 't', '-append')",
    "duration": "t = seconds({0}); save('new.mat', 't', '-append')",
}
_Element: TypeAlias = "tuple[int, memoryview]"  # type, data
_MATRIX, _COMPRESSED = 14, 15
_WHOLE, _NAME = (5, 6), (1, 16)  # types of dimensions and of names
_NUMBERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
_LETTERS = {1: "latin-1", 2: "latin-1", 4: "utf-16-{}", 16: "utf-8", 17: "utf-16-{}", 18: "utf-32-{}"}
_CELL, _STRUCT, _OBJECT, _CHAR, _SPARSE, _FUNCTION, _OPAQUE = 1, 2, 3, 4, 5, 16, 17
_ARRAYS = range(6, 16)  # double to uint64
_COMPLEX = 0x800


@dataclass(frozen=True)
class Unread:
    """A value other than numbers, text or a struct."""

    what: str
    rows: int = 0  # of a column


def opaque(name: str, kind: str) -> Unread:
    """Return the entry of an object that only MATLAB reads, with the commands that save it as arrays."""
    commands = _AS_ARRAYS.get(kind)
    hint = f": there, {commands.format(name)}" if commands else ": save its numbers as arrays"
    return Unread(f"an object of the class {kind}, which only MATLAB reads{hint}")


def read_mat4(path: Path) -> dict[str, Value]:
    """Return the variables of a version 4 file by name. Raises any exception of scipy for a damaged file."""
    from scipy.io import loadmat
    from scipy.sparse import issparse

    values: dict[str, Value] = {}
    for name, value in loadmat(path).items():
        if issparse(value):
            values[name] = Unread("a sparse matrix: save full(...) of it")
        elif not name.startswith("__"):
            values[name] = "\n".join(value.ravel()) if value.dtype.kind == "U" else value
    return values


def read_mat5(raw: bytes, memory: int) -> dict[str, Value]:
    """Return the variables of a file by name. Raises ValueError, zlib.error or struct.error for a damaged file.

    Raises InputError where they are larger than `memory` [bytes] when they are unpacked.
    """
    order = {b"IM": "<", b"MI": ">"}.get(raw[126:128])
    if order is None:
        raise ValueError("no byte order mark")
    values: dict[str, Value] = {}
    total = len(raw)
    for kind, data in _elements(memoryview(raw)[128:], order):
        if kind == _COMPRESSED:
            data = _unpacked(data, order, total, memory)
            total += len(data)
            ((kind, data),) = _elements(data, order)
        if kind != _MATRIX:
            raise ValueError(f"type {kind} is not a variable")
        name, value = _variable(data, order, "")
        if name:  # data of functions and objects have none
            values[name] = value
    return values


def _unpacked(packed: memoryview, order: str, total: int, memory: int) -> memoryview:
    """The element in compressed data, which begin with its size; `total` is what others have taken [bytes]."""
    (size,) = unpack(order + "I", zlib.decompressobj().decompress(packed, 8)[4:])
    check_memory([total, size], memory)
    stream = zlib.decompressobj()
    data = stream.decompress(packed, size + 16)
    if stream.unconsumed_tail:
        raise ValueError("compressed data are longer than they say")
    return memoryview(data)


def _elements(data: memoryview, order: str) -> Iterator[_Element]:
    at = 0
    while at < len(data):
        (kind,) = unpack(order + "I", data[at : at + 4])
        if kind >> 16:  # a small element, four bytes at most, in one word with its tag
            kind, size, start = kind & 0xFFFF, kind >> 16, at + 4
            at += 8
        else:
            (size,) = unpack(order + "I", data[at + 4 : at + 8])
            start = at + 8
            at = start + size + (-size % 8 if kind != _COMPRESSED else 0)
        if start + size > min(at, len(data)):
            raise ValueError("an element is longer than its container")
        yield kind, data[start : start + size]


def _variable(data: memoryview, order: str, field: str) -> tuple[str, Value]:
    """The name and value of a variable; `field` is the path of one in a struct, which has no name."""
    if not data:
        return "", Unread("empty")
    parts = _elements(data, order)
    flags = int(_numbers(parts, order, _WHOLE)[0])
    kind = flags & 0xFF
    if kind == _OPAQUE:  # these have no dimensions
        name, _, class_name = (_name(parts) for _ in range(3))
        return name, opaque(field or name, class_name)
    shape = tuple(int(n) for n in _numbers(parts, order, _WHOLE))
    name = _name(parts)
    if len(shape) < 2 or min(shape) < 0:
        raise ValueError("a variable has no dimensions")
    return name, _value(parts, order, kind, shape, bool(flags & _COMPLEX), field or name)


def _value(
    parts: Iterator[_Element], order: str, kind: int, shape: tuple[int, ...], is_complex: bool, name: str
) -> Value:
    if kind in _ARRAYS:
        values = _numbers(parts, order).reshape(shape, order="F")
        return Unread("complex numbers") if is_complex else values
    if kind == _CHAR:
        return _text(parts, order, shape)
    if kind == _STRUCT:
        return _struct(parts, order, shape, name)
    if kind == _OBJECT:
        return opaque(name, _name(parts))
    if kind in (_CELL, _SPARSE, _FUNCTION):
        words = {_CELL: "cells", _SPARSE: "a sparse matrix: save full(...) of it", _FUNCTION: "a function"}
        return Unread(words[kind], max(shape) if prod(shape) == max(shape) else 0)
    raise ValueError(f"class {kind} is not known")


def _struct(parts: Iterator[_Element], order: str, shape: tuple[int, ...], name: str) -> Value:
    length = int(_numbers(parts, order, _WHOLE)[0])
    kind, letters = _next(parts)
    if kind not in _NAME or length < 1 or len(letters) % length:
        raise ValueError("a struct has no names of fields")
    fields: list[str] = []
    for i in range(0, len(letters), length):
        field = _plain(letters[i : i + length])
        fields.append(field if field not in fields else f"{field}_{i // length + 1}")
    if not fields:
        return Unread("empty")
    values = []
    for kind, data in parts:
        if kind != _MATRIX:
            raise ValueError("a field is not a variable")
        values.append(_variable(data, order, f"{name}.{fields[len(values) % len(fields)]}")[1])
    if len(values) != prod(shape) * len(fields):
        raise ValueError("a struct lacks fields")
    structs = [dict(zip(fields, values[i : i + len(fields)], strict=True)) for i in range(0, len(values), len(fields))]
    return structs[0] if len(structs) == 1 else structs


def _text(parts: Iterator[_Element], order: str, shape: tuple[int, ...]) -> str:
    if not prod(shape):
        return ""
    kind, data = _next(parts)
    letters = bytes(data).decode(_LETTERS[kind].format("le" if order == "<" else "be"), "replace")
    rows = shape[0] if len(letters) == prod(shape) else 1  # stored column by column
    return "\n".join(letters[i::rows] for i in range(rows))


def _next(parts: Iterator[_Element]) -> _Element:
    element = next(parts, None)
    if element is None:
        raise ValueError("a variable is cut off")
    return element


def _numbers(parts: Iterator[_Element], order: str, expected: tuple[int, ...] = ()) -> np.ndarray:
    kind, data = _next(parts)
    if kind not in _NUMBERS or (expected and (kind not in expected or not data)):
        raise ValueError(f"type {kind} is not the expected type of number")
    return np.frombuffer(data, order + _NUMBERS[kind])


def _name(parts: Iterator[_Element]) -> str:
    kind, data = _next(parts)
    if kind not in _NAME:
        raise ValueError("a variable has no name")
    return _plain(data)


def _plain(letters: memoryview) -> str:
    return bytes(letters).partition(b"\0")[0].decode("utf-8", "replace")
