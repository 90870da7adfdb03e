"""Heads of motion capture's and pose estimation's text files: Motive, Vicon Nexus, Qualisys (.tsv), DeepLabCut.

Their names stand over several lines (a body or marker, a kind of quantity, an axis), and their rate and units beside
them.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass

from nectosome.measure.formats.headings import fill_right, stack
from nectosome.units import InputError, did_you_mean

Lines = list[tuple[int, str]]
_LENGTHS = {"meters": "m", "centimeters": "cm", "millimeters": "mm"}
_ID = re.compile(r"[0-9A-Fa-f-]{8,}|-?\d{4,}")  # of a computer, not of a person
_VICON = ("Trajectories", "Devices", "Model Outputs", "Segments", "Joints")
_QUALISYS = re.compile(r"(?:[A-Z0-9]+_)*[A-Z0-9]+")
_AXES_6D = ("X", "Y", "Z", "Roll", "Pitch", "Yaw", "Residual", *(f"Rot[{k}]" for k in range(9)))
_UNITS_6D = ("mm", "mm", "mm", "deg", "deg", "deg", "mm", *[""] * 9)


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
    elif first.startswith("NO_OF_FRAMES"):
        head = _qualisys(lines)
    elif first.split(delimiter)[0] == "scorer" and len(lines) > 2:
        head = _deeplabcut(lines, delimiter)
    if head is not None and table is not None:
        raise InputError("a text file has one table; leave table out.", file=file)
    return head


def has_sections(lines: Sequence[str]) -> bool:
    """Whether these are the first lines of a file of several sections."""
    return is_section(next((line for line in lines if line.strip()), ""))


def is_section(line: str) -> bool:
    """Whether a line is the title of a section of Vicon's."""
    return _bare(line) in _VICON


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
    parts = [[_named(cell) for cell in row] for row in bodies]
    names = stack([*parts, [kind.lower() for kind in kinds], _lower(axes)])
    length = _LENGTHS.get(about.get("Length Units", "").lower(), "")
    turns = "" if about.get("Rotation Type", "") == "Quaternion" else "deg"
    units = [{"Position": length, "Mean Marker Error": length, "Rotation": turns}.get(kind, "") for kind in kinds]
    names[:2], units[:2] = axes[:2], ["", ""]
    return CaptureHead("Motive", tuple(names), tuple(units), lines[at][0], ",")


def _named(cell: str) -> str:
    """Return a name of a person, not one that a program counted."""
    return "" if _ID.fullmatch(cell) else cell


def _vicon(lines: Lines, table: str | None, file: str) -> CaptureHead:
    """Vicon Nexus: sections of a title, a rate, the markers, the axes and the units."""
    starts = [k for k, (_, line) in enumerate(lines) if is_section(line)]
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
