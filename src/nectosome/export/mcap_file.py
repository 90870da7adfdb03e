"""A saved run as an MCAP file, which Foxglove opens: frames of its parts, and all of its numbers over time."""

import json
import math
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from scipy.spatial.transform import Rotation

from nectosome.io.atomic import write_atomic
from nectosome.io.extras import package
from nectosome.measure.formats.mcap import UNITS
from nectosome.units import InputError

from .run_table import column_groups, run_table

_FRAMES, _WORLD = "/tf", "world"
_TOLD = ("title", "robot", "status", "status_reason", "provenance")  # attributes of a run that go along
_NUMBER = {"type": "number"}


def write_mcap(run: xr.Dataset, path: Path) -> None:
    """Write a run as JSON in an MCAP file, whole or not at all: one that `view.saved.saved_run` accepts.

    The topic /tf has the pose of each part's first station in the world [m], as `foxglove.FrameTransforms` (docs.
    foxglove.dev/docs/sdk/schemas). All columns of `run_table` are fields of topics: those whose headings differ in the
    last word only are one, and a heading of one word has the field `value`. Their units are in the schema, and in the
    metadata `units` of the channel. Times are rounded to 1 ns; what is no finite number is null. The same run gives
    the same bytes.

    Raises InputError where the package is missing, for a time before 0 s, and where the file cannot be written.
    """
    times = np.rint(1e9 * run["time"].values).astype(np.int64).tolist()
    if times[0] < 0:
        raise InputError(f"begins at {times[0] / 1e9:g} s, and MCAP has no times before 0 s.")
    out = BytesIO()
    writer = package("mcap.writer", "mcap").Writer(out)
    writer.start(library="nectosome")
    writer.add_metadata("nectosome", {name: str(run.attrs[name]) for name in _TOLD if name in run.attrs})
    messages = _frames(writer, run, times) | _numbers(writer, run)
    for k, time in enumerate(times):
        for channel, each in messages.items():
            data = json.dumps(each[k], separators=(",", ":"), allow_nan=False).encode()
            writer.add_message(channel, log_time=time, publish_time=time, data=data)
    writer.finish()
    write_atomic(path, out.getvalue())


def _channel(writer: Any, topic: str, kind: str, fields: dict[str, Any], units: dict[str, str]) -> int:
    """Number of a new channel with these fields of its schema."""
    schema = json.dumps({"title": kind, "type": "object", "properties": fields})
    number = writer.register_schema(kind, "jsonschema", schema.encode())
    metadata = {UNITS: json.dumps(units)} if units else {}
    return writer.register_channel(topic, "json", number, metadata)


def _numbers(writer: Any, run: xr.Dataset) -> dict[int, list[dict[str, float | None]]]:
    """Messages with the columns of the table, by their channel; the time is that of the messages."""
    table, found = run_table(run), {}
    for words, headings in column_groups(table).items():
        if words == ("time",):
            continue
        names = [heading.partition(" (")[0].removeprefix(" ".join(words)).strip() or "value" for heading in headings]
        said = (heading.partition(" (")[2].removesuffix(")") for heading in headings)
        units = {name: unit for name, unit in zip(names, said, strict=True) if unit}
        fields = {name: _NUMBER | ({"description": units[name]} if name in units else {}) for name in names}
        channel = _channel(writer, f"/{'/'.join(words)}", f"nectosome.{'.'.join(words)}", fields, units)
        values = table[headings].to_numpy(dtype=float).tolist()
        rows = [[x if math.isfinite(x) else None for x in row] for row in values]  # JSON knows no other numbers
        found[channel] = [dict(zip(names, row, strict=True)) for row in rows]
    return found


def _frames(writer: Any, run: xr.Dataset, times: list[int]) -> dict[int, list[dict[str, Any]]]:
    """Messages with the frames of all parts, by their channel."""
    parts = [str(name) for name in run["part"].values]
    first = [int(np.flatnonzero(run["station_part"].values == part)[0]) for part in parts]
    places = run["position"].values[:, first].tolist()
    turns = Rotation.from_matrix(run["rotation"].values[:, first].reshape(-1, 3, 3)).as_quat()
    turns = turns.reshape(len(times), len(parts), 4).tolist()
    vector, turn = ({"type": "object", "properties": dict.fromkeys(axes, _NUMBER)} for axes in ("xyz", "xyzw"))
    stamp = {"type": "object", "properties": {key: {"type": "integer"} for key in ("sec", "nsec")}}
    text = {"type": "string"}
    frame = {"timestamp": stamp, "parent_frame_id": text, "child_frame_id": text, "translation": vector}
    frames = {"type": "array", "items": {"type": "object", "properties": frame | {"rotation": turn}}}
    channel = _channel(writer, _FRAMES, "foxglove.FrameTransforms", {"transforms": frames}, {})

    def message(k: int) -> dict[str, Any]:
        stamp = dict(zip(("sec", "nsec"), divmod(times[k], 10**9), strict=True))
        each = zip(parts, places[k], turns[k], strict=True)
        return {
            "transforms": [
                {
                    "timestamp": stamp,
                    "parent_frame_id": _WORLD,
                    "child_frame_id": part,
                    "translation": dict(zip("xyz", place, strict=True)),
                    "rotation": dict(zip("xyzw", turn, strict=True)),
                }
                for part, place, turn in each
            ]
        }

    return {channel: [message(k) for k in range(len(times))]}
