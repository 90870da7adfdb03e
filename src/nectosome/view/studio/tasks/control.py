"""The tab that makes a robot follow a reference: what is commanded and measured, and a simulated rig in real time."""

import math
import threading
import time
from functools import partial
from html import escape
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from nectosome import control
from nectosome.core import Status
from nectosome.io import InputError, RobotDescription, drive_period, get_value, numeric_paths, parse_quantity, resolve
from nectosome.io import show_quantity as shown
from nectosome.mechanism import Robot
from nectosome.robots import Commanded, build, common_readings, reading_of
from nectosome.view.following import followed_panel
from nectosome.view.studio.knobs import knobs_of
from nectosome.view.studio.work import Progress, told

from .rig import FRAME, LONGEST, Rig

if TYPE_CHECKING:
    from nectosome.view.studio.session import Session

_CONSTANT = "constant"
_USUAL, _A_BEAT = 20.0, 4  # samples a second, and in a beat where its mean is measured
_REHEARSED = 10.0  # s of the reference on the model, to find gains
_SEEN = 20.0  # s that the plot shows while it goes on
_PLOTS = 0.5  # s between plots
_SHARE = 0.5  # of a drive's amplitude, that its offset may be
_SIZES = {
    "angle": "20 deg",
    "length": "10 cm",
    "speed": "5 cm/s",
    "angular_speed": "10 deg/s",
    "force": "0.1 N",
    "torque": "10 mN m",
    "curvature": "1 1/m",
}


class _Asked(NamedTuple):
    """What stands on the page."""

    description: RobotDescription
    command: str
    measure: str
    mean: bool
    reference: str
    size: str
    frequency: str
    gains: str


