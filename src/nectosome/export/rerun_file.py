"""A saved run as a file of rerun.io: its parts in motion, and all of its numbers over time."""

from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from jaxtyping import Float, Int
from plotly.colors import hex_to_rgb

from nectosome.description import WaterDescription
from nectosome.io.atomic import write_atomic
from nectosome.io.extras import package
from nectosome.units import InputError
from nectosome.view.display.bodies import RigidMesh, Soft, bodies_of, disc_mesh, slice_mesh
from nectosome.view.tubes import description

from .run_table import column_groups, run_table

_AROUND = 4.0  # how far planes reach beyond the path, in lengths of the robot
_AWAY, _DIRECTION = 1.2, np.array((-0.7, -1.0, 0.6))  # of the camera, in lengths of the robot
_SEEN = 0.6  # of the camera's view to each side, in lengths of the robot
_HERE = ("world", "here")
_WATER, _GROUND, _PATH = (120, 180, 220, 70), (196, 182, 152, 120), (120, 126, 134)
_FIRST_PLOTS = (("velocity", "{body}"), ("energy",))  # beside the robot, as the file opens


def write_rerun(run: xr.Dataset, path: Path) -> None:
    """Write a run for the viewer of rerun.io, whole or not at all: one that `view.saved.check_drawable` accepts.

    Below /world/robot, with z up, each part is a mesh in the frame of its first station, with its pose over time; a
    rod is slices in the frame of its root, as in the studio. Places [m] have 32 bits, as in the viewer. Below /numbers
    are the columns of `run_table`, in 64 bits: those whose headings differ in the last word only are one entity, and
    each heading names its series. The timeline `time` is rounded to 1 ns.

    Nothing is sent anywhere. Raises InputError where the package is missing or switched off, and where the file cannot
    be written.
    """
    rerun = package("rerun", "rerun")
    # properties would hold when the file was written
    stream = rerun.RecordingStream("nectosome", send_properties=False)
    if not rerun.is_enabled(stream):
        raise InputError("the environment variable RERUN switches rerun off: unset it.")
    memory = stream.memory_recording()
    with rerun.error_utils.catch_and_log_exceptions(strict=True):  # else what fails is left out, with a warning
        stream.send_recording_name(str(run.attrs.get("title") or "simulation"))
        _RerunWriter(rerun, stream, run).write()
    write_atomic(path, memory.drain_as_bytes())


