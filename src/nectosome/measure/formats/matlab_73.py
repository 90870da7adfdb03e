"""MAT-files of version 7.3, which are HDF5 files with MATLAB's classes as attributes; arrays are read by slices."""

from typing import TYPE_CHECKING, Any

import numpy as np

from nectosome.measure.formats.conventions import text
from nectosome.measure.formats.matlab_values import Unread, Value, opaque

if TYPE_CHECKING:
    import h5py


class Transposed:
    """A dataset with MATLAB's order of dimensions, which HDF5 has the other way round."""

    def __init__(self, dataset: "h5py.Dataset"):
        self.shape, self.dtype, self._dataset = dataset.shape[::-1], dataset.dtype, dataset

    def __getitem__(self, key: Any) -> np.ndarray:
        key = key if isinstance(key, tuple) else (key,)
        full = (*key, *[slice(None)] * (len(self.shape) - len(key)))
        return np.asarray(self._dataset[full[::-1]]).T


def read_mat73(file: "h5py.File") -> dict[str, Value]:
    """Return the variables of a file by name; the arrays among them are read later."""
    return {name: _value(name, file, node) for name, node in file.items() if not name.startswith("#")}


def _value(name: str, file: "h5py.File", node: Any, depth: int = 0) -> Value:
    import h5py

    said = dict(node.attrs)
    kind = text(said.get("MATLAB_class", ""))
    if depth > 20:
        return Unread("nested too deeply")
    if "MATLAB_object_decode" in said and kind != "function_handle":
        return opaque(name, kind)
    if "MATLAB_sparse" in said:
        return Unread("a sparse matrix: save full(...) of it")
    if isinstance(node, h5py.Group):
        return _struct(name, file, node, depth)
    if kind == "function_handle":
        return Unread("a function")
    if "MATLAB_empty" in said or node.shape is None:
        return "" if kind == "char" else Unread("empty")
    if kind == "cell" or node.dtype.kind == "O":
        return Unread("cells")
    if kind == "char":
        letters = Transposed(node)[:]
        return "\n".join("".join(map(chr, row)) for row in np.atleast_2d(letters))
    if node.dtype.names is not None and set(node.dtype.names) == {"real", "imag"}:
        return Unread("complex numbers")
    return Transposed(node)


def _struct(name: str, file: "h5py.File", group: "h5py.Group", depth: int) -> Value:
    """A struct; or an array of them, whose fields are lists of references."""
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
