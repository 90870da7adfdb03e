"""Cameras of a sheet, from its known points; where these are lamps, measured in the pictures."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, UInt8

from nectosome.io.errors import InputError
from nectosome.measure.cameras import Camera, calibrate, calibrate_behind

from .candidates import MarkerEye
from .marker_sheet import MarkerSheet


def camera_of(
    sheet: MarkerSheet, name: str, size: tuple[int, int], pictures: Sequence[UInt8[np.ndarray, "h w 3"]]
) -> tuple[Camera, Float[np.ndarray, "n 2"]]:
    """A camera by the known points that it sees, and their pixels. Raises InputError that names the point.

    With a `lamp` each point is the mean over `pictures` of the middle of the one blob within `near` px of `seen`.
    """
    known = [point for point in sheet.points if name in sheet.points[point].seen]
    at = np.array([sheet.points[point].at for point in known]).reshape(-1, 3)
    pixels = np.array([sheet.points[point].seen[name] for point in known], float).reshape(-1, 2)
    if sheet.lamp is not None:
        pixels = _measured(sheet, name, known, pixels, pictures)
    lens = sheet.cameras[name].lens
    made = lens if lens is None or isinstance(lens, str) else lens.made()
    try:
        if sheet.glass is not None:
            camera = calibrate_behind(at, pixels, sheet.glass.made(), lens=made, size=size)
        else:
            camera = calibrate(at, pixels, lens=made, size=size)
    except InputError as error:
        what, _, number = (error.field or "").partition(".")
        which = f".{known[int(number)]}" if number.isdigit() and int(number) < len(known) else ""
        raise InputError(f"camera {name}: {error.message}", field=f"points{which}" if what else None) from None
    return camera, pixels


def _measured(
    sheet: MarkerSheet, name: str, known: Sequence[str], pixels: Float[np.ndarray, "n 2"],
    pictures: Sequence[UInt8[np.ndarray, "h w 3"]],
) -> Float[np.ndarray, "n 2"]:  # fmt: skip
    assert sheet.lamp is not None
    eye = MarkerEye([sheet.lamp], sheet.smallest)
    found = [np.array([c.pixel for c in eye.look(image)[0]]).reshape(-1, 2) for image in pictures]
    out = np.empty_like(pixels)
    for k, point in enumerate(known):
        inside = [near[np.hypot(*(near - pixels[k]).T) <= sheet.near] for near in found]
        single = [near[0] for near in inside if len(near) == 1]
        if len(single) < 0.5 * len(inside):
            most = max(len(near) for near in inside)
            what = "no lamp" if most == 0 else f"{most} blobs of its colour" if most > 1 else "seldom a lamp"
            raise InputError(
                f"there is {what} within {sheet.near:g} px of ({pixels[k, 0]:g}, {pixels[k, 1]:g}). Look at the "
                "pixel, and at the range of colours of the lamp.",
                field=f"points.{point}.seen.{name}",
            )
        out[k] = np.mean(single, axis=0)
    return out
