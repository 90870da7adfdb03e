"""What the page says of a rig in words: its channels, what it measures at rest, and signals within its limits."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

import viser

from nectosome.controllers import PIDGains, Reference
from nectosome.rigs import Loop, Pair, actuator_bench
from nectosome.rigs.device_files import FileFields
from nectosome.rigs.laws import Signal
from nectosome.rigs.rig_file import RigFile
from nectosome.rigs.run_plan import read_plan
from nectosome.studio.folder import WorkFolder
from nectosome.units import DIMENSIONS, InputError, dimension_of, read_positive, show_quantity

from .left_panel import add_text, cells

_STILL = ("step", "constant")  # shapes without a frequency
SIMULATED = "simulated rig"
SIMULATED_FILE = Path(__file__).parents[1] / "simulated_rig.yaml"
NONE = "none"
SIGNALS = (NONE, "step", "sine", "chirp")
REFERENCES = ("constant", "sine", "triangle", "chirp")
_SHARE, _FREQUENCY = 0.2, 0.5  # of the range; Hz, of the signal that is offered
_RATE = 0.5  # of the largest rate
_HEAD = 100_000  # [bytes] of a file in which its devices are looked for


class ShapeFields:
    """A shape, its size and its frequencies, of which those are seen that it has."""

    def __init__(self, gui: viser.GuiApi, label: str, shapes: tuple[str, ...], first: str):
        self.kind: Any = gui.add_dropdown(label, shapes, initial_value=first)
        hint = "With its unit: the height of a step, the amplitude of a sine."
        self.size = add_text(gui, "Size", "10 kPa", hint=hint)
        self.frequency = add_text(gui, "Frequency", "0.5 Hz", "0.5 Hz", hint="Of a chirp the first one.")
        self.to = add_text(gui, "To", "5 Hz", "5 Hz", hint="Last frequency of the chirp.")
        self.kind.on_update(lambda _: self._see())
        self._see()

    def _see(self) -> None:
        kind = self.kind.value
        self.size.visible = kind != NONE
        self.frequency.visible = kind not in (NONE, *_STILL)
        self.to.visible = kind == "chirp"


class Signals:
    """A shape for each command of a rig, in folders of the commands' names."""

    def __init__(self, gui: viser.GuiApi, place: viser.GuiFolderHandle):
        self._gui, self._place = gui, place
        self._folders: list[viser.GuiFolderHandle] = []
        self._shapes: dict[str, ShapeFields] = {}

    def renew(self, rig: RigFile) -> None:
        """Those of another rig: a small sine on the first command."""
        for folder in self._folders:
            folder.remove()
        self._folders, self._shapes = [], {}
        for k, command in enumerate(rig.rig.commands):
            with self._place:
                folder = self._gui.add_folder(command)
            with folder:
                shape = ShapeFields(self._gui, "Signal", SIGNALS, NONE if k else "sine")
            shape.size.value, shape.frequency.value = first_signal(rig, command)
            self._folders.append(folder)
            self._shapes[command] = shape

    @property
    def plan(self) -> dict[str, dict[str, str]]:
        """Signals as a plan has them, by command."""
        plan: dict[str, dict[str, str]] = {}
        for command, shape in self._shapes.items():
            kind, size = shape.kind.value, shape.size.value
            if kind == "step":
                plan[command] = {"kind": kind, "height": size}
            elif kind != NONE:
                plan[command] = {"kind": kind, "amplitude": size, "frequency": shape.frequency.value}
                plan[command] |= {"to": shape.to.value} if kind == "chirp" else {}
        return plan


class Tracking:
    """A pair of command and measurement, a reference, and gains."""

    labels: ClassVar = {
        "reference": "Size",
        "amplitude": "Size",
        "frequency": "Frequency",
        "to": "To",
        "gains": "Gains",
    }

    def __init__(self, gui: viser.GuiApi):
        self._rig: RigFile | None = None
        self._command: Any = gui.add_dropdown("Command", ("",))
        self._measurement: Any = gui.add_dropdown("Measurement", ("",))
        self._shape = ShapeFields(gui, "Reference", REFERENCES, "sine")
        hint = (
            "K_p, K_i, K_d in the units of the command's range, of Size, and s. Empty: found on the model, where the "
            "rig has one."
        )
        self._gains = add_text(gui, "Gains", "0.5, 0.1, 0", hint=hint)
        self._measurement.on_update(lambda _: self._chosen())

    def renew(self, rig: RigFile) -> None:
        """Names of another rig."""
        self._rig = rig
        self._command.options = tuple(rig.rig.commands) or ("",)
        self._measurement.options = tuple(rig.rig.measurements) or ("",)
        self._gains.value = ""
        self._chosen()

    @property
    def options(self) -> dict[str, str | None]:
        """Command, measurement, and the reference as `Reference.parse` takes it."""
        kind, size = self._shape.kind.value, self._shape.size.value
        still = kind == "constant"
        return {
            "command": self._command.value,
            "measurement": self._measurement.value,
            "reference": size if still else kind,
            "amplitude": None if still else size,
            "frequency": None if still else self._shape.frequency.value,
            "to": self._shape.to.value if kind == "chirp" else None,
        }

    @property
    def gains(self) -> str:
        """Gains as they are written."""
        return self._gains.value

    def _chosen(self) -> None:
        if self._rig is not None and self._measurement.value in self._rig.rig.measurements:
            self._shape.size.value = first_reference(self._rig, self._measurement.value)


class PreparedRun(NamedTuple):
    """What is run: signals or loops by command, how long it takes [s], and what it is called in its log."""

    name: str
    seconds: float
    signals: dict[str, Signal] | None = None
    loops: dict[str, Loop] | None = None


