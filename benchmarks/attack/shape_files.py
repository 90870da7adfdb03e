"""Meshes and drawings of parts: files of every format, damaged, foreign, or with the ending of another format."""

import io
import random
from collections.abc import Iterator, Mapping

import ezdxf
import trimesh

from .attempt import Attack, commanded, warm_up
from .damage import spoilt_files

_ROBOT = "name: part\nbody: {{kind: rigid, shape: {shape}, density: 1000 kg/m3, joint: {{kind: free}}}}\n"
_MESH, _DRAWING = "{{mesh: {file}, unit: mm}}", "{{drawing: {file}, unit: mm, thickness: 2 mm, plane: xy}}"
_SQUARE = "<svg xmlns='http://www.w3.org/2000/svg'><path d='M 0 0 L 30 0 C 40 5 40 15 30 20 L 0 20 Z'/></svg>"
_CORNERS = (0.0, 0.0), (30.0, 0.0), (30.0, 20.0), (0.0, 20.0)


def meshes(rng: random.Random, count: int) -> Iterator[Attack]:
    """Files of meshes beside a robot file that names them."""
    box = trimesh.creation.box((60.0, 40.0, 20.0))
    good = {f"part.{kind}": _bytes(box.export(file_type=kind)) for kind in ("stl", "obj", "ply")}
    good["text.stl"] = _bytes(box.export(file_type="stl_ascii"))
    return _attacks(rng, count, good, _MESH)


def drawings(rng: random.Random, count: int) -> Iterator[Attack]:
    """Drawings of outlines beside a robot file that names them."""
    document, lines = ezdxf.new(units=ezdxf.units.MM), io.StringIO()
    document.modelspace().add_lwpolyline(_CORNERS, close=True)
    document.write(lines)
    return _attacks(rng, count, {"fin.svg": _SQUARE.encode(), "fin.dxf": lines.getvalue().encode()}, _DRAWING)


def _bytes(exported: str | bytes) -> bytes:
    return exported.encode() if isinstance(exported, str) else exported


def _attacks(rng: random.Random, count: int, good: Mapping[str, bytes], shape: str) -> Iterator[Attack]:
    def checked(file: str, raw: bytes):
        robot = _ROBOT.format(shape=shape.format(file=file))
        return commanded(("check", "it.yaml"), {"it.yaml": robot.encode(), file: raw}, (file, "it.yaml"))

    warm_up(checked(file, raw) for file, raw in good.items())
    for about, file, raw in spoilt_files(rng, count, {file: (file, raw) for file, raw in good.items()}):
        yield Attack(about, checked(file, raw))
