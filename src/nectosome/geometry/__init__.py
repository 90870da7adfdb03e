"""Shapes of real parts: files of meshes, the closed surfaces in them and what those measure. Plain NumPy data."""

from .mesh_files import SUFFIXES, read_mesh_bytes
from .mesh_numbers import UNITS, Measured, file_hash, is_likely, measure, outer_surface
from .packed import pack_slices, pack_surface, unpack_slices, unpack_surface
from .simplify import creased, keeps_volume, simplified
from .slices import MeshSlices
from .triangles import Moments, Triangles, area_vectors

__all__ = [
    "SUFFIXES",
    "UNITS",
    "Measured",
    "MeshSlices",
    "Moments",
    "Triangles",
    "area_vectors",
    "creased",
    "file_hash",
    "is_likely",
    "keeps_volume",
    "measure",
    "outer_surface",
    "pack_slices",
    "pack_surface",
    "read_mesh_bytes",
    "simplified",
    "unpack_slices",
    "unpack_surface",
]
