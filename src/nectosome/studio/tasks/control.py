"""The tab that makes a robot follow a reference: what is commanded and measured, and a simulated rig in real time."""

import threading
import time
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from nectosome import controllers as control
from nectosome.core import Status
from nectosome.model import build, common_readings, reading_of
from nectosome.studio.work import Progress, called, told
from nectosome.units import InputError, shorten
from nectosome.view.closed_loop import followed_panel

from .control_request import (
    CONSTANT,
    Asked,
    PreparedLoop,
    beats,
    commands_of,
    first_joint,
    first_measured,
    first_range,
    is_held,
    loop_of,
    most_of,
    numbers_of,
)
from .live_rig import LiveRig

if TYPE_CHECKING:
    from nectosome.studio.answers import Answer
    from nectosome.studio.session import Session

_SEEN = 20.0  # s that the plot shows while it goes on
_PLOTS = 1.0  # s between plots
_SIZES = {
    "angle": "20 deg",
    "length": "10 cm",
    "speed": "5 cm/s",
    "angular_speed": "10 deg/s",
    "force": "0.1 N",
    "torque": "10 mN m",
    "curvature": "1 1/m",
}


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
        shapes = (CONSTANT, *control.SHAPES)
        self._shape = gui.add_dropdown("Reference", shapes, initial_value=CONSTANT)
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
        session.on_seen(self._seen)
        self._mean.on_update(lambda _: setattr(self._gains, "value", ""))
        self._shape.on_update(lambda _: setattr(self._frequency, "visible", self._shape.value != CONSTANT))
        self._start.on_click(lambda _: self._told(self._begin))
        self._stop.on_click(lambda _: session.work.cancel())

    def renew(self) -> None:
        """What can be commanded and measured of the session's robot."""
        description = self._session.description
        with self._drawing:
            self._robot += 1
            self._place.visible = False
        self._model = build(description)
        commands = commands_of(description)
        kind, held = first_joint(description).kind, is_held(description)
        readings = common_readings(self._model)
        first = first_measured(description, self._session.problem.forward)
        self._command.options, self._measure.options = commands, tuple(readings)
        chosen = [name for name in self._session.problem.variables if held and name in commands]
        self._command.value, self._measure.value = (chosen or commands)[0], first
        self._mean.value = (held or kind in ("free", "planar", "prismatic")) and beats(description)
        self._command_chosen()
        self._measure_chosen()

    def _command_chosen(self) -> None:
        self._range.value, self._gains.value = first_range(self._session, self._command.value), ""

    def _measure_chosen(self) -> None:
        self._size.value, self._gains.value = self._usual(), ""
        if (answer := self._session.answer) is not None:
            self._seen(answer)

    def _usual(self) -> str:
        return _SIZES.get(reading_of(self._model, self._measure.value).dimension, "1")

    def _seen(self, answer: "Answer") -> None:
        """Suggest what the robot can reach, once it is seen, unless something else stands there already."""
        if self._size.value == self._usual():
            self._size.value = most_of(answer.run, reading_of(self._model, self._measure.value)) or self._usual()

    def _told(self, work: Any) -> None:
        with told(self._session.tell):
            work()

    # --- a run

    def _begin(self) -> None:
        asked = Asked(
            self._session.description,
            f"{self._command.value}={self._range.value}",
            self._measure.value,
            self._mean.value,
            self._shape.value,
            self._size.value,
            self._frequency.value,
            self._gains.value,
        )
        if not all(part.strip() for part in self._range.value.partition(":")):
            words = f'"{shorten(self._range.value)}" has no two ends. Write LOW:HIGH and the unit, such as -8:8 mN m.'
            raise InputError(words, field=self._range.label)
        with called({"command": self._range.label}):
            reach = control.read_range(asked.command, asked.description)
        self._session.work.begin("control", partial(self._compute, asked, reach, self._robot), lambda _: None)

    def _compute(self, asked: Asked, reach: control.CommandRange, robot: int, progress: Progress) -> None:
        self._stop.disabled = False
        try:
            fields = {"reference": self._size, "amplitude": self._size, "frequency": self._frequency}
            fields |= {"gains": self._gains, "mean": self._mean, "command": self._range}
            with called({name: field.label for name, field in fields.items()}):
                loop = loop_of(asked, reach, self._model, progress)
            if loop is None or robot != self._robot:
                return
            with self._drawing:
                self._gains.value = loop.gains_text
            self._put_slider(loop)
            self._run(loop, robot, progress)
        finally:
            self._stop.disabled = True
            if self._slider is not None:
                self._slider.disabled = True

    def _run(self, loop: PreparedLoop, robot: int, progress: Progress) -> None:
        """Go on in real time, then keep it."""
        session, rig, last = self._session, loop.rig, 0.0
        self._now = loop.wanted.size
        session.go_live(rig.begin())

        def going_on(share: float, words: str) -> bool:
            nonlocal last
            if time.perf_counter() - last > _PLOTS:
                last = time.perf_counter()
                self._draw(rig, robot, "", _SEEN)
            return progress(share, words) and robot == self._robot

        def wanted(k: int) -> float:
            return float(self._now) if loop.course is None else float(loop.course[k])  # type: ignore[arg-type]

        run, words = None, ""
        try:
            status = rig.run(wanted, session.live, going_on)
            words = f"controlled for {rig.pace.time:.1f} s, {rig.pace}"
            words += "" if status == Status.SOLVED else f"; it {status.reason}"
            run = rig.kept(status) if len(rig.going.pieces) > 1 else None
            self._draw(rig, robot, numbers_of(rig, loop.wanted), np.inf)
        finally:
            session.end_live(run, words)

    def _put_slider(self, loop: PreparedLoop) -> None:
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

    def _draw(self, rig: LiveRig, robot: int, words: str, seconds: float) -> None:
        figure: Any = followed_panel(rig.followed.last(seconds).track()).figure
        figure.update_layout(margin={"l": 50, "r": 8, "t": 50, "b": 36}, font_size=11, height=None, hovermode="x")
        figure.update_layout(legend={"font_size": 10, "entrywidth": 0.5, "entrywidthmode": "fraction"})
        figure.update_traces(showlegend=False, selector={"name": "command"})
        figure.update_yaxes(title_font_size=10, title_standoff=4).update_xaxes(title_font_size=10)
        with self._drawing:
            if robot != self._robot:
                return
            self._line.content = words
            if self._plot is None:
                with self._place:
                    self._plot = self._session.gui.add_plotly(figure, aspect=1.2, config={"displayModeBar": False})
            else:
                self._plot.figure = figure
