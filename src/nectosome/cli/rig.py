"""`nectosome rig`: `check` reads a rig, `run` takes runs by a plan, `tare` and `calibrate` set up sensors."""

import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import App, Parameter

from nectosome.cli.control_on_rig import CODES
from nectosome.cli.options import command, value
from nectosome.cli.output import Force, Json, report, tell, write
from nectosome.cli.progress import progress_bar
from nectosome.io.summary import Summary
from nectosome.io.tables import Label, Number, Table, number
from nectosome.io.work_clock import clock_text
from nectosome.units import InputError, count, read_positive

if TYPE_CHECKING:
    from nectosome.io.yaml_text import Key
    from nectosome.rigs.readings import Calibration, ChannelReadings, Readings, ZeroedSensor
    from nectosome.rigs.rig_file import RigFile
    from nectosome.rigs.run_plan import RunPlan
    from nectosome.rigs.run_series import Series


rig = command(App(name="rig", help="Check a rig, set the zeros of its sensors, and take runs by a plan as a campaign."))
RigConfig = Annotated[Path, Parameter("--config", help="Rig file (.yaml): devices, sample time, limits.")]


@rig.command(name="check")
def rig_check(
    *,
    config: RigConfig,
    time: Annotated[str, value("Time for which channels are read.")] = "1s",
    as_json: Json = False,
) -> int:
    """Read every channel of a rig, which is not moved, and print noise, gaps, and what looks wrong."""
    seconds = read_positive(time, "time", "--time")

    from nectosome.rigs import RigError
    from nectosome.rigs.readings import read_channels
    from nectosome.rigs.rig_file import load_rig

    file = load_rig(config)
    with progress_bar("reading") as update:
        try:
            readings = read_channels(file, seconds, lambda share: update("", share))
        except RigError as error:
            tell(f"failed: {error}")
            return 1
    write(summary(readings))
    return 1 if readings.wrong() else 0


def summary(readings: "Readings") -> Summary:
    """A row for each channel, and what looks wrong."""
    limits = readings.file.limits.measurements
    heads = {"channel": "channel", "mean": "mean", "deviation": "deviation", "least": "from", "most": "to"}
    heads |= {"noise": "% of limits", "missing": "% missing"}
    rows = list[tuple[str | Number, ...]]()
    for one in readings.channels():
        within = limits.get(one.name)
        noise = one.deviation / (within.most - within.least) if within is not None else math.nan
        shown = f"{100 * noise:.2g}" if math.isfinite(noise) else "-"
        rows.append(
            (
                one.name,
                *(Number(x, one.unit) for x in (one.mean, one.deviation, one.least, one.most)),
                Number(noise, shown=shown),
                Number(one.missing, shown=f"{100 * one.missing:.3g}"),
            )
        )
    rate = f"{readings.rate:.4g} samples/s" if math.isfinite(readings.rate) else "a single sample"
    title = f"{readings.file.rig.name}: {count(len(rows), 'channel')}, {rate}, nothing was commanded"
    return Summary(
        title,
        [Table("channels", heads, rows)],
        warnings=readings.wrong(),
        values={"rate": Number(readings.rate, "Hz"), "samples": Number(len(readings.values))},
    )


@rig.command(name="run")
def rig_run(
    plan: Annotated[Path, Parameter(help="Plan of runs (.yaml): signals of commands, conditions, repeats.")],
    /,
    *,
    config: RigConfig,
    out: Annotated[
        Path | None,
        Parameter(help="Folder of all runs, a campaign; the same command again continues there, --force starts anew."),
    ] = None,
    dry_run: Annotated[
        bool, Parameter(help="Check all signals and print the runs and their time; move nothing.")
    ] = False,
    force: Force = False,
    as_json: Json = False,
) -> int:
    """Play signals on a rig in open loop, condition by condition, and record every channel as a campaign.

    Guards are on; the rig is vented at the end of every run. A run that a guard ends is repeated, then left out.
    """
    if (out is None) == (not dry_run):
        raise InputError("give a folder, or --dry-run.", field="--out")

    from nectosome.rigs.rig_file import load_rig
    from nectosome.rigs.run_plan import load_plan
    from nectosome.rigs.run_series import CAMPAIGN, run_series

    planned = load_plan(plan, load_rig(config))
    if out is None:
        write(_plan_summary(planned))
        return 0
    with progress_bar("running") as update:
        series = run_series(planned, out, update, tell, anew=force)
    write(_series_summary(planned, series))
    if series.status != "finished":
        tell(f"{series.status}: {series.reason} The same command goes on from there.")
    for name, why in series.left_out.items():
        tell(f"left out: {name}: {why}")
    report(*[out / CAMPAIGN] if series.finished else [])
    return CODES[series.status] or int(bool(series.left_out))


