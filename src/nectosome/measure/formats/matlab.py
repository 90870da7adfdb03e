"""MAT-files of all versions: variables, fields of a struct, or a Simulink log as columns."""

from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from nectosome.measure.formats.arrays import ArraySource, LazyArray
from nectosome.measure.formats.file_errors import (
    check_memory,
    damage_as_input_error,
    first_bytes,
    is_text,
    wrong_format,
)
from nectosome.measure.formats.hdf5 import open_cached
from nectosome.measure.formats.matlab_binary import Unread, Value, opaque, read_mat4, read_mat5
from nectosome.measure.formats.source import Options, TableSource
from nectosome.measure.formats.tables import NamedArray, SkippedEntry, choose, classify, join, text
from nectosome.units import shorten

if TYPE_CHECKING:
    import h5py

ENDINGS = (".mat",)
BEGINNINGS = (b"MATLAB 5",)

_SIGNATURES = (b"PK\x03\x04", b"CDF", b"\x93NUMPY", b"TDS", b"\xd0\xcf\x11\xe0")


def _reversed(dataset: "h5py.Dataset") -> LazyArray:
    """A dataset with MATLAB's order of dimensions, the reverse of HDF5's."""

    def read(key: Any) -> np.ndarray:
        key = key if isinstance(key, tuple) else (key,)
        full = (*key, *[slice(None)] * (len(dataset.shape) - len(key)))
        return np.asarray(dataset[full[::-1]]).T

    return LazyArray(dataset.shape[::-1], dataset.dtype, read)


def _value(name: str, file: "h5py.File", node: Any, depth: int = 0) -> Value:
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
        return _struct(name, file, node, depth)
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


def _struct(name: str, file: "h5py.File", group: "h5py.Group", depth: int) -> Value:
    """A struct, or an array of structs, whose fields are lists of references."""
    import h5py

    listed = {
        field: node
        for field, node in group.items()
        if isinstance(node, h5py.Dataset) and "MATLAB_class" not in node.attrs and node.dtype.kind == "O"
    }
    if not listed or len(listed) < len(group):
        return {field: _value(f"{name}.{field}", file, node, depth + 1) for field, node in group.items()}
    fields = {field: [file[reference] for reference in np.ravel(node[()])] for field, node in listed.items()}
    count = min(map(len, fields.values()))
    return [
        {field: _value(f"{name}.{field}", file, nodes[i], depth + 1) for field, nodes in fields.items()}
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
            values = {name: _value(name, file, node) for name, node in file.items() if not name.startswith("#")}
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
