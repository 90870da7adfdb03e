"""A camera from known points (direct linear transformation), through glass and water as well as in air."""

from typing import Literal

import numpy as np
from jaxtyping import Float

from nectosome.io.errors import InputError

from .camera import Camera
from .checks import refuse_few, refuse_numbers, refuse_places
from .lens import Lens
from .misread import refuse_misread, refuse_no_camera, refuse_swapped
from .refine import Fit, fit
from .report import report_on

Estimated = Literal["k1", "k1 k2"]

_STARTS = (0.0, -0.1, 0.1)  # of k1 r^2: from one of them alone 2 % of lenses seen by eight points are missed
_CONDITION = 1e3  # of the linear equations; points around a workspace have 4 to 20
_DETERMINED = 1e-5  # of the derivatives, with the lens


def calibrate(
    points: Float[np.ndarray, "n 3"],
    pixels: Float[np.ndarray, "n 2"],
    *,
    lens: Lens | Estimated | None = None,
    size: tuple[int, int] | None = None,
    sd_px: float | None = None,
    chance: float = 0.01,
) -> Camera:
    r"""Camera that puts known `points` [m], right-handed, where their `pixels` (u right, v down) were read.

    The linear solution (Abdel-Aziz & Karara 1971) is refined until the sum of |read - put|^2 [px^2] is least (Hartley &
    Zisserman 2004, algorithm 7.1). Its eleven numbers take up a part of what refraction at a flat glass does: it holds
    within the space that the points enclose. `lens` is known, or estimated as k1, or k1 and k2, of OpenCV's. `size` is
    (width, height) of the picture, `sd_px` the standard error of a coordinate that is read, where it is known. The
    report has the residuals, the covariance (by `sd_px` where residuals agree with it, by what they say else) and how
    well the points determine the camera.

    Raises InputError, `field` telling which point (counted from 0), for too few points, points on a line, in a plane or
    twice the same, badly conditioned ones, a point far off the others or swapped with another (at a `chance` of
    refusing readings that are right; 0: no such test), points that fit no camera, and points that are seen as in a
    mirror; ValueError for wrong shapes and settings.
    """
    points, pixels = np.array(points, float), np.array(pixels, float)
    known, terms = _lens(lens)
    n, unknowns = len(points), 11 + terms
    if points.shape != (n, 3) or pixels.shape != (n, 2):
        raise ValueError(
            f"calibrate: [n, 3] and [n, 2] are expected; points are {points.shape}, pixels {pixels.shape}."
        )
    if sd_px is not None and not 0 < sd_px < np.inf:
        raise ValueError(f"calibrate: sd_px is {sd_px:g} px; it must be a positive number.")
    refuse_numbers(points, pixels, size)
    refuse_few(n, unknowns)
    refuse_places(points, pixels)
    if known is not None:
        _refuse_unseen(known, pixels)

    def refit(points: np.ndarray, pixels: np.ndarray) -> Fit:
        return fit(points, pixels, known, terms)

    found = fit(points, pixels, known, terms, _STARTS)
    _refuse_condition(found)
    freedom = 2 * n - unknowns
    doubt = ""
    if chance > 0:
        refuse_swapped(points, pixels, found, refit, freedom, chance)
        doubt = refuse_misread(points, pixels, found, refit, freedom, sd_px, chance)
    refuse_no_camera(pixels, found, freedom, terms > 0)
    _refuse_undetermined(found, terms)
    _refuse_mirrored(found, points)
    report = report_on(found, points, pixels, terms, sd_px, chance, doubt)
    return Camera(found.camera.matrix, found.camera.lens, size, report)


def _lens(lens: Lens | Estimated | None) -> tuple[Lens | None, int]:
    if lens is None or isinstance(lens, Lens):
        return lens, 0
    terms = {"k1": 1, "k1 k2": 2}.get(lens)
    if terms is None:
        raise ValueError(f'calibrate: lens is "{lens}"; a Lens, "k1", "k1 k2" or None is expected.')
    return None, terms


def _refuse_unseen(lens: Lens, pixels: Float[np.ndarray, "n 2"]) -> None:
    for k in np.flatnonzero(np.isnan(lens.straightened(pixels)).any(axis=1)):
        raise InputError(
            f"({pixels[k, 0]:g}, {pixels[k, 1]:g}) is where this lens shows nothing: look at its coefficients, and "
            "whether they belong to this size of the picture.",
            field=f"pixels.{k}",
        )


def _refuse_condition(found: Fit) -> None:
    if found.condition > _CONDITION:
        raise InputError(
            f"do not determine a camera: its equations have a condition of {found.condition:.2g}, and up to "
            f"{_CONDITION:g} is allowed. Choose points all around the workspace, near and far.",
            field="points",
        )


def _refuse_undetermined(found: Fit, terms: int) -> None:
    if found.determined < _DETERMINED:
        what = "the lens beside the camera" if terms else "a camera"
        raise InputError(
            f"do not determine {what}: its least squares have a condition of {1 / found.determined:.2g}, and up to "
            f"{1 / _DETERMINED:g} is allowed. Add points, some near the middle of the picture and some near its edge.",
            field="points",
        )


def _refuse_mirrored(found: Fit, points: Float[np.ndarray, "n 3"]) -> None:
    depth = found.camera.depth(points)
    if (depth < 0).all():
        raise InputError(
            "are seen as in a mirror: x, y, z are left-handed, or u and v are exchanged, or v is counted from the "
            "bottom, or points and pixels are in different orders.",
            field="points",
        )
    _, _, shown = found.camera.projected(points)
    if (depth > 0).all() and not (shown > 0).all():
        raise InputError(
            f"tell no lens: the one that fits best turns back before points.{int(np.argmin(shown))}. Add points, or "
            "say what the lens is.",
            field="points",
        )
    if not (depth > 0).all():
        raise InputError(
            f"points.{int(np.argmin(depth))} comes out behind the camera: see that points and pixels belong together.",
            field="points",
        )
