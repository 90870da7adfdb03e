"""From geometry to pixels: a camera in perspective, faces lit by one light and painted from far to near, lines.

A picture is an array [h, w, 3] of blue, green, red. Pixels are counted from the upper left corner of the picture to the
right and down, so that the middle of its first one is at (0.5, 0.5).
"""

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, UInt8

from nectosome.io.extras import package

Picture = UInt8[np.ndarray, "h w 3"]

_SHIFT = 4  # bits of a pixel's fraction that OpenCV is told
_FAR = 2.0**14  # px, from the corner of the picture: what reaches beyond is all but beside the eye, and not drawn
_LIGHT = np.array([-0.36, 0.75, 0.56])  # where it comes from: right, up, towards the viewer
_AMBIENT, _SOFT, _SHINE, _SHARPNESS = 0.42, 0.75, 0.2, 20


class Camera(NamedTuple):
    """Where a picture is taken from; [m, world frame]."""

    eye: Float[np.ndarray, "3"]
    axes: Float[np.ndarray, "3 3"]  # rows: right, up and back towards the viewer
    focal: float  # [px]
    size: tuple[int, int]  # width and height [px]

    def project(self, points: Float[np.ndarray, "... 3"]) -> tuple[np.ndarray, np.ndarray]:
        """Pixels [..., 2] of points, and how far ahead of the eye these are [...] [m]."""
        right, up, back = np.moveaxis((points - self.eye) @ self.axes.T, -1, 0)
        depth = -back
        scale = self.focal / np.where(depth > 0, depth, np.nan)
        return np.stack([0.5 * self.size[0] + scale * right, 0.5 * self.size[1] - scale * up], axis=-1), depth


def axes_towards(viewer: tuple[float, float, float]) -> Float[np.ndarray, "3 3"]:
    """Axes of a camera in the direction `viewer` of what it looks at, upright; from straight above, y is up."""
    back = np.asarray(viewer, float) / np.linalg.norm(viewer)
    above = np.array([0.0, 0, 1]) if abs(back[2]) < 1 - 1e-9 else np.array([0.0, 1, 0])
    right = np.cross(above, back)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(back, right), back])


def colour_of(text: str) -> Float[np.ndarray, "3"]:
    """Blue, green, red of a colour such as "#0072B2"."""
    return np.array([int(text[k : k + 2], 16) for k in (5, 3, 1)], float)


def walls(rings: Float[np.ndarray, "rings around 3"]) -> Float[np.ndarray, "n 4 3"]:
    """Faces between rings; they turn right-handed about their outward normal, as those of `triangles` do."""
    beside = np.roll(rings, -1, axis=1)
    return np.stack([rings[:-1], beside[:-1], beside[1:], rings[1:]], axis=2).reshape(-1, 4, 3)


def lit(faces: Float[np.ndarray, "n 4 3"], colour: Float[np.ndarray, "3"], camera: Camera) -> Float[np.ndarray, "n 3"]:
    r"""Colours of faces under a light above the viewer's left shoulder.

    Light from all around, soft light from one side (half Lambert: Mitchell, McTaggart and Green 2006, "Shading in
    Valve's Source Engine"), and Blinn's highlight (1977), with the unit normal n of a face, the light's direction l,
    and h halfway between l and the viewer's:

    $$ c = c_0 \left[a + d \left(\tfrac{1 + n \cdot l}{2}\right)^2\right] + 255\, s \max(n \cdot h, 0)^m $$
    """
    normal = _unit(np.cross(faces[:, 2] - faces[:, 0], faces[:, 3] - faces[:, 1]))
    light = _LIGHT @ camera.axes
    half = light + _unit(camera.eye - faces.mean(axis=1))
    soft = (0.5 + 0.5 * normal @ light) ** 2
    shine = np.maximum(np.sum(normal * _unit(half), axis=-1), 0) ** _SHARPNESS
    return np.clip(colour * (_AMBIENT + _SOFT * soft)[:, None] + 255 * _SHINE * shine[:, None], 0, 255)


