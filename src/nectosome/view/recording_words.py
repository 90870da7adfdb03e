"""What recordings hold and what was tracked in videos, in lines and tables."""

import json
import math
from typing import TYPE_CHECKING

from nectosome.io.summary import Summary
from nectosome.io.tables import Number, Table
from nectosome.units import count, shown_unit

if TYPE_CHECKING:
    import xarray as xr


def recording_summary(recording: "xr.Dataset") -> Summary:
    """What was read: quantities with their ranges, what was converted and repaired, and what is odd."""
    from nectosome.measure.labels import unit_of

    about = json.loads(recording.attrs["provenance"])
    dim = "time" if "time" in recording.dims else "row"
    part = f" [{about['part']}]" if about["part"] else ""
    rows = count(recording.sizes[dim], "row")
    conditions = {
        str(name): Number(float(value), unit_of(value)) for name, value in recording.coords.items() if value.ndim == 0
    }
    lines = [f"  {name}: {_shown(x)}" for name, x in conditions.items()]
    lines += [f"  {what}: {said}" for what in ("found", "conversions", "repairs") for said in about[what]]
    heads = {"quantity": "quantity", "column": "column", "minimum": "min", "mean": "mean", "maximum": "max"}
    quantities = []
    for name in recording.data_vars:
        a = recording.variables[name].attrs  # of thousands, quicker than each as a data array with coordinates
        numbers = (
            Number(
                float(a.get(key, math.nan)), a["units"], shown=f"{a[key]:.6g} {a['units']}".strip() if key in a else ""
            )
            for key in ("minimum", "mean", "maximum")
        )
        quantities.append((str(name), a["column"], *numbers, Number(int(a["missing"]))))
    return Summary(
        f"{about['file']}{part}: {about['reader']}, {rows}{_duration(recording) if dim == 'time' else ''}",
        [Table("quantities", heads | {"missing": "missing"}, quantities)],
        above=lines,
        warnings=about["warnings"],
        values={"rows": Number(recording.sizes[dim]), **conditions},
    )


def _shown(condition: Number) -> str:
    """A condition as people write it: angles in degrees."""
    factor, unit = shown_unit(condition.unit)
    return f"{factor * condition.value:.6g} {unit}".rstrip()


def _duration(recording: "xr.Dataset") -> str:
    import numpy as np

    first, last = (float(recording["time"][k]) for k in (0, -1))
    n = recording.sizes["time"]
    if n == 1:
        return f", at {first:.6g} s"
    usual = float(np.median(np.diff(recording["time"][: min(n, 100_000)].values)))
    return f", {first:.6g} to {last:.6g} s, every {usual:.4g} s"


def track_summary(tracked: "xr.Dataset") -> Summary:
    """How much of the tracked segments or markers was seen, and how well."""
    import numpy as np

    about = json.loads(tracked.attrs["provenance"])
    time = tracked["time"].values
    above = [
        f"  {time.size} frames, {time[0]:.6g} to {time[-1]:.6g} s",
        *(f"  found: {said}" for said in about["found"]),
    ]
    markers = "marker" in tracked
    dim, heads = ("name", {"name": "marker"}) if markers else ("segment", {"segment": "segment"})
    heads |= {"seen": "seen"} | ({"residual": "off (px)", "error": "error"} if markers else {})
    heads |= {} if markers else {"length": "length", "quality": "quality"}
    rows = list[tuple[str | Number, ...]]()
    for k, name in enumerate(tracked[dim].values):
        good = tracked["reason"].values[:, k] == 0
        cells = [_rounded(float(np.mean(good)), "", 100.0, "%")]
        if good.any() and markers:
            error = np.sqrt(np.sum(tracked["marker_se"].values[good, k] ** 2, axis=1))
            residual = float(np.median(tracked["residual"].values[good, k]))
            cells += [
                Number(residual, "px", shown=f"{residual:.2f}"),
                _rounded(float(np.median(error)), "m", 1e3, "mm", 2),
            ]
        elif good.any():
            unit = str(tracked["length"].attrs["units"])
            factor, shown = (1e3, "mm") if unit == "m" else (1.0, unit)
            cells.append(_rounded(float(np.median(tracked["length"].values[good, k])), unit, factor, shown))
            quality = float(np.median(tracked["quality"].values[good, k]))
            cells.append(Number(quality, shown=f"{quality:.2f}"))
        rows.append((str(name), *cells))
    return Summary(
        f"{about['file']}: {about['reader']}",
        [Table("markers" if markers else "segments", heads, rows)],
        above=above,
        warnings=about["warnings"],
        values={"frames": Number(time.size), "start": Number(float(time[0]), "s"), "end": Number(float(time[-1]), "s")},
    )


def _rounded(value: float, unit: str, factor: float, shown: str, digits: int = 1) -> Number:
    return Number(value, unit, shown=f"{factor * value:.{digits}f} {shown}")