def _plan_summary(plan: "RunPlan") -> Summary:
    """All runs with their conditions and lengths."""
    names = [*(plan.runs[0].conditions if plan.runs else ())]
    heads = {"run": "run", **{name: name for name in names}, "time": "time"}
    rows = [(run.name, *run.conditions.values(), Number(plan.seconds(run), "s")) for run in plan.runs]
    given = plan.description
    notes = [f"{name}: {value}" for name, value in plan.constants.items()]
    notes.append(
        f"each run: {given.settle:g} s at rest, signals that grow within {given.ramp:g} s and fall "
        f"within {given.ramp:g} s behind; {given.rest:g} s without power between runs"
    )
    title = f"{count(len(rows), 'run')}, {clock_text(plan.total)} in all"
    return Summary(title, [Table("runs", heads, rows)], notes=notes, values={"seconds": Number(plan.total, "s")})


def _series_summary(plan: "RunPlan", series: "Series") -> Summary:
    """How many runs are there, and which were repeated or left out."""
    conditions = {run.name: run.words for run in plan.runs}
    rows = [
        (name, conditions[name], Number(number), "left out" if name in series.left_out else "taken")
        for name, number in series.repeated.items()
    ]
    heads = {"run": "run", "conditions": "conditions", "set_aside": "set aside", "end": ""}
    title = f"{len(series.finished)} of {count(len(plan.runs), 'run')} finished"
    attributes = {"status": series.status, "status_reason": series.reason}
    tables = [Table("repeated", heads, rows, listed=True)] if rows else []
    return Summary(title, tables, attributes=attributes)


Channel = Annotated[str, Parameter(help="Measurement, as DEVICE.CHANNEL, such as cell.thrust.")]
Apply = Annotated[bool, Parameter(help="Write what was found into the rig file; its comments stay.")]


@rig.command(name="tare")
def rig_tare(
    *,
    config: RigConfig,
    channel: Channel,
    time: Annotated[str, value("Time for which it is read.")] = "2s",
    apply: Apply = False,
    as_json: Json = False,
) -> int:
    """Read a sensor at rest without a load, and print the zero with which it reads 0."""
    seconds = read_positive(time, "time", "--time")

    from nectosome.rigs.readings import ZeroedSensor
    from nectosome.rigs.rig_file import load_rig

    file = load_rig(config)
    sensor = ZeroedSensor.of(file, channel)
    reading = _read(file, channel, seconds, "at rest")
    if reading is None:
        return 1
    zero, error = sensor.raw(reading.mean), reading.error / abs(sensor.slope)
    rows: list[tuple[str | Label | Number, ...]] = [
        ("reading", Number(reading.mean, sensor.unit), Number(reading.error, sensor.unit)),
        ("zero", Number(zero, sensor.raw_unit), Number(error, sensor.raw_unit)),
        (Label("zero_before", "in the file"), Number(sensor.zero, sensor.raw_unit)),
    ]
    heads = {"what": channel, "value": "", "error": "standard error"}
    notes = [] if apply else [_line(sensor.zero_at, sensor.zero_text(zero))]
    write(Summary(f"{channel} at rest", [Table("zero", heads, rows)], notes=notes))
    if apply:
        _apply(config, {sensor.zero_at: sensor.zero_text(zero)})
    return 0


@rig.command(name="calibrate")
def rig_calibrate(
    *,
    config: RigConfig,
    channel: Channel,
    known: Annotated[
        str | None, value('Known loads, one after another, such as "0 N, 1 N, 2 N"; each is asked for.')
    ] = None,
    readings: Annotated[
        Path | None, Parameter(help="File with a column of the channel's readings and one of the loads, `load`.")
    ] = None,
    time: Annotated[str, value("Time for which each load is read.")] = "2s",
    apply: Apply = False,
    as_json: Json = False,
) -> int:
    """Find slope and zero of a sensor from its readings of known loads, by least squares."""
    seconds = read_positive(time, "time", "--time")
    if (known is None) == (readings is None):
        raise InputError("give either --known or --readings.", field="--known")

    import numpy as np

    from nectosome.rigs.readings import Calibration, ZeroedSensor
    from nectosome.rigs.rig_file import load_rig

    file = load_rig(config)
    sensor = ZeroedSensor.of(file, channel)
    if sensor.slope_at is None:
        message = "has no slope in the rig file. Give it one there, if it gives counts or volts."
        raise InputError(message, field="--channel")
    if readings is not None:
        raw, loads = _recorded(readings, sensor)
    else:
        wanted = _loads(known or "", sensor.unit)
        raw = np.empty(len(wanted))
        for k, (text, load) in enumerate(wanted):
            _ask(text, k + 1, len(wanted), there=file.rig.put_on(channel, load))
            reading = _read(file, channel, seconds, text)
            if reading is None:
                return 1
            raw[k] = sensor.raw(reading.mean)
        loads = np.array([load for _, load in wanted])
    result = Calibration.of(raw, loads, sensor.raw_unit, sensor.unit)
    changes = {sensor.zero_at: sensor.zero_text(result.zero), sensor.slope_at: sensor.slope_text(result.gain)}
    notes = [] if apply else [_line(at, text) for at, text in changes.items()]
    write(_summary(sensor, result, raw, loads, notes))
    if apply:
        _apply(config, changes)
    return 0


