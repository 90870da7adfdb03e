"""Zero and slope of a sensor in a rig file: what they should be by readings, and how the file is changed."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from jaxtyping import Float

from nectosome.io import write_atomic
from nectosome.io.yaml_text import Key, read_text, replaced_value
from nectosome.measure import calibrate
from nectosome.units import InputError, did_you_mean, shorten

from .rig_file import RigDescription, RigFile, load_rig


@dataclass(frozen=True)
class ZeroedSensor:
    """Where a rig file has the zero of a channel: quantity = slope (raw - zero), with `raw` in `raw_unit`.

    - slope_at: where its slope is, or None where it has none that can be changed.
    """

    channel: str
    unit: str
    zero_at: Key
    zero: float
    slope: float
    raw_unit: str
    slope_at: Key | None = None

    @classmethod
    def of(cls, file: RigFile, channel: str) -> "ZeroedSensor":
        """That of a channel. Raises InputError for one that is not there, and for one without a zero in the file."""
        known = file.rig.measurements
        if channel not in known:
            message = f'there is no measurement "{shorten(channel)}": {", ".join(known) or "none"}.'
            raise InputError(message + did_you_mean(channel, known, most=0), field="--channel")
        device, _, name = channel.partition(".")
        given: Any = file.written.devices[device]
        if given.kind == "ni":
            one = file.rig.devices[device].wiring.inputs[name]  # pyright: ignore[reportAttributeAccessIssue]
            at = ("devices", device, "inputs", name)
            return cls(channel, known[channel], (*at, "zero"), one.zero, one.slope, "V", (*at, "slope"))
        if given.kind == "dynamixel" and name in given.servos:
            servo = given.servos[name]
            at = ("devices", device, "servos", name, "zero")
            return cls(channel, "rad", at, servo.zero, float(servo.sign), "rad")
        raise InputError(f"a channel of the kind {given.kind} has no zero in a rig file.", field="--channel")

    def raw(self, quantity: float) -> float:
        """The raw reading of a quantity."""
        return self.zero + quantity / self.slope

    def zero_text(self, zero: float) -> str:
        """A zero as it stands in a file."""
        return f"{zero:.6g} {self.raw_unit}"

    def slope_text(self, slope: float) -> str:
        """A slope as it stands in a file."""
        return f"{slope:.6g} {self.unit}/{self.raw_unit}"


@dataclass(frozen=True)
class Calibration:
    """Gain and zero of a sensor by known loads, with standard errors, and what is left [unit of the loads]."""

    gain: float
    gain_error: float
    zero: float
    zero_error: float
    residuals: Float[np.ndarray, "n"]

    @classmethod
    def of(cls, raw: Float[np.ndarray, "n"], loads: Float[np.ndarray, "n"], raw_unit: str, unit: str) -> "Calibration":
        """By least squares. Raises InputError for fewer than three loads, and for equal readings."""
        given = (xr.DataArray(np.asarray(x), attrs={"units": of}) for x, of in ((raw, raw_unit), (loads, unit)))
        try:
            line = calibrate(*given)
        except ValueError as error:
            raise InputError(str(error).removeprefix("calibrate: "), field="--known") from None
        gain, zero = float(line["gain"]), float(line["zero"])
        residuals = np.asarray(loads) - gain * (np.asarray(raw) - zero)
        return cls(gain, float(line["gain_se"]), zero, float(line["zero_se"]), residuals)


def changed_file(path: Path, changes: dict[Key, str]) -> None:
    """Write values of fields into a rig file; all else in it stays, comments too. It is whole or unchanged.

    Raises InputError where the file cannot be changed so, for instance where a value stands in several places.
    """
    before = load_rig(path).written
    text = read_text(path)
    for at, value in changes.items():
        text = replaced_value(text, str(path), at, value)
    content = text.encode()
    write_atomic(path, lambda temporary: _written(temporary, content, before, changes, path))


def _written(temporary: Path, content: bytes, before: RigDescription, changes: dict[Key, str], path: Path) -> None:
    """Write the file, and check that it is the same but for the changes."""
    temporary.write_bytes(content)
    after = load_rig(temporary).written
    if _without(before, changes) != _without(after, changes):
        raise InputError("cannot be changed: a value of it stands in several places.", file=str(path))


def _without(given: RigDescription, changes: dict[Key, str]) -> Any:
    data = given.model_dump()
    for *groups, last in changes:
        place: Any = data
        for step in groups:
            place = place[step]
        place.pop(last)
    return data
