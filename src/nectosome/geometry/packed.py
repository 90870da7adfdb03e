"""Rows of numbers as short text that reads back as the same bits, for files."""

import base64
import binascii
import zlib

import numpy as np

from .slices import MeshSlices
from .triangles import Triangles

_STEPS = 65535  # of a coordinate over the size of the surface
_LONGEST = 1_000_000  # bytes
_FEWEST = 98  # bytes: of a tetrahedron


def packed(numbers: bytes) -> str:
    """Bytes as text: zlib, then base 64."""
    return base64.b64encode(zlib.compress(numbers, 9)).decode()


def unpacked(text: str) -> bytes:
    """The bytes of `packed`. Raises ValueError for any other text and for more than a megabyte."""
    try:
        reader = zlib.decompressobj()
        numbers = reader.decompress(base64.b64decode(text, validate=True), _LONGEST)
    except (binascii.Error, zlib.error) as error:
        raise ValueError("it was cut or changed") from error
    if not reader.eof:
        raise ValueError("it was cut or changed")
    return numbers


def pack_surface(surface: Triangles) -> str:
    """A surface of at most 65535 corners as text, its corners rounded to 1/65535 of its size along each axis."""
    low, high = surface.bounds
    steps = np.round((surface.vertices - low) / np.where(high > low, high - low, 1.0) * _STEPS)
    bounds, whole = surface.bounds.astype("<f8"), np.concatenate([[len(steps)], steps.ravel(), surface.faces.ravel()])
    return packed(bounds.tobytes() + whole.astype("<u2").tobytes())


def unpack_surface(text: str) -> Triangles:
    """The surface of a text. Raises ValueError for any other text."""
    numbers = unpacked(text)
    if len(numbers) < _FEWEST or len(numbers) % 2:
        raise ValueError("it was cut or changed")
    (low, high), (n, *_) = np.frombuffer(numbers[:48], "<f8").reshape(2, 3), np.frombuffer(numbers[48:], "<u2")
    whole = np.frombuffer(numbers[50:], "<u2").astype(int)
    steps, faces = whole[: 3 * n], whole[3 * n :]
    if not np.isfinite([low, high]).all() or len(faces) % 3 or not len(faces) or faces.max() >= n:
        raise ValueError("it was cut or changed")
    return Triangles(low + (high - low) * steps.reshape(-1, 3) / _STEPS, faces.reshape(-1, 3))


def pack_slices(slices: MeshSlices) -> str:
    """Slices as text, each number with all of its digits."""
    table = np.concatenate([slices.share[:, None], slices.centre, slices.half], axis=1)
    return packed(table.astype("<f8").tobytes())


def unpack_slices(text: str) -> MeshSlices:
    """The slices of a text. Raises ValueError for any other text."""
    numbers = unpacked(text)
    if not numbers or len(numbers) % 48:
        raise ValueError("it was cut or changed")
    table = np.frombuffer(numbers, "<f8").reshape(-1, 6)
    if not np.isfinite(table).all() or abs(table[:, 0].sum() - 1) > 1e-9:
        raise ValueError("it was cut or changed")
    return MeshSlices(table[:, 0], table[:, 1:4], table[:, 4:])
