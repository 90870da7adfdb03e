r"""A segment in a picture: its centre, axis, length and width, from the pixels of its colour.

`moments`: each pixel has the weight $w$, its fraction covered by the segment, from its colour between that of the
segment and that of its surroundings; centre and axes are those of the moments

$$ c = \sum w p / \sum w, \quad C = \sum w (p - c)(p - c)^T / \sum w, \quad L = \sqrt{12 \lambda_1} $$

of a rectangle with the same second moments. `rectangle`: the smallest rectangle around the pixels in the colour's range
(OpenCV's minAreaRect, Hu et al. 2024, section 3.2), of whole pixels.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, UInt8

from nectosome.io.extras import package

from .plane import MotionPlane
from .sheet import Colour, Fit

MOST = 8  # most colours: one bit of a byte each
_MARGIN = 2  # [px] around a blob that may be partly covered
_RING = 3  # [px] around these: the surroundings
_TRUST = np.array([1.0, 0.5, 0.5], np.float32)  # weights of brightness and colour (videos subsample colour)
_NEAR = 11  # [px] side of the square for local means
_GRAIN = 1.0  # [counts] least noise
_FAINT = 0.1  # least coverage of a pixel that its colour can show
_Rectangle = tuple[Float[np.ndarray, "2"], float, float, float, float]


class ColourGroups:
    """Up to eight colour ranges, looked up for all pixels at once; equal ranges are one group."""

    def __init__(self, ranges: Sequence[Colour]):
        colours = [(colour.hue, colour.saturation, colour.value) for colour in ranges]
        groups = list(dict.fromkeys(colours))
        self.of = [groups.index(colour) for colour in colours]  # group of each range
        self.count = len(groups)
        if not 1 <= self.count <= MOST:
            raise ValueError(f"ColourGroups: {self.count} colours; from 1 to {MOST} are possible.")
        self._cv2 = package("cv2", "video")
        table = np.zeros((1, 256, 3), np.uint8)
        level = np.arange(256)
        for k, (hue, *others) in enumerate(groups):
            low, high = (edge / (2 * math.pi) * 256 for edge in hue)
            # a hue n means n to n + 1 of 256 parts of a turn
            middle = level + 0.5
            hues = (middle >= low) & (middle <= high) if low < high else (middle >= low) | (middle <= high)
            rest = [(level >= 255 * low - 0.5) & (level <= 255 * high + 0.5) for low, high in others]
            for channel, part in enumerate([hues, *rest]):
                table[0, part, channel] |= 1 << k
        self._table = table

    def find(self, image: UInt8[np.ndarray, "height width 3"]) -> UInt8[np.ndarray, "height width"]:
        """Return the groups of each pixel as bits: bit k is the k-th group; `image` is blue, green, red."""
        cv2 = self._cv2
        hsv = cv2.cvtColor(image, cv2.COLOR_BGR2HSV_FULL)
        found = cv2.LUT(hsv, self._table)
        hue, saturation, value = cv2.split(found)
        return cv2.bitwise_and(cv2.bitwise_and(hue, saturation), value)


@dataclass(frozen=True)
class Blob:
    """Connected pixels of one colour."""

    colour: int
    left: int
    top: int
    width: int
    height: int
    pixels: int
    cut: bool  # touches the edge of the picture
    mask: Bool[np.ndarray, "height width"]  # within its box


@dataclass(frozen=True)
class SegmentPose:
    """A segment's rectangle in the plane; the axis is along `length`, without a sign."""

    middle: Float[np.ndarray, "2"]
    axis: float  # [rad], counter-clockwise from x
    length: float
    width: float
    area: float
    cut: bool  # touches the edge of the picture


def blobs(bits: UInt8[np.ndarray, "height width"], alone: Sequence[bool], smallest: int) -> list[list[Blob]]:
    """Blobs of each colour with at least `smallest` pixels, the largest first.

    For a colour that is `alone` (of one object), gaps of a pixel or two are closed.
    """
    cv2 = package("cv2", "video")
    found: list[list[Blob]] = [[] for _ in alone]
    square = np.ones((3, 3), np.uint8)
    left, top, width, height = cv2.boundingRect(bits)
    if not width:
        return found
    crop = bits[top : top + height, left : left + width]
    for k, single in enumerate(alone):
        mask = crop & np.uint8(1 << k)  # NumPy scalar: OpenCV takes a sequence of four as one colour
        if single:
            mask = cv2.morphologyEx(mask, cv2.MORPH_CLOSE, square)
        count, labels, boxes, _ = cv2.connectedComponentsWithStats(mask, connectivity=8, ltype=cv2.CV_32S)
        pixels = boxes[1:count, cv2.CC_STAT_AREA]
        for label in 1 + np.argsort(-pixels, kind="stable"):
            x, y, w, h, n = (int(number) for number in boxes[label])
            if n < smallest:
                break
            inside = labels[y : y + h, x : x + w] == label
            x, y = left + x, top + y
            cut = x == 0 or y == 0 or x + w == bits.shape[1] or y + h == bits.shape[0]
            found[k].append(Blob(k, x, y, w, h, n, cut, inside))
    return found


