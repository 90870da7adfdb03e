"""The rig's tab: a rig, simulated or real, plays signals or tracks a reference, within its limits."""

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import plotly.graph_objects as go
from jaxtyping import Float
from plotly.subplots import make_subplots

from nectosome.io import load_dataset
from nectosome.rigs import RigError
from nectosome.rigs.rig_file import RigFile, load_rig
from nectosome.studio.browser_script import RIG_RUNS
from nectosome.studio.desk import Desk
from nectosome.studio.rig_process import RigEnd, RigOrder
from nectosome.studio.rig_room import RigNews
from nectosome.studio.work import Progress, errors_shown, labelled
from nectosome.units import InputError
from nectosome.view.style import BLACK, BLUE, GREY, easy_unit

from .left_panel import PanelTask, Plot, add_text, note, small
from .rig_request import (
    SIMULATED,
    SIMULATED_FILE,
    PreparedRun,
    Signals,
    Tracking,
    channels_html,
    controlled,
    played,
    rig_files,
)

_POINTS = 250  # of a line, each with the least and the largest value around it
_HEIGHT = 0.32  # of a channel, as a share of the width
_OPEN, _CLOSED = "signals, open loop", "PID, closed loop"
_WINDOW = 20.0  # s that the plot shows during a run
_BIG = '<style>[id="{}"] {{ height: 4em !important; font-size: 1.3em; letter-spacing: 0.1em; }}</style>'


def channels_figure(units: Mapping[str, str], rows: Float[np.ndarray, "n columns"]) -> tuple[go.Figure, float]:
    """Figure of rows of a run's log, and its height as a share of its width; `units` are those of their columns."""
    column = dict(zip(units, rows.T, strict=True))
    lines = _lines_of(units)
    fig = make_subplots(len(lines), 1, shared_xaxes=True, vertical_spacing=0.3 / len(lines))
    for row, (name, drawn) in enumerate(lines.items(), start=1):
        size, unit = easy_unit(np.concatenate([column[of] for of in drawn]), units[name])
        for of, line in drawn.items():
            time, values = _thinned(column["time"], column[of])
            fig.add_scatter(x=time, y=size * values, line=line, mode="lines", name=of, row=row, col=1)
        title = f"{name} ({unit})" if unit else name
        fig.add_annotation(
            text=title, x=0, xref="paper", xanchor="left", y=1.0, yref=f"y{row if row > 1 else ''} domain",
            yanchor="bottom", showarrow=False, font_size=11,
        )  # fmt: skip
    small(fig).update_layout(height=None, showlegend=False, margin={"l": 44, "r": 8, "t": 22, "b": 36})
    fig.update_yaxes(nticks=5).update_xaxes(title="time (s)", row=len(lines))
    return fig, _HEIGHT * len(lines) + 0.12


def logged(path: Path) -> tuple[dict[str, str], Float[np.ndarray, "n columns"]]:
    """Units of the columns of a run's log, and all its rows."""
    data = load_dataset(path)
    units = {str(name): str(data[name].attrs["units"]) for name in ("time", *data.data_vars)}
    return units, np.stack([data[name].values for name in units], axis=1)


def _lines_of(units: Mapping[str, str]) -> dict[str, dict[str, dict[str, object]]]:
    """Columns that are drawn together, with their lines, by the one that names them.

    With a measurement are drawn its reference, and the command of the same name and unit, as that of a servo.
    """
    styles: dict[str, dict[str, dict[str, object]]] = {}
    commands = [name for name in units if name.endswith(".command")]
    drawn = {name for name in units if name in ("time", "late") or name.endswith((".command", ".reference"))}
    for name in (name for name in units if name not in drawn):
        lines: dict[str, dict[str, object]] = {name: {"color": BLUE, "width": 1.3}}
        if f"{name}.reference" in units:
            lines[f"{name}.reference"] = {"color": BLACK, "width": 1.2, "dash": "dot"}
        if units.get(f"{name}.command") == units[name]:
            commands.remove(f"{name}.command")
            lines[f"{name}.command"] = {"color": GREY, "width": 1.2}
        styles[name] = lines
    return styles | {name: {name: {"color": GREY, "width": 1.3}} for name in commands}


