"""Readings of a rig at rest, where nothing is commanded, and zeros and slopes of sensors in its file by them."""

import math
from collections.abc import Callable
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

from .rig import RigError
from .rig_file import RigDescription, RigFile, load_rig

_SLOW = 0.9  # of the samples that the file asks for, below which they come too slowly
_BATCHES = 10  # of readings, whose means tell the standard error of the whole


@dataclass(frozen=True)
class Readings:
    """Readings of all channels, a row for each sample, and the time that they took [s]."""

    file: RigFile
    values: Float[np.ndarray, "samples channels"]
    seconds: float

    @property
    def rate(self) -> float:
        """Samples per second that were really taken; NaN for a single one."""
        return (len(self.values) - 1) / self.seconds if self.seconds else math.nan

    def channels(self) -> "list[ChannelReadings]":
        """The readings of each channel."""
        names = self.file.rig.measurements
        return [ChannelReadings(name, unit, self.values[:, k]) for k, (name, unit) in enumerate(names.items())]

    def wrong(self) -> list[str]:
        """What looks wrong, in sentences."""
        sentences = [sentence for channel in self.channels() for sentence in self._wrong(channel)]
        sentences += self.file.rig.remarks()
        if self.rate < _SLOW / self.file.dt:
            sentences.append(
                f"{self.rate:.4g} samples/s were taken, and dt asks for {1 / self.file.dt:.4g}. Look at what else runs "
                "on this machine and at the speed of the lines, or take a longer dt."
            )
        return sentences

    def _wrong(self, channel: "ChannelReadings") -> list[str]:
        limits, unit, sentences = self.file.limits.measurements.get(channel.name), channel.unit, []
        if channel.missing:
            sentences.append(
                f"{channel.name}: {100 * channel.missing:.3g} % of the readings are missing. Look whether the sensor "
                "sees its target, and is within its range."
            )
        if limits is not None and channel.known and not limits.least <= channel.least <= channel.most <= limits.most:
            sentences.append(
                f"{channel.name}: from {channel.least:.4g} to {channel.most:.4g} {unit}, and {limits.least:g} to "
                f"{limits.most:g} {unit} are allowed. Look at the sensor's zero and sign."
            )
        if limits is not None and channel.frozen and channel.name not in self.file.rig.commands:
            sentences.append(
                f"{channel.name}: all readings are {channel.mean:.6g} {unit} to the last bit. Look whether the sensor "
                "still measures; a counter at rest, such as an encoder, may do so."
            )
        return sentences


@dataclass(frozen=True)
class ChannelReadings:
    """Readings of a channel in its SI unit."""

    name: str
    unit: str
    values: Float[np.ndarray, "n"]

    @property
    def known(self) -> int:
        """Number of readings that are no NaN."""
        return int(np.isfinite(self.values).sum())

    @property
    def missing(self) -> float:
        """Share of NaN."""
        return 1 - self.known / len(self.values)

    @property
    def mean(self) -> float:
        """Mean of the known ones; NaN without any."""
        return float(np.mean(self._known)) if self.known else math.nan

    @property
    def deviation(self) -> float:
        """Standard deviation; NaN where fewer than two are known."""
        return float(np.std(self._known, ddof=1)) if self.known > 1 else math.nan

    @property
    def error(self) -> float:
        """Standard error of the mean, by the means of ten batches: neighbours may be alike. NaN for too few."""
        if self.known < 2 * _BATCHES:
            return math.nan
        means = [float(batch.mean()) for batch in np.array_split(self._known, _BATCHES)]
        return float(np.std(means, ddof=1) / math.sqrt(_BATCHES))

    @property
    def least(self) -> float:
        """Smallest known one."""
        return float(self._known.min()) if self.known else math.nan

    @property
    def most(self) -> float:
        """Largest known one."""
        return float(self._known.max()) if self.known else math.nan

    @property
    def frozen(self) -> bool:
        """Whether all are known, and the same to the last bit."""
        return len(self.values) > 1 and not self.missing and self.least == self.most

    @property
    def _known(self) -> Float[np.ndarray, "k"]:
        return self.values[np.isfinite(self.values)]


def read_channels(file: RigFile, seconds: float, progress: Callable[[float], object] | None = None) -> Readings:
    """Connect to a rig, and read all channels for some time, in samples dt apart; nothing is commanded.

    Raises InputError where it cannot be connected to, and RigError where a reading fails.
    """
    rig, rows = file.rig, list[tuple[float, ...]]()
    if not rig.measurements:
        raise InputError("the rig measures nothing: there is no channel to read.", field="devices")
    try:
        try:
            rig.connect()
        except RigError as error:
            raise InputError(f"{error} Nothing was commanded.") from error
        start = rig.now()
        while True:
            rows.append(rig.measure())
            last = rig.now() - start
            if last + file.dt > seconds * (1 + 1e-9):
                break
            if progress is not None:
                progress(last / seconds)
            rig.wait(start + max(len(rows) * file.dt, last))
    finally:
        rig.close()
    return Readings(file, np.array(rows), last)


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
        found = file.rig.devices[device].zero_of(name)
        if found is None:
            kind = file.written.devices[device].kind
            raise InputError(f"a channel of the kind {kind} has no zero in a rig file.", field="--channel")
        at = ("devices", device, *found.group)
        slope_at = (*at, "slope") if found.sloped else None
        return cls(channel, known[channel], (*at, "zero"), found.zero, found.slope, found.raw_unit, slope_at)

    def raw(self, quantity: float) -> float:
        """The raw reading of a quantity."""
        return self.zero + quantity / self.slope

    def zero_text(self, zero: float) -> str:
        """A zero as it stands in a file."""
        digits = 10 if self.raw_unit == "count" else 6  # of 24 bits, and less than a count
        return f"{zero:.{digits}g} {self.raw_unit}"

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
