"""C3D files of motion capture: the markers' positions, or the analog channels, over time (through ezc3d)."""

import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np

from nectosome.io.extras import package
from nectosome.io.file_system import is_file
from nectosome.measure.formats.arrays import ArraySource, LazyArray
from nectosome.measure.formats.file_errors import damage_as_input_error, first_bytes, wrong_format
from nectosome.measure.formats.source import Options, TableSource
from nectosome.measure.formats.tables import NamedArray, SkippedEntry, choose
from nectosome.units import InputError

ENDINGS = (".c3d",)

_MARK = 0x50  # second byte of every C3D file
_BLOCK = 512  # bytes
_POINTS, _ANALOGS = "points", "analogs"
_LONGEST = 300.0  # reading one file [s]
# ezc3d can crash the interpreter on damaged files, so it runs in one of its own, with limited memory
_PROGRAM = """
import json, sys
try:
    import resource
    resource.setrlimit(resource.RLIMIT_AS, (int(sys.argv[3]), int(sys.argv[3])))
except (ImportError, ValueError):
    pass
import ezc3d
import numpy as np
file = ezc3d.c3d(sys.argv[1])
groups = file["parameters"]
def texts(group, name):
    return [str(value).strip() for value in groups.get(group, {}).get(name, {}).get("value", [])]
def described(group):
    names = [name for k in ("", *range(2, 50)) for name in texts(group, f"LABELS{k}")]
    return {"names": names, "units": texts(group, "UNITS")}
words = {group: described(group) for group in ("POINT", "ANALOG")}
rate = float(file["header"]["points"]["frame_rate"])
np.savez(sys.argv[2], points=file["data"]["points"][:3], analogs=file["data"]["analogs"][0],
         words=json.dumps({"rate": rate, **words}))
"""


class _Contents(NamedTuple):
    points: np.ndarray  # coordinate, marker, frame
    analogs: np.ndarray  # channel, sample
    words: dict[str, dict[str, list[str]]]  # names and units of points and analog channels
    rate: float  # [Hz]


def open_c3d(path: Path, options: Options) -> TableSource:
    """Open a .c3d file: its points, or what `options.table` names (points, analogs).

    Raises InputError for another format, a damaged or broken-off file, and where ezc3d is not installed.
    """
    start = first_bytes(path)
    if len(start) < _BLOCK or start[1] != _MARK:
        raise wrong_format(path, "a C3D file", start)
    with damage_as_input_error(path):
        package("ezc3d", "c3d")
        there, said = _frames(path, start)
        if there < said:  # ezc3d would fill what is missing with zeros
            raise InputError(f"is cut off or damaged: {there} of {said} frames are there.")
        points, analogs, words, rate = _read(path)
        if points.shape[2] > there:
            raise InputError(f"is damaged: {points.shape[2]} frames by its parameters, and room for {there}.")
        entries: list[NamedArray | SkippedEntry] = []
        if points.size:
            unit = (words["POINT"]["units"] or [""])[0]
            names = _distinct(words["POINT"]["names"], points.shape[1], "point")
            columns = {f"{name} {axis}": points[k, i] for i, name in enumerate(names) for k, axis in enumerate("xyz")}
            entries += _group(_POINTS, columns, rate, [unit] * len(columns))
        if analogs.size:
            names = _distinct(words["ANALOG"]["names"], len(analogs), "analog")
            units = [*words["ANALOG"]["units"], *[""] * len(names)][: len(names)]
            ratio = analogs.shape[1] / max(points.shape[2], 1)
            entries += _group(_ANALOGS, dict(zip(names, analogs, strict=True)), rate * ratio, units)
        table = choose(entries, options.table or (_POINTS if points.size else None))
        return ArraySource("c3d", path, table.blocks(), table.found, left_out=table.left_out)


def _frames(path: Path, start: bytes) -> tuple[int, int]:
    """How many frames the file has room for, and how many its header says; a header counts up to 65 535."""
    with path.open("rb") as file:
        file.seek((start[0] - 1) * _BLOCK + 3 if start[0] else 0)
        processor = (file.read(1) or b"\0")[0]  # 84: Intel, 85: DEC, 86: MIPS
    order, sign = {85: ("<", 13), 86: (">", 12)}.get(processor, ("<", 15))  # of bytes, and byte with the scale's sign
    words = np.frombuffer(start[:24], f"{order}u2")
    points, analog, first, last, data = (int(words[k]) for k in (1, 2, 3, 4, 8))
    frame = (4 * points + analog) * (4 if start[sign] & 0x80 else 2)  # a scale below 0 means floats
    room = path.stat().st_size - (data - 1) * _BLOCK
    return max(room // max(frame, 1), 0), last - first + 1


def _read(path: Path) -> _Contents:
    """Read the whole file. Raises InputError if ezc3d cannot."""
    limit = 2 * 2**30 + 50 * path.stat().st_size
    with tempfile.TemporaryDirectory(prefix="nectosome-") as folder:
        out = Path(folder) / "contents.npz"
        command = [sys.executable, "-c", _PROGRAM, str(path), str(out), str(limit)]
        try:
            done = subprocess.run(command, capture_output=True, timeout=_LONGEST, check=False)
        except subprocess.TimeoutExpired:
            raise InputError(f"is not read within {_LONGEST:g} s: it is damaged.") from None
        if done.returncode or not is_file(out):
            raise InputError("cannot be read: the file is damaged or cut off.")
        with np.load(out) as kept:
            words = json.loads(kept["words"].item())
            return _Contents(kept["points"], kept["analogs"], words, float(words["rate"]))


def _distinct(names: list[str], count: int, kind: str) -> list[str]:
    """Return distinct names of points or channels, with numbers for those without."""
    names = [*names, *[""] * count][:count]
    names = [name or f"{kind} {k}" for k, name in enumerate(names, 1)]
    return [name if names.index(name) == k else f"{name} ({k + 1})" for k, name in enumerate(names)]


def _group(group: str, columns: dict[str, np.ndarray], rate: float, units: list[str]) -> list[NamedArray]:
    """The columns of a group after their time."""
    if not (np.isfinite(rate) and rate > 0):
        raise InputError(f"says no rate of its {group}.")
    rows = len(next(iter(columns.values())))
    ramp = LazyArray((rows,), float, lambda part: np.arange(*part.indices(rows)) / rate)
    note = f"time: from the rate of {rate:g} Hz"
    time = NamedArray("time", ramp, "s", group=group, first=True, notes=[note], computed=True)
    named = zip(columns.items(), units, strict=True)
    return [time, *(NamedArray(name, x, unit, group=group) for (name, x), unit in named)]
