"""Checkpoint format of long computations: named arrays and JSON data in an npz file, with a checksum."""

import hashlib
import io
import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nectosome.io.atomic import write_atomic
from nectosome.io.file_system import read_bytes
from nectosome.units import InputError

if TYPE_CHECKING:
    import numpy as np

FORMAT = 1
_ARRAY = "array."


def save_checkpoint(path: str | Path, arrays: Mapping[str, "np.ndarray"], meta: Mapping[str, Any]) -> None:
    """Write named arrays (no object arrays) and `meta` (JSON data), atomically.

    Raises InputError if it cannot be written, TypeError for data that JSON or npz cannot hold.
    """
    import numpy as np

    named = {name: np.asarray(array) for name, array in arrays.items()}
    for name, array in named.items():
        if array.dtype.hasobject:
            raise TypeError(f"array {name} holds objects, which a checkpoint cannot store")
    text = json.dumps(dict(meta))
    head = json.dumps({"format": FORMAT, "checksum": _checksum(named, text)})
    buffer = io.BytesIO()
    with_prefix: dict[str, Any] = {_ARRAY + name: array for name, array in named.items()}
    np.savez(buffer, head=np.array(head), meta=np.array(text), **with_prefix)
    write_atomic(path, buffer.getvalue())


def load_checkpoint(path: str | Path) -> "tuple[dict[str, np.ndarray], dict[str, Any]]":
    """Return arrays and meta data. Raises InputError for a missing, foreign or damaged file, or another version."""
    import numpy as np

    source, raw = str(path), read_bytes(path)
    try:
        with np.load(io.BytesIO(raw), allow_pickle=False) as file:
            head, text = json.loads(str(file["head"])), str(file["meta"])
            known = head["format"] == FORMAT
            arrays = {name.removeprefix(_ARRAY): file[name] for name in file.files if name.startswith(_ARRAY)}
            whole = _checksum(arrays, text) == head["checksum"]
            meta = json.loads(text)
    except Exception:  # zip, npy and JSON readers raise different exceptions
        raise InputError("cannot be read: this is not a checkpoint, or it is incomplete.", file=source) from None
    if not known:
        raise InputError("this checkpoint is of another version of nectosome. Start again.", file=source)
    if not whole:
        raise InputError("this checkpoint is damaged: its checksum does not match. Start again.", file=source)
    return arrays, meta


def _checksum(arrays: Mapping[str, "np.ndarray"], text: str) -> str:
    digest = hashlib.sha256(text.encode())
    for name in sorted(arrays):
        array = arrays[name]
        digest.update(f"\0{name}\0{array.dtype.str}\0{array.shape}\0".encode())
        digest.update(array.tobytes())
    return digest.hexdigest()
