"""What there is to say of a calibration."""

import numpy as np
from jaxtyping import Float
from scipy.stats import chi2

from .camera import Report
from .checks import axes
from .misread import smallest_found
from .refine import Fit, put


def report_on(
    found: Fit,
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


def _unseen(found: Fit, pixels: Float[np.ndarray, "n 2"], freedom: int, chance: float) -> str:
    """How large a misreading may be that nothing shows."""
    least, where = smallest_found(found, freedom, chance)
    known = least < np.sqrt(np.sum(axes(pixels) ** 2))
    limit = f"of less than {least:.2g} px (at points.{where})" if known else "of any size"
    more = "1 more equation" if freedom == 1 else f"{freedom} more equations"
    return f"{more} than unknowns: a misreading {limit} may stay unseen"


def _place_se(found: Fit, middle: Float[np.ndarray, "3"], terms: int) -> float:
    """Standard error across the view [m] of what a place there is, for errors of 1 px in the known points' pixels."""
    camera = found.camera
    own = camera.lens.distortion[:terms] if camera.lens is not None else np.empty(0)
    _, by_matrix, by_lens = put(camera.matrix, own, np.array([[*middle, 1.0]]), None if terms else camera.lens)
    slope = np.concatenate([by_matrix, by_lens], axis=2)[0]
    back = np.linalg.pinv(camera.projected(middle[None])[1][0])
    return float(np.sqrt(np.trace(back @ slope @ found.covariance @ slope.T @ back.T) / 2))
