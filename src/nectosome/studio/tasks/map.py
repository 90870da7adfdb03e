"""The tab that maps what a robot's motion gives over one or two of its quantities; a click loads a point."""

from functools import partial
from typing import Any

import numpy as np
import plotly.graph_objects as go
import xarray as xr

from nectosome.core import Status
from nectosome.description import (
    RobotDescription,
    dump_robot,
    get_value,
    numeric_paths,
    parse_robot,
    resolve,
    with_values,
)
from nectosome.designs.axes import SweepAxis, axis_of
from nectosome.designs.sweep import mean_of, nonzero_means, sweep
from nectosome.io import load_dataset, save_dataset
from nectosome.studio.desk import Desk
from nectosome.studio.folder import NOTHING
from nectosome.studio.sliders import SliderScale, scales_of
from nectosome.studio.work import Progress
from nectosome.units import InputError, shorten
from nectosome.view.saved import check_sweep
from nectosome.view.style import VERMILLION
from nectosome.view.sweep import axis_of as shown_axis
from nectosome.view.sweep import sides, sweep_figure

from .left_panel import PanelTask, Plot, add_text, note, small

_POINTS = 5  # of an axis at first
_STEP = 0.1  # of the robot's value, between them
_MOST = 2500  # points
_NEAR = 1e-3  # of an axis' largest value: so far a number that is written may lie beyond an end
_GOOD = {status.name for status in (Status.SOLVED, Status.SETTLED, Status.UNSTABLE)}


class Map(PanelTask):
    """Lays out the tab."""

    def __init__(self, desk: Desk):
        super().__init__(desk)
        gui = desk.gui
        self._found: xr.Dataset | None = None
        hint = "PATH=LOW..HIGH:STEP, or PATH=A,B,C; units at the end."
        one, two = "L=300..700:50 mm", "E=3,5,10 MPa"
        self._axes = [
            add_text(gui, "Axis 1", one, hint=hint),
            add_text(gui, "Axis 2", two, hint=f"{hint} May be empty."),
        ]
        self._add_button("Compute map", self._begin)
        self._shown: Any = gui.add_dropdown("Show", (NOTHING,))
        self._shown.on_update(lambda _: self._try(self._draw))
        self._line = gui.add_html("")
        self._plot = Plot(gui, order=0)
        with self._plot.folder:
            gui.add_html('<span id="studio-map"></span>')  # behind which a click on the map is typed
            hint = "A click on the map loads its point; so does its x, y here."
            self._point = add_text(gui, "Point", "0.5, 0.006", hint=hint)
            self._point.on_update(self._pointed)
        with gui.add_folder("Saved maps"):
            self._name = gui.add_text("Name", "map")
            self._add_button("Save map (.nc)", self._save)
            self._saved: Any = gui.add_dropdown("File", (NOTHING,))
            self._add_button("Open map", self._open)

    def renew(self) -> None:
        """Ask for a map around the robot of the desk."""
        robot, problem = self._desk.description, self._desk.problem
        with self._drawing:
            self._robot, self._found = self._robot + 1, None
            self._plot.folder.visible, self._line.content, self._point.value = False, "", ""
        scales = scales_of(robot, problem.vary)
        for field, scale in zip(self._axes, [*scales[:2], None, None], strict=False):
            field.value = "" if scale is None else _around(scale, float(get_value(robot, scale.name)))
        self._look()

    def _look(self) -> None:
        self._saved.options = self._desk.folder.choices(".nc")

    def _pointed(self, event: Any) -> None:
        if event.client is not None:  # not emptied by us
            self._try(self._load)

    def _begin(self) -> None:
        description, robot = self._desk.description, self._robot
        axes = [_axis(field, description) for field in self._axes if field.value.strip()]
        if not axes:
            raise InputError("is empty: say what to go over, as in L=300..700:100mm.", field=self._axes[0].label)
        paths = [path for axis in axes for path in resolve(description, axis.name)]
        if len(set(paths)) < len(paths):
            raise InputError("names a quantity twice.", field="Axis 2")
        points = int(np.prod([len(axis.values) for axis in axes]))
        if points > _MOST:
            raise InputError(f"{points} points are too many for this page: {_MOST} at most. Take nectosome sweep.")

        machines = self._desk.machines
        request = "\n".join(("map", *(field.value for field in self._axes), dump_robot(description)))

        def compute(progress: Progress) -> xr.Dataset:
            progress(f"{points} points, the first ones while their equations are compiled", 0.0)
            over = {axis.name: axis.values for axis in axes}
            with machines.kept(request) as folder, machines.executor() as executor:
                return sweep(description, over, folder=folder, executor=executor, progress=progress)

        self._desk.work.begin(machines.named("map"), compute, partial(self._take, robot))

    def _take(self, robot: int, found: xr.Dataset) -> None:
        with self._drawing:
            if robot != self._robot:
                return
            self._found, self._point.value = found, ""
        known, last = tuple(nonzero_means(found)) or (NOTHING,), self._shown.value
        along = f"force.{self._desk.problem.forward.lstrip('-')}"
        self._shown.options = known
        self._shown.value = next(name for name in (last, "speed", along, known[0]) if name in known)
        self._draw()

    def _draw(self) -> None:
        """Show the map, if there is one."""
        with self._drawing:
            table, name = self._found, self._shown.value
            if table is None or (name == NOTHING and nonzero_means(table)):
                return
            unsolved = int((~table["status"].isin([*_GOOD])).sum())
            words = f"{table['status'].size} points, {unsolved} without a motion (crosses)" if unsolved else ""
            self._plot.folder.visible = known = name != NOTHING
            self._line.content = note(words or ("" if known else "No point of the map moves."))
            if known:
                self._plot.show(_figure(table, name, self._point.value), 0.85)

    def _load(self) -> None:
        """Take the numbers of the point in the field. Raises InputError where it is none, or not yet."""
        table = self._found
        if table is None or not self._point.value.strip():
            return
        place = place_of(self._point.value, table)
        if place is None:
            ends = (f"{name} from {axis.min():.6g} to {axis.max():.6g}" for name, axis in _places(table).items())
            words = f'"{shorten(self._point.value)}" is no point of the map. Write {", ".join(ends)}.'
            raise InputError(words, field=self._point.label)
        self._desk.tell("", False)
        robot = parse_robot(table.attrs["robot"])
        self._desk.become(with_values(robot, {name: float(table[name][k]) for name, k in place.items()}))
        self._draw()

    def _save(self) -> None:
        if self._found is None:
            raise InputError("there is no map yet.")
        path = self._desk.folder.target(self._name.value, ".nc")
        save_dataset(self._found, path)
        self._look()
        self._saved.value = self._desk.folder.name(path)
        self._tell_saved(path)

    def _open(self) -> None:
        name = self._saved.value
        if name == NOTHING:
            return
        table = load_dataset(self._desk.folder.existing(name))
        check_sweep(table, name)
        own, robot = self._desk.description, parse_robot(table.attrs["robot"], f"{name}, its robot")
        if robot.name != own.name or numeric_paths(robot).keys() != numeric_paths(own).keys():
            raise InputError(f"is a map of {robot.name}, not of the robot that is shown. Open that one.", field=name)
        self._take(self._robot, table)
        self._desk.tell(f"opened {name}", False)


