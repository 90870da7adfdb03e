"""Overlay of tracked segments on the video: rectangles, angles, quality, and reasons of gaps."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float, UInt8

from nectosome.io.atomic import write_atomic
from nectosome.io.extras import package

from .clip import Clip, write_video
from .plane import MotionPlane, plane_of
from .reasons import Reason
from .sheet import SegmentSheet

if TYPE_CHECKING:
    import xarray as xr

# blue, green, red of a colour-blind-safe palette (Okabe and Ito)
_COLOURS = ((178, 114, 0), (0, 94, 213), (115, 158, 0), (167, 121, 204), (0, 159, 230), (233, 180, 86), (66, 228, 240))
_AWAY = 5.0  # [px] distance of outlines from the segment, in a picture 720 px high
_WHITE, _BLACK = (255, 255, 255), (0, 0, 0)


def draw_over(
    video: str | Path, sheet: SegmentSheet, tracked: "xr.Dataset", path: Path, progress: Callable[[str, float], None]
) -> None:
    """Write the video (.mp4) with an overlay of the tracked segments. Raises InputError if it cannot be written."""
    clip = Clip(Path(video), sheet.rate)
    plane = plane_of(sheet, clip.size)
    count = tracked.sizes["time"]

    def pictures() -> Any:
        for k, frame in enumerate(clip.frames()):
            progress("overlay", k / count)
            yield frame.time, draw(frame.image, plane, tracked.isel(time=k))

    write_atomic(path, lambda beside: write_video(beside, pictures()))


def draw(image: UInt8[np.ndarray, "h w 3"], plane: MotionPlane, at: "xr.Dataset") -> UInt8[np.ndarray, "h w 3"]:
    """A picture with the segments at one time."""
    cv2 = package("cv2", "video")
    image = image.copy()
    scale = max(image.shape[0] / 720, 0.5)
    names = [str(name) for name in at["segment"].values]
    lines = [(f"t = {float(at['time']):.3f} s", _WHITE)]
    centre, direction = at["position"].values, at["direction"].values
    length, width, why = at["length"].values, at["width"].values, at["reason"].values
    for s, name in enumerate(names):
        colour = _COLOURS[s % len(_COLOURS)]
        if why[s] != Reason.SEEN:
            lines.append((f"{name}: {Reason(int(why[s])).reason}", colour))
            continue
        quality = float(at["quality"].values[s])
        lines.append((f"{name}: {np.rad2deg(direction[s]):.1f} deg, quality {quality:.2f}", colour))
        away = _AWAY * scale * plane.pixel  # so that the segment stays visible
        corners = plane.pixels(_corners(centre[s], direction[s], length[s], width[s] + 2 * away))
        outline = [np.round(corners * 16).astype(np.int32)]
        cv2.polylines(image, outline, True, _WHITE, round(3 * scale), cv2.LINE_AA, 4)
        cv2.polylines(image, outline, True, colour, max(round(1.5 * scale), 1), cv2.LINE_AA, 4)
        end = np.round(corners[[0, 3]].mean(0) * 16).astype(int)  # the segment's end
        cv2.circle(image, (int(end[0]), int(end[1])), round(4 * scale * 16), colour, -1, cv2.LINE_AA, 4)
    for k, (text, colour) in enumerate(lines):
        _write(image, text, (round(12 * scale), round((28 + 26 * k) * scale)), colour, scale)
    return image


def _corners(middle: Float[np.ndarray, "2"], direction: float, length: float, width: float) -> Float[np.ndarray, "4 2"]:
    along = 0.5 * length * np.array([np.cos(direction), np.sin(direction)])
    across = 0.5 * width * np.array([-np.sin(direction), np.cos(direction)])
    return middle + np.array([along + across, across - along, -along - across, along - across])


def _write(image: Any, text: str, place: tuple[int, int], colour: tuple[int, int, int], scale: float) -> None:
    """Write white text on black, after a mark of its colour."""
    cv2 = package("cv2", "video")
    font, size, bold = cv2.FONT_HERSHEY_SIMPLEX, 0.6 * scale, max(round(1.5 * scale), 1)
    side, edge = round(14 * scale), round(5 * scale)
    left, low = place[0] + 2 * side, place[1]
    (wide, high), below = cv2.getTextSize(text, font, size, bold)
    corner = (place[0] - edge, low - high - edge)
    cv2.rectangle(image, corner, (left + wide + edge, low + below + edge // 2), _BLACK, -1)
    cv2.rectangle(image, (place[0], low - side), (place[0] + side, low), colour, -1)
    cv2.putText(image, text, (left, low), font, size, _WHITE, bold, cv2.LINE_AA)
