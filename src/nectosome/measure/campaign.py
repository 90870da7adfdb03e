"""Campaigns: recordings of one kind, with conditions and repeat numbers."""

import json
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field, WithJsonSchema

from nectosome.io.file_system import entries, is_file
from nectosome.io.schema.described import Described, Text
from nectosome.io.schema.validate import errors_at, validate_as
from nectosome.io.yaml_text import read_text, read_yaml
from nectosome.units import InputError, shorten

from .beside import DeviceFile, same_run, with_devices
from .formats.file_errors import MEMORY
from .recordings import read_all
from .sheet import DeviceClock, Sheet, SourceFields, TimedColumns
from .sheet_values import Drift, Lateness, SamplingRate

if TYPE_CHECKING:
    import xarray as xr

_START = {"type": "string", "examples": ["-20..20 deg", "10 deg", "reading", "equilibrium"]}
_OF_SOURCE = ("split", "time", "clocks", "columns")  # what a recording says in the place of its campaign
_WINDOW = {"type": "string", "examples": ["1.5..11.5 s"]}


class DeviceEntry(TimedColumns):
    """The file of another device in the same run; its quantities are resampled at the times of the recording."""

    file: Annotated[
        str, Field(min_length=1), WithJsonSchema({"type": "string", "examples": ["camera_1.csv", "b_*.csv"]})
    ]
    """The file, relative to the campaign; each * is what it stands for in the recording's file."""
    shift: Lateness = 0.0
    """How much later it is than the recording: a time, or the range of what `identify` shall find."""
    drift: Drift = 0.0
    """Share by which its clock runs fast beside that of the recording: a number, or a range."""


class RecordingEntry(SourceFields):
    """A recording of a campaign; what it says of time and columns takes the place of what the campaign says."""

    file: Annotated[str, Field(min_length=1), WithJsonSchema({"type": "string", "examples": ["run_1.csv", "a_*.csv"]})]
    """The file, relative to the campaign; a pattern with * stands for several, repeats of each other."""
    start: dict[str, Annotated[Text, WithJsonSchema(_START)]] = Field(default_factory=dict)
    """How joints and strains of the robot start, by path: a range of what is unknown, a number, or `reading`, the first
    reading. `before.PATH` is a number that the robot had before: it starts at rest in the equilibrium with that;
    `before: equilibrium` is the one of the robot as it is.

    What is left out is as the robot file says."""
    shift: Lateness | None = None
    """How much later readings are on the file's clock than on that of the robot and its inputs: a range, or a time. A
    device that is late by itself has its own under `clocks`."""
    drift: Drift | None = None
    """Share by which the file's clock runs fast beside that of the robot and its inputs: a range, or a number."""
    beside: dict[str, DeviceEntry] = Field(default_factory=dict)
    """Files of other devices in the same run, by the name of the device; `time: {trigger: sync}` in each puts them on
    one clock."""
    window: Annotated[Text, WithJsonSchema(_WINDOW)] | None = None
    """Time in which its conditions hold, on its clock: `correct` takes means and cycles of it alone."""


class DriveEntry(Described):
    """How a column drives a robot."""

    smooth: SamplingRate | None = None
    """Cut-off of a smoothing spline in the place of its samples, such as 8 Hz: for noise and for steps of an encoder,
    whose accelerations make a simulation slow."""


class CampaignSheet(Sheet):
    """A campaign: a sheet for several files, with the conditions of each."""

    drives: dict[str, DriveEntry] = Field(default_factory=dict)
    """Columns that drive the robot, and how, for `identify`."""
    recordings: Annotated[tuple[RecordingEntry, ...], Field(min_length=1)]
    """The files, each with its conditions. Files of the same conditions are repeats."""


@dataclass(frozen=True)
class CampaignFile:
    """One file of a campaign, and its sheet with its conditions."""

    path: Path
    sheet: Sheet
    own: Mapping[str, Any] = field(default_factory=dict)  # `start`, `shift` and others, where it says them
    beside: tuple[DeviceFile, ...] = ()

    def read(self, memory: int = MEMORY) -> "list[xr.Dataset]":
        """Read its recordings, as `read_all`; conditions are coordinates; start, shift, drift and window attributes."""
        told = {name: json.dumps(value) for name, value in self.own.items()}
        recordings = read_all(self.path, self.sheet, memory=memory)
        if self.beside:
            others = [(device, read_all(device.path, device.sheet, memory=memory)) for device in self.beside]
            many = next((path for path, all_of in self._each(recordings, others) if len(all_of) > 1), None)
            if many is not None:
                raise InputError("holds several recordings, and devices beside it need one.", file=str(many))
            recordings = [with_devices(recordings[0], [(device, own) for device, (own,) in others])]
        return [recording.assign_attrs(told) for recording in recordings]

    def _each(self, recordings: Any, others: Any) -> "list[tuple[Path, list[xr.Dataset]]]":
        return [(self.path, recordings), *((device.path, own) for device, own in others)]


