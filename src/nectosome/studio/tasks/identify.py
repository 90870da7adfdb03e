"""The tab that finds unknown quantities of a robot from a recording of its motion."""

import json
from contextlib import suppress
from pathlib import Path
from typing import Any

import xarray as xr

from nectosome.description import RobotDescription, driving_signals, with_values
from nectosome.identification import FitSoFar, FitStoppedError, RobotFit, identify
from nectosome.measure import read
from nectosome.measure.formats.source import endings
from nectosome.measure.labels import unit_of
from nectosome.model import build
from nectosome.solve import common_readings, reading_of
from nectosome.studio.desk import Desk
from nectosome.studio.folder import NOTHING
from nectosome.studio.sliders import around
from nectosome.studio.uploads import received
from nectosome.studio.work import STOP, Progress, labelled
from nectosome.units import DIMENSIONS, InputError, read_pairs, shorten
from nectosome.view.fit_pages import robot_panel
from nectosome.view.scorecard import number as shown

from .column_guesses import guessed
from .left_panel import PanelTask, Plot, add_text, cells, note, with_legend

_SHEETS = (".yaml", ".yml")
_NONE = "none"
_FIELDS = {  # examples and hints, by label
    "Compare": ("push=-force.y", "One a line: COLUMN=READING."),
    "Driven by": ("torque=limbs.fin.joint.torque", "One a line: COLUMN=PATH of a signal of the robot."),
    "Unknown": ("limbs.fin.young = 1..9 MPa log", "One a line: PATH = LOW..HIGH, and log for a logarithmic scale."),
    "At the start": (
        "body.joint.position = -20..20 deg",
        "One a line, if it does not start as its file says: PATH = LOW..HIGH of what is unknown, a number, or reading. "
        "PATH is of a joint or a strain, or before.PATH of what the robot had before it was let go.",
    ),
}
_FOUND, _STOPPED = "Apply what was found", "Apply the best so far"
_MOST = 64  # starts
_NOTHING_YET = "the fit was stopped before its first step: there is no best so far."


class Identify(PanelTask):
    """Lays out the tab."""

    def __init__(self, desk: Desk):
        super().__init__(desk)
        gui = desk.gui
        self._recording: xr.Dataset | None = None
        self._found: RobotDescription | None = None
        hint = "What recordings do not say themselves, such as units: a file of the folder, taken as they are read."
        self._sheet: Any = gui.add_dropdown("Sheet", (_NONE,), hint=hint)
        sent = gui.add_upload_button("Send a recording (.csv, ...)")
        sent.on_upload(lambda _: self._try(lambda: self._send(sent.value.name, sent.value.content)))
        self._file: Any = gui.add_dropdown("File", (NOTHING,))
        self._add_button("Open recording", self._open)
        gui.add_button("Look again").on_click(lambda _: self._look())
        self._columns = gui.add_html("")
        self._compare, self._drive, self._unknown, self._start = (
            add_text(gui, label, example, multiline=True, hint=hint) for label, (example, hint) in _FIELDS.items()
        )
        hint = "How much later readings are than inputs: LOW..HIGH of what is unknown, or a time."
        self._shift = add_text(gui, "Readings late by", "-0.2..0.2 s", hint=hint)
        self._skip = gui.add_number("Leave out first (s)", 0.0, min=0.0, step=0.1)
        self._starts = gui.add_number("Starts", 1, min=1, max=_MOST, step=1)
        self._add_button("Identify", self._begin)
        self._plot = Plot(gui)
        self._table = gui.add_html("")
        self._apply = self._add_button(_FOUND, self._become, visible=False)

    def renew(self) -> None:
        """Begin anew for another robot; a recording that was read stays."""
        robot, problem = self._desk.description, self._desk.problem
        with self._drawing:
            self._robot, self._found = self._robot + 1, None
            self._plot.folder.visible = self._apply.visible = False
            self._table.content = ""
        ranges = {name: str(span) for name, span in problem.vary.items()}
        if not ranges:
            variables = (around(robot, alias) for alias in robot.number_aliases)
            ranges = {v.name: v.text() for v in variables if v is not None}
        self._unknown.value = "\n".join(f"{name} = {text}" for name, text in ranges.items())
        self._look()
        self._guess()

    def _look(self) -> None:
        folder = self._desk.folder
        self._file.options = folder.choices(*endings())
        self._sheet.options = [_NONE, *(name for name in folder.names(*_SHEETS) if not name.endswith(".design.yaml"))]

    def _send(self, name: str, data: bytes) -> None:
        with received(name, data) as path:
            self._take(path, path.name)

    def _open(self) -> None:
        name = self._file.value
        if name != NOTHING:
            self._take(self._desk.folder.existing(name), name)

    def _take(self, path: Path, name: str) -> None:
        """Take a recording, as the sheet says."""
        sheet = None if self._sheet.value == _NONE else self._desk.folder.existing(self._sheet.value)
        recording = read(path, sheet).load()
        if "time" not in recording.dims:
            raise InputError("has no time.", file=name)
        self._recording = recording
        time, columns = recording["time"].values, recording.data_vars.items()
        listed = ", ".join(f"{column} ({unit_of(values) or '1'})" for column, values in columns)
        words = f"{shorten(name)}: {time.size} samples, {time[-1] - time[0]:.4g} s; {listed}"
        self._guess()
        self._columns.content = note(words)
        self._desk.tell(f"{shorten(name)} was read", False)

    def _guess(self) -> None:
        """What columns are, as far as their names tell."""
        if self._recording is None:
            return
        robot = build(self._desk.description)
        readings = {name: reading_of(robot, name).unit for name in common_readings(robot)}
        columns = {str(column): unit_of(values) for column, values in self._recording.data_vars.items()}
        compare, drives = guessed(columns, _signals(self._desk.description), readings)
        self._compare.value, self._drive.value = (
            "\n".join(f"{column}={of}" for column, of in found.items()) for found in (compare, drives)
        )

    def _begin(self) -> None:
        recording, robot, number = self._recording, self._desk.description, self._robot
        if recording is None:
            raise InputError("there is no recording yet. Send one, or open one of the folder.")
        compare, drive, vary = (
            read_pairs(filter(str.strip, field.value.splitlines()), label, "angle = fin.angle")
            for field, label in ((self._compare, "Compare"), (self._drive, "Driven by"), (self._unknown, "Unknown"))
        )
        for label, given in (("Compare", compare), ("Unknown", vary)):
            if not given:
                raise InputError("is empty: give at least one.", field=label)
        begun = read_pairs(
            filter(str.strip, self._start.value.splitlines()), "At the start", "body.joint.position = -20..20deg"
        )
        shift = self._shift.value.strip() or 0.0
        skip, starts, machines = float(self._skip.value), int(self._starts.value), self._desk.machines

        def compute(progress: Progress) -> RobotFit | FitSoFar:
            names = {"vary": "Unknown", "compare": "Compare", "start": "At the start", "shift": "Readings late by"}
            with machines.executor() as executor, labelled(names):
                try:
                    return identify(
                        robot,
                        [recording],
                        vary=vary,
                        compare=compare,
                        drive=drive,
                        skip=skip,
                        start=begun,
                        shift=shift,
                        starts=starts if starts > 1 else None,  # more where one does not fit
                        executor=executor,
                        progress=progress,
                    )
                except FitStoppedError as stopped:
                    if stopped.best is None:
                        raise
                    return stopped.best

        def done(found: RobotFit | FitSoFar) -> None:
            if isinstance(found, FitSoFar):
                self._show_stopped(number, with_values(robot, {name: found.values[name] for name in vary}), found)
            else:
                self._show(number, found)

        self._desk.work.begin(machines.named("identifying"), compute, done, _NOTHING_YET, button=STOP)

    def _show(self, number: int, found: RobotFit) -> None:
        data = found.to_dataset()
        figure: Any = robot_panel(data, 0).figure
        with self._drawing:
            if number != self._robot:
                return
            self._desk.tell("identified; what was found is in the tab", False)
            self._found, self._apply.label = found.robot, _FOUND
            self._table.content = fitted_html(data)
            self._apply.visible = self._plot.folder.visible = True
            self._plot.show(with_legend(figure), 0.75 * data.sizes["column"] + 0.1)

    def _show_stopped(self, number: int, robot: RobotDescription, best: FitSoFar) -> None:
        with self._drawing:
            if number != self._robot:
                return
            self._desk.tell("stopped, best so far; what it is stands in the tab", False)
            self._found, self._apply.label = robot, _STOPPED
            self._table.content = so_far_html(best)
            self._apply.visible, self._plot.folder.visible = True, False

    def _become(self) -> None:
        with self._drawing:
            fit = self._found
        if fit is not None:
            self._desk.become(fit)


