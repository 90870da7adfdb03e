"""Rig files: devices and their connections, and the limits of their commands and measurements."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field

from nectosome.core.described import class_for
from nectosome.description.fields import Name, PositiveTime
from nectosome.io.schema.described import Described, OneOf
from nectosome.io.schema.validate import validate_as
from nectosome.io.yaml_text import read_text, read_yaml
from nectosome.units import InputError, did_you_mean, shorten

from .device_files import AnyQuantity, DeviceDescription, FileFields, model_of_settings, same_unit, unit_size
from .devices.serial_line import share_ports
from .devices.simulated_actuator import SimulatedActuator
from .guards import NOTHING, CommandLimits, Limits, MeasurementLimits
from .rig import Devices, Rig, RigError

if TYPE_CHECKING:
    from nectosome.identification.hysteresis.fit import Identified


_Command = model_of_settings(CommandLimits, low=AnyQuantity, high=AnyQuantity, slew=AnyQuantity)
_Measurement = model_of_settings(
    MeasurementLimits, least=AnyQuantity, most=AnyQuantity, error=(AnyQuantity | None, None)
)


class GuardFields(model_of_settings(Limits, commands=None, measurements=None)):
    """Guards of the whole rig.

    Time of a controller's command at an end of its range or at its largest rate counts as that of an error does: a loop
    whose gains are far too high oscillates there, maybe with a small error.
    """


class RigDescription(Described):
    """The file of a rig: its devices, and the limits of their commands and measurements.

    Channels are called DEVICE.CHANNEL: `servos.left` is the channel `left` of the device `servos`.
    """

    about: str = ""
    """What the rig is, in sentences."""
    dt: PositiveTime
    """Time between samples."""
    devices: Annotated[dict[Name, Annotated[DeviceDescription, OneOf()]], Field(min_length=1)]
    """The devices, by names of their own."""
    commands: dict[str, _Command] = Field(default_factory=dict)  # pyright: ignore[reportInvalidTypeForm]
    """Limits of every command."""
    measurements: dict[str, _Measurement] = Field(default_factory=dict)  # pyright: ignore[reportInvalidTypeForm]
    """Limits of measurements; one without limits is recorded and not guarded."""
    guards: GuardFields = GuardFields()
    """When clocks, sensors and controllers count as faulty."""


@dataclass(frozen=True)
class RigFile:
    """A rig as its file describes it."""

    rig: Devices
    limits: Limits
    dt: float  # between samples [s]
    models: "Mapping[str, Identified]"  # of simulated actuators, by their command
    written: RigDescription

    def unit_size(self, command: str) -> float:
        """Size in SI of the unit in which the range of a command is written."""
        given = self.written.commands[command]
        return next(filter(None, (unit_size(text) for text in (given.high, given.low))), 1.0)


def load_rig(path: str | Path) -> RigFile:
    """Read a rig file; no device is opened. Raises InputError that names file, line and field."""
    source = str(path)
    data, lines = read_yaml(read_text(path), source)
    if isinstance(data, dict) and "kind" in data and "devices" not in data:
        raise InputError(
            "a rig file names its devices. Write devices: {NAME: {kind: ...}} with the fields of the device in it, and "
            "the limits as commands: {NAME.CHANNEL: {low, high, slew}} and measurements: {NAME.CHANNEL: {least, most, "
            "error}}. `nectosome new rig` writes such a file.",
            file=source, line=lines.get(("kind",)), field="kind",
        )  # fmt: skip
    given = validate_as(RigDescription, data, "rig", file=source, lines=lines)
    file = FileFields(source, lines)
    devices = dict[str, Rig]()
    for name, device in given.devices.items():
        devices[name] = class_for(device, Rig).from_description(device, file.within("devices", name), given.dt)
    with file.within("devices").errors():
        share_ports(devices, given.devices)
    rig, models = Devices(devices), dict[str, "Identified"]()
    limits = _limits(given, file, rig.commands, rig.measurements)
    for name, device in devices.items():
        try:
            device.take_limits(_own(limits.commands, name), _own(limits.measurements, name))
        except InputError as error:
            group, _, channel = (error.field or "").partition(".")
            raise file.wrong(error.message, group, f"{name}.{channel}") from None
        if isinstance(device, SimulatedActuator):
            models |= {f"{name}.{command}": device.model for command in device.commands}
        _check_ends(device, name, limits, file)
    return RigFile(rig, limits, given.dt, models, given)


def _own(group: Mapping[str, Any], name: str) -> dict[str, Any]:
    """What belongs to the channels of a device, by their own names."""
    return {channel.removeprefix(f"{name}."): one for channel, one in group.items() if channel.startswith(f"{name}.")}


def _limits(
    given: RigDescription, file: FileFields, commands: Mapping[str, str], measurements: Mapping[str, str]
) -> Limits:
    """The limits, in the units of the channels. Raises InputError."""
    groups: tuple[tuple[str, Mapping[str, Any], Mapping[str, str], type, tuple[str, ...]], ...] = (
        ("command", given.commands, commands, CommandLimits, ("slew",)),
        ("measurement", given.measurements, measurements, MeasurementLimits, ("error",)),
    )
    found: dict[str, dict[str, Any]] = {}
    for kind, group, known, limits, differences in groups:
        for name in group:
            if name not in known:
                message = f'there is no {kind} "{shorten(name)}": {", ".join(known) or "none"}.'
                raise file.wrong(message + did_you_mean(name, known, most=0), f"{kind}s", name)
        found[kind] = {
            name: _in_units(fields, file.within(f"{kind}s", name), known[name], limits, differences)
            for name, fields in group.items()
        }
    for name in commands:
        if name not in given.commands:
            raise file.wrong("is missing: every command needs low, high and slew.", "commands", name)
    for name, fields in given.measurements.items():
        if fields.follows not in (None, NOTHING, *commands):
            message = f'there is no command "{shorten(fields.follows)}": {", ".join(commands) or "none"}.'
            raise file.wrong(message + did_you_mean(fields.follows, commands, most=0), "measurements", name, "follows")
    return file.within("guards").create(
        Limits, given.guards, commands=found["command"], measurements=found["measurement"]
    )


def _in_units(fields: Any, file: FileFields, unit: str, limits: type, differences: tuple[str, ...]) -> Any:
    """Limits of a channel in its SI unit; a `slew` is a change of it per second."""
    numbers: dict[str, float] = {}
    for name in ("low", "high", "slew", "least", "most", "error"):
        text = getattr(fields, name, None)
        if text is None:
            continue
        try:
            of = f"{unit}/s" if name == "slew" and unit not in ("", "1") else "1/s" if name == "slew" else unit
            numbers[name] = same_unit(text, of, difference=name in differences)
        except ValueError as error:
            raise file.wrong(str(error), name) from None
    return file.create(limits, fields, **numbers)


def _check_ends(rig: Rig, name: str, limits: Limits, file: FileFields) -> None:
    """Check that a device takes its commands at both ends of their ranges. Raises InputError."""
    for channel in rig.commands:
        at = f"{name}.{channel}"
        for end in ("low", "high"):
            try:
                rig.check_command(channel, getattr(limits.commands[at], end))
            except RigError as error:
                raise file.wrong(str(error), "commands", at, end) from None