@dataclass(frozen=True)
class Campaign:
    """The files that a campaign file lists, in its order."""

    about: str
    planned: tuple[CampaignFile, ...]

    def recordings(
        self, progress: Callable[[str, float], object] | None = None, memory: int = MEMORY
    ) -> "list[xr.Dataset]":
        """Read all recordings; those of the same conditions are repeats, with their number, from 1, in `repeat`.

        `progress` is told the name of each file and the share that is read. Each file may
        take `memory` [bytes], as in `read_all`. Raises InputError if one cannot be read.
        """
        recordings: list[xr.Dataset] = []
        seen: Counter[tuple[tuple[str, float, str], ...]] = Counter()
        for k, file in enumerate(self.planned):
            if progress is not None:
                progress(file.path.name, k / len(self.planned))
            key = tuple(sorted((name, *value) for name, value in file.sheet.conditions.items()))
            for recording in file.read(memory):
                seen[key] += 1
                recordings.append(recording.assign_coords(repeat=((), seen[key], {"units": "1"})))
        return recordings


def load_campaign(path: str | Path) -> Campaign:
    """Read a campaign file: a sheet with a list of `recordings`, each a `file` (or a pattern) and its `conditions`.

    File names are relative to the campaign file; files that match one pattern are repeats of each other. Conditions of
    the sheet apply to all recordings; its `split`, `time`, `clocks` and `columns` to those without their own. Raises
    InputError that names file, line and field.
    """
    folder, source = Path(path).parent, str(path)
    data, lines = read_yaml(read_text(path), source)
    campaign = validate_as(CampaignSheet, data, "campaign", file=source, lines=lines)
    files: list[CampaignFile] = []
    for k, one in enumerate(campaign.recordings):
        own = {name: getattr(one, name) or getattr(campaign, name) for name in _OF_SOURCE}
        conditions = campaign.conditions | one.conditions
        of_all = {name: getattr(campaign, name) for name in ("about", "file", "repair")}
        sheet = Sheet.model_construct(conditions=conditions, **of_all, **own)
        said = {"start": one.start or None, "shift": one.shift, "drift": one.drift, "window": one.window}
        drives = {name: drive.model_dump(exclude_none=True) for name, drive in campaign.drives.items()}
        said["drives"] = drives or None
        said["shared_clocks"] = True if campaign.clocks and not one.clocks else None
        with errors_at(source, lines, "recordings", k, "file"):
            found = _files(folder, one.file)
        said = {name: x for name, x in said.items() if x is not None}
        for file in found:
            beside = []
            for name, device in one.beside.items():
                with errors_at(source, lines, "recordings", k, "beside", name, "file"):
                    (path,) = _files(folder, same_run(device.file, one.file, str(file.relative_to(folder))))
                of_device = Sheet(time=device.time, columns=device.columns, repair=campaign.repair)
                clock = DeviceClock(shift=device.shift, drift=device.drift)
                beside.append(DeviceFile(name, path, of_device, clock))
            files.append(CampaignFile(file, sheet, said, tuple(beside)))
    listed = Counter((one.path, one.sheet.split and one.sheet.split.value) for one in files)
    paths = Counter(path for path, _ in listed)
    duplicate = next((path for (path, value), n in listed.items() if n > 1 or (not value and paths[path] > 1)), None)
    if duplicate is not None:
        raise InputError(f"{duplicate.name} is listed twice.", file=source, field="recordings")
    return Campaign(campaign.about, tuple(files))


def _files(folder: Path, pattern: str) -> list[Path]:
    """Files of a name or a pattern. Raises InputError for none, and for one outside of the folder."""
    if Path(pattern).is_absolute() or ".." in Path(pattern).parts:
        raise InputError(f'"{shorten(pattern)}" is outside the folder of the campaign file.')
    paths = entries(folder, pattern) if any(c in pattern for c in "*?[") else [folder / pattern]
    if not paths or not all(map(is_file, paths)):
        raise InputError(f'there is no file "{shorten(pattern)}" beside the campaign file that may be read.')
    return paths