def _thinned(
    time: Float[np.ndarray, "n"], values: Float[np.ndarray, "n"]
) -> tuple[Float[np.ndarray, "m"], Float[np.ndarray, "m"]]:
    """At most twice as many points as are drawn, without loss of peaks: of each piece the least and the largest."""
    each = len(time) // _POINTS
    if each <= 2:
        return time, values
    count = len(time) // each
    pieces = values[: count * each].reshape(count, each)
    known = np.where(np.isfinite(pieces), pieces, 0.0)
    ends = np.sort(np.stack([known.argmin(axis=1), known.argmax(axis=1)], axis=1), axis=1)
    k = np.append((ends + each * np.arange(count)[:, None]).ravel(), np.arange(count * each, len(time)))
    return time[k], values[k]


class RigTask(PanelTask):
    """Lays out the tab."""

    def __init__(self, desk: Desk):
        super().__init__(desk)
        gui = desk.gui
        self._loaded: tuple[RigFile, Any] | None = None  # and what makes it anew
        self._own = False  # whether the run is of this tab
        self._seen = 0, False  # the newest run that was shown, and whether it had ended
        self._notice: Any = None
        self._stop = gui.add_button("STOP", color="red", disabled=True, hint="Space or Escape do the same.")
        gui.add_html(_BIG.format(self._stop._impl.uuid))
        self._stop.on_click(self._stopped)
        self._key = [gui.add_command(f"Stop the rig ({key})", hotkey=key, disabled=True) for key in ("space", "escape")]
        for command in self._key:
            command.on_trigger(self._stopped)
        self._said = gui.add_html("")
        self._plot = Plot(gui, "Channels")
        self._settings = gui.add_folder("Run")
        with self._settings:
            self._lay_out()
        self._file.on_update(lambda _: self._try(self._load))
        self._mode.on_update(lambda _: self._choose_mode())
        self._list()
        self._suggest_name()
        self._try(self._load)
        desk.rigs.watch(self._news)
        desk.on_closed(self._leave)

    def _lay_out(self) -> None:
        """What is chosen before a run."""
        gui = self._gui
        self._file: Any = gui.add_dropdown("Rig", (SIMULATED,))
        self._add_button("Look again", self._list)
        self._channels = gui.add_html("")
        self._add_button("Check: measure, move nothing", self._check)
        self._mode = gui.add_dropdown("Commands", (_OPEN, _CLOSED))
        self._open, self._closed = gui.add_folder("Signals"), gui.add_folder("PID", visible=False)
        self._signals = Signals(gui, self._open)
        with self._closed:
            self._tracking = Tracking(gui)
        self._time = add_text(gui, "Time", "10 s", "10 s")
        hint = "Time in which signals grow before it, and fall behind it."
        self._ramp = add_text(gui, "Ramp", "1 s", "1 s", hint=hint)
        hint = "Name of the file in the working folder; nothing is overwritten."
        self._name = add_text(gui, "Log", "rig_1.nc", hint=hint)
        self._add_button("Start", self._begin)

    def renew(self) -> None:
        """Nothing here is of the robot."""

    def _list(self) -> None:
        self._file.options = (SIMULATED, *rig_files(self._desk.folder))

    def _load(self) -> None:
        name = self._file.value
        make = partial(load_rig, SIMULATED_FILE if name == SIMULATED else self._desk.folder.existing(name))
        self._loaded = None
        self._channels.content = ""
        rig = make()
        with self._drawing:
            self._loaded = rig, make
            self._channels.content = channels_html(rig)
            self._signals.renew(rig)
            self._tracking.renew(rig)

    def _choose_mode(self) -> None:
        is_open = self._mode.value == _OPEN
        self._open.visible, self._closed.visible, self._ramp.visible = is_open, not is_open, is_open

    def _suggest_name(self) -> None:
        taken = {*self._desk.folder.names(".nc", ".csv")}
        k = next(k for k in range(1, len(taken) + 2) if not {f"rig_{k}.nc", f"rig_{k}.csv"} & taken)
        self._name.value = f"rig_{k}"

    def _chosen(self) -> tuple[RigFile, Any]:
        if self._loaded is None:
            raise InputError("no rig is chosen, or its file cannot be read. Choose one.", field=self._file.label)
        return self._loaded

    # --- a check

    def _check(self) -> None:
        rig, name = self._chosen()[0], self._file.value
        self._desk.work.begin("check of the rig", lambda _: self._readings(rig, name), partial(self._checked, rig))

    def _readings(self, rig: RigFile, name: str) -> tuple[float, ...]:
        """What it measures. Raises InputError for a fault of the rig."""
        with self._desk.rigs.taken(name):
            try:
                try:
                    rig.rig.connect()
                    return rig.rig.measure()
                finally:
                    rig.rig.close()
            except RigError as error:
                raise InputError(str(error)) from error

    def _checked(self, rig: RigFile, readings: tuple[float, ...]) -> None:
        self._channels.content = channels_html(rig, readings)
        self._desk.tell("every channel was read; nothing was moved.", False)

    # --- a run

    def _begin(self) -> None:
        rig, make = self._chosen()
        log = self._desk.folder.target(self._name.value, ".nc")
        prepare = partial(played, rig, self._signals.plan, self._time.value, self._ramp.value)
        if self._mode.value == _CLOSED:
            options = self._tracking.options
            prepare = partial(controlled, rig, options, self._time.value, self._tracking.gains)
        order = partial(RigOrder, make, log)
        compute = partial(self._run, self._file.value, rig.dt, prepare, order)
        self._desk.work.begin("rig", compute, self._ended)

    def _run(self, name: str, dt: float, prepare: Any, order: Any, progress: Progress) -> RigEnd | None:
        with labelled({"time": "Time", "ramp": "Ramp", **self._tracking.labels}):
            run: PreparedRun = prepare()
        if not progress("beginning", 0.0):
            return None
        order = order(run.name, run.signals, run.loops)
        order.experiment()  # what does not fit the rig is known before a process begins
        self._own = True
        try:
            return self._desk.rigs.run(name, order, run.seconds, round(_WINDOW / dt), progress)
        finally:
            self._own = False

    def _ended(self, end: RigEnd | None) -> None:
        self._suggest_name()
        if end is not None and end.path is not None:
            self._tell_saved(end.path)

    async def _stopped(self, _: Any) -> None:  # async: it waits for no thread that is busy
        self._desk.rigs.stop()

    def _leave(self) -> None:
        """The tab is closed: its run ends."""
        self._desk.rigs.unwatch(self._news)
        if self._own:
            self._desk.rigs.stop()

    # --- what is seen of any tab's run

    def _news(self, news: RigNews) -> None:
        with errors_shown(self._desk.tell), self._drawing:
            if (news.number, news.end is not None) < self._seen:
                return  # drawn late
            self._seen = news.number, news.end is not None
            self._show(news)

    def _show(self, news: RigNews) -> None:
        end = news.end
        self._stop.disabled, self._settings.visible = end is not None, end is not None
        for command in self._key:
            command.disabled = end is not None or not self._own
        self._notify(end is None and self._own)
        if end is None:
            who = "" if self._own else " It was started on another page; STOP ends it."
            self._said.content = note(f"{news.rig} runs.{who}", True)
        else:
            self._said.content = note(f"{news.rig}: {end.status}: {end.reason}", end.status != "finished")
        units, rows = news.units, news.rows
        if end is not None and end.path is not None and end.path.suffix == ".nc":
            units, rows = logged(end.path)
        if len(rows):
            self._plot.folder.visible = True
            self._plot.show(*channels_figure(units, rows))

    def _notify(self, runs: bool) -> None:
        """The notice by which the page's script knows that its keys stop the rig."""
        if runs and self._notice is None:
            self._notice = self._desk.notify(RIG_RUNS, "Space or Escape stops it, anywhere on this page.")
        elif not runs and self._notice is not None:
            self._notice.remove()
            self._notice = None