class _RerunWriter:
    def __init__(self, rerun: Any, stream: Any, run: xr.Dataset):
        self._rerun, self._stream, self._run = rerun, stream, run
        nanoseconds = np.rint(1e9 * run["time"].values).astype("timedelta64[ns]")
        self._times = [rerun.TimeColumn("time", duration=nanoseconds)]

    def write(self) -> None:
        """Write everything; first how the file opens."""
        body = str(self._run["part"].values[0])
        groups = self._groups()
        plots = [tuple(word.format(body=body) for word in words) for words in _FIRST_PLOTS]
        robot = description(self._run)
        bodies = bodies_of(self._run, robot)
        corners = np.concatenate([shape.corners(0) for shape in bodies.values()] or [np.zeros((1, 3))])
        size = float(np.ptp(corners, axis=0).max()) or 1.0
        self._open_with(body, corners.mean(axis=0), size, [words for words in plots if words in groups])
        self._keep(("world",), self._rerun.ViewCoordinates.RIGHT_HAND_Z_UP)
        for name, shape in bodies.items():
            part = ("world", "robot", name)
            self._send(part, self._rerun.Transform3D.columns(**_pose(shape)))
            if isinstance(shape, RigidMesh):
                self._keep(part, self._mesh(*_lit(shape.vertices, shape.faces, shape.flat), shape.colour))
            else:
                self._write_rod(part, shape)
        self._write_path(body, size)
        if robot is not None:
            self._write_water(robot.water, _AROUND * size)
        for words, (headings, values) in groups.items():
            self._keep(("numbers", *words), self._rerun.SeriesLines(names=headings))
            columns = self._rerun.Scalars.columns(scalars=values.ravel())
            self._send(("numbers", *words), columns.partition([len(headings)] * len(values)))

    def _groups(self) -> dict[tuple[str, ...], tuple[list[str], Float[np.ndarray, "t n"]]]:
        """Columns of the table, by the words of their headings."""
        table = run_table(self._run)
        groups = column_groups(table)
        return {words: (headings, table[headings].to_numpy(dtype=float)) for words, headings in groups.items()}

    def _write_rod(self, words: tuple[str, ...], rod: Soft) -> None:
        slices = [rod.slices(k) for k in range(len(rod.place))]
        for inner, (vertices, faces), batches in (
            (words, slice_mesh(), slices),
            ((*words, "ends"), disc_mesh(), [one.ends for one in slices]),
        ):
            self._keep(inner, self._mesh(*_lit(vertices, faces, flat=False), rod.colour))
            place, turn, size = (np.concatenate(values) for values in zip(*batches, strict=True))
            poses = {"translations": place, "quaternions": _xyzw(turn), "scales": size}
            columns = self._rerun.InstancePoses3D.columns(**poses)
            self._send(inner, columns.partition([len(one.place) for one in batches]))

    def _write_path(self, body: str, size: float) -> None:
        """Write the path of this part, and what the camera follows along it."""
        station = int(np.flatnonzero(self._run["station_part"].values == body)[0])
        path = self._run["position"].values[:, station]
        self._keep(("world", "path"), self._rerun.LineStrips3D([path], colors=[_PATH]))
        # the camera follows the box around what has one: a triangle without area, which is not drawn
        corners = _SEEN * size * np.array([[-1.0], [1.0]]) * np.ones(3)
        self._keep(_HERE, self._rerun.Mesh3D(vertex_positions=corners, triangle_indices=[[0, 1, 1]]))
        self._send(_HERE, self._rerun.Transform3D.columns(translation=path))

    def _write_water(self, water: WaterDescription, beyond: float) -> None:
        """Write surface, floor and walls as planes that reach so far [m] beyond the path."""
        places = self._run["position"].values.reshape(-1, 3)
        low, high = places.min(axis=0) - beyond, places.max(axis=0) + beyond
        planes = {"surface": (2, water.surface, _WATER), "floor": (2, water.floor, _GROUND)}
        planes |= {f"wall_{end}": (0, x, _WATER) for end, x in zip(("low", "high"), water.walls or (), strict=False)}
        for name, (axis, at, colour) in planes.items():
            if at is None:
                continue
            others = [other for other in range(3) if other != axis]
            corners = np.full((4, 3), float(at))
            for corner, (i, j) in zip(corners, ((0, 0), (1, 0), (1, 1), (0, 1)), strict=True):
                corner[others] = (low, high)[i][others[0]], (low, high)[j][others[1]]
            plane = self._rerun.Mesh3D(
                vertex_positions=corners, triangle_indices=[[0, 1, 2], [0, 2, 3]], albedo_factor=colour
            )
            self._keep(("world", "around", name), plane)

    def _open_with(self, body: str, middle: Float[np.ndarray, "3"], size: float, plots: list[tuple[str, ...]]) -> None:
        """Open with the robot, of this size [m] and about this place, beside plots; the camera goes along."""
        blueprint = package("rerun.blueprint", "rerun")
        eye = middle + _AWAY * size * _DIRECTION
        follow = blueprint.EyeControls3D(position=eye, look_target=middle, tracking_entity=self._entity(_HERE))
        views = [blueprint.TimeSeriesView(origin=self._entity(("numbers", *words)), name=words[0]) for words in plots]
        robot = blueprint.Spatial3DView(origin="/world", name="robot", eye_controls=follow)
        parts = blueprint.Horizontal(robot, blueprint.Vertical(*views))
        self._stream.send_blueprint(blueprint.Blueprint(parts, collapse_panels=True))

    def _mesh(self, vertices: np.ndarray, normals: np.ndarray, faces: np.ndarray, colour: str) -> Any:
        shape = {"vertex_positions": vertices, "vertex_normals": normals, "triangle_indices": faces}
        return self._rerun.Mesh3D(**shape, albedo_factor=hex_to_rgb(colour))

    def _keep(self, words: tuple[str, ...], what: Any) -> None:
        self._stream.log(self._entity(words), what, static=True)

    def _send(self, words: tuple[str, ...], columns: Any) -> None:
        self._stream.send_columns(self._entity(words), self._times, columns)

    def _entity(self, words: tuple[str, ...]) -> str:
        return self._rerun.new_entity_path(list(words))


def _pose(shape: RigidMesh | Soft) -> dict[str, np.ndarray]:
    return {"translation": shape.place, "quaternion": _xyzw(shape.turn)}


def _xyzw(turn: Float[np.ndarray, "n 4"]) -> Float[np.ndarray, "n 4"]:
    """Quaternions with the scalar last, from those with it first."""
    return np.roll(turn, -1, axis=-1)


def _lit(
    vertices: Float[np.ndarray, "n 3"], faces: Int[np.ndarray, "m 3"], flat: bool
) -> tuple[Float[np.ndarray, "k 3"], Float[np.ndarray, "k 3"], Int[np.ndarray, "m 3"]]:
    """Vertices, their unit normals, and faces: the viewer shades none without normals.

    A normal is that of the faces around, by area; of a flat mesh that of its face, which shares no vertices then.
    """
    if flat:
        vertices, faces = vertices[faces].reshape(-1, 3), np.arange(faces.size).reshape(-1, 3)
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    normals = np.zeros_like(vertices)
    np.add.at(normals, faces, np.cross(b - a, c - a)[:, None])
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return vertices, normals / np.where(length > 0, length, 1.0), faces
