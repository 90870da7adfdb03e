"""Plates by their outlines as surfaces; no plotting here."""

import jax.numpy as jnp
import numpy as np

from nectosome.description.plates import PlateShape
from nectosome.geometry import Triangles
from nectosome.geometry.outlines import plate_faces
from nectosome.mechanism.plates import outline_moments


def plate_surface(plate: PlateShape) -> Triangles:
    """Surface of a plate in the axes of its part, from the centre of its area [m]."""
    points = np.array(plate.outline)
    faces = plate_faces(points - np.asarray(outline_moments(jnp.asarray(points)).centre), plate.thickness)
    x, y, normal = np.moveaxis(faces, -1, 0)
    corners = np.stack([x, -normal, y] if plate.plane == "xz" else [x, y, normal], axis=-1)
    k = np.arange(4 * len(corners)).reshape(-1, 4)
    return Triangles(corners.reshape(-1, 3), np.concatenate([k[:, [0, 1, 2]], k[:, [0, 2, 3]]]))
