"""MAT-files of all versions: variables, fields of a struct, or a Simulink log as columns.

Those of version 5 to 7.2 (MathWorks, "MAT-File Format", chapter 1) are parsed here with every length and type checked:
scipy crashes the interpreter on damaged ones.
"""

import zlib
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass, replace
from math import prod
from pathlib import Path
from struct import unpack
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from nectosome.measure.formats.arrays import ArrayRows, ArraySource, LazyArray
from nectosome.measure.formats.hdf5 import open_cached
from nectosome.measure.formats.source import Options, TableSource
from nectosome.measure.formats.tables import NamedArray, SkippedEntry, choose, classify, join, text
from nectosome.units import shorten

from .file_errors import check_memory, damage_as_input_error, first_bytes, is_text, wrong_format

if TYPE_CHECKING:
    import h5py

ENDINGS = (".mat",)
BEGINNINGS = (b"MATLAB 5",)

_SIGNATURES = (b"PK\x03\x04", b"CDF", b"\x93NUMPY", b"TDS", b"\xd0\xcf\x11\xe0")

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


def _reversed(dataset: "h5py.Dataset") -> LazyArray:
    """A dataset with MATLAB's order of dimensions, the reverse of HDF5's."""

    def read(key: Any) -> np.ndarray:
        key = key if isinstance(key, tuple) else (key,)
        full = (*key, *[slice(None)] * (len(dataset.shape) - len(key)))
        return np.asarray(dataset[full[::-1]]).T

    return LazyArray(dataset.shape[::-1], dataset.dtype, read)


def _hdf5_value(name: str, file: "h5py.File", node: Any, depth: int = 0) -> Value:
    import h5py

    attributes = dict(node.attrs)
    kind = text(attributes.get("MATLAB_class", ""))
    if depth > 20:
        return Unread("nested too deeply")
    if "MATLAB_object_decode" in attributes and kind != "function_handle":
        return opaque(name, kind)
    if "MATLAB_sparse" in attributes:
        return Unread("a sparse matrix: save full(...) of it")
    if isinstance(node, h5py.Group):
        return _hdf5_struct(name, file, node, depth)
    if kind == "function_handle":
        return Unread("a function")
    if "MATLAB_empty" in attributes or node.shape is None:
        return "" if kind == "char" else Unread("empty")
    if kind == "cell" or node.dtype.kind == "O":
        return Unread("cells", max(node.shape, default=0))
    if kind == "char":
        letters = _reversed(node)[:]
        return "\n".join("".join(map(chr, row)) for row in np.atleast_2d(letters))
    if node.dtype.names is not None and set(node.dtype.names) == {"real", "imag"}:
        return Unread("complex numbers")
    return _reversed(node)


def _hdf5_struct(name: str, file: "h5py.File", group: "h5py.Group", depth: int) -> Value:
    """A struct, or an array of structs, whose fields are lists of references."""
    import h5py

    listed = {
        field: node
        for field, node in group.items()
        if isinstance(node, h5py.Dataset) and "MATLAB_class" not in node.attrs and node.dtype.kind == "O"
    }
    if not listed or len(listed) < len(group):
        return {field: _hdf5_value(f"{name}.{field}", file, node, depth + 1) for field, node in group.items()}
    fields = {field: [file[reference] for reference in np.ravel(node[()])] for field, node in listed.items()}
    count = min(map(len, fields.values()))
    return [
        {field: _hdf5_value(f"{name}.{field}", file, nodes[i], depth + 1) for field, nodes in fields.items()}
        for i in range(count)
    ]


def open_matlab(path: Path, options: Options) -> TableSource:
    """Open a .mat file of any version: vectors of equal length, a matrix, a struct of them, or a Simulink log.

    Raises InputError for another format, a damaged file, no table or several, and objects that only MATLAB can read.
    """
    import h5py

    start = first_bytes(path)
    with damage_as_input_error(path), ExitStack() as stack:
        if h5py.is_hdf5(path):
            file = stack.enter_context(open_cached(path, options.memory))
            values = {name: _hdf5_value(name, file, node) for name, node in file.items() if not name.startswith("#")}
        elif start.startswith(_SIGNATURES) or (is_text(start) and not start.startswith(b"MATLAB")):
            raise wrong_format(path, "a MAT-file", start)
        else:
            check_memory([path.stat().st_size], options.memory, "it holds")
            values = read_mat4(path) if 0 in start[:4] else read_mat5(path.read_bytes(), options.memory)
        entries = [entry for name, value in values.items() for entry in _entries(name, value, "")]
        name = options.table.replace(".", "/") if options.table is not None else None
        table = choose(entries, name)
        return ArraySource(
            "matlab", path, table.blocks(), table.found, close=stack.pop_all().close, left_out=table.left_out
        )


def _entries(name: str, value: Value, group: str) -> list[NamedArray | SkippedEntry]:
    """The entries of a variable or field."""
    if isinstance(value, str):
        lines = value.count("\n") + 1
        return [SkippedEntry(name, "text", group, f'"{shorten(value)}"', rows=lines if lines > 1 else 0)]
    if isinstance(value, Unread):
        return [SkippedEntry(name, value.what, group, rows=value.rows)]
    if isinstance(value, list):
        return [SkippedEntry(name, f"an array of {len(value)} structs", group)]
    if not isinstance(value, dict):
        return [classify(name, value, group)]
    inside = join(group, name)
    if {"time", "signals"} <= value.keys():
        return _logged(value, inside)
    lower = {field.lower(): field for field in value}
    if {"time", "data"} <= lower.keys():
        return _series(name, value, lower, inside)
    return [entry for field, inner in value.items() for entry in _entries(field, inner, inside)]


def _logged(struct: dict[str, Value], group: str) -> list[NamedArray | SkippedEntry]:
    """Simulink's structure with time: `time`, and for each of the `signals` its `values`, `label` and `blockName`."""
    signals = struct["signals"]
    entries = _entries("time", struct["time"], group)
    for i, signal in enumerate(signals if isinstance(signals, list) else [signals]):
        if isinstance(signal, dict) and "values" in signal:
            names = [signal.get("label"), signal.get("blockName")]
            name = next((n.rpartition("/")[2] for n in names if isinstance(n, str) and n.strip()), f"signals({i + 1})")
            entries += _entries(name, signal["values"], group)
    return entries


def _series(name: str, struct: dict[str, Value], fields: dict[str, str], group: str) -> list[NamedArray | SkippedEntry]:
    """A timeseries as a struct: `Time`, `Data` (with the name of the struct), and their infos with the units."""
    units = {fields[key]: _unit(struct.get(info)) for key, info in (("time", "TimeInfo"), ("data", "DataInfo"))}
    entries: list[NamedArray | SkippedEntry] = []
    for field, value in struct.items():
        if field not in ("TimeInfo", "DataInfo"):
            inside = _entries(name if field == fields["data"] else field, value, group)
            entries += [replace(x, unit=units.get(field, "")) if isinstance(x, NamedArray) else x for x in inside]
    return entries


def _unit(info: "Value | None") -> str:
    unit = info.get("Units") if isinstance(info, dict) else None
    return unit if isinstance(unit, str) else ""


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
