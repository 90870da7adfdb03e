"""Tracking of a body by its markers in the videos of several cameras: calibration, marker positions, pose."""

import json
from collections.abc import Iterator, Sequence
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float, Int, UInt8

from nectosome.io import provenance
from nectosome.units import InputError
from nectosome.vision.cameras import (
    Camera,
    PlaceStatus,
    Triangulated,
    calibrate,
    calibrate_through_glass,
    fill,
    fill_rotations,
    pose,
    triangulate,
)
from nectosome.vision.cameras.pose import roll_pitch_yaw

from .angles import unusual
from .clip import Clip, Progress, clip_of, intervals
from .marker_identity import MarkerBody, MarkerFinder, Sightings, Tracks, identify_markers, without_lamps
from .reasons import Reason, loss_notes
from .sheet import MarkerSheet

if TYPE_CHECKING:
    import xarray as xr


_FIRST = 10  # frames in which lamps are measured
_AREA = (0.1, 0.5)  # limits of a marker's area, see `unusual`
_SD = 0.1  # [px] assumed error of a marker's centroid before residuals are known


def calibrate_camera(
    sheet: MarkerSheet, name: str, size: tuple[int, int], pictures: Sequence[UInt8[np.ndarray, "h w 3"]]
) -> tuple[Camera, Float[np.ndarray, "n 2"]]:
    """Camera calibrated by its visible known points, and their pixels. Raises InputError that names the point.

    With a `lamp` each pixel is the mean over `pictures` of the centroid of the one blob within `near` px of `seen`.
    """
    known = [point for point in sheet.points if name in sheet.points[point].seen]
    at = np.array([sheet.points[point].at for point in known]).reshape(-1, 3)
    pixels = np.array([sheet.points[point].seen[name] for point in known], float).reshape(-1, 2)
    if sheet.lamp is not None:
        pixels = _lamp_pixels(sheet, name, known, pixels, pictures)
    lens = sheet.cameras[name].lens
    built = lens if lens is None or isinstance(lens, str) else lens.build()
    try:
        if sheet.glass is not None:
            camera = calibrate_through_glass(at, pixels, sheet.glass.build(), lens=built, size=size)
        else:
            camera = calibrate(at, pixels, lens=built, size=size)
    except InputError as error:
        what, _, number = (error.field or "").partition(".")
        which = f".{known[int(number)]}" if number.isdigit() and int(number) < len(known) else ""
        raise InputError(f"camera {name}: {error.message}", field=f"points{which}" if what else None) from None
    return camera, pixels


def _lamp_pixels(
    sheet: MarkerSheet, name: str, known: Sequence[str], pixels: Float[np.ndarray, "n 2"],
    pictures: Sequence[UInt8[np.ndarray, "h w 3"]],
) -> Float[np.ndarray, "n 2"]:  # fmt: skip
    assert sheet.lamp is not None
    finder = MarkerFinder([sheet.lamp], sheet.smallest)
    found = [np.array([c.pixel for c in finder.find(image)[0]]).reshape(-1, 2) for image in pictures]
    out = np.empty_like(pixels)
    for k, point in enumerate(known):
        inside = [near[np.hypot(*(near - pixels[k]).T) <= sheet.near] for near in found]
        single = [near[0] for near in inside if len(near) == 1]
        if len(single) < 0.5 * len(inside):
            most = max(len(near) for near in inside)
            what = "no lamp" if most == 0 else f"{most} blobs of its colour" if most > 1 else "a lamp in few frames"
            raise InputError(
                f"there is {what} within {sheet.near:g} px of ({pixels[k, 0]:g}, {pixels[k, 1]:g}). Check the "
                "pixel, and the lamp's range of colours.",
                field=f"points.{point}.seen.{name}",
            )
        out[k] = np.mean(single, axis=0)
    return out


