"""Heads of text files that programs write: Motive, Vicon Nexus, Qualisys (.tsv), DeepLabCut, LabVIEW (.lvm).

Names of motion capture stand over several lines (a body or marker, a kind of quantity, an axis), and their rate and
units beside them.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import pandas as pd

from nectosome.measure.formats.clock_text import date_time
from nectosome.measure.formats.headings import fill_right, stack
from nectosome.units import InputError, did_you_mean

Lines = list[tuple[int, str]]
_LENGTHS = {"meters": "m", "centimeters": "cm", "millimeters": "mm"}
_ID = re.compile(r"[0-9A-Fa-f-]{8,}|-?\d{4,}")  # that a program counted, no name of a person's
_VICON = ("Trajectories", "Devices", "Model Outputs", "Segments", "Joints")
_QUALISYS = re.compile(r"(?:[A-Z0-9]+_)*[A-Z0-9]+")
_AXES_6D = ("X", "Y", "Z", "Roll", "Pitch", "Yaw", "Residual", *(f"Rot[{k}]" for k in range(9)))
_UNITS_6D = ("mm", "mm", "mm", "deg", "deg", "deg", "mm", *[""] * 9)
_LABVIEW, _END = "LabVIEW Measurement", "***End_of_Header***"
_ZERO = pd.Timestamp("1904-01-01", tz="UTC")  # of LabVIEW's absolute times


@dataclass(frozen=True)
class CaptureHead:
    """Names and units of all columns, the line of the names, where the rows are, and what else the head says."""

    program: str
    names: tuple[str, ...]
    units: tuple[str, ...]
    line: int  # of the last of the names
    delimiter: str
    rate: float | None = None  # [Hz], where no column has the time
    start: str = ""  # date and time of time 0
    end: int | None = None  # last line of the section
    notes: tuple[str, ...] = ()
    decimal: str = "."
    skipped: tuple[tuple[int, int], ...] = ()  # first and last line of heads between the rows
    later: tuple[tuple[int, float], ...] = ()  # line from which on the times count from a later instant, how much [s]
    ramps: tuple[tuple[int, float, float], ...] = ()  # lines from which on the time is ramped, it there, interval [s]


def capture_head(lines: Lines, table: str | None, file: str) -> CaptureHead | None:
    """Return the head of a file that begins with these lines; None for files of other programs.

    Vicon's files have several sections: `table` names one, else it is the trajectories, or the first one. Raises
    InputError for a damaged head.
    """
    if not lines:
        return None
    first = _bare(lines[0][1])
    delimiter = "\t" if "\t" in lines[0][1] else ","
    head = None
    if first.startswith("Format Version,") and "Take Name" in first:
        head = _motive(lines)
    elif first in _VICON:
        return _vicon(lines, table, file)
    elif lines[0][1].startswith(_LABVIEW):
        return _labview(lines, file)
    elif first.startswith("NO_OF_FRAMES"):
        head = _qualisys(lines)
    elif first.split(delimiter)[0] == "scorer" and len(lines) > 2:
        head = _deeplabcut(lines, delimiter)
    if head is not None and table is not None:
        raise InputError("a text file has one table; leave table out.", file=file)
    return head


def has_sections(lines: Sequence[str]) -> bool:
    """Whether these are the first lines of a file of several sections: of Vicon's, or of LabVIEW's."""
    return (bool(lines) and lines[0].startswith(_LABVIEW)) or _is_title(next(filter(str.strip, lines), ""))


def begins_section(line: str) -> bool:
    """Whether a line is the title of a section of Vicon's, or the first of a segment's head of LabVIEW's."""
    return _is_title(line) or _begins_segment(line)


def _is_title(line: str) -> bool:
    return _bare(line) in _VICON


def _begins_segment(line: str) -> bool:
    word, _, rest = line.partition("Channels")
    return not word and rest[:1] in ("\t", ",") and rest.strip("\t, ").isdigit()


def _bare(line: str) -> str:
    return line.strip().strip(",\t")


def _cells(line: str, delimiter: str) -> list[str]:
    return [cell.strip().strip('"') for cell in line.split(delimiter)]


def _motive(lines: Lines) -> CaptureHead | None:
    """OptiTrack Motive: type, name, ID (and parent) of each body, kind of quantity, then frame, time and axes."""
    keys = _cells(lines[0][1], ",")
    about = dict(zip(keys[::2], keys[1::2], strict=False))
    at = next((k for k, (_, line) in enumerate(lines[:12]) if line.startswith(("Frame,Time", '"Frame","Time'))), None)
    if at is None or at < 3:
        return None
    axes = _cells(lines[at][1], ",")
    above = [_padded(_cells(line, ","), len(axes)) for _, line in lines[1:at]]
    kinds, bodies = above[-1], [row for row in above[1:-1] if row[1] != "Parent"]
    parts = [["" if _ID.fullmatch(cell) else cell for cell in row] for row in bodies]
    names = stack([*parts, [kind.lower() for kind in kinds], _lower(axes)])
    length = _LENGTHS.get(about.get("Length Units", "").lower(), "")
    turns = "" if about.get("Rotation Type", "") == "Quaternion" else "deg"
    units = [{"Position": length, "Mean Marker Error": length, "Rotation": turns}.get(kind, "") for kind in kinds]
    names[:2], units[:2] = axes[:2], ["", ""]
    return CaptureHead("Motive", tuple(names), tuple(units), lines[at][0], ",")


