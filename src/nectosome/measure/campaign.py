"""Campaigns: recordings of one kind, with conditions and repeat numbers."""

import json
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field, WithJsonSchema

from nectosome.io.schema.described import Text
from nectosome.io.schema.validate import errors_at, validate_as
from nectosome.io.yaml_text import read_text, read_yaml
from nectosome.units import InputError, shorten

from .recordings import read
from .sheet import Sheet, SourceFields

if TYPE_CHECKING:
    import xarray as xr

_START = {"type": "string", "examples": ["-20..20 deg", "10 deg", "reading"]}
_SHIFT = {"type": "string", "examples": ["-0.2..0.2 s", "20 ms"]}


class RecordingEntry(SourceFields):
    """A recording of a campaign; what it says of time and columns takes the place of what the campaign says."""

    file: Annotated[str, Field(min_length=1), WithJsonSchema({"type": "string", "examples": ["run_1.csv", "a_*.csv"]})]
    """The file, relative to the campaign; a pattern with * stands for several, repeats of each other."""
    start: dict[str, Annotated[Text, WithJsonSchema(_START)]] = Field(default_factory=dict)
    """How joints of the robot start, by path: a range of what is unknown, a number, or `reading`, the first reading.

    What is left out is as the robot file says."""
    shift: Annotated[Text, WithJsonSchema(_SHIFT)] | None = None
    """How much later readings are on the file's clock than on that of the robot and its inputs: a range, or a time."""


class CampaignSheet(Sheet):
    """A campaign: a sheet for several files, with the conditions of each."""

    recordings: Annotated[tuple[RecordingEntry, ...], Field(min_length=1)]
    """The files, each with its conditions. Files of the same conditions are repeats."""


@dataclass(frozen=True)
class CampaignFile:
    """One file of a campaign, its sheet with its conditions, and the number of its repeat."""

    path: Path
    sheet: Sheet
    repeat: int  # from 1
    own: Mapping[str, Any] = field(default_factory=dict)  # `start` and `shift`, where it says them

    def read(self) -> "xr.Dataset":
        """Read the recording; its conditions and its `repeat` are coordinates, its start and shift attributes."""
        told = {name: json.dumps(value) for name, value in self.own.items()}
        return read(self.path, self.sheet).assign_coords(repeat=((), self.repeat, {"units": "1"})).assign_attrs(told)


@dataclass(frozen=True)
class Campaign:
    """The files that a campaign file lists, in its order."""

    about: str
    planned: tuple[CampaignFile, ...]

    def recordings(self) -> "list[xr.Dataset]":
        """Read all recordings. Raises InputError if one cannot be read."""
        return [file.read() for file in self.planned]


def load_campaign(path: str | Path) -> Campaign:
    """Read a campaign file: a sheet with a list of `recordings`, each a `file` (or a pattern) and its `conditions`.

    File names are relative to the campaign file; files that match one pattern are repeats of each other. Conditions of
    the sheet apply to all recordings; its `time`, `clocks` and `columns` to those without their own. Raises
    InputError that names file, line and field.
    """
    folder, source = Path(path).parent, str(path)
    data, lines = read_yaml(read_text(path), source)
    campaign = validate_as(CampaignSheet, data, "campaign", file=source, lines=lines)
    files: list[CampaignFile] = []
    seen: Counter[tuple[tuple[str, float, str], ...]] = Counter()
    for k, one in enumerate(campaign.recordings):
        own = {name: getattr(one, name) or getattr(campaign, name) for name in ("time", "clocks", "columns")}
        conditions = campaign.conditions | one.conditions
        sheet = Sheet.model_construct(about=campaign.about, file=campaign.file, conditions=conditions, **own)
        said = {"start": one.start, "shift": one.shift}
        key = tuple(sorted((name, *value) for name, value in conditions.items()))
        with errors_at(source, lines, "recordings", k, "file"):
            found = _files(folder, one.file)
        for file in found:
            seen[key] += 1
            files.append(CampaignFile(file, sheet, seen[key], {name: x for name, x in said.items() if x}))
    duplicate = next((p for p, n in Counter(one.path for one in files).items() if n > 1), None)
    if duplicate is not None:
        raise InputError(f"{duplicate.name} is listed twice.", file=source, field="recordings")
    return Campaign(campaign.about, tuple(files))


def _files(folder: Path, pattern: str) -> list[Path]:
    """Files of a name or a pattern. Raises InputError for none, and for one outside of the folder."""
    if Path(pattern).is_absolute() or ".." in Path(pattern).parts:
        raise InputError(f'"{shorten(pattern)}" is outside the folder of the campaign file.')
    found = sorted(folder.glob(pattern)) if any(c in pattern for c in "*?[") else [folder / pattern]
    if not found or not all(file.is_file() for file in found):
        raise InputError(f'there is no file "{shorten(pattern)}" beside the campaign file.')
    return found
