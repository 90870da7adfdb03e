"""Heads of LabVIEW's text files (.lvm): the names, units and clock of each segment, as its own head says them.

One head for the file, then one for each segment: units of the channels in `Y_Unit_Label`, the time of sample k as X0 +
k Delta_X where no column has it, the instant of time 0 in `Date` and `Time`. A file that LabVIEW went on writing has
several segments; where each begins with the time 0 again, what lies between their dates is added.
"""

from collections.abc import Sequence

from nectosome.measure.formats.clock_text import date_time
from nectosome.measure.formats.motion_capture import CaptureHead, Lines
from nectosome.units import InputError

_FIRST, _END = "LabVIEW Measurement", "***End_of_Header***"


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
    line, names, units, rate, start, first = segments[0]
    skipped, later = [], []
    for number, (k, other) in enumerate(zip(starts[1:], segments[1:], strict=True), 2):
        if other[1:4] != (names, units, rate):
            why = f"segment {number} has other channels, units or intervals than the first one"
            raise InputError(f"{why}. Save it as a file of its own.", file=file, line=lines[k][0])
        skipped.append((lines[k][0], other[0]))
        if start and other[4] and first is not None and other[5] is not None and other[5] <= first:
            later.append((other[0], (date_time(other[4]) - date_time(start)).total_seconds()))
    notes = [f"{len(segments)} segments"] if skipped else []
    notes += ["X_Value is the time"] if "Time" in names else [f"time from Delta_X, {1 / rate:g} s"] if rate else []
    return CaptureHead(
        "LabVIEW",
        names,
        units,
        line,
        delimiter,
        rate,
        start,
        notes=tuple(notes),
        decimal=decimal,
        skipped=tuple(skipped),
        later=tuple(later),
    )


def _entries(lines: Lines) -> dict[str, list[str]]:
    """Words of a head and their cells."""
    cells = [line.replace(",", "\t").split("\t") if "\t" not in line else line.split("\t") for _, line in lines]
    return {row[0].strip(): [cell.strip() for cell in row[1:]] for row in cells}


def _segment(
    lines: Lines, delimiter: str, decimal: str, columns: str, file: str
) -> tuple[int, tuple[str, ...], tuple[str, ...], float | None, str, float | None]:
    """Line of the names, names, units, rate [Hz] where no column is the time, instant of time 0, time of the first row.

    Times are those of the first channel.
    """
    end = next((k for k, (_, line) in enumerate(lines) if line.startswith(_END)), None)
    if end is None or end + 2 > len(lines) - 1:
        raise InputError("the head of this segment breaks off.", file=file, line=lines[0][0])
    about = _entries(lines[:end])
    line, heading = lines[end + 1]
    row = lines[end + 2][1].split(delimiter)
    names = [cell.strip() for cell in heading.split(delimiter)][: len(row)]
    is_time = about.get("X_Dimension", ["Time"])[0] == "Time"
    x = [name == "X_Value" and columns != "No" and is_time for name in names]
    step = 2 if columns == "Multi" else 1
    channels = [k for k, name in enumerate(names) if name != "X_Value"]
    labels = about.get("Y_Unit_Label", [])[::step]
    units = dict(zip(channels, labels, strict=False))

    def number(word: str, channel: int = 0) -> float | None:
        try:
            return float(about[word][::step][channel].replace(decimal, "."))
        except (KeyError, IndexError, ValueError):
            return None

    rate = None
    if columns == "No" and is_time:
        every = {number("Delta_X", k) for k in range(len(channels))} - {None}
        if len(every) > 1:
            raise InputError("its channels have different Delta_X and no column of times.", file=file, line=lines[0][0])
        interval = next(iter(every), None)
        rate = 1 / interval if interval else None
    start = " ".join(about[word][0] for word in ("Date", "Time") if about.get(word, [""])[0])
    try:
        start = str(date_time(start.replace(decimal, "."))) if is_time else ""
    except ValueError:
        start = ""
    first = row[x.index(True)].replace(decimal, ".") if any(x) else ""
    return (
        line,
        tuple("Time" if is_x else name for is_x, name in zip(x, names, strict=True)),
        tuple("s" if is_x else units.get(k, "") for k, is_x in enumerate(x)),
        rate,
        start,
        float(first) if first.replace(".", "", 1).replace("E", "", 1).strip("+-").isdigit() else None,
    )