def segment_pose(
    blob: Blob, image: UInt8[np.ndarray, "height width 3"], bits: UInt8[np.ndarray, "height width"], plane: MotionPlane,
    fit: Fit, across: bool,
) -> SegmentPose:  # fmt: skip
    """Rectangle of a blob; `across`: the segment is wider than long."""
    middle, direction, longer, shorter, area = (
        _by_moments(blob, image, bits, plane) if fit == "moments" else _by_rectangle(blob, plane)
    )
    if across:
        direction, longer, shorter = direction + np.pi / 2, shorter, longer
    return SegmentPose(middle, float(direction % np.pi), longer, shorter, area, blob.cut)


def _by_moments(blob: Blob, image: np.ndarray, bits: np.ndarray, plane: MotionPlane) -> _Rectangle:
    window, share = coverage(blob, image, bits)
    places = plane.grid[window].reshape(-1, 2)
    weight = share.ravel()
    total = weight.sum()
    if not total:  # no contrast
        return np.zeros(2), 0.0, 0.0, 0.0, 0.0
    middle = weight @ places / total
    off = places - middle
    moments = (off * weight[:, None]).T @ off / total
    spread = 12 * np.linalg.eigvalsh(moments) - plane.pixel**2  # a pixel's own second moment is 1/12
    shorter, longer = np.sqrt(np.maximum(spread, 0.0))
    direction = 0.5 * np.arctan2(2 * moments[0, 1], moments[0, 0] - moments[1, 1])
    return middle, float(direction), float(longer), float(shorter), float(total * plane.pixel**2)


def coverage(blob: Blob, image: np.ndarray, bits: np.ndarray) -> tuple[tuple[slice, slice], Float[np.ndarray, "h w"]]:
    """Window around a blob, and the coverage of each of its pixels by the segment."""
    cv2 = package("cv2", "video")
    wide = _MARGIN + _RING
    height, width = bits.shape
    top, left = max(blob.top - wide, 0), max(blob.left - wide, 0)
    bottom, right = min(blob.top + blob.height + wide, height), min(blob.left + blob.width + wide, width)
    window = (slice(top, bottom), slice(left, right))
    own = np.zeros((bottom - top, right - left), np.uint8)
    own[blob.top - top : blob.top - top + blob.height, blob.left - left : blob.left - left + blob.width] = blob.mask
    square = np.ones((3, 3), np.uint8)
    near = cv2.dilate(own, square, iterations=_MARGIN)
    other = cv2.dilate(((bits[window] != 0) & (own == 0)).astype(np.uint8), square)
    around = (cv2.dilate(near, square, iterations=_RING) > near) & (other == 0)
    core = cv2.erode(own, square) > 0
    core = core if core.any() else own > 0
    colour = cv2.cvtColor(image[window], cv2.COLOR_BGR2YCrCb) * _TRUST
    inside = colour[core].mean(0)
    ground = _ground(colour, around)
    contrast = inside - ground
    # weights by the scatter of the surroundings (Fisher 1936)
    left = (colour - ground)[around]
    scatter = left.T @ left / max(len(left), 1) + _GRAIN**2 * np.eye(3)
    weighted = contrast @ np.linalg.inv(scatter)
    share = np.sum((colour - ground) * weighted, axis=2) / np.maximum(np.sum(contrast * weighted, axis=2), 1e-6)
    share = np.where(share < _FAINT, 0.0, np.minimum(share, 1.0))
    return window, np.where(own > 0, share, share * ((near > 0) & (other == 0)))


def _ground(colour: Float[np.ndarray, "h w 3"], around: Bool[np.ndarray, "h w"]) -> Float[np.ndarray, "h w 3"]:
    """Background colour at each pixel: local means over the ring, since a floor is seldom uniform."""
    cv2 = package("cv2", "video")
    there = around.astype(np.float32)
    if not there.any():
        return np.zeros_like(colour)
    far = colour[around].mean(0)
    size = (_NEAR, _NEAR)
    weight = cv2.blur(there, size, borderType=cv2.BORDER_CONSTANT)[..., None] + 1e-3
    return (cv2.blur(colour * there[..., None], size, borderType=cv2.BORDER_CONSTANT) + 1e-3 * far) / weight


def _by_rectangle(blob: Blob, plane: MotionPlane) -> _Rectangle:
    cv2 = package("cv2", "video")
    outline, _ = cv2.findContours(blob.mask.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    pixels = np.concatenate(outline)[:, 0, :]
    places = plane.grid[blob.top + pixels[:, 1], blob.left + pixels[:, 0]]
    corner = places[0]
    scaled = ((places - corner) / plane.pixel).astype(np.float32)  # little rounding near 0
    middle, (first, second), degrees = cv2.minAreaRect(scaled)
    direction = np.deg2rad(degrees) + (0.0 if first >= second else np.pi / 2)
    longer, shorter = (plane.pixel * (side + 1.0) for side in (max(first, second), min(first, second)))
    return corner + plane.pixel * np.array(middle), float(direction), longer, shorter, blob.pixels * plane.pixel**2