def paint(
    image: Picture, camera: Camera, faces: Float[np.ndarray, "n 4 3"], colours: Float[np.ndarray, "n 3"], finer: int
) -> None:
    """Paint the faces that are turned to the camera over an image `finer` times its size, the farthest first."""
    cv2 = package("cv2", "video")
    pixels, depth = camera.project(faces)
    p0, p1, p2, p3 = np.moveaxis(pixels, 1, 0)
    a, b = p2 - p0, p3 - p1
    shown = np.flatnonzero(a[:, 1] * b[:, 0] > a[:, 0] * b[:, 1])  # right-handed, for v runs down; not behind the eye
    shown = shown[np.abs(pixels[shown]).reshape(-1, 8).max(axis=1) < _FAR]
    shown = shown[np.argsort(-depth[shown].mean(axis=1), kind="stable")]
    corners = _fixed(pixels[shown], finer)
    for face, colour in zip(corners, _each(colours[shown]), strict=True):
        cv2.fillConvexPoly(image, face, colour, cv2.LINE_8, _SHIFT)


def darken(
    image: Picture, camera: Camera, bodies: Iterable[Float[np.ndarray, "rings around 3"]], finer: int, share: float
) -> None:
    """Darken an image by a share where bodies flattened onto a plane are seen, with soft edges: their shadow.

    A body is what lies between its rings, one stretch after another.
    """
    cv2 = package("cv2", "video")
    width, height = (n // 2 for n in camera.size)  # of the shadow, which is not sharp
    mask = np.zeros((height, width), np.uint8)
    for rings in bodies:
        pixels, _ = camera.project(rings)
        if np.all(np.abs(pixels) < _FAR):
            for stretch in np.concatenate([pixels[:-1], pixels[1:]], axis=1).astype(np.float32):
                cv2.fillConvexPoly(mask, np.rint(0.5 * cv2.convexHull(stretch) - 0.5).astype(np.int32), 255)
    left, top, wide, high = cv2.boundingRect(mask)
    if not high:
        return
    soft = max(height / 90, 1.0)
    edge = int(3 * soft)
    top, bottom = max(top - edge, 0), min(top + high + edge, height)
    left, right = max(left - edge, 0), min(left + wide + edge, width)
    mask = cv2.GaussianBlur(mask[top:bottom, left:right], (0, 0), soft)
    light = cv2.resize(255 - np.rint(share * mask).astype(np.uint8), None, fx=2 * finer, fy=2 * finer)
    top, bottom, left, right = (2 * finer * n for n in (top, bottom, left, right))
    seen = image[top:bottom, left:right]
    cv2.multiply(seen, cv2.merge([light] * 3), dst=seen, scale=1 / 255)


def rule(
    image: Picture,
    camera: Camera,
    lines: Float[np.ndarray, "n 2 3"],
    colours: Float[np.ndarray, "n 3"],
    finer: int,
    width: int = 1,
) -> None:
    """Draw straight lines from point to point over an image `finer` times the camera's, `width` [px of the image]."""
    cv2 = package("cv2", "video")
    ends = _fixed(camera.project(lines)[0], finer).tolist()
    for (a, b), colour in zip(ends, _each(colours), strict=True):
        cv2.line(image, a, b, colour, width, cv2.LINE_AA, _SHIFT)


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), np.finfo(float).tiny)


def _each(colours: Float[np.ndarray, "n 3"]) -> Iterator[tuple[int, int, int]]:
    """Colours one at a time: thousands of lists that live at once would keep the garbage collector busy."""
    flat = np.rint(colours).astype(np.uint8).ravel().tolist()
    return zip(flat[0::3], flat[1::3], flat[2::3], strict=True)


def _fixed(pixels: np.ndarray, finer: int) -> np.ndarray:
    """Pixels as OpenCV counts them, from the middle of the first one, in whole parts."""
    return np.round((pixels * finer - 0.5) * 2**_SHIFT).astype(np.int32)