def _signals(robot: RobotDescription) -> dict[str, str]:
    """Units of the signals that can be given by a recording, by path; none where a motor finds its own speed."""
    with suppress(InputError):
        return {path: DIMENSIONS[signal.dimension].unit for path, signal in driving_signals(robot).items()}
    return {}


def so_far_html(best: FitSoFar) -> str:
    """What a fit that was stopped had found: values, without intervals, and errors."""
    rows = [["stopped, best so far", "value"], *([name, text] for name, text in best.shown.items())]
    few, every = best.recordings
    of = f", in {few} of {every} recordings" if few < every else ""
    lines = ["The fit did not come to its end: nothing says how sure these values are."]
    lines += [f"{column}: off by {off:.3g} % of its range (root mean square){of}" for column, off in best.off.items()]
    return cells(rows, "studio-so-far", lines)


def fitted_html(found: xr.Dataset) -> str:
    """What a fit to one recording found: values with their intervals, errors and warnings."""
    rows = [["", "value", "95 % from", "to", "unit"]]
    for name in found["parameter"].values:
        one = found.sel(parameter=name)
        values = (shown(float(one[key])) for key in ("value", "low", "high"))
        mark = "" if bool(one["identifiable"]) else " *"
        rows.append([f"{name}{mark}", *values, str(one["unit"].item())])
    lines = [] if bool(found["identifiable"].all()) else ["* not identifiable alone"]
    lines += json.loads(found.attrs.get("scatter", "[]"))
    lines += [words for words in json.loads(found.attrs["words"]) if ": identifiable" not in words]
    for c, column in enumerate(map(str, found["column"].values)):
        rms, largest = (f"{float(found[key][0, c]):.3g} %" for key in ("e_rmsp", "e_mp"))
        lines.append(f"{column}: off by {rms} of its range (root mean square), {largest} at most")
    if found.attrs["starts"] > 1:
        lines.append(f"{found.attrs['agree']} of {found.attrs['starts']} starts came to these values")
    lines += [f"beware: {warning}" for warning in json.loads(found.attrs["warnings"])]
    return cells(rows, "studio-fit", [*lines, *json.loads(found.attrs["notes"])])