def track_markers(
    videos: Sequence[str | Path],
    sheet: MarkerSheet,
    progress: Progress = lambda what, share: None,
) -> "xr.Dataset":
    """Track the markers of a body through videos, in the order of the sheet's cameras.

    The dataset has, over `time` [s] (of the first camera): `marker` (name, axis), positions in the tank [m], with
    `marker_se`, `residual` [px] and `reason` (name), one of `Reason`; `position` (axis) [m] of the origin of the body
    frame and `angle` [rad] (roll, pitch, yaw: R = Rz(yaw) Ry(pitch) Rx(roll)), with `position_se` and `angle_se`;
    `misfit` [m], the rms distance of the markers from the fitted body; `quality` from 0 to 1, the median misfit over
    the misfit; `status`, one of `PlaceStatus`; and `filled`. Values with a reason are NaN. Standard errors are those of
    the pixels' scatter, from the residuals, without the calibration's errors. Raises InputError.
    """
    names = list(sheet.cameras)
    if len(videos) != len(names):
        raise InputError(
            f"the sheet has {len(names)} cameras ({', '.join(names)}), and there are {len(videos)} videos."
        )
    finder = MarkerFinder(list(sheet.markers.values()), sheet.smallest)
    at = np.array([marker.at for marker in sheet.markers.values()])
    body = MarkerBody(at, finder.groups.of, sheet.misfit, sheet.tolerance, list(sheet.markers))
    clips = [_clip(video, sheet, name) for video, name in zip(videos, names, strict=True)]
    cameras: list[Camera] = []
    seen: list[Sightings] = []
    for k, (clip, name) in enumerate(zip(clips, names, strict=True)):
        pictures = [frame.image for frame in islice(clip.frames(), _FIRST)]
        camera, lamps = calibrate_camera(sheet, name, clip.size, pictures)
        cameras.append(camera)
        own = Sightings()
        for frame in clip.frames(_part(progress, name, k, len(clips))):
            found = finder.find(frame.image)
            own.time.append(frame.time + sheet.cameras[name].offset)
            own.groups.append(without_lamps(found, lamps, sheet.near) if sheet.lamp is not None else found)
        seen.append(own)
    progress("places", 0.9)
    return _dataset(sheet, clips, cameras, identify_markers(cameras, seen, body), at)


def _part(progress: Progress, name: str, k: int, n: int) -> Progress:
    """Progress of camera `k` of `n` as a fraction of the whole."""
    return lambda what, share: progress(f"{name}, {what}", 0.9 * (k + share) / n)


def _clip(video: str | Path, sheet: MarkerSheet, name: str) -> Clip:
    own = sheet.cameras[name]
    advice = f"Are the videos in the order of the cameras ({', '.join(sheet.cameras)})?"
    return clip_of(video, own.rate, own.size, f"camera {name} has", advice)


