"""Closed surfaces of triangles for tests."""

import numpy as np
import trimesh

from nectosome.geometry.triangles import Triangles


def of(mesh: trimesh.Trimesh) -> Triangles:
    return Triangles(np.asarray(mesh.vertices, float), np.asarray(mesh.faces))


def spheroid(along: float, across: float, fineness: int = 4) -> Triangles:
    """Half axes along x and across [m]."""
    sphere = of(trimesh.creation.icosphere(subdivisions=fineness))
    return sphere._replace(vertices=sphere.vertices * [along, across, across])


def box(*sides: float) -> Triangles:
    return of(trimesh.creation.box(sides))


def cylinder(length: float, radius: float) -> Triangles:
    """Along z."""
    return of(trimesh.creation.cylinder(radius, length, sections=48))


def octahedron() -> Triangles:
    corners = np.concatenate([np.eye(3), -np.eye(3)])
    faces = [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]]
    return Triangles(corners, np.array(faces))


def revolved(x: np.ndarray, radii: np.ndarray, sections: int = 96) -> Triangles:
    """Surface around the x axis through points from aft to ahead [m], the first and the last on the axis."""
    angles = np.linspace(0, 2 * np.pi, sections, endpoint=False)
    rings = np.stack([np.repeat(x[1:-1], sections), np.outer(radii[1:-1], np.cos(angles)).ravel(),
                      np.outer(radii[1:-1], np.sin(angles)).ravel()], axis=1)  # fmt: skip
    index = np.arange(len(rings)).reshape(-1, sections)
    on, a, b = np.roll(index, -1, axis=1), index[:-1].ravel(), index[1:].ravel()
    c, d = on[:-1].ravel(), on[1:].ravel()
    aft, ahead = np.full(sections, len(rings)), np.full(sections, len(rings) + 1)
    ends = np.stack([aft, on[0], index[0]], 1), np.stack([ahead, index[-1], on[-1]], 1)
    faces = np.concatenate([np.stack([a, c, b], 1), np.stack([c, d, b], 1), *ends])
    return Triangles(np.concatenate([rings, [[x[0], 0, 0], [x[-1], 0, 0]]]), faces)


def turned(triangles: Triangles, rotation: np.ndarray, by: tuple[float, float, float] = (0, 0, 0)) -> Triangles:
    return triangles._replace(vertices=triangles.vertices @ rotation.T + np.asarray(by))
