"""Files of meshes: from the file to all that is measured of it, on one core, by formats and numbers of triangles.

The mesh is a bumpy ball. The reader of trimesh beside it hands over vertices and faces and looks at nothing.
"""

import statistics
import tempfile
from functools import partial
from pathlib import Path

import numpy as np
import trimesh

from nectosome.geometry import mesh_numbers

from .timing import once

_REPEATS = 5


def main() -> None:
    """Measure meshes of 10 000 to 400 000 triangles."""
    print("triangles  file   nectosome  trimesh, reading alone")
    with tempfile.TemporaryDirectory() as name:
        for around in (50, 158, 316):
            ball = trimesh.creation.uv_sphere(radius=50, count=[around, around])
            ball.vertices *= 1 + 0.1 * np.sin(ball.vertices[:, :1] / 5)
            for kind in ("stl", "ply", "obj"):
                path = Path(name) / f"ball.{kind}"
                ball.export(path)
                own, read = [], []
                for _ in range(_REPEATS):
                    mesh_numbers.measured_bytes.cache_clear()
                    own.append(once(partial(mesh_numbers.measure, path, "mm"))[0])
                    read.append(once(partial(trimesh.load_mesh, path, process=False))[0])
                times = f"{statistics.median(own):9.3f} s  {statistics.median(read):.3f} s"
                print(f"{len(ball.faces):9d}  {kind}  {times}", flush=True)


if __name__ == "__main__":
    main()
