"""What a camera sees of a robot: where points fall in a picture, which faces it sees, and in what light.

Pixels are counted from the upper left corner of the picture to the right and down, so that the middle of its first one
is at (0.5, 0.5). Colours are blue, green, red, from 0 to 255.
"""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from plotly.colors import hex_to_rgb

from nectosome.io.extras import package

_FAR = 2.0**14  # px, from the corner of the picture: what reaches beyond is all but beside the eye, and not drawn
_LIGHT = np.array([-0.36, 0.75, 0.56])  # where it comes from: right, up, towards the viewer
_AMBIENT, _SOFT, _SHINE, _SHARPNESS = 0.42, 0.75, 0.2, 20


class Perspective(NamedTuple):
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
    return np.array(hex_to_rgb(text)[::-1], float)


def walls(rings: Float[np.ndarray, "rings around 3"]) -> Float[np.ndarray, "n 4 3"]:
    """Faces between rings; they turn right-handed about their outward normal, as those of `triangles` do."""
    beside = np.roll(rings, -1, axis=1)
    return np.stack([rings[:-1], beside[:-1], beside[1:], rings[1:]], axis=2).reshape(-1, 4, 3)


def lit(
    faces: Float[np.ndarray, "n 4 3"],
    colour: Float[np.ndarray, "3"],
    camera: Perspective,
    normal: Float[np.ndarray, "n 3"] | None = None,
) -> Float[np.ndarray, "n 3"]:
    r"""Colours of faces under a light above the viewer's left shoulder, by their own or by these normals.

    Light from all around, soft light from one side (half Lambert: Mitchell, McTaggart and Green 2006, "Shading in
    Valve's Source Engine"), and Blinn's highlight (1977), with the unit normal n of a face, the light's direction l,
    and h halfway between l and the viewer's:

    $$ c = c_0 \left[a + d \left(\tfrac{1 + n \cdot l}{2}\right)^2\right] + 255\, s \max(n \cdot h, 0)^m $$
    """
    normal = _unit(np.cross(faces[:, 2] - faces[:, 0], faces[:, 3] - faces[:, 1]) if normal is None else normal)
    light = _LIGHT @ camera.axes
    half = light + _unit(camera.eye - faces.mean(axis=1))
    soft = (0.5 + 0.5 * normal @ light) ** 2
    shine = np.maximum(np.sum(normal * _unit(half), axis=-1), 0) ** _SHARPNESS
    return np.clip(colour * (_AMBIENT + _SOFT * soft)[:, None] + 255 * _SHINE * shine[:, None], 0, 255)


def seen(
    camera: Perspective, faces: Float[np.ndarray, "n 4 3"], colours: Float[np.ndarray, "n 3"]
) -> tuple[Float[np.ndarray, "m 4 2"], Float[np.ndarray, "m 3"]]:
    """Corners [px] and colours of the faces that are turned to the camera, the farthest first."""
    pixels, depth = camera.project(faces)
    p0, p1, p2, p3 = np.moveaxis(pixels, 1, 0)
    a, b = p2 - p0, p3 - p1
    shown = np.flatnonzero(a[:, 1] * b[:, 0] > a[:, 0] * b[:, 1])  # right-handed, for v runs down; not behind the eye
    shown = shown[np.abs(pixels[shown]).reshape(-1, 8).max(axis=1) < _FAR]
    shown = shown[np.argsort(-depth[shown].mean(axis=1), kind="stable")]
    return pixels[shown], colours[shown]


def outlines(
    camera: Perspective, bodies: Iterable[Float[np.ndarray, "rings around 3"]]
) -> list[Float[np.ndarray, "corners 2"]]:
    """Convex outlines [px] of the stretches between the rings of bodies, which cover together what these do."""
    cv2 = package("cv2", "video")
    found = []
    for rings in bodies:
        pixels, _ = camera.project(rings)
        if np.all(np.abs(pixels) < _FAR):
            stretches = np.concatenate([pixels[:-1], pixels[1:]], axis=1).astype(np.float32)
            found += [cv2.convexHull(stretch)[:, 0] for stretch in stretches]
    return found


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), np.finfo(float).tiny)
