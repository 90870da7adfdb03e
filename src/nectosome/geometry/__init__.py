"""Shapes of real parts: files of meshes, the closed surfaces in them and what those measure. Plain NumPy data."""

from .mesh_files import SUFFIXES, read_mesh_bytes
from .mesh_numbers import UNITS, Measured, file_hash, is_likely, measure, measured_bytes, outer_surface
from .packed import pack_slices, pack_surface, packed, unpack_slices, unpack_surface, unpacked
from .simplify import creased, keeps_volume, simplified
from .slices import MeshSlices
from .triangles import Moments, Triangles, area_vectors
