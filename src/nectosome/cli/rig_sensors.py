"""`nectosome rig tare` and `rig calibrate`: the zero and the slope of a sensor, such as a load cell."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from nectosome.cli.options import value
from nectosome.cli.output import Json, report, tell, write
from nectosome.cli.progress import progress_bar
from nectosome.cli.rig import RigConfig, rig
from nectosome.io.summary import Summary
from nectosome.io.tables import Label, Number, Table
from nectosome.units import InputError, read_positive

if TYPE_CHECKING:
    from nectosome.io.yaml_text import Key
    from nectosome.rigs.readings import ChannelReadings
    from nectosome.rigs.rig_file import RigFile
    from nectosome.rigs.sensor_zero import Calibration, ZeroedSensor

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

    from nectosome.rigs.rig_file import load_rig
    from nectosome.rigs.sensor_zero import ZeroedSensor

    file = load_rig(config)
    sensor = ZeroedSensor.of(file, channel)
    found = _read(file, channel, seconds, "at rest")
    if found is None:
        return 1
    zero, error = sensor.raw(found.mean), found.error / abs(sensor.slope)
    rows: list[tuple[str | Label | Number, ...]] = [
        ("reading", Number(found.mean, sensor.unit), Number(found.error, sensor.unit)),
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

    from nectosome.rigs.rig_file import load_rig
    from nectosome.rigs.sensor_zero import Calibration, ZeroedSensor

    file = load_rig(config)
    sensor = ZeroedSensor.of(file, channel)
    if sensor.slope_at is None:
        raise InputError("has no slope in the rig file that could be calibrated.", field="--channel")
    if readings is not None:
        raw, loads = _recorded(readings, sensor)
    else:
        wanted = _loads(known or "", sensor.unit)
        raw = np.empty(len(wanted))
        for k, (text, _) in enumerate(wanted):
            _ask(text, k + 1, len(wanted))
            found = _read(file, channel, seconds, text)
            if found is None:
                return 1
            raw[k] = sensor.raw(found.mean)
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
    found = next(one for one in every if one.name == channel)
    if found.missing:
        tell(f"{channel}: {100 * found.missing:.3g} % of the readings are missing. Look at the sensor's range.")
        return None
    return found


def _loads(text: str, unit: str) -> list[tuple[str, float]]:
    """Loads with their texts. Raises InputError."""
    from nectosome.rigs.channel_units import same_unit

    try:
        found = [(part.strip(), same_unit(part.strip(), unit)) for part in text.split(",")]
    except ValueError as error:
        raise InputError(str(error), field="--known") from None
    if len(found) < 3:
        raise InputError("three loads are needed at least, of which two differ.", field="--known")
    return found


def _ask(load: str, number: int, count: int) -> None:
    """Wait until a load is on. Raises InputError where nobody answers."""
    tell(f"load {number} of {count}: put on {load}, wait until it hangs still, then press Enter.", kept=False)
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


def _summary(sensor: "ZeroedSensor", found: "Calibration", raw: Any, loads: Any, notes: list[str]) -> Summary:
    """Slope and zero with their errors, and what is left of each load."""
    per = f"{sensor.unit}/{sensor.raw_unit}"
    rows = [
        ("slope", Number(found.gain, per), Number(found.gain_error, per), Number(sensor.slope, per)),
        ("zero", Number(found.zero, sensor.raw_unit), Number(found.zero_error, sensor.raw_unit),
         Number(sensor.zero, sensor.raw_unit)),
    ]  # fmt: skip
    heads = {"what": sensor.channel, "value": "", "error": "standard error", "before": "in the file"}
    left = [
        (str(k), Number(float(load), sensor.unit), Number(float(x), sensor.raw_unit), Number(float(r), sensor.unit))
        for k, (load, x, r) in enumerate(zip(loads, raw, found.residuals, strict=True), start=1)
    ]
    each = {"load": "load", "quantity": "", "reading": "reading", "residual": "residual"}
    tables = [Table("calibration", heads, rows), Table("loads", each, left, listed=True)]
    return Summary(f"{sensor.channel}, {len(left)} loads", tables, notes=notes)


def _line(at: "Key", text: str) -> str:
    """What to write where."""
    return f"in the rig file, {'.'.join(map(str, at[:-1]))}: {at[-1]}: {text} (--apply writes it)"


def _apply(config: Path, changes: "dict[Key, str]") -> None:
    from nectosome.rigs.sensor_zero import changed_file

    changed_file(config, changes)
    report(config)