class Control:
    """Lays out the tab."""

    def __init__(self, session: "Session"):
        self._session, gui = session, session.gui
        self._drawing = threading.Lock()
        self._robot = 0  # how many there were: what is found for one before is not shown
        self._now: float | None = None  # what the slider wants [SI]
        self._command: Any = gui.add_dropdown("Command", ("",))
        self._range = gui.add_text("Range", "", hint="LOW:HIGH of the command, such as -8:8 mN m.")
        self._measure: Any = gui.add_dropdown("Measure", ("",))
        self._mean = gui.add_checkbox(
            "Mean over a beat", False, hint="The controller is told the mean of the last beat."
        )
        shapes = (_CONSTANT, *control.SHAPES)
        self._shape = gui.add_dropdown("Reference", shapes, initial_value=_CONSTANT)
        self._size = gui.add_text("Value", "", hint="With its unit; the amplitude of a sine or triangle.")
        self._frequency = gui.add_text("Frequency", "0.1 Hz", visible=False)
        self._gains = gui.add_text(
            "Gains", "", hint="K_p, K_i, K_d in the units above and s; empty: found on the model."
        )
        self._start, self._stop = gui.add_button("Start"), gui.add_button("Stop", disabled=True)
        self._place = gui.add_folder("Run", visible=False)
        with self._place:
            self._line = gui.add_html("")
        self._plot: Any = None  # made when it is needed, as its program is large
        self._slider: Any = None
        self._command.on_update(lambda _: self._command_chosen())
        self._measure.on_update(lambda _: self._measure_chosen())
        self._mean.on_update(lambda _: setattr(self._gains, "value", ""))
        self._shape.on_update(lambda _: setattr(self._frequency, "visible", self._shape.value != _CONSTANT))
        self._start.on_click(lambda _: self._told(self._begin))
        self._stop.on_click(lambda _: session.work.cancel())
        self.renew()

    def renew(self) -> None:
        """What can be commanded and measured of the session's robot."""
        description = self._session.description
        with self._drawing:
            self._robot += 1
            self._place.visible = False
        self._model = build(description)
        commands = _commands(description)
        kind = getattr(description.body.joint, "kind", "")
        readings = common_readings(self._model)
        own = [name for name in readings if name.startswith("body.")]
        first = "heading" if kind in ("free", "planar") else "force.x" if kind == "fixed" or not own else own[0]
        self._command.options, self._measure.options = commands, tuple(readings)
        self._command.value, self._measure.value = commands[0], first
        self._mean.value = kind in ("free", "planar") and _beats(description)
        self._command_chosen()
        self._measure_chosen()

    def _command_chosen(self) -> None:
        self._range.value, self._gains.value = _range(self._session, self._command.value), ""

    def _measure_chosen(self) -> None:
        self._size.value = _SIZES.get(reading_of(self._model, self._measure.value).dimension, "1")
        self._gains.value = ""

    def _told(self, work: Any) -> None:
        with told(self._session.tell):
            work()

    # --- a run

    def _begin(self) -> None:
        asked = _Asked(
            self._session.description,
            f"{self._command.value}={self._range.value}",
            self._measure.value,
            self._mean.value,
            self._shape.value,
            self._size.value,
            self._frequency.value,
            self._gains.value,
        )
        reach = control.read_range(asked.command, asked.description)
        self._session.work.begin("control", partial(self._compute, asked, reach, self._robot), self._kept)
        self._stop.disabled = False

    def _compute(self, asked: _Asked, reach: control.Range, robot: int, progress: Progress) -> None:
        try:
            loop = _loop(asked, reach, self._model, progress)
            if loop is None or robot != self._robot:
                return
            with self._drawing:
                self._gains.value = loop.gains_text
            self._put_slider(loop)
            self._run(loop, robot, progress)
        finally:
            self._stop.disabled = True

    def _run(self, loop: "_Loop", robot: int, progress: Progress) -> None:
        """Go on in real time, then keep it."""
        session, rig, last = self._session, loop.rig, 0.0
        self._now = loop.wanted.size
        session.go_live(rig.begin())

        def going_on(share: float, words: str) -> bool:
            nonlocal last
            if time.perf_counter() - last > _PLOTS:
                last = time.perf_counter()
                self._draw(rig, robot, words, _SEEN)
            return progress(share, words) and robot == self._robot

        def wanted(k: int) -> float:
            return float(self._now) if loop.course is None else float(loop.course[k])  # type: ignore[arg-type]

        run, words = None, ""
        try:
            status = rig.run(wanted, session.live, going_on)
            words = f"controlled for {rig.pace.time:.1f} s, {rig.pace}"
            words += "" if status == Status.SOLVED else f"; it {status.reason}"
            run = rig.kept(status) if len(rig.going.pieces) > 1 else None
            self._draw(rig, robot, _numbers(rig, loop.wanted), np.inf)
        finally:
            session.end_live(run, words)

    def _kept(self, _: None) -> None:
        """All is told by now."""

    def _put_slider(self, loop: "_Loop") -> None:
        """A slider for what is wanted, where that stays what it is, from the start to as far again."""
        if self._slider is not None:
            self._slider.remove()
            self._slider = None
        self._place.visible = True
        if loop.course is not None:
            return
        unit, size = loop.wanted.unit, loop.wanted.unit_size
        start, value = loop.start / size, loop.wanted.size / size
        far = 2 * abs(value - start) or 1.0
        with self._place:
            name = f"{self._measure.value} wanted ({unit})" if unit else f"{self._measure.value} wanted"
            self._slider = self._session.gui.add_slider(name, start - far, start + far, far / 100, value)
        self._slider.on_update(lambda event: setattr(self, "_now", float(event.target.value) * size))

    def _draw(self, rig: Rig, robot: int, words: str, seconds: float) -> None:
        figure: Any = followed_panel(rig.track(seconds)).figure
        figure.update_layout(margin={"l": 54, "r": 8, "t": 40, "b": 40}, font_size=11, height=None, hovermode="x")
        with self._drawing:
            if robot != self._robot:
                return
            self._line.content = words if words.startswith("<") else _note(words)
            if self._plot is None:
                with self._place:
                    self._plot = self._session.gui.add_plotly(figure, aspect=0.85)
            else:
                self._plot.figure = figure


class _Loop(NamedTuple):
    """A rig that is ready, and what it is to follow."""

    rig: Rig
    wanted: control.Wanted
    start: float  # what is measured at first [SI]
    course: np.ndarray | None  # by samples; None where the slider says it
    gains_text: str


