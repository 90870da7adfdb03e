"""Files of meshes (STL, OBJ, PLY) to triangles, within bounds of size; what is no such file is told in a sentence."""

import io
import logging
import re
import warnings
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from nectosome.io.file_system import exists, is_file, read_bytes
from nectosome.units import InputError, shorten

SUFFIXES = (".stl", ".obj", ".ply")
MOST_BYTES = 300_000_000
MOST_TRIANGLES = 1_000_000
_SMALLER = "Save it with fewer triangles."


def read_mesh_bytes(path: str | Path, source: str) -> bytes:
    """Contents of a file of a mesh, which messages call `source`.

    Raises InputError for another ending, no such file, and more than MOST_BYTES.
    """
    if Path(path).suffix.lower() not in SUFFIXES:
        raise InputError(f"is no mesh that can be read: its name must end in {_either()}.", file=source)
    if exists(path) and not is_file(path):
        raise InputError("cannot be read: it is no ordinary file.", file=source)
    data = read_bytes(path, MOST_BYTES + 1, source)
    if len(data) > MOST_BYTES:
        raise InputError(f"is larger than {MOST_BYTES // 1_000_000} MB, which is too large. {_SMALLER}", file=source)
    return data


def _either() -> str:
    return f"{', '.join(SUFFIXES[:-1])} or {SUFFIXES[-1]}"


def parse_mesh(data: bytes, source: str) -> tuple[Float[np.ndarray, "n 3"], Int[np.ndarray, "m 3"]]:
    """Vertices, in the file's own unit, and triangles of the contents of the file `source`.

    Raises InputError for what is no such file, is cut off, has no or more than MOST_TRIANGLES triangles, has NaN,
    infinite or no size.
    """
    kind = Path(source).suffix.lower().removeprefix(".")
    try:
        _check_count({"stl": _stl_count, "obj": _obj_count, "ply": _ply_count}[kind](data))
        vertices, faces = _loaded(data, kind)
    except _UnreadableError as error:
        raise InputError(str(error), file=source) from None
    return vertices, faces


class _UnreadableError(Exception):
    """What is wrong with a file, without its name."""


def _check_count(count: int) -> None:
    if count == 0:
        raise _UnreadableError("has no triangles.")
    if count > MOST_TRIANGLES:
        raise _UnreadableError(f"has {count} triangles, at most {MOST_TRIANGLES} are read. {_SMALLER}")


def _stl_count(data: bytes) -> int:
    """Triangles of an STL file; a binary one has as many bytes as its header says, whatever it begins with."""
    if not data.strip():
        raise _UnreadableError("is empty.")
    count = int.from_bytes(data[80:84], "little") if len(data) >= 84 else -1
    if count >= 0 and len(data) == 84 + 50 * count:
        return count
    if data.lstrip()[:5].lower() == b"solid" and b"\0" not in data[:1000]:
        words = data.lower()
        facets = words.count(b"facet normal")
        if words.count(b"endfacet") != facets or words.count(b"vertex") != 3 * facets or b"endsolid" not in words:
            raise _UnreadableError(
                "is cut off or damaged: not every facet of this STL text has its end and three corners."
            )
        return facets
    if len(data) < 84:
        raise _UnreadableError("is no STL file: it has neither the text nor the header of one.")
    if len(data) < 84 + 50 * count:
        there = (len(data) - 84) // 50
        raise _UnreadableError(f"is no STL file, or cut off: its header tells {count} triangles, {there} are there.")
    raise _UnreadableError(f"is no STL file: its header tells {count} triangles, and it is longer than that.")


def _obj_count(data: bytes) -> int:
    if not data.strip():
        raise _UnreadableError("is empty.")
    if b"\0" in data:
        raise _UnreadableError("is no OBJ file: those are text, this is not.")
    if not re.search(rb"^v\s", data, re.MULTILINE):
        raise _UnreadableError("is no OBJ file: it has no vertices (lines that begin with v).")
    return len(re.findall(rb"^f\s", data, re.MULTILINE))


def _ply_count(data: bytes) -> int:
    if not data.strip():
        raise _UnreadableError("is empty.")
    if data[:3] != b"ply" or b"end_header" not in data[:100_000]:
        raise _UnreadableError("is no PLY file: it does not begin with the header of one.")
    head, _, body = data.partition(b"end_header")
    counts = {name: int(n) for name, n in re.findall(rb"element\s+(\w+)\s+(\d{1,18})", head)}
    if sum(counts.values()) > len(body):
        raise _UnreadableError("is cut off: its header tells more vertices and faces than it has.")
    return counts.get(b"face", 0)


_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("colour", "<u2")])  # of a binary STL file


def _loaded(data: bytes, kind: str) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and triangles that are there: numbers, and of some extent."""
    if kind == "stl" and len(data) == 84 + 50 * int.from_bytes(data[80:84], "little"):
        with np.errstate(invalid="ignore"):  # of NaN, which is looked for below
            vertices = np.frombuffer(data[84:], _FACET)["corners"].reshape(-1, 3).astype(float)
        faces = np.arange(len(vertices)).reshape(-1, 3)
    else:
        vertices, faces = _by_trimesh(data, kind)
    _check_count(len(faces))
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise _UnreadableError("is damaged: a face names a vertex that is not there.")
    if not np.isfinite(vertices[faces]).all():
        raise _UnreadableError("has vertices that are NaN or infinite.")
    if not np.ptp(vertices[faces], axis=(0, 1)).min() > 0:
        raise _UnreadableError("is flat: it has no volume.")
    return vertices, faces


def _by_trimesh(data: bytes, kind: str) -> tuple[np.ndarray, np.ndarray]:
    """Without looking at any other file that this one names, as those of materials."""
    import trimesh

    logging.getLogger("trimesh").addHandler(logging.NullHandler())  # else it writes what it does not like to stderr
    options: dict[str, Any] = {"skip_materials": True, "maintain_order": True} if kind == "obj" else {}
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of NaN that becomes a whole number, which is looked for below
            mesh = trimesh.load_mesh(io.BytesIO(data), file_type=kind, process=False, **options)
        vertices, faces = np.array(mesh.vertices, float), np.array(mesh.faces, int).reshape(-1, 3)
        if vertices.ndim != 2 or vertices.shape[1] != 3:
            raise ValueError("its vertices do not have three coordinates each")
    except Exception as error:  # of any kind, since its readers index, cast and reshape what a file says
        why = shorten(" ".join(str(error).split()) or type(error).__name__, 80)
        raise _UnreadableError(f"cannot be read as {kind.upper()}: it is cut off or damaged ({why}).") from None
    return vertices, faces
