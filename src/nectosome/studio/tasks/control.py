"""The control tab: a robot under a PID, as a simulated rig in real time."""

import time
from collections.abc import Mapping
from contextlib import suppress
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from nectosome import controllers
from nectosome.core import Status
from nectosome.description import (
    JointDescription,
    PrismaticJoint,
    RobotDescription,
    drive_period,
    get_value,
    numeric_paths,
    resolve,
)
from nectosome.model import build
from nectosome.solve import common_readings, reading_of
from nectosome.solve.readings import Reading
from nectosome.studio.answers import Answer
from nectosome.studio.desk import Desk
from nectosome.studio.sliders import scales_of
from nectosome.studio.work import Progress, labelled
from nectosome.units import InputError, read_quantity, shorten
from nectosome.units import show_quantity as shown
from nectosome.view.closed_loop import signals_panel

from .left_panel import PanelTask, Plot, add_text, cells
from .live_rig import FRAME, LONGEST, LiveRig

CONSTANT = "constant"
SHAPES = ("sine", "triangle")  # that go on until the run is stopped
_TUNED = 10.0  # s of the reference, along which gains are detuned
_SPEEDS = ("velocity.x", "velocity.y", "velocity.z")
_MOST, _NOTHING = 0.8, 1e-4  # of a speed or force; m/s, N
_SHARE = 0.5  # of a drive's amplitude, that its offset may be
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


class PreparedLoop(NamedTuple):
    """A compiled rig, and its reference."""

    rig: LiveRig
    task: controllers.ControlTask
    samples: np.ndarray | None  # of the reference; None where the slider sets it
    gains_text: str


def prepare_loop(description: RobotDescription, options: Mapping[str, Any], progress: Progress) -> PreparedLoop | None:
    """A rig with its gains, compiled; None where it was cancelled. `options` are those of `ControlTask.parse`.

    Raises InputError.
    """
    if not progress("compiling the equations", 0.0):
        return None
    task = controllers.ControlTask.parse(description, **options, resolution=FRAME)
    gains = task.find_gains(_TUNED, progress)
    if gains is None or not progress("compiling the rig", 0.0):
        return None
    pid = task.pid(gains)
    samples, first = None, task.reference.constant
    if first is None:
        samples = task.reference.samples(LONGEST + task.robot.dt, task.robot.dt, task.start)
        first = float(samples[0])
    LiveRig(task.loop, pid, first).step(first)  # all compilation happens here
    rig = LiveRig(task.loop, pid, first)
    return PreparedLoop(rig, task, samples, task.gains_text(gains).replace(",", ", "))


def commands_of(description: RobotDescription) -> tuple[str, ...]:
    """Quantities that can be commanded: offsets of drives first, by their aliases where they have one; then aliases."""
    named = {path: alias for alias in description.number_aliases for path in resolve(description, alias)}
    offsets = [
        named.get(path, path) for path in numeric_paths(description) if path.endswith((".offset", ".force.value"))
    ]
    return tuple(dict.fromkeys([*offsets, *description.number_aliases])) or tuple(numeric_paths(description))


def first_range(desk: Desk, command: str) -> str:
    """Initial range of a command: that of its slider, or of an offset half the amplitude of its drive."""
    description = desk.description
    for scale in scales_of(description, desk.problem.vary):
        if scale.name == command:
            return f"{scale.low:g}..{scale.high:g} {scale.unit}".strip()
    path = resolve(description, command)[0]
    known = numeric_paths(description)
    beside = path.rpartition(".")[0] + ".amplitude"
    if not path.endswith(".offset") or beside not in known:
        return ""
    most = _SHARE * abs(float(get_value(description, beside)))
    number, _, unit = shown(most, known[path].dimension).partition(" ")
    return f"-{number}..{number} {unit}".strip() if most else ""


def first_joint(description: RobotDescription) -> JointDescription:
    """The joint of the body, or of the first limb on the world."""
    return next(iter(description.parts.values())).joint


