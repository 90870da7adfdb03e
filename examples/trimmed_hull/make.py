"""Make the meshes of this folder: a hull of revolution and a fin, as binary STL in millimetres, few triangles each."""

import sys
from pathlib import Path

import numpy as np

LENGTH, RADIUS, AROUND = 520.0, 60.0, 20  # mm, mm, corners of each ring
NOSE, TAIL = 120.0, 200.0  # mm, of half an ellipsoid and of a paraboloid; a cylinder is between them
SPAN, ROOT, TIP, THICK = 120.0, 70.0, 45.0, 8.0  # of the fin [mm]

Corners = np.ndarray  # of triangles, shape (m, 3, 3), counter-clockwise as seen from outside [mm]


def hull() -> Corners:
    """Nose ahead along +x, tail in the origin."""
    tail = TAIL * np.linspace(0, 1, 7)
    nose = LENGTH - NOSE * np.cos(np.linspace(0, np.pi / 2, 7))
    x = np.concatenate([tail, nose])
    radii = RADIUS * np.where(x <= TAIL, 1 - (1 - x / TAIL) ** 2, 1.0)
    ahead = np.clip((x - LENGTH + NOSE) / NOSE, 0, 1)
    radii = radii * np.sqrt(1 - ahead**2)
    angle = 2 * np.pi * np.arange(AROUND) / AROUND
    rings = np.stack(
        [
            np.broadcast_to(x[:, None], (x.size, AROUND)),
            radii[:, None] * np.cos(angle),
            radii[:, None] * np.sin(angle),
        ],
        axis=-1,
    )
    return skin(rings)


def fin() -> Corners:
    """Span along +x from the hull, chord along y, the shaft in the origin at a third of the chord."""
    chord = np.array([0.0, 0.05, 0.3, 0.7, 1.0])  # from the edge ahead, which is at +y
    half = 0.5 * THICK * np.array([0.0, 0.7, 1.0, 0.6, 0.0])
    outline = np.concatenate([np.stack([chord, half], 1), np.stack([chord, -half], 1)[-2:0:-1]])
    sections = [(0.0, 0.0), (0.0, 1.0), (SPAN, TIP / ROOT), (SPAN, 0.0)]  # the ends close in a point
    rings = []
    for x, share in sections:
        y, z = (0.33 - outline[:, 0]) * ROOT * share, outline[:, 1] * share
        rings.append(np.stack([np.full(len(outline), x), y, z], axis=-1))
    return skin(np.array(rings))


def skin(rings: np.ndarray) -> Corners:
    """Triangles between rings of points, those without an area left out, with their normals outwards."""
    a, b = rings[:-1], rings[1:]
    c, d = np.roll(a, -1, axis=1), np.roll(b, -1, axis=1)
    corners = np.concatenate([np.stack(t, axis=-2).reshape(-1, 3, 3) for t in ((a, b, c), (c, b, d))])
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    corners = corners[area > 1e-6]
    volume = np.sum(corners[:, 0] * np.cross(corners[:, 1], corners[:, 2]))
    return corners if volume > 0 else corners[:, ::-1]


def write_stl(path: Path, corners: Corners) -> None:
    """Write a binary STL file; readers work out the normals."""
    triangles = np.zeros(len(corners), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("more", "<u2")])
    triangles["corners"] = corners
    header = b"made by examples/trimmed_hull/make.py".ljust(80)
    path.write_bytes(header + np.uint32(len(corners)).tobytes() + triangles.tobytes())


def main(folder: Path) -> None:
    """Write both meshes."""
    write_stl(folder / "hull.stl", hull())
    write_stl(folder / "fin.stl", fin())


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
