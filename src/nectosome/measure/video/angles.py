"""Segments of a video over time: places, directions and angles of joints, with a quality and a reason for each gap."""

import json
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float, Int

from nectosome.io import provenance
from nectosome.io.errors import InputError

from .clip import Clip, Progress
from .eye import Eye, Field
from .plane import Plane
from .reasons import Reason, lost
from .sheet import SegmentSheet
from .times import intervals
from .usual import judged

if TYPE_CHECKING:
    import xarray as xr

_ODD = 0.1  # of a stated size, beyond which the scale is doubted


def track_segments(
    video: str | Path,
    sheet: SegmentSheet,
    progress: Progress = lambda what, share: None,
) -> "xr.Dataset":
    """Track a chain of segments through a video.

    The dataset has, over `time` [s]: `position` (segment, axis) of each segment's middle [m; px without a scale] and
    its `direction` [rad] from its start to its end, counter-clockwise from x, `joint_angle` (joint) [rad], what a
    direction has more than the one before, from -pi to pi; `length` and `width`; `quality` of each segment from 0 to 1,
    and `reason` (segment), one of `Reason`. What has a reason is nan, but for the place and size of a segment of which
    only the direction is not known. Missing frames leave no row: `gaps` says where. Raises InputError.
    """
    clip = Clip(Path(video), sheet.rate)
    if sheet.size is not None and sheet.size != clip.size:
        (w, h), (a, b) = sheet.size, clip.size
        raise InputError(
            f"its pictures are {a} x {b} pixels, and the sheet is made for {w} x {h}. Pixels of the sheet (points, "
            "origin, base, lens) would lie elsewhere.",
            file=str(video),
        )
    eye = Eye(sheet, clip.size)
    times: list[float] = []
    values: list[Float[np.ndarray, "segments 6"]] = []
    reasons: list[list[Reason]] = []
    for frame in clip.frames(progress):
        seen = eye.look(frame.image)
        times.append(frame.time)
        values.append(seen.values)
        reasons.append(seen.reasons)
    return _dataset(clip, eye, np.array(times), np.array(values), np.array(reasons, np.int8))


def _dataset(
    clip: Clip, eye: Eye, time: Float[np.ndarray, "t"], values: Float[np.ndarray, "t s 6"], why: Int[np.ndarray, "t s"]
) -> "xr.Dataset":
    import xarray as xr

    sheet, unit = eye.sheet, eye.plane.unit
    names = list(sheet.segments)
    quality = judged(values, why)
    bad = why != Reason.SEEN
    values = values.copy()
    values[~np.isin(why, (Reason.SEEN, Reason.DIRECTION, Reason.ROUND))] = np.nan
    direction = np.where(bad, np.nan, values[..., Field.DIRECTION])
    turn = np.diff(direction, axis=1)
    joints = [f"{a}-{b}" for a, b in pairwise(names)]
    gaps, odd = intervals(time, clip)
    attrs = {
        "title": sheet.about or clip.path.name,
        "reasons": json.dumps({int(reason): reason.words for reason in Reason}),
        "gaps": json.dumps(gaps),
        "provenance": json.dumps(
            provenance({"sheet": sheet.model_dump(mode="json")})
            | {
                "file": str(clip.path),
                "reader": clip.said,
                "found": _found(eye.plane),
                "odd": [*odd, *_sizes(sheet, values, bad), *lost(names, why)],
            }
        ),
    }
    return xr.Dataset(
        {
            "position": (("time", "segment", "axis"), values[..., : Field.DIRECTION], {"units": unit}),
            "direction": (("time", "segment"), _wrapped(direction), {"units": "rad"}),
            "joint_angle": (("time", "joint"), _wrapped(turn), {"units": "rad"}),
            "length": (("time", "segment"), values[..., Field.LENGTH], {"units": unit}),
            "width": (("time", "segment"), values[..., Field.WIDTH], {"units": unit}),
            "quality": (("time", "segment"), quality, {"units": "1"}),
            "reason": (("time", "segment"), why, {"units": "1"}),
        },
        coords={"time": ("time", time, {"units": "s"}), "segment": names, "joint": joints, "axis": ["x", "y"]},
        attrs=attrs,
    )


def _found(plane: Plane) -> list[str]:
    said = [f"a pixel is {1e3 * plane.pixel:.4g} mm"] if plane.unit == "m" else ["no scale: places are in pixels"]
    return said + ([f"known points are {plane.residual:.2g} px off (rms)"] if plane.residual is not None else [])


def _sizes(sheet: SegmentSheet, values: Float[np.ndarray, "t s 6"], bad: np.ndarray) -> Iterator[str]:
    for s, (name, segment) in enumerate(sheet.segments.items()):
        seen = values[~bad[:, s], s]
        for k, what in ((Field.LENGTH, "length"), (Field.WIDTH, "width")):
            stated = getattr(segment, what)
            if stated is not None and len(seen):
                usual = float(np.median(seen[:, k]))
                if abs(usual / stated - 1) > _ODD and (what == "length" or usual > 1.5 * stated):
                    told = f"{1e3 * usual:.3g} mm in the pictures and {1e3 * stated:.3g} mm in the sheet"
                    yield f"{name}: its {what} is {told}. Is a pixel as large as the sheet says?"


def _wrapped(angle: Float[np.ndarray, "..."]) -> Float[np.ndarray, "..."]:
    return (angle + np.pi) % (2 * np.pi) - np.pi
