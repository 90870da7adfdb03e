"""MAT-files of version 4, through scipy."""

from pathlib import Path

from nectosome.measure.formats.matlab_values import Unread, Value


def read_mat4(path: Path) -> dict[str, Value]:
    """Return the variables of a file by name: matrices and texts. Raises whatever scipy does where it is damaged."""
    from scipy.io import loadmat
    from scipy.sparse import issparse

    values: dict[str, Value] = {}
    for name, value in loadmat(path).items():
        if issparse(value):
            values[name] = Unread("a sparse matrix: save full(...) of it")
        elif not name.startswith("__"):
            values[name] = "\n".join(value.ravel()) if value.dtype.kind == "U" else value
    return values
