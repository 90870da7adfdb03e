"""Tracked points in HDF5: the analysis files of SLEAP, and tables of pandas, as DeepLabCut writes them.

SLEAP (talmolab/sleap, `info/write_tracking_h5.py`; talmolab/sleap-io, analysis HDF5): `tracks` with the coordinates,
whose attribute `dims` names its axes in newer files; in older ones they are track, coordinate, node, frame.
pandas (`io/pytables.py`): a group with `table`, whose names are in the attribute `values_block_0_kind`, as a pickle, or
with `block0_values`, whose names are in `block0_items_level0` and so on. No pickle is run: only lists, tuples,
texts and numbers are read. The numbers are read row by row, when they are used.
"""

import io
import json
import pickle
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from nectosome.measure.formats.arrays import ArrayRows, LazyArray
from nectosome.measure.formats.headings import stack
from nectosome.measure.formats.tables import NamedArray, text

if TYPE_CHECKING:
    import h5py

_BYTE_ARRAY = pickle.BYTEARRAY8[0]
_MOST = 2**20  # bytes of an attribute, and of an array of names
_NO_RATE = (
    "its rows are frames, and it says no rate of them: write time: {rate: 30 Hz} in a sheet, with that of the video"
)
_SLEAP = ("track", "xy", "node", "frame")  # of older files
_FIELD, _BLOCK = "values_block_", "/block0_values"
_COORDINATES = {"x", "y", "z", "likelihood"}
_Datasets = Mapping[str, "h5py.Dataset"]


def pose_table(datasets: _Datasets) -> tuple[NamedArray, list[str]] | None:
    """Return the columns of a file of SLEAP or pandas, with notes; None for any other file.

    Raises any exception for a damaged one.
    """
    if {"tracks", "node_names", "track_names"} <= datasets.keys() and len(datasets["tracks"].shape) == 4:
        return _matrix(*_sleap(datasets)), ["written by: SLEAP", _NO_RATE]
    tables = [path for path, data in datasets.items() if _is_table(path, data)]
    blocks = [
        path for path in datasets if path.endswith(_BLOCK) and f"{path.removesuffix('values')}items_level0" in datasets
    ]
    if len(tables) + len(blocks) != 1:
        return None
    array, labels, index = _pandas_table(datasets[tables[0]]) if tables else _pandas_block(datasets, blocks[0])
    poses = all(len(label) > 2 and label[-1] in _COORDINATES for label in labels)
    titles = stack(
        list(zip(*(label[1:] if poses else label for label in labels), strict=True))
    )  # no name of the network
    titles = ["frame" if poses else "index", *titles] if index else titles
    return _matrix(array, titles), ["written by: DeepLabCut", _NO_RATE] if poses else ["written by: pandas"]


def _matrix(array: ArrayRows, labels: list[str]) -> NamedArray:
    return NamedArray("", array, labels=labels, along="frame")


def _sleap(datasets: _Datasets) -> tuple[LazyArray, list[str]]:
    """x, y and score of each node of each track, with their names, read by frames."""
    tracks, scores = datasets["tracks"], datasets.get("point_scores")
    nodes, names = _texts(datasets["node_names"]), _texts(datasets["track_names"])
    said = text(tracks.attrs.get("dims", ""))
    dims = [*map(str, json.loads(said))] if said else [*_SLEAP]
    size = dict(zip(dims, tracks.shape, strict=True))
    if sorted(dims) != sorted(_SLEAP) or size["xy"] != 2 or size["node"] != len(nodes):
        raise ValueError("other axes than track, xy, node and frame")
    flat = [dim for dim in dims if dim != "xy"]
    if scores is not None and scores.shape != tuple(size[dim] for dim in flat):
        raise ValueError("scores of another number of points")
    bodies = [names[k] if k < len(names) else f"track {k + 1}" for k in range(size["track"])]
    points = [f"{body} {node}" if size["track"] > 1 else node for body in bodies for node in nodes]
    labels = [f"{point} {what}" for point in points for what in ("x", "y", "score")[: 2 if scores is None else 3]]

    def part(data: "h5py.Dataset", axes: list[str], rows: slice) -> np.ndarray:
        values = np.asarray(data[(*[slice(None)] * axes.index("frame"), rows)])
        wanted = [dim for dim in ("frame", "track", "node", "xy") if dim in axes]
        return values.transpose([axes.index(dim) for dim in wanted])

    def read(rows: slice) -> np.ndarray:
        values = part(tracks, dims, rows)
        if scores is not None:
            values = np.concatenate([values, part(scores, flat, rows)[..., None]], axis=-1)
        return values.reshape(len(values), len(labels))

    return LazyArray((size["frame"], len(labels)), float, read), labels