def place_of(point: str, found: xr.Dataset) -> dict[str, int] | None:
    """Nearest place on each axis to `x, y` in the units of the figure; None where that is no point of the map."""
    axes = _places(found)
    try:
        values = [float(text) for text in point.split(",")]
    except ValueError:
        return None
    if len(values) != len(axes):
        return None
    pairs = list(zip(axes.values(), values, strict=True))
    near = [_NEAR * np.abs(axis).max() for axis in axes.values()]
    if not all(axis.min() - e <= x <= axis.max() + e for (axis, x), e in zip(pairs, near, strict=True)):
        return None
    return {name: int(np.argmin(np.abs(axis - x))) for name, (axis, x) in zip(axes, pairs, strict=True)}


def _places(found: xr.Dataset) -> dict[str, np.ndarray]:
    """Values on each axis, in the units of the figure."""
    return {name: shown_axis(found[name]).values for name in sides(found)}


def _axis(field: Any, description: RobotDescription) -> SweepAxis:
    """Axis that a field of the page asks for. Raises InputError."""
    try:
        name, equals, values = (part.strip() for part in field.value.partition("="))
        if not (name and equals):
            raise InputError(f'"{shorten(field.value)}" must have a name, = and values.')
        return axis_of(name, values, description)
    except InputError as error:
        raise InputError(error.message, field=field.label) from None


def _around(scale: SliderScale, value: float) -> str:
    """Axis around a value [SI], in the unit of its slider and within it."""
    shown = scale.shown(value)
    step = float(f"{_STEP * abs(shown):.2g}") or (scale.high - scale.low) / (_POINTS - 1)
    step = min(step, (scale.high - scale.low) / (_POINTS - 1))
    wide = (_POINTS - 1) * step
    low = min(max(shown - 0.5 * wide, scale.low), scale.high - wide)
    return f"{scale.name}={low:.6g}..{low + wide:.6g}:{step:.6g} {scale.unit}".strip()


def _figure(found: xr.Dataset, name: str, point: str) -> go.Figure:
    """The map or curve, with what has no motion, and why, and the point that is loaded."""
    fig, names = small(sweep_figure(found, name)), sides(found)
    axes = [shown_axis(found[side]).values for side in names]
    status = found["status"].transpose(*names).values
    mean = mean_of(found, name)
    level = float(np.nanmin(mean)) if len(names) == 1 else 0.0  # where a point without a value stands
    rows: list[tuple[np.ndarray, dict[str, Any], list[str]]] = []
    bad = np.argwhere(~np.isin(status, [*_GOOD]))
    cross = {"symbol": "x", "size": 8, "color": VERMILLION}
    rows.append((bad, cross, [Status[str(status[tuple(k)])].reason for k in bad]))
    loaded = place_of(point, found)
    ring = {"symbol": "circle-open", "size": 15, "color": VERMILLION, "line": {"width": 3}}
    if loaded is not None:
        rows.append((np.array([[loaded[side] for side in names]]), ring, ["loaded"]))
    values = mean.transpose(*names).values
    for places, marker, words in rows:
        x = [axes[0][k[0]] for k in places]
        y = [axes[1][k[1]] if len(names) == 2 else np.nan_to_num(values[k[0]], nan=level) for k in places]
        hover = "%{text}<extra></extra>"
        fig.add_scatter(x=x, y=y, mode="markers", marker=marker, text=words, hovertemplate=hover, cliponaxis=False)
    fig.update_layout(
        meta=f"studio-map-{len(names)}", margin_t=16, margin_r=64 if len(names) == 2 else 12, showlegend=False
    )
    return fig