def _loop(asked: _Asked, reach: control.Range, model: Robot, progress: Progress) -> _Loop | None:
    """Gains, and the robot under them, with all that is compiled; None where it was cancelled. Raises InputError."""
    constant = asked.reference == _CONSTANT
    beat = control.read_beat(asked.description, reach, asked.mean)
    hertz = _A_BEAT * beat.at(reach.resting) if asked.mean and beat is not None else _USUAL
    dt = 1 / hertz
    moments = 1 if beat is None else control.moments_of(beat, reach.largest, dt)
    of = reading_of(model, asked.measure)
    reference, amplitude = (asked.size, None) if constant else (asked.reference, asked.size)
    wanted = control.Wanted.read(reference, amplitude, of.dimension)
    turns = 0.0 if constant else _positive(asked.frequency)
    scale = np.array([reach.unit_size / wanted.unit_size])
    gains = None if not asked.gains.strip() else scale * _gains(asked.gains)
    if not progress(0.0, "compiling the equations"):
        return None
    robot = Commanded(asked.description, reach.name, asked.measure, dt, max(moments, math.ceil(dt / FRAME)))
    start = robot.start()[0].reading
    measuring = control.Measuring(beat if asked.mean else None)
    if gains is None:
        about = wanted.size if constant else start
        course = wanted.samples(start, turns, _REHEARSED, dt)
        found = control.relay_gains(
            robot, reach.low, reach.high, about, measuring, progress=lambda share: progress(share, "finding gains")
        )
        pace = found and control.gentler(
            robot,
            found.gains,
            reach.low,
            reach.high,
            course,
            measuring,
            progress=lambda share: progress(share, "rehearsing on the model"),
        )
        if found is None or pace is None:
            return None
        gains = control.paced(found.gains, pace)
    if not progress(0.0, "compiling the rig"):
        return None
    pid = control.smooth_pid(gains, reach.low, reach.high, dt)
    course = None if constant else wanted.samples(start, turns, LONGEST + dt, dt)
    first = wanted.size if course is None else float(course[0])
    Rig(robot, pid, first, measuring).step(first)  # what has to be compiled is compiled here
    return _Loop(Rig(robot, pid, first, measuring), wanted, start, course, ", ".join(f"{x:.4g}" for x in gains / scale))


def _commands(description: RobotDescription) -> tuple[str, ...]:
    """What can be commanded: offsets of drives first, by their short names where they have some, then all that has."""
    named = {path: alias for alias in description.aliases for path in resolve(description, alias)}
    offsets = [
        named.get(path, path) for path in numeric_paths(description) if path.endswith((".offset", ".force.value"))
    ]
    return tuple(dict.fromkeys([*offsets, *description.aliases])) or tuple(numeric_paths(description))


def _range(session: "Session", command: str) -> str:
    """A range to begin with: of an offset half the amplitude of its drive to both sides, else that of the slider."""
    description = session.description
    for knob in knobs_of(description, session.problem.variables):
        if knob.name == command:
            return f"{knob.low:g}:{knob.high:g} {knob.unit}".strip()
    path = resolve(description, command)[0]
    known = numeric_paths(description)
    beside = path.rpartition(".")[0] + ".amplitude"
    if not path.endswith(".offset") or beside not in known:
        return ""
    most = _SHARE * abs(float(get_value(description, beside)))
    number, _, unit = shown(most, known[path].dimension).partition(" ")
    return f"-{number}:{number} {unit}".strip() if most else ""


def _beats(description: RobotDescription) -> bool:
    try:
        return drive_period(description) > 0
    except InputError:
        return False


def _positive(text: str) -> float:
    try:
        value = parse_quantity(text, "frequency")
    except ValueError as error:
        raise InputError(str(error), field="frequency") from None
    if value <= 0:
        raise InputError(f'"{text}" is out of range: it must be more than 0.', field="frequency")
    return value


def _gains(text: str) -> np.ndarray:
    try:
        numbers = [parse_quantity(part, "number") for part in text.split(",")]
    except ValueError as error:
        raise InputError(str(error), field="gains") from None
    if len(numbers) != 3 or not any(numbers) or min(numbers) < 0 < max(numbers):
        raise InputError(f'"{text}" is not three numbers of one sign, such as 4, 0.5, 0.', field="gains")
    return np.array(numbers)


def _numbers(rig: Rig, wanted: control.Wanted) -> str:
    """How well the reference was followed, since it last changed where the slider said it."""
    track = rig.track()
    reference, output = track["reference"].values, track["output"].values
    changes = np.flatnonzero(np.diff(reference)) if wanted.kind == _CONSTANT else np.zeros(0, int)
    k = slice(int(changes[-1]) + 1 if changes.size else 0, None)
    rows = [("rms error", wanted.show(control.rms_error(output[k], reference[k])))]
    answer = control.step_response(track["time"].values[k], output[k], reference[k])
    if answer is not None:
        settled = answer.settling - float(track["time"].values[k][0])
        rows = [
            ("overshoot", f"{100 * answer.overshoot:.3g} %"),
            ("settled within 5 %", f"after {settled:.3g} s" if np.isfinite(settled) else "never"),
            ("steady error", wanted.show(answer.steady_error)),
            *rows,
        ]
    since = ", since the reference last changed" if changes.size else ""
    cells = "".join(
        f"<tr><td>{name}</td><td style='text-align:right'>{escape(value)}</td></tr>" for name, value in rows
    )
    table = f"<table style='width:100%'>{cells}</table>"
    return f"<div style='font-size:13px;padding:0 12px' id='studio-control'>{table}Simulated{since}.</div>"


def _note(words: str) -> str:
    return f"<div style='font-size:13px;padding:0 12px'>{escape(words)}</div>"
