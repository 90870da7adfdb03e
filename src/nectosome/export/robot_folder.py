"""A robot as a folder that moves: its file, with all numbers in it, and the files of its meshes."""

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from nectosome.description import Rigid, RobotDescription, dump_robot
from nectosome.description.meshes import MeshShape, path_in
from nectosome.geometry import file_hash
from nectosome.io.file_system import reason
from nectosome.units import InputError


class FoundFiles(NamedTuple):
    """Files by their paths below a folder, and words for each that is not there."""

    contents: dict[str, bytes]
    missing: tuple[str, ...]


def robot_files(description: RobotDescription, name: str, source: Path) -> FoundFiles:
    """The robot file `name`, and the meshes that it names, which are looked for in the folder `source`.

    Recordings and drawings are in the robot file as numbers. What was measured of a mesh is so too: a robot whose mesh
    is not there, or has changed, is whole without it.
    """
    meshes = mesh_files(description, source)
    return FoundFiles({name: dump_robot(description).encode(), **meshes.contents}, meshes.missing)


def mesh_files(description: RobotDescription, source: Path) -> FoundFiles:
    """The meshes that a robot names, which are looked for in the folder `source`."""
    contents, missing = {}, []
    for shape in _meshes(description):
        try:
            path = path_in(source, shape.mesh)
            if file_hash(path) != shape.numbers.sha256:
                raise InputError("has changed since it was measured.")
            contents[shape.mesh] = path.read_bytes()
        except (InputError, OSError) as error:
            why = error.message if isinstance(error, InputError) else reason(error)
            missing.append(f"{shape.mesh}: {why}")
    return FoundFiles(contents, tuple(dict.fromkeys(missing)))


def _meshes(description: RobotDescription) -> Iterator[MeshShape]:
    for part in description.parts.values():
        if isinstance(part, Rigid) and isinstance(part.shape, MeshShape):
            yield part.shape