def _vicon(lines: Lines, table: str | None, file: str) -> CaptureHead:
    """Vicon Nexus: sections of a title, a rate, the markers, the axes and the units."""
    starts = [k for k, (_, line) in enumerate(lines) if _is_title(line)]
    titles = [_bare(lines[k][1]) for k in starts]
    if table is not None and table not in titles:
        raise InputError(f'there is no section "{table}".{did_you_mean(table, titles)}', file=file)
    chosen = titles.index(table) if table else titles.index("Trajectories") if "Trajectories" in titles else 0
    at = starts[chosen]
    stop = starts[chosen + 1] if chosen + 1 < len(starts) else len(lines)
    if stop - at < 6:
        raise InputError("this section of Vicon's has no rows.", file=file, line=lines[at][0])
    delimiter = "\t" if "\t" in lines[at + 3][1] else ","
    title, (line, rate), markers, axes, units = (lines[at + k] for k in range(5))
    try:
        samples = float(_bare(rate))
    except ValueError:
        raise InputError(f"a rate in Hz is expected below {title[1].strip()}.", file=file, line=line) from None
    names, width = _cells(axes[1], delimiter), len(_cells(axes[1], delimiter))
    upper = fill_right(_padded(_cells(markers[1], delimiter), width), names)
    head = stack([upper, _lower(names)])
    head[:2] = names[:2]
    notes = [f"section: {titles[chosen]}"]
    if len(titles) > 1:
        others = [name for k, name in enumerate(titles) if k != chosen]
        notes.append(f"left out: the section {', '.join(others)}; choose one by file: {{table: {others[0]}}}")
    if titles[chosen] == "Devices":  # several samples a frame: the rows count
        head[0] = "camera frame"
    return CaptureHead(
        "Vicon",
        tuple(head),
        tuple(_padded(_cells(units[1], delimiter), width)),
        units[0],
        delimiter,
        samples,
        end=lines[stop][0] - 1 if stop < len(lines) else None,
        notes=tuple(notes),
    )


def _qualisys(lines: Lines) -> CaptureHead | None:
    """Qualisys Track Manager: words with values, one a line, then names of columns or none, then the rows."""
    about: dict[str, list[str]] = {}
    at = 0
    for at, (_, line) in enumerate(lines):  # noqa: B007
        word, *values = _cells(line, "\t")
        if not _QUALISYS.fullmatch(word) or word.replace(".", "").isdigit():
            break
        about[word] = values
    else:
        return None
    number, line = lines[at]
    heading = _cells(line, "\t")
    named = any(cell[:1].isalpha() for cell in heading)
    rows = lines[at + named][1] if at + named < len(lines) else ""
    width = len(_cells(rows.rstrip("\t"), "\t"))
    if about.get("BODY_NAMES"):
        bodies = [name for name in about["BODY_NAMES"] if name]
        columns = [f"{body} {axis.lower()}" for body in bodies for axis in _AXES_6D]
        units = [unit for _ in bodies for unit in _UNITS_6D]
    else:
        markers = [name for name in about.get("MARKER_NAMES", []) if name]
        columns = [f"{marker} {axis}" for marker in markers for axis in "xyz"]
        units = ["mm"] * len(columns)
    before = width - len(columns)
    if not columns or before not in (0, 1, 2):
        return None
    first = [cell for cell in heading if cell in ("Frame", "Time")] if named else []
    first = first if len(first) == before else ["Frame", "Time"][:before]
    rate = about.get("FREQUENCY", [""])[0]
    stamp = about.get("TIME_STAMP", [""])[0].replace(", ", " ")
    return CaptureHead(
        "Qualisys",
        (*first, *columns),
        (*["s" if name == "Time" else "" for name in first], *units),
        number if named else number - 1,
        "\t",
        float(rate) if rate.replace(".", "", 1).isdigit() and float(rate) > 0 else None,
        start=stamp,
    )


def _deeplabcut(lines: Lines, delimiter: str) -> CaptureHead | None:
    """DeepLabCut (and what writes as it does): scorer, individuals, body parts, coordinates."""
    rows = {}
    for number, line in lines[:4]:
        label, *cells = _cells(line, delimiter)
        if label in ("scorer", "individuals", "bodyparts", "coords"):
            rows[label] = number, cells
    if not {"bodyparts", "coords"} <= rows.keys():
        return None
    parts = [rows[label][1] for label in ("individuals", "bodyparts", "coords") if label in rows]
    if len({len(part) for part in parts}) > 1:
        return None
    names = ["frame", *stack(parts)]
    return CaptureHead("DeepLabCut", tuple(names), ("",) * len(names), rows["coords"][0], delimiter)


def _padded(cells: Sequence[str], count: int) -> list[str]:
    return [*cells, *[""] * count][:count]


def _lower(axes: Sequence[str]) -> list[str]:
    return [axis.lower() if axis in ("X", "Y", "Z", "W") else axis for axis in axes]


def _labview(lines: Lines, file: str) -> CaptureHead:
    """LabVIEW's text files (.lvm): one head for the file, then one for each segment.

    Units of the channels are in `Y_Unit_Label`, the time of sample k is X0 + k Delta_X where its column is empty, the
    instant of time 0 is in `Date` and `Time`. A file that LabVIEW went on writing has several segments; where each
    begins with the time 0 again, what lies between their dates is added. Absolute times are seconds since 1904, in UTC:
    they count from the first one. Raises InputError for a head that breaks off, and for segments with other channels
    than the first.
    """
    starts = [k for k, (_, line) in enumerate(lines) if _begins_segment(line)]
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
