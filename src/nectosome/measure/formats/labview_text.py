"""Heads of LabVIEW's text files (.lvm): the names, units and clock of each segment, as its own head says them.

One head for the file, then one for each segment: units of the channels in `Y_Unit_Label`, the time of sample k as X0 +
k Delta_X where its column is empty, the instant of time 0 in `Date` and `Time`. A file that LabVIEW went on writing has
several segments; where each begins with the time 0 again, what lies between their dates is added. Absolute times are
seconds since 1904, in UTC: they count from the first one.
"""

from collections.abc import Sequence
from typing import NamedTuple

import pandas as pd

from nectosome.measure.formats.clock_text import date_time
from nectosome.measure.formats.motion_capture import CaptureHead, Lines
from nectosome.units import InputError

_FIRST, _END = "LabVIEW Measurement", "***End_of_Header***"
_ZERO = pd.Timestamp("1904-01-01", tz="UTC")  # of absolute times


def is_labview(lines: Sequence[str]) -> bool:
    """Whether these are the first lines of LabVIEW's."""
    return bool(lines) and lines[0].startswith(_FIRST)


def is_segment(line: str) -> bool:
    """Whether a line is the first of a segment's head."""
    word, _, rest = line.partition("Channels")
    return not word and rest[:1] in ("\t", ",") and rest.strip("\t, ").isdigit()


def labview_head(lines: Lines, file: str) -> CaptureHead | None:
    """Return the head of a file that begins with these lines, the heads of all segments included; None for others.

    Raises InputError for a head that breaks off, and for segments with other channels than the first.
    """
    if not is_labview([line for _, line in lines[:1]]):
        return None
    starts = [k for k, (_, line) in enumerate(lines) if is_segment(line)]
    if not starts:
        raise InputError("LabVIEW's head has no segment.", file=file, line=lines[0][0])
    about = _entries(lines[1 : starts[0]])
    delimiter = "," if about.get("Separator", [""])[0].lower() == "comma" else "\t"
    decimal = about.get("Decimal_Separator", ["."])[0]
    columns = about.get("X_Columns", ["One"])[0]
    segments = [_segment(lines[k:], delimiter, decimal, columns, file) for k in starts]
    first, start = segments[0], segments[0].start
    skipped, later = [], []
    is_absolute = about.get("Time_Pref", [""])[0] == "Absolute"
    if is_absolute and first.begins is not None:
        start = str((_ZERO + pd.Timedelta(seconds=first.begins)).round("us"))
        later.append((first.line, -first.begins))
    for number, (k, other) in enumerate(zip(starts[1:], segments[1:], strict=True), 2):
        if (other.names, other.units, other.rate) != (first.names, first.units, first.rate):
            why = f"segment {number} has other channels, units or intervals than the first one"
            raise InputError(f"{why}. Save it as a file of its own.", file=file, line=lines[k][0])
        skipped.append((lines[k][0], other.line))
        begins_again = first.begins is not None and other.begins is not None and other.begins <= first.begins
        if first.start and other.start and begins_again and not is_absolute:
            later.append((other.line, (date_time(other.start) - date_time(first.start)).total_seconds()))
    ramps = tuple(one.ramp for one in segments if one.ramp is not None)
    notes = [f"{len(segments)} segments"] if skipped else []
    every = [interval for *_, interval in ramps] + ([1 / first.rate] if first.rate else [])
    if every:
        notes += [f"time from Delta_X, {', '.join(dict.fromkeys(f'{interval:g} s' for interval in every))}"]
    elif "Time" in first.names:
        notes += ["X_Value is the time"]
    return CaptureHead(
        "LabVIEW",
        first.names,
        first.units,
        first.line,
        delimiter,
        first.rate,
        start,
        notes=tuple(notes),
        decimal=decimal,
        skipped=tuple(skipped),
        later=tuple(later),
        ramps=ramps,
    )


def _entries(lines: Lines) -> dict[str, list[str]]:
    """Words of a head and their cells."""
    cells = [line.replace(",", "\t").split("\t") if "\t" not in line else line.split("\t") for _, line in lines]
    return {row[0].strip(): [cell.strip() for cell in row[1:]] for row in cells}


class _Segment(NamedTuple):
    """What the head of a segment says; times are those of its first channel."""

    line: int  # of the names
    names: tuple[str, ...]
    units: tuple[str, ...]
    rate: float | None  # [Hz], where no column can have the time
    start: str  # instant of time 0
    begins: float | None  # time of the first row [s]
    ramp: tuple[int, float, float] | None  # line of the first row, its time and the interval [s], if the head has them


def _segment(lines: Lines, delimiter: str, decimal: str, columns: str, file: str) -> _Segment:
    """Return what the head with these first lines says. Raises InputError for a broken one, and for two times."""
    end = next((k for k, (_, line) in enumerate(lines) if line.startswith(_END)), None)
    if end is None or end + 2 > len(lines) - 1:
        raise InputError("the head of this segment breaks off.", file=file, line=lines[0][0])
    about = _entries(lines[:end])
    line, heading = lines[end + 1]
    row = lines[end + 2][1].split(delimiter)
    names = [cell.strip() for cell in heading.split(delimiter)][: len(row)]
    is_time = about.get("X_Dimension", ["Time"])[0] == "Time"
    x = [name == "X_Value" and is_time for name in names]
    step = 2 if columns == "Multi" else 1
    channels = [k for k, name in enumerate(names) if name != "X_Value"]

    def cells(word: str) -> list[str]:
        """One for each channel; some programs leave no room for the times beside them."""
        row = about.get(word, [])
        return (row[::step] if step == 1 or not any(row[1::step]) else row)[: len(channels)]

    units = dict(zip(channels, cells("Y_Unit_Label"), strict=False))

    def numbers(word: str) -> list[float]:
        return [float(cell) for x in cells(word) if _is_number(cell := x.replace(decimal, "."))]

    zeros, intervals = numbers("X0"), numbers("Delta_X")
    if is_time and columns != "Multi" and intervals:
        if len(set(intervals)) > 1:
            raise InputError("its channels have different Delta_X and one time.", file=file, line=lines[0][0])
        if zeros and max(zeros) - min(zeros) > 0.5 * intervals[0]:
            raise InputError("its channels have different X0 and one time.", file=file, line=lines[0][0])
    start = " ".join(about[word][0] for word in ("Date", "Time") if about.get(word, [""])[0])
    try:
        start = str(date_time(start.replace(decimal, "."))) if is_time else ""
    except ValueError:
        start = ""
    first = row[x.index(True)].replace(decimal, ".") if any(x) else ""
    rate = ramp = None
    begins = float(first) if _is_number(first) else None
    if columns == "No" and is_time and intervals and intervals[0]:
        begins = next(iter(zeros), 0.0)
        if any(x):
            ramp = lines[end + 2][0], begins, intervals[0]
        else:
            rate = 1 / intervals[0]
    return _Segment(
        line,
        tuple("Time" if is_x else name for is_x, name in zip(x, names, strict=True)),
        tuple("s" if is_x else units.get(k, "") for k, is_x in enumerate(x)),
        rate,
        start,
        begins,
        ramp,
    )


def _is_number(cell: str) -> bool:
    return cell.replace(".", "", 1).upper().replace("E", "", 1).replace("-", "").replace("+", "").isdigit()
