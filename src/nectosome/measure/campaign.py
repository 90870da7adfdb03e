"""Campaigns: recordings of one kind, with conditions and repeat numbers."""

from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from nectosome.io.yaml_text import Key, read_text, read_yaml
from nectosome.units import InputError, shorten

from .recordings import read
from .sheet import Sheet, parse_sheet

if TYPE_CHECKING:
    import xarray as xr

_OWN = ("conditions", "time", "columns")  # fields that a recording may override


@dataclass(frozen=True)
class CampaignFile:
    """One file of a campaign, its sheet with its conditions, and the number of its repeat."""

    path: Path
    sheet: Sheet
    repeat: int  # from 1

    def read(self) -> "xr.Dataset":
        """Read the recording; its conditions and its `repeat` are coordinates."""
        return read(self.path, self.sheet).assign_coords(repeat=((), self.repeat, {"units": "1"}))


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
    the sheet apply to all recordings; its `time` and `columns` to those without their own. Raises InputError that names
    file, line and field.
    """
    path = Path(path)
    source = str(path)
    data, lines = read_yaml(read_text(path), source)
    sheet = parse_sheet(data, lines, source, also=("recordings",))
    listed = data.get("recordings")

    def wrong(at: Key, message: str) -> InputError:
        return InputError(message, file=source, line=lines.get(at), field=".".join(map(str, at)))

    if not isinstance(listed, list) or not listed:
        raise wrong(("recordings",), "needs a list of files, each with its conditions.")
    files: list[CampaignFile] = []
    seen: Counter[tuple[tuple[str, float, str], ...]] = Counter()
    for k, item in enumerate(listed):
        at: Key = ("recordings", k)
        if not isinstance(item, dict) or not set(item) <= {"file", *_OWN} or "file" not in item:
            raise wrong(at, "needs a file and its conditions, as in {file: run_1.csv, conditions: {f: 1.1 Hz}}.")
        below = {key[len(at) :]: line for key, line in lines.items() if key[: len(at)] == at}
        own = parse_sheet({k: item[k] for k in _OWN if item.get(k)}, below, source)
        with_own = replace(
            sheet,
            conditions={**sheet.conditions, **own.conditions},
            time=own.time or sheet.time,
            columns=own.columns or sheet.columns,
        )
        for file in _files(path.parent, str(item["file"]), wrong, (*at, "file")):
            key = tuple(sorted((name, *value) for name, value in with_own.conditions.items()))
            seen[key] += 1
            files.append(CampaignFile(file, with_own, seen[key]))
    duplicate = next((p for p, n in Counter(one.path for one in files).items() if n > 1), None)
    if duplicate is not None:
        raise InputError(f"{duplicate.name} is listed twice.", file=source, field="recordings")
    return Campaign(sheet.about, tuple(files))


def _files(folder: Path, pattern: str, wrong, at: Key) -> list[Path]:
    if Path(pattern).is_absolute() or ".." in Path(pattern).parts:
        raise wrong(at, f'"{shorten(pattern)}" is outside the folder of the campaign file.')
    found = sorted(folder.glob(pattern)) if any(c in pattern for c in "*?[") else [folder / pattern]
    if not found or not all(file.is_file() for file in found):
        raise wrong(at, f'there is no file "{shorten(pattern)}" beside the campaign file.')
    return found
