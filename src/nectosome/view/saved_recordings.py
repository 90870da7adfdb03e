"""What `nectosome measure` and `nectosome track` save: which of these a file is, with its plots and its words."""

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import xarray as xr

from nectosome.io.results import Contents, check_contents
from nectosome.io.summary import Summary
from nectosome.measure.condition_means import NUMBERS
from nectosome.units import InputError

from .means_page import means_panels, show_means
from .means_words import means_table
from .recording_pages import marker_panel, recording_panel, segment_panel, show_recordings, show_track
from .recording_words import recording_summary, track_summary
from .style import Panel

_ERRORS = ("by_cycles", "by_repeats", "low", "high")  # of a mean
_SEGMENTS = {
    "direction": ("time", "segment"),
    "length": ("time", "segment"),
    "quality": ("time", "segment"),
    "joint_angle": ("time", "joint"),
}
_MARKERS = {
    "marker_se": ("time", "name", "axis"),
    "residual": ("time", "name"),
    "position": ("time", "axis"),
    "position_se": ("time", "axis"),
    "angle": ("time", "turn"),
    "angle_se": ("time", "turn"),
    "misfit": ("time",),
}


class SavedRecording(NamedTuple):
    """Plots by what they show, the words of the command that made the file, and what writes its page again."""

    panels: dict[str, Panel]
    summary: Summary
    page: Callable[[xr.Dataset, str | Path], None]


def is_recording(data: xr.Dataset) -> bool:
    """Whether a results file is meant to be of `measure` or `track`: by what only theirs have."""
    tracks = "segment" in data.dims or "marker" in data
    return tracks or "condition" in data.dims or '"reader"' in str(data.attrs.get("provenance"))


def saved_recording(data: xr.Dataset, source: str) -> SavedRecording:
    """What a results file shows that `measure`, with means or without, or `track` saved; `source` is its name.

    Raises InputError where it is none of them, with what it lacks.
    """
    if "condition" in data.dims:
        _check_means(data, source)
        return SavedRecording(means_panels(data), means_table(data), show_means)
    if "segment" in data.dims or "marker" in data:
        markers = "marker" in data
        names = ("name", "axis", "turn") if markers else ("segment", "joint")
        needed = {"time": ("time",)} | (_MARKERS if markers else _SEGMENTS)
        kind = "a track of markers" if markers else "a track of segments"
        contents = Contents(kind, needed, finite=("time",), names=names, texts=("title",), encoded={"provenance": dict})
        check_contents(data, contents._replace(units=[*needed]), source)
        _need(data.sizes["time"], kind, "it has no frames", source)
        seen = data.get("reason")
        where = ("time", "name" if markers else "segment")
        _need(seen is not None and seen.dims == where and seen.dtype.kind == "i", kind, "it has no reason", source)
        _check_provenance(data, kind, ("found", "warnings"), source)
        panel = marker_panel(data) if markers else segment_panel(data)
        return SavedRecording({"markers" if markers else "segments": panel}, track_summary(data), show_track)
    _check_recording(data, source)
    page = lambda data, path: show_recordings([data], path)  # noqa: E731
    return SavedRecording({"recording": recording_panel(data)}, recording_summary(data), page)


def _check_means(data: xr.Dataset, source: str) -> None:
    kind, there = "a table of means", [name for name in NUMBERS if name in data]
    texts = ("title", "column", "against", "conditions", "notes")
    names = [name for name in str(data.attrs.get("conditions", "")).splitlines() if name]
    keys = dict.fromkeys((*names, *(f"{name}_{key}" for name in there for key in _ERRORS), *there), ("condition",))
    contents = Contents(kind, {"mean": ("condition",)} | keys, {"simulated": ("condition",)}, names, texts=texts)
    check_contents(data, contents._replace(units=[*keys]), source)
    for name in ("runs", "cycles"):
        fits = name in data and data[name].dims == ("condition",) and data[name].dtype.kind == "i"
        _need(fits, kind, f"it has no {name} by conditions", source)
    _need(data.sizes["condition"], kind, "it has no condition", source)


def _check_recording(data: xr.Dataset, source: str) -> None:
    kind = "a recording, a table of means or a track"
    dim = next((name for name in ("time", "row") if name in data.dims), "time")
    needed = dict.fromkeys((dim, *map(str, data.data_vars)), (dim,))
    single = {str(name): () for name, value in data.coords.items() if value.ndim == 0}
    contents = Contents(kind, needed, single, finite=(dim,), texts=("title",), encoded={"provenance": dict})
    check_contents(data, contents._replace(units=[*needed, *single]), source)
    _need(data.data_vars and data.sizes[dim], kind, "it has no readings", source)
    for name, values in data.data_vars.items():
        own = values.attrs
        fits = isinstance(own.get("column"), str) and str(own.get("missing", "")).isdecimal()
        _need(fits, kind, f"it is not told which column {name} was", source)
        numbers = (own[key] for key in ("minimum", "mean", "maximum") if key in own)
        _need(all(isinstance(x, float) for x in numbers), kind, f"{name} has no range", source)
    _check_provenance(data, kind, ("found", "conversions", "repairs", "warnings"), source)


def _check_provenance(data: xr.Dataset, kind: str, lists: Sequence[str], source: str) -> None:
    about = json.loads(data.attrs["provenance"])
    fits = all(isinstance(about.get(key), str) for key in ("file", "reader"))
    fits = fits and isinstance(about.get("part", ""), str)
    for key in lists:
        said = about.get(key)
        fits = fits and isinstance(said, list) and all(isinstance(words, str) for words in said)
    _need(fits, kind, "its provenance does not say how it was read", source)


def _need(fits: object, kind: str, what: str, source: str) -> None:
    if not fits:
        raise InputError(f"this is not {kind}: {what}.", file=source)
