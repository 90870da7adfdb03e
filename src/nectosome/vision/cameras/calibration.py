"""A camera from known points (direct linear transformation), through glass and water as well as in air."""

from dataclasses import replace
from typing import Any, Literal

import numpy as np
from jaxtyping import Float
from scipy.stats import chi2

from nectosome.units import InputError

from .camera import Camera, Glass, Lens, Report
from .known_points import (
    axes,
    refuse_few,
    refuse_misread,
    refuse_no_camera,
    refuse_numbers,
    refuse_places,
    refuse_swapped,
    smallest_found,
)
from .least_squares import CameraFit, fit, put

_ROUNDS = 200
_SETTLED = 1e-10  # of the distance from the points
Estimated = Literal["k1", "k1 k2"]
_STARTS = (0.0, -0.1, 0.1)  # of k1 r^2: from one of them alone 2 % of lenses seen by eight points are missed
_CONDITION = 1e3  # of the linear equations; points around a workspace have 4 to 20
_DETERMINED = 1e-5  # of the derivatives, with the lens


def calibrate_behind(
    points: Float[np.ndarray, "n 3"], pixels: Float[np.ndarray, "n 2"], glass: Glass, **settings: Any
) -> Camera:
    """Camera that puts `points` [m] behind a pane where their `pixels` were read; `settings` are those of `calibrate`.

    Where points seem to be depends on where the camera is: `calibrate` is asked again with the points as they seem from
    the centre that it found, until that rests. Each round brings it about five times closer, and its numbers, with the
    glass known, hold beyond the points too. Raises what `calibrate` raises, and InputError where the centre comes to no
    rest or points are on the camera's side of the pane.
    """
    points = np.asarray(points, float)
    side = (points - glass.point) @ glass.normal
    side = side if abs(side.max()) > abs(side.min()) else -side
    for k in np.flatnonzero(side < glass.thickness):
        raise InputError("is not behind the glass, where all others are.", field=f"points.{k}")
    rough: dict[str, Any] = settings | {"chance": 0.0}
    centre = calibrate(points, pixels, **rough).centre
    if (centre - glass.point) @ glass.normal * np.sign((points[0] - glass.point) @ glass.normal) > 0:
        # refraction draws the centre nearer to the pane, seldom through it
        depth = abs((centre - points.mean(axis=0)) @ glass.normal)
        centre = centre - np.sign((points[0] - glass.point) @ glass.normal) * glass.normal * depth
    for _ in range(_ROUNDS):
        seen, _ = glass.apparent(centre, points)
        if not np.isfinite(seen).all():
            break
        found = calibrate(seen, pixels, **rough).centre
        step = float(np.linalg.norm(found - centre))
        centre = found
        if step < _SETTLED * float(np.linalg.norm(points - centre, axis=1).max()):
            camera = calibrate(glass.apparent(centre, points)[0], pixels, **settings)
            assert camera.report is not None
            notes = (*camera.report.notes, f"the glass is known: the camera is {_away(camera, glass):.4g} m before it")
            return replace(camera, glass=glass, report=replace(camera.report, notes=notes))
    raise InputError(
        "fit no camera behind this glass: look at the glass's place, normal and thickness, and at the points.",
        field="points",
    )


def _away(camera: Camera, glass: Glass) -> float:
    return abs(float((camera.centre - glass.point) @ glass.normal))


def report_on(
    found: CameraFit,
    points: Float[np.ndarray, "n 3"],
    pixels: Float[np.ndarray, "n 2"],
    terms: int,
    sd_px: float | None,
    chance: float,
    doubt: str,
) -> Report:
    """Numbers and notes; `terms` of the lens were estimated, `doubt` is that of a misreading."""
    freedom = found.residual.size - 11 - terms
    sd = float(np.sqrt(found.squares / freedom))
    agree = sd_px is not None and bool(chi2.sf(found.squares / sd_px**2, freedom) > 0.01)
    covariance = (sd_px if sd_px is not None and agree else sd) ** 2 * found.covariance
    notes = [f"direct linear transformation of {len(points)} points, then least squares of what they are off"]
    lens = found.camera.lens
    if lens is not None and terms:
        for k in range(terms):
            value, error = float(lens.distortion[k]), float(np.sqrt(covariance[12 + k, 12 + k]))
            unsure = ", not told apart from 0" if abs(value) < 2 * error else ""
            notes.append(f"k{k + 1} = {value:.3g} +- {error:.1g} estimated{unsure}")
    elif lens is not None:
        notes.append("the lens was known")
    if sd_px is not None and not agree:
        notes.append(
            f"the points are {sd:.2g} px off where {sd_px:.2g} px were expected: refraction, the lens, or their places"
        )
    if doubt:
        notes.append(doubt)
    if chance > 0:
        notes.append(_unseen(found, pixels, freedom, chance))
    return Report(
        rms=float(np.sqrt(found.squares / len(points))),
        residual=found.residual,
        sd=sd,
        freedom=freedom,
        condition=found.condition,
        place_se=_place_se(found, points.mean(axis=0), terms),
        covariance=covariance,
        notes=tuple(notes),
    )


def _unseen(found: CameraFit, pixels: Float[np.ndarray, "n 2"], freedom: int, chance: float) -> str:
    """How large a misreading may be that nothing shows."""
    least, where = smallest_found(found, freedom, chance)
    known = least < np.sqrt(np.sum(axes(pixels) ** 2))
    limit = f"of less than {least:.2g} px (at points.{where})" if known else "of any size"
    more = "1 more equation" if freedom == 1 else f"{freedom} more equations"
    return f"{more} than unknowns: a misreading {limit} may stay unseen"


def _place_se(found: CameraFit, middle: Float[np.ndarray, "3"], terms: int) -> float:
    """Standard error across the view [m] of what a place there is, for errors of 1 px in the known points' pixels."""
    camera = found.camera
    own = camera.lens.distortion[:terms] if camera.lens is not None else np.empty(0)
    _, by_matrix, by_lens = put(camera.matrix, own, np.array([[*middle, 1.0]]), None if terms else camera.lens)
    slope = np.concatenate([by_matrix, by_lens], axis=2)[0]
    back = np.linalg.pinv(camera.projected(middle[None])[1][0])
    return float(np.sqrt(np.trace(back @ slope @ found.covariance @ slope.T @ back.T) / 2))


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

    def refit(points: np.ndarray, pixels: np.ndarray) -> CameraFit:
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


def _refuse_condition(found: CameraFit) -> None:
    if found.condition > _CONDITION:
        raise InputError(
            f"do not determine a camera: its equations have a condition of {found.condition:.2g}, and up to "
            f"{_CONDITION:g} is allowed. Choose points all around the workspace, near and far.",
            field="points",
        )


def _refuse_undetermined(found: CameraFit, terms: int) -> None:
    if found.determined < _DETERMINED:
        what = "the lens beside the camera" if terms else "a camera"
        raise InputError(
            f"do not determine {what}: its least squares have a condition of {1 / found.determined:.2g}, and up to "
            f"{1 / _DETERMINED:g} is allowed. Add points, some near the middle of the picture and some near its edge.",
            field="points",
        )


def _refuse_mirrored(found: CameraFit, points: Float[np.ndarray, "n 3"]) -> None:
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