def _dataset(
    sheet: MarkerSheet, clips: Sequence[Clip], cameras: Sequence[Camera], tracks: Tracks, at: Float[np.ndarray, "m 3"]
) -> "xr.Dataset":
    import xarray as xr

    time, why = tracks.time, tracks.reasons.copy()
    covered = _unusual_areas(cameras, triangulate(cameras, tracks.pixels, sd_px=_SD), tracks.areas, why)
    pixels = np.where(covered[..., None], np.nan, tracks.pixels)
    places = triangulate(cameras, pixels, sd_px=_SD)
    there = places.status == PlaceStatus.GOOD
    why = np.where((why == Reason.SEEN) & ~there, Reason.LOST, why)
    # two cameras give one redundant equation per position: residuals estimate the error of a pixel
    sd = _pixel_error(pixels, places) or _SD
    places = triangulate(cameras, pixels, sd_px=sd)
    found = pose(places.place, at, covariance=places.covariance, unwrap=True)
    good = (found.status == PlaceStatus.GOOD) | (found.status == PlaceStatus.GIMBAL)
    usual = np.nanmedian(found.residual) if good.any() else np.nan
    with np.errstate(invalid="ignore", divide="ignore"):
        quality = np.where(good, np.minimum(1.0, usual / np.maximum(found.residual, 1e-15)), 0.0)
    position, angle, filled = found.place, found.angles, np.zeros(len(time), bool)
    if sheet.fill > 0:
        position, gaps_filled = fill(time, position, sheet.fill)
        filled = gaps_filled[:, 0]
        rotation, _ = fill_rotations(time, found.rotation, sheet.fill)
        angle = np.where(filled[:, None], roll_pitch_yaw(rotation), angle)
    gaps, warnings = intervals(time, clips[0])
    for clip, name in list(zip(clips, sheet.cameras, strict=True))[1:]:
        warnings += [f"{name}: {clip.damaged} packets could not be decoded"] if clip.damaged else []
    about = {
        "file": ", ".join(str(clip.path) for clip in clips),
        "reader": "; ".join(clip.description for clip in clips),
        "found": [*_notes(sheet, cameras, tracks), f"a marker's centroid has an error of {sd:.2g} px"],
        "warnings": [*warnings, *loss_notes(list(sheet.markers), why), *_status_notes(found.status)],
    }
    attrs = {
        "title": sheet.about or clips[0].path.name,
        "reasons": json.dumps({int(reason): reason.reason for reason in Reason}),
        "statuses": json.dumps({int(status): status.reason for status in PlaceStatus}),
        "gaps": json.dumps(gaps),
        "provenance": json.dumps(provenance({"sheet": sheet.model_dump(mode="json")}) | about),
    }
    metres, radians = {"units": "m"}, {"units": "rad"}
    return xr.Dataset(
        {
            "marker": (("time", "name", "axis"), places.place, metres),
            "marker_se": (("time", "name", "axis"), places.se, metres),
            "residual": (("time", "name"), places.residual, {"units": "px"}),
            "reason": (("time", "name"), why.astype(np.int8), {"units": "1"}),
            "position": (("time", "axis"), position, metres),
            "position_se": (("time", "axis"), found.place_se, metres),
            "angle": (("time", "turn"), angle, radians),
            "angle_se": (("time", "turn"), found.angles_se, radians),
            "misfit": ("time", found.residual, metres),
            "quality": ("time", quality, {"units": "1"}),
            "status": ("time", found.status, {"units": "1"}),
            "filled": ("time", filled.astype(np.int8), {"units": "1"}),
        },
        coords={
            "time": ("time", time, {"units": "s"}),
            "name": list(sheet.markers),
            "axis": ["x", "y", "z"],
            "turn": ["roll", "pitch", "yaw"],
        },
        attrs=attrs,
    )


def _unusual_areas(
    cameras: Sequence[Camera], places: Triangulated, areas: Float[np.ndarray, "c t m"], why: Int[np.ndarray, "t m"]
) -> np.ndarray:
    """Mask of the pixels of covered or merged markers, by an unusual area times depth squared."""
    strange = np.zeros(areas.shape, bool)
    for c, camera in enumerate(cameras):
        depth = camera.depth(places.place)
        for k in range(areas.shape[2]):
            full = areas[c, :, k] * depth[:, k] ** 2
            known = np.isfinite(full)
            if not known.any():
                continue
            usual = np.median(full[known & (full > 0)]) if np.any(known & (full > 0)) else 1.0
            with np.errstate(divide="ignore", invalid="ignore"):
                larger, smaller = unusual(np.log(full / usual), known, *_AREA)
            fresh = why[:, k] == Reason.SEEN
            why[fresh & larger, k] = Reason.MERGED
            why[fresh & smaller, k] = Reason.COVERED
            strange[c, :, k] = larger | smaller
    return strange


def _pixel_error(pixels: Float[np.ndarray, "c t m 2"], places: Triangulated) -> float | None:
    """Standard error of a pixel coordinate, from the residuals; None if they are too few."""
    count = np.sum(np.isfinite(pixels[..., 0]), axis=0)
    good = places.status == PlaceStatus.GOOD
    freedom = np.sum(2 * count[good] - 3)
    if freedom < 30:
        return None
    return float(np.sqrt(np.sum(count[good] * places.residual[good] ** 2) / freedom))


def _notes(sheet: MarkerSheet, cameras: Sequence[Camera], tracks: Tracks) -> Iterator[str]:
    for name, camera in zip(sheet.cameras, cameras, strict=True):
        assert camera.report is not None
        yield f"{name}: points are {camera.report.rms:.2g} px off (rms)"
        yield from (f"{name}: {note}" for note in camera.report.notes)
    if tracks.late:
        yield f"frames of the cameras are up to {1e3 * tracks.late:.3g} ms apart: pixels are interpolated"


def _status_notes(status: Int[np.ndarray, "t"]) -> list[str]:
    return [
        f"body: {kind.reason} in {np.sum(status == kind)} of {len(status)} frames"
        for kind in PlaceStatus
        if kind != PlaceStatus.GOOD and np.any(status == kind)
    ]
