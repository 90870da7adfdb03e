"""Camera calibration by known points (direct linear transformation), in air or through glass and water."""

from dataclasses import replace
from typing import Any, Literal

import numpy as np
from jaxtyping import Float
from scipy.stats import chi2

from nectosome.units import InputError

from . import point_checks
from .camera import Camera, Glass, Lens, Report
from .least_squares import CameraFit, fit

_ROUNDS = 200
_TOLERANCE = 1e-10  # [distance from the points]
Estimated = Literal["k1", "k1 k2"]
_STARTS = (0.0, -0.1, 0.1)  # initial k1 r^2: a single start misses 2 % of lenses with eight points
_CONDITION = 1e3  # of the linear equations; 4 to 20 for points around a workspace
_DETERMINED = 1e-5  # least singular value ratio of the Jacobian, with the lens


def calibrate_through_glass(
    points: Float[np.ndarray, "n 3"], pixels: Float[np.ndarray, "n 2"], glass: Glass, **settings: Any
) -> Camera:
    """Camera for `points` [m] behind a pane and their `pixels`; `settings` are those of `calibrate`.

    The apparent positions of the points depend on the camera's centre: `calibrate` is iterated with the apparent
    positions from the last centre until the centre converges, about five times closer per iteration. With the glass
    known, the camera is valid beyond the points, too. Raises as `calibrate`, and InputError if the centre does not
    converge or points are on the camera's side of the pane.
    """
    points = np.asarray(points, float)
    side = (points - glass.point) @ glass.normal
    normal = glass.normal if abs(side.max()) > abs(side.min()) else -glass.normal  # towards the points
    for k in np.flatnonzero((points - glass.point) @ normal < glass.thickness):
        raise InputError("is not behind the glass like the others.", field=f"points.{k}")
    rough: dict[str, Any] = settings | {"chance": 0.0}
    centre = calibrate(points, pixels, **rough).centre
    if (centre - glass.point) @ normal > 0:  # refraction moves the centre towards the pane, seldom through it
        centre = centre - normal * abs((centre - points.mean(axis=0)) @ normal)
    for _ in range(_ROUNDS):
        seen, _ = glass.apparent(centre, points)
        if not np.isfinite(seen).all():
            break
        found = calibrate(seen, pixels, **rough).centre
        step = float(np.linalg.norm(found - centre))
        centre = found
        if step < _TOLERANCE * float(np.linalg.norm(points - centre, axis=1).max()):
            camera = calibrate(glass.apparent(centre, points)[0], pixels, **settings)
            assert camera.report is not None
            away = abs(float((camera.centre - glass.point) @ glass.normal))
            notes = (*camera.report.notes, f"known glass: the camera is {away:.4g} m in front of it")
            return replace(camera, glass=glass, report=replace(camera.report, notes=notes))
    raise InputError(
        "fit no camera through this glass: check the glass's point, normal and thickness, and the points.",
        field="points",
    )


def _report(
    found: CameraFit,
    points: Float[np.ndarray, "n 3"],
    pixels: Float[np.ndarray, "n 2"],
    terms: int,
    sd_px: float | None,
    chance: float,
    doubt: str,
) -> Report:
    """Report of a fit; `terms` lens coefficients were estimated, `doubt` is a note on a possible misreading."""
    freedom = found.residual.size - 11 - terms
    sd = float(np.sqrt(found.squares / freedom))
    agree = sd_px is not None and bool(chi2.sf(found.squares / sd_px**2, freedom) > 0.01)
    covariance = (sd_px if sd_px is not None and agree else sd) ** 2 * found.covariance
    notes = [f"direct linear transformation of {len(points)} points, then least squares of the residuals"]
    lens = found.camera.lens
    if lens is not None and terms:
        for k in range(terms):
            value, error = float(lens.distortion[k]), float(np.sqrt(covariance[12 + k, 12 + k]))
            unsure = ", not distinguishable from 0" if abs(value) < 2 * error else ""
            notes.append(f"k{k + 1} = {value:.3g} +- {error:.1g} estimated{unsure}")
    elif lens is not None:
        notes.append("the lens is known")
    if sd_px is not None and not agree:
        notes.append(
            f"residuals are {sd:.2g} px instead of {sd_px:.2g} px: refraction, the lens, or errors of the points"
        )
    if doubt:
        notes.append(doubt)
    if chance > 0:
        notes.append(_undetected(found, pixels, freedom, chance))
    return Report(
        rms=float(np.sqrt(found.squares / len(points))),
        residual=found.residual,
        sd=sd,
        freedom=freedom,
        condition=found.condition,
        place_se=_place_se(found, points.mean(axis=0)),
        covariance=covariance,
        notes=tuple(notes),
    )


def _undetected(found: CameraFit, pixels: Float[np.ndarray, "n 2"], freedom: int, chance: float) -> str:
    """Note on the largest misreading that would not be detected."""
    least, where = point_checks.smallest_found(found, freedom, chance)
    known = least < np.sqrt(np.sum(point_checks.axes(pixels) ** 2))
    limit = f"of less than {least:.2g} px (at points.{where})" if known else "of any size"
    more = "1 more equation" if freedom == 1 else f"{freedom} more equations"
    return f"{more} than unknowns: a misreading {limit} may be undetected"


