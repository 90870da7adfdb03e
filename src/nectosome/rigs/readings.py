"""Readings of all channels of a rig at rest: nothing is commanded."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from nectosome.units import InputError

from .rig import RigError
from .rig_file import RigFile

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
