"""The control tab: a robot under a PID, as a simulated rig in real time."""

import time
from functools import partial
from typing import Any

import numpy as np

from nectosome.controllers import CommandRange
from nectosome.core import Status
from nectosome.description import RobotDescription
from nectosome.model import build
from nectosome.solve import common_readings, reading_of
from nectosome.studio.answers import Answer
from nectosome.studio.desk import Desk
from nectosome.studio.work import Progress, labelled
from nectosome.units import InputError, read_quantity, shorten
from nectosome.view.closed_loop import signals_panel

from .control_request import (
    CONSTANT,
    SHAPES,
    PreparedLoop,
    commands_of,
    first_joint,
    first_measured,
    first_range,
    has_beat,
    is_fixed,
    most_of,
    prepare_loop,
    results_html,
)
from .left_panel import PanelTask, Plot
from .live_rig import LiveRig

_WINDOW = 20.0  # s that the plot shows during a run
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


class Control(PanelTask):
    """Lays out the tab."""

    def __init__(self, desk: Desk):
        super().__init__(desk)
        gui = desk.gui
        self._setpoint: float | None = None  # of the slider [SI]
        self._command: Any = gui.add_dropdown("Command", ("",))
        self._range = gui.add_text("Range", "", hint="LOW..HIGH of the command, such as -8..8 mN m.")
        self._measure: Any = gui.add_dropdown("Measure", ("",))
        self._mean = gui.add_checkbox(
            "Mean over a beat", False, hint="The measurement is averaged over the last beat of the drives."
        )
        shapes = (CONSTANT, *SHAPES)
        self._shape = gui.add_dropdown("Reference", shapes, initial_value=CONSTANT)
        self._size = gui.add_text("Value", "", hint="With its unit; the amplitude of a sine or triangle.")
        self._frequency = gui.add_text("Frequency", "0.1 Hz", visible=False)
        self._gains = gui.add_text(
            "Gains", "", hint="K_p, K_i, K_d in the units above and s; empty: found on the model."
        )
        self._add_button("Start", self._begin)
        self._stop = gui.add_button("Stop", disabled=True)
        self._plot = Plot(gui, "Run")
        with self._plot.folder:
            self._line = gui.add_html("")
        self._slider: Any = None
        self._command.on_update(lambda _: self._command_chosen())
        self._measure.on_update(lambda _: self._measure_chosen())
        desk.on_seen(self._seen)
        self._mean.on_update(lambda _: setattr(self._gains, "value", ""))
        self._shape.on_update(lambda _: setattr(self._frequency, "visible", self._shape.value != CONSTANT))
        self._stop.on_click(lambda _: desk.work.cancel())

    def renew(self) -> None:
        """Commands and readings of the robot of the desk."""
        description = self._desk.description
        with self._drawing:
            self._robot += 1
            self._plot.folder.visible = False
        self._model = build(description)
        commands = commands_of(description)
        kind, fixed = first_joint(description).kind, is_fixed(description)
        readings = common_readings(self._model)
        first = first_measured(description, self._desk.problem.forward)
        self._command.options, self._measure.options = commands, tuple(readings)
        chosen = [name for name in self._desk.problem.vary if fixed and name in commands]
        self._command.value, self._measure.value = (chosen or commands)[0], first
        self._mean.value = (fixed or kind in ("free", "planar", "prismatic")) and has_beat(description)
        self._command_chosen()
        self._measure_chosen()

    def _command_chosen(self) -> None:
        self._range.value, self._gains.value = first_range(self._desk, self._command.value), ""

    def _measure_chosen(self) -> None:
        self._size.value, self._gains.value = self._default_size(), ""
        if (answer := self._desk.answer) is not None:
            self._seen(answer)

    def _default_size(self) -> str:
        return _SIZES.get(reading_of(self._model, self._measure.value).dimension, "1")

    def _seen(self, answer: Answer) -> None:
        """Suggest a reference within reach of the robot, from its simulation, unless the user gave one."""
        if self._size.value == self._default_size():
            self._size.value = most_of(answer.run, reading_of(self._model, self._measure.value)) or self._default_size()

    # --- a run

    def _begin(self) -> None:
        description, size, constant = self._desk.description, self._size.value, self._shape.value == CONSTANT
        options = {
            "command": f"{self._command.value}={self._range.value}",
            "measure": self._measure.value,
            "mean": self._mean.value,
            "reference": size if constant else self._shape.value,
            "amplitude": None if constant else size,
            "frequency": None if constant else self._frequency.value,
            "gains": self._gains.value.strip() or None,
        }
        if not all(part.strip() for part in self._range.value.partition("..")):
            words = f'"{shorten(self._range.value)}" has no two ends. Write LOW..HIGH and the unit, such as -8..8 mN m.'
            raise InputError(words, field=self._range.label)
        with labelled({"command": self._range.label, "reference": self._size.label}):
            CommandRange.parse(options["command"], description)
            read_quantity(size, reading_of(self._model, options["measure"]).dimension, "reference")
        compute = partial(self._compute, description, options, self._robot)
        self._desk.work.begin("control", compute, lambda _: None)

    def _compute(self, description: RobotDescription, options: dict[str, Any], robot: int, progress: Progress) -> None:
        self._stop.disabled = False
        try:
            fields = {"reference": self._size, "amplitude": self._size, "frequency": self._frequency}
            fields |= {"gains": self._gains, "mean": self._mean, "command": self._range}
            with labelled({name: field.label for name, field in fields.items()}):
                loop = prepare_loop(description, options, progress)
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
        """Run in real time, then keep the run."""
        desk, rig, last = self._desk, loop.rig, 0.0
        self._setpoint = loop.task.reference.constant or 0.0
        desk.go_live(rig.begin())

        def report(what: str, share: float) -> bool:
            nonlocal last
            if time.perf_counter() - last > _PLOTS:
                last = time.perf_counter()
                self._draw(rig, robot, "", _WINDOW)
            return progress(what, share) and robot == self._robot

        def reference(k: int) -> float:
            return float(self._setpoint) if loop.samples is None else float(loop.samples[k])  # type: ignore[arg-type]

        run, words = None, ""
        try:
            status = rig.run_by_clock(reference, desk.live, report)
            words = f"controlled for {rig.clock.time:.1f} s, {rig.clock}"
            words += "" if status == Status.SOLVED else f"; it {status.reason}"
            run = rig.to_dataset(status) if len(rig.run.intervals) > 1 else None
            self._draw(rig, robot, results_html(rig, loop.task.reference), np.inf)
        finally:
            desk.end_live(run, words)

    def _put_slider(self, loop: PreparedLoop) -> None:
        """A slider for a constant reference, from the initial output to twice as far."""
        if self._slider is not None:
            self._slider.remove()
            self._slider = None
        self._plot.folder.visible = True
        target = loop.task.reference
        if target.constant is None:
            return
        unit, size = target.unit, target.unit_size
        start, value = loop.task.start / size, target.constant / size
        far = 2 * abs(value - start) or 1.0
        with self._plot.folder:
            name = f"{self._measure.value}, reference ({unit})" if unit else f"{self._measure.value}, reference"
            self._slider = self._desk.gui.add_slider(name, start - far, start + far, far / 100, value)
        self._slider.on_update(lambda event: setattr(self, "_setpoint", float(event.target.value) * size))

    def _draw(self, rig: LiveRig, robot: int, words: str, seconds: float) -> None:
        figure: Any = signals_panel(rig.record.last(seconds).signals()).figure
        figure.update_layout(margin={"l": 50, "r": 8, "t": 50, "b": 36}, font_size=11, height=None, hovermode="x")
        figure.update_layout(legend={"font_size": 10, "entrywidth": 0.5, "entrywidthmode": "fraction"})
        figure.update_traces(showlegend=False, selector={"name": "command"})
        figure.update_yaxes(title_font_size=10, title_standoff=4).update_xaxes(title_font_size=10)
        with self._drawing:
            if robot != self._robot:
                return
            self._line.content = words
            self._plot.show(figure, 1.2)