def _place_se(found: CameraFit, middle: Float[np.ndarray, "3"]) -> float:
    """Standard error across the view [m] at `middle`, for errors of 1 px in the known points' pixels."""
    back = np.linalg.pinv(found.camera.project_with_jacobian(middle[None])[1][0])
    return float(np.sqrt(np.trace(back @ found.middle @ back.T) / 2))


def calibrate(
    points: Float[np.ndarray, "n 3"],
    pixels: Float[np.ndarray, "n 2"],
    *,
    lens: Lens | Estimated | None = None,
    size: tuple[int, int] | None = None,
    sd_px: float | None = None,
    chance: float = 0.01,
) -> Camera:
    r"""Camera that maps known `points` [m], right-handed, to their measured `pixels` (u right, v down).

    The linear solution (Abdel-Aziz & Karara 1971) is refined to the least sum of |measured - projected|^2 [px^2]
    (Hartley & Zisserman 2004, algorithm 7.1). Its eleven parameters absorb part of the refraction at a flat glass, so
    it is valid within the volume of the points. `lens` is known, or estimated as k1, or k1 and k2, of OpenCV. `size` is
    (width, height) of the picture, `sd_px` the standard error of a measured coordinate, if known. The report has the
    residuals, the covariance (scaled by `sd_px` if the residuals agree with it, else by the residuals) and how well the
    points determine the camera.

    Raises InputError, with the point (from 0) in `field`, for too few points, points on a line, in a plane or equal,
    ill-conditioned ones, an outlier or two swapped points (at the significance level `chance`; 0: no test), points that
    fit no camera, mirrored points, and without OpenCV; ValueError for wrong shapes and settings.
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
    point_checks.refuse_numbers(points, pixels, size)
    point_checks.refuse_few(n, unknowns)
    point_checks.refuse_places(points, pixels)
    if known is not None:
        _refuse_unseen(known, pixels)

    def refit(points: np.ndarray, pixels: np.ndarray) -> CameraFit:
        return fit(points, pixels, known, terms)

    found = fit(points, pixels, known, terms, _STARTS)
    _refuse_condition(found)
    freedom = 2 * n - unknowns
    doubt = ""
    if chance > 0:
        point_checks.refuse_swapped(points, pixels, found, refit, freedom, chance)
        doubt = point_checks.refuse_misread(points, pixels, found, refit, freedom, sd_px, chance)
    point_checks.refuse_no_camera(pixels, found, freedom, terms > 0)
    _refuse_undetermined(found, terms)
    _refuse_mirrored(found, points)
    report = _report(found, points, pixels, terms, sd_px, chance, doubt)
    return Camera(found.camera.matrix, found.camera.lens, size, report)


def _lens(lens: Lens | Estimated | None) -> tuple[Lens | None, int]:
    if lens is None or isinstance(lens, Lens):
        return lens, 0
    terms = {"k1": 1, "k1 k2": 2}.get(lens)
    if terms is None:
        raise ValueError(f'calibrate: lens is "{lens}"; a Lens, "k1", "k1 k2" or None is expected.')
    return None, terms


def _refuse_unseen(lens: Lens, pixels: Float[np.ndarray, "n 2"]) -> None:
    for k in np.flatnonzero(np.isnan(lens.undistort(pixels)).any(axis=1)):
        raise InputError(
            f"({pixels[k, 0]:g}, {pixels[k, 1]:g}) is outside the image of this lens: check its coefficients, and "
            "whether they belong to this picture size.",
            field=f"pixels.{k}",
        )


def _refuse_condition(found: CameraFit) -> None:
    if found.condition > _CONDITION:
        raise InputError(
            f"do not determine a camera: its equations have a condition number of {found.condition:.2g}, and up to "
            f"{_CONDITION:g} is allowed. Choose points all around the workspace, near and far.",
            field="points",
        )


def _refuse_undetermined(found: CameraFit, terms: int) -> None:
    if found.determined < _DETERMINED:
        what = "the lens beside the camera" if terms else "a camera"
        raise InputError(
            f"do not determine {what}: the fit has a condition number of {1 / found.determined:.2g}, and up to "
            f"{1 / _DETERMINED:g} is allowed. Add points, some near the middle of the picture and some near its edge.",
            field="points",
        )


def _refuse_mirrored(found: CameraFit, points: Float[np.ndarray, "n 3"]) -> None:
    depth = found.camera.depth(points)
    if (depth < 0).all():
        raise InputError(
            "are mirrored: x, y, z are left-handed, or u and v are exchanged, or v is counted from the "
            "bottom, or points and pixels are in different orders.",
            field="points",
        )
    _, _, shown = found.camera.project_with_jacobian(points)
    if (depth > 0).all() and not (shown > 0).all():
        raise InputError(
            f"determine no lens: the best fit folds back before points.{int(np.argmin(shown))}. Add points, or "
            "give the lens.",
            field="points",
        )
    if not (depth > 0).all():
        raise InputError(
            f"points.{int(np.argmin(depth))} is behind the fitted camera: check that points and pixels correspond.",
            field="points",
        )