def is_fixed(description: RobotDescription) -> bool:
    """Whether the first part is fixed, or its motion is prescribed."""
    joint = first_joint(description)
    return joint.kind == "fixed" or getattr(joint, "motion", None) is not None


def first_measured(description: RobotDescription, forward: str) -> str:
    """Initial reading: the heading of a robot that can turn, the speed of one on a line.

    Of a fixed body the force on its mount along `forward`; on a spring its position, on a hinge its angle.
    """
    joint, part = first_joint(description), next(iter(description.parts))
    if is_fixed(description):
        return f"force.{forward.lstrip('-') or 'x'}"
    if joint.kind in ("free", "planar", "spherical"):
        return "heading"
    if isinstance(joint, PrismaticJoint):
        return f"{part}.position" if joint.stiffness else _SPEEDS[int(np.argmax(np.abs(joint.axis)))]
    return f"{part}.angle"


def most_of(run: xr.Dataset, reading: Reading) -> str:
    """Share of the mean speed or force of a run, which the robot can reach; empty for other readings."""
    if reading.kind in _SPEEDS:
        now = run["velocity"].isel(part=0, axis=_SPEEDS.index(reading.kind))
    elif reading.kind == "force" and "load_force" in run:
        now = run["load_force"].isel(axis=reading.index).sum(("load", "part"))
    else:
        return ""
    value = float(f"{_MOST * float(now.mean('time')):.1g}")
    return shown(value, reading.dimension) if abs(value) > _NOTHING else ""


def has_beat(description: RobotDescription) -> bool:
    """Whether its drives have a common period."""
    with suppress(InputError):
        return drive_period(description) > 0
    return False


def results_html(rig: LiveRig, reference: controllers.Reference) -> str:
    """Tracking errors, of a constant reference since its last change."""
    run = rig.record
    target, output = run.reference, run.output
    changes = np.flatnonzero(np.diff(target)) if reference.kind == CONSTANT else np.zeros(0, int)
    k = slice(int(changes[-1]) + 1 if changes.size else 0, None)
    begun = float(run.time[k][0])
    found = controllers.tracking_rows(run.time[k] - begun, output[k], target[k], "", reference.show)
    rows = [(label.shown, number.shown) for label, number in found]
    since = ", since the last change of the reference" if changes.size else ""
    return cells(rows, "studio-control", [f"Simulated{since}."])


class Control(PanelTask):
    """Lays out the tab."""

    def __init__(self, desk: Desk):
        super().__init__(desk)
        gui = desk.gui
        self._setpoint: float | None = None  # of the slider [SI]
        self._command: Any = gui.add_dropdown("Command", ("",))
        self._range = add_text(gui, "Range", "-8..8 mN m", hint="LOW..HIGH of the command.")
        self._measure: Any = gui.add_dropdown("Measure", ("",))
        self._mean = gui.add_checkbox(
            "Mean over a beat", False, hint="The measurement is averaged over the last beat of the drives."
        )
        shapes = (CONSTANT, *SHAPES)
        self._shape = gui.add_dropdown("Reference", shapes, initial_value=CONSTANT)
        self._size = add_text(gui, "Value", "20 deg", hint="With its unit; the amplitude of a sine or triangle.")
        self._frequency = add_text(gui, "Frequency", "0.1 Hz", "0.1 Hz", visible=False)
        hint = "K_p, K_i, K_d in the units above and s; empty: found on the model."
        self._gains = add_text(gui, "Gains", "0.5, 0.1, 0", hint=hint)
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
            controllers.CommandRange.parse(options["command"], description)
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
        start, value = (float(f"{x / size:.4g}") for x in (loop.task.start, target.constant))
        far = float(f"{2 * abs(value - start) or 1.0:.2g}")  # no more digits than its field has room for
        low, high = (float(f"{end:.4g}") for end in (start - far, start + far))
        with self._plot.folder:
            name = f"{self._measure.value}, reference ({unit})" if unit else f"{self._measure.value}, reference"
            self._slider = self._desk.gui.add_slider(name, low, high, float(f"{far / 100:.1g}"), value)
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