def rig_files(folder: WorkFolder) -> list[str]:
    """Names of the rig files of a folder: those that have devices."""
    return [name for name in folder.names(".yaml", ".yml") if _has_devices(folder.existing(name))]


def _has_devices(path: Path) -> bool:
    try:
        with path.open("rb") as file:
            head = file.read(_HEAD)
    except OSError:
        return False
    return b"\ndevices:" in b"\n" + head


def played(rig: RigFile, signals: Mapping[str, Mapping[str, str]], time: str, ramp: str) -> PreparedRun:
    """Signals of a plan of one run, by command. Raises InputError for one beyond the limits of its command."""
    if not signals:
        raise InputError("no command has a signal. Choose one for a command.")
    data = {"signals": {name: dict(fields) for name, fields in signals.items()}, "time": time, "ramp": ramp}
    try:
        plan = read_plan(data, rig, FileFields("", {}))
        (run,) = plan.runs
        samples = plan.signals(run)
    except InputError as error:
        field = (error.field or "").removeprefix("signals.").removesuffix(".0")  # a value is a list of one in a plan
        raise InputError(error.message, field=field or None) from None
    kinds = ", ".join(dict.fromkeys(fields["kind"] for fields in signals.values()))
    return PreparedRun(kinds, plan.seconds(run), signals=samples)


def controlled(rig: RigFile, options: Mapping[str, str | None], time: str, gains: str) -> PreparedRun:
    """A PID from one measurement to one command, rehearsed on the model, where there is one.

    `options` are the arguments of `Reference.parse`, with `command` and `measurement`. Gains are in the units of the
    command's range, of the reference, and s; without, they are found on the model. Raises InputError.
    """
    pair = Pair.of(rig.rig, options["command"], options["measurement"])
    unit = rig.rig.measurements[pair.measurement]
    shape = {name: options[name] for name in ("amplitude", "frequency", "to")}
    target = Reference.parse(options["reference"] or "", dimension_of(unit), **shape)
    samples = target.samples(read_positive(time, "time", "time"), rig.dt)
    given = PIDGains.parse(gains, rig.unit_size(pair.command) / target.unit_size) if gains.strip() else None
    model = rig.models.get(pair.command)
    bench = actuator_bench(rig.rig, rig.limits, rig.dt, samples, "pid", given, model, pair)
    bench.rehearse()
    return PreparedRun(target.kind, len(samples) * rig.dt, loops=dict(bench.loops))


def first_signal(rig: RigFile, command: str) -> tuple[str, str]:
    """Amplitude and frequency that are offered of a command: a fifth of its range, at half its rate at most."""
    limits = rig.limits.commands[command]
    size = _SHARE * (min(limits.high, -limits.low) or max(limits.high, -limits.low))
    rate = min(_FREQUENCY, _RATE * limits.slew / (2 * math.pi * size))
    return shown(size, rig.rig.commands[command]), f"{float(f'{rate:.1g}'):g} Hz"


def first_reference(rig: RigFile, measurement: str) -> str:
    """Amplitude that is offered of a reference: a fifth of the range of its measurement."""
    limits, unit = rig.limits.measurements.get(measurement), rig.rig.measurements[measurement]
    return "" if limits is None else shown(_SHARE * (limits.most - limits.least) / 2, unit)


def shown(value: float, unit: str) -> str:
    """A value in a unit that is easy to read."""
    if not math.isfinite(value):
        return "no reading" if math.isnan(value) else f"{value:g}"
    dimension = dimension_of(unit)
    if dimension == "number" and unit not in ("", DIMENSIONS["number"].unit):
        return f"{value:.4g} {unit}"
    return show_quantity(value, dimension)


def _short(value: float, unit: str) -> str:
    """A reading with three digits: it changes as one looks."""
    number, _, of = shown(value, unit).partition(" ")
    return f"{float(number):.3g} {of}".strip() if math.isfinite(value) else shown(value, unit)


def _span(low: float, high: float, unit: str) -> str:
    """Both ends as the file has them, with one unit where they have the same."""
    (first, _, of), (last, _, of_last) = (shown(x, unit).partition(" ") for x in (low, high))
    return f"{first} to {last} {of_last}".strip() if of in ("", of_last) else f"{first} {of} to {last} {of_last}"


def channels_html(rig: RigFile, readings: Sequence[float] | None = None) -> str:
    """Devices, commands and measurements of a rig, with their limits, and what it measures where that is known."""
    commands, measurements = rig.rig.commands, rig.rig.measurements
    rows: list[tuple[str, ...]] = [("command", "range", "rate")]
    for name, unit in commands.items():
        limits = rig.limits.commands[name]
        rows.append((name, _span(limits.low, limits.high, unit), f"{shown(limits.slew, unit)}/s"))
    now = dict(zip(measurements, readings or (), strict=False))
    rows.append(("measurement", "range", "now" if now else ""))
    lines = [f"{key}: {device.name}" for key, device in rig.rig.devices.items()]
    for name, unit in measurements.items():
        limits = rig.limits.measurements.get(name)
        ends = "not guarded" if limits is None else _span(limits.least, limits.most, unit)
        rows.append((name, ends, _short(now[name], unit) if name in now else ""))
        if name in now and limits is not None and not limits.least <= now[name] <= limits.most:
            lines.append(f"{name} is out of its range: a run would end at once.")
    about = [rig.written.about] if rig.written.about else []
    return cells(rows, "studio-rig", [*about, *lines, f"a sample each {show_quantity(rig.dt, 'time')}"])