def _read(file: "RigFile", channel: str, seconds: float, label: str) -> "ChannelReadings | None":
    """Readings of a channel at rest; None where it cannot be read, which is told."""
    from nectosome.rigs import RigError
    from nectosome.rigs.readings import read_channels

    with progress_bar(label) as update:
        try:
            every = read_channels(file, seconds, lambda share: update("", share)).channels()
        except RigError as error:
            tell(f"failed: {error}")
            return None
    of_channel = next(one for one in every if one.name == channel)
    if of_channel.missing:
        tell(f"{channel}: {100 * of_channel.missing:.3g} % of the readings are missing. Look at the sensor's range.")
        return None
    return of_channel


def _loads(text: str, unit: str) -> list[tuple[str, float]]:
    """Loads with their texts. Raises InputError."""
    from nectosome.rigs.device_files import same_unit

    try:
        values = [(part.strip(), same_unit(part.strip(), unit)) for part in text.split(",")]
    except ValueError as error:
        raise InputError(str(error), field="--known") from None
    if len(values) < 3:
        raise InputError("three loads are needed at least, of which two differ.", field="--known")
    return values


def _ask(load: str, number: int, count: int, *, there: bool) -> None:
    """Wait until a load is on, or, where the simulator has put it on, to be told to go on.

    Raises InputError where nobody answers.
    """
    on_it = (
        f"{load} is on the simulated sensor: press"
        if there
        else f"put on {load}, wait until it hangs still, then press"
    )
    tell(f"load {number} of {count}: {on_it} Enter.", kept=False)
    if not sys.stdin.readline():
        raise InputError("nobody says that the load is on: stdin has ended. Take --readings FILE.", field="--known")


def _recorded(path: Path, sensor: "ZeroedSensor") -> tuple[Any, Any]:
    """Raw readings and loads of a file. Raises InputError."""
    from nectosome.measure import read

    data = read(path)
    units = {str(name): str(column.attrs.get("units", "")) for name, column in data.data_vars.items()}
    listed = ", ".join(f"{name} [{unit or '?'}]" for name, unit in units.items())
    if units.get("load") != sensor.unit:
        raise InputError(f"has no column load in {sensor.unit}: {listed}.", file=str(path))
    raw = [name for name, unit in units.items() if name != "load" and unit == sensor.raw_unit]
    if len(raw) != 1:
        raise InputError(f"one column of readings in {sensor.raw_unit} is needed: {listed}.", file=str(path))
    return data[raw[0]].values, data["load"].values


def _summary(sensor: "ZeroedSensor", fit: "Calibration", raw: Any, loads: Any, notes: list[str]) -> Summary:
    """Slope and zero with their errors, and what is left of each load; JSON has each reading too."""
    import numpy as np

    per = f"{sensor.unit}/{sensor.raw_unit}"
    rows = [
        ("slope", Number(fit.gain, per), Number(fit.gain_error, per), Number(sensor.slope, per)),
        ("zero", Number(fit.zero, sensor.raw_unit), Number(fit.zero_error, sensor.raw_unit),
         Number(sensor.zero, sensor.raw_unit)),
    ]  # fmt: skip
    heads = {"what": sensor.channel, "value": "", "error": "standard error", "before": "in the file"}
    left = [
        (str(k), Number(float(load), sensor.unit), Number(float(x), sensor.raw_unit), Number(float(r), sensor.unit))
        for k, (load, x, r) in enumerate(zip(loads, raw, fit.residuals, strict=True), start=1)
    ]
    each = {"load": "load", "quantity": "", "reading": "reading", "residual": "residual"}
    known = [(float(load), loads == load) for load in np.unique(loads)]
    by_load = [
        (
            Label(number(load), f"{number(load)} {sensor.unit}"),
            Number(int(there.sum())),
            Number(float(raw[there].mean()), sensor.raw_unit),
            Number(float(fit.residuals[there].mean()), sensor.unit),
            Number(float(np.abs(fit.residuals[there]).max()), sensor.unit),
        )
        for load, there in known
    ]
    grouped = {"load": "load", "count": "readings", "reading": "mean", "residual": "mean left", "most": "largest left"}
    tables = [Table("calibration", heads, rows), Table("loads", grouped, by_load, computed=True)]
    title = f"{sensor.channel}, {count(len(left), 'reading')} of {count(len(known), 'load')}"
    return Summary(title, tables, notes=notes, facts=[Table("readings", each, left, listed=True)])


def _line(at: "Key", text: str) -> str:
    """What to write where."""
    return f"in the rig file, {'.'.join(map(str, at[:-1]))}: {at[-1]}: {text} (--apply writes it)"


def _apply(config: Path, changes: "dict[Key, str]") -> None:
    from nectosome.rigs.readings import changed_file

    changed_file(config, changes)
    report(config)