def _is_table(path: str, data: "h5py.Dataset") -> bool:
    """Whether a dataset is a table of pandas with columns of numbers."""
    return path.endswith("/table") and data.dtype.names is not None and f"{_FIELD}0" in data.dtype.names


def _pandas_table(data: "h5py.Dataset") -> tuple[LazyArray, list[tuple[str, ...]], bool]:
    """The columns of all blocks, their names, and whether the first one, which has no name, is the index."""
    fields = [name for name in data.dtype.names if name.startswith(_FIELD) and data.dtype[name].base.kind in "biuf"]
    labels = list[tuple[str, ...]]()
    for field in fields:
        key = f"{field}_kind"
        if data.attrs.get_id(key).get_storage_size() > _MOST:
            raise ValueError("too many names")
        raw: Any = data.attrs[key]
        names = _named(unpickled_texts(raw.encode("latin-1") if isinstance(raw, str) else bytes(raw)))
        if data.dtype[field].shape != (len(names),):
            raise ValueError("another number of names than columns")
        labels += names
    index = "index" in data.dtype.names and data.dtype["index"].kind in "iuf"

    def read(rows: slice) -> np.ndarray:
        records = data[rows]
        first = [records["index"][:, None]] if index else []
        return np.concatenate([*first, *(records[field] for field in fields)], axis=1).astype(float)

    return LazyArray((data.shape[0], len(labels) + index), float, read), labels, index


def _pandas_block(datasets: _Datasets, path: str) -> tuple[ArrayRows, list[tuple[str, ...]], bool]:
    """The columns of the only block of a table of the other layout, and their names."""
    before, data = path.removesuffix("values"), datasets[path]
    columns = list[list[str]]()
    while (level := f"{before}items_level{len(columns)}") in datasets:
        texts, codes = _texts(datasets[level]), datasets[f"{before}items_label{len(columns)}"]
        if max(codes.shape, default=0) > _MOST:
            raise ValueError("too many names")
        columns.append([texts[int(k)] for k in codes[:]])
    labels = list(zip(*columns, strict=True))
    if data.shape != (data.shape[0], len(labels)):
        raise ValueError("another number of names than columns")
    return data, labels, False


def _texts(data: "h5py.Dataset") -> list[str]:
    """An array of texts of fixed length, as those are that name points and tracks."""
    if 0 in data.shape:
        return []
    fits = data.dtype.kind == "S" and len(data.shape) == 1 and data.shape[0] * data.dtype.itemsize <= _MOST
    if not fits:
        raise ValueError("names of another kind")  # not read: HDF5 can hang in a damaged heap of strings
    return [name.decode("utf-8", "replace").strip() for name in data[:].tolist()]


def _named(value: Any) -> list[tuple[str, ...]]:
    """A list of names, each of which may be a tuple of several."""
    if not isinstance(value, list) or not value:
        raise ValueError("no names of columns")
    names = [name if isinstance(name, tuple) else (name,) for name in value]
    if not all(name and all(isinstance(part, str | int) for part in name) for name in names):
        raise ValueError("names of another kind")
    return [tuple(map(str, name)) for name in names]


class _TextsOnly(pickle._Unpickler):  # that of Python: that of C takes as much memory as a damaged pickle asks for
    """Reads what is made of texts, numbers, lists and tuples alone: it finds no function or class, and so runs none."""

    # without that of arrays of bytes, which take the memory that they say before they are read
    dispatch: ClassVar = {code: read for code, read in pickle._Unpickler.dispatch.items() if code != _BYTE_ARRAY}

    def find_class(self, module: str, name: str) -> Any:
        raise ValueError(f"{module}.{name} is not allowed in names")


def unpickled_texts(raw: bytes) -> Any:
    """Return the lists and tuples of texts and numbers in a pickle, without running it; any exception for others."""
    return _TextsOnly(io.BytesIO(raw)).load()
