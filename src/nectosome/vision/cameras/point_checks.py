"""Checks of known points: number, geometry, swapped points and outliers (by the redundant equations)."""

from collections.abc import Callable, Iterator
from itertools import combinations

import numpy as np
from jaxtyping import Float
from scipy.spatial.distance import pdist
from scipy.stats import chi2
from scipy.stats import f as variance_ratio

from nectosome.units import InputError

from .least_squares import CameraFit, linear, normaliser, transformed

FLAT = 0.02  # least distance from a plane or a line over the spread [-]
Refit = Callable[[np.ndarray, np.ndarray], CameraFit]  # of points and pixels
_READ = 0.5  # [px] largest residual that is never an outlier
_GROSS = 0.05  # largest residual of a camera over the points' spread in the picture [-]
_ALIKE = 0.05  # significance level at which two explanations differ [-]
_REFINED = 8  # candidates, best by the linear camera, that are fitted
_TRIED = 30  # points with the largest residuals, of which all pairs are tried as swapped


def refuse_few(n: int, unknowns: int) -> None:
    """Raise InputError without a redundant equation."""
    least = unknowns // 2 + 1
    if n < least:
        what = "the 11 parameters of a camera" if unknowns == 11 else f"a camera and its lens ({unknowns} parameters)"
        out = "" if unknowns == 11 else ", or give the lens"
        raise InputError(
            f"{n} points give {2 * n} equations, and {what} need {least} points, better eight or more: add "
            f"points{out}.",
            field="points",
        )


def refuse_numbers(
    points: Float[np.ndarray, "n 3"], pixels: Float[np.ndarray, "n 2"], size: tuple[int, int] | None
) -> None:
    """Raise InputError for NaN or infinite values, and for pixels outside the picture."""
    for name, values in (("points", points), ("pixels", pixels)):
        for k in np.flatnonzero(~np.isfinite(values).all(axis=1)):
            raise InputError(f"{_row(values[k])} is NaN or infinite: leave the point out.", field=f"{name}.{k}")
    if size is not None:
        for k in np.flatnonzero(((pixels < -0.5) | (pixels > np.array(size) - 0.5)).any(axis=1)):
            raise InputError(
                f"{_row(pixels[k])} lies outside the picture of {size[0]} x {size[1]} pixels: u counts from the "
                "left, v from the top.",
                field=f"pixels.{k}",
            )


def refuse_places(points: Float[np.ndarray, "n 3"], pixels: Float[np.ndarray, "n 2"]) -> None:
    """Raise InputError for points that are equal, on a line, or in a plane, all or all but one."""
    seen = axes(pixels)
    if seen[0] < 1:
        raise InputError(
            f"lie within {seen[0]:.2g} px (rms) of their centroid, which determines no camera. Pixels "
            "are expected, not fractions of the picture's size.",
            field="pixels",
        )
    if seen[1] < FLAT * seen[0]:
        raise InputError(
            f"lie on a line, {seen[1]:.2g} px (rms) off it, which is impossible for points in a volume. Check which "
            "numbers are u and v.",
            field="pixels",
        )
    spread = axes(points)
    refuse_same(points, "points")
    if spread[1] < FLAT * spread[0]:
        raise InputError(
            f"lie on a line, {_far(spread[1], spread[0])}: nothing is known across it. Choose points all around the "
            "workspace.",
            field="points",
        )
    out = "Points in a plane determine no camera: add points clearly off it, best by half of their spread."
    if spread[2] < FLAT * spread[0]:
        raise InputError(f"lie in a plane, {_far(spread[2], spread[0])}. {out}", field="points")
    for k in range(len(points)):
        others = axes(np.delete(points, k, axis=0))
        if others[2] < FLAT * spread[0]:
            raise InputError(
                f"all but points.{k} lie in a plane, {_far(others[2], spread[0])}; one point is not enough. {out}",
                field="points",
            )


def refuse_same(points: Float[np.ndarray, "n 3"], name: str) -> None:
    """Raise InputError for two equal points."""
    near = pdist(points) <= 1e-9 * np.abs(points).max()
    if near.any():
        i, j = (int(index[np.argmax(near)]) for index in np.triu_indices(len(points), 1))
        raise InputError(f"equals {name}.{i}: leave one of them out.", field=f"{name}.{j}")


def axes(points: Float[np.ndarray, "n d"]) -> Float[np.ndarray, "d"]:
    """Root mean square distances of points from their centroid along their principal axes, the longest first."""
    singular = np.linalg.svd(points - points.mean(axis=0), compute_uv=False) / np.sqrt(len(points))
    return np.pad(singular, (0, points.shape[1] - len(singular)))


def _far(off: float, spread: float) -> str:
    share = f", {100 * off / spread:.2g} % of their spread of {spread:.3g} m" if spread > 0 else ""
    return f"{off:.2g} m (rms) off it{share}"


def _row(values: Float[np.ndarray, "d"]) -> str:
    return "(" + ", ".join(f"{x:g}" for x in values) + ")"


def refuse_swapped(
    points: Float[np.ndarray, "n 3"],
    pixels: Float[np.ndarray, "n 2"],
    found: CameraFit,
    refit: Refit,
    freedom: int,
    chance: float,
) -> None:
    """Raise InputError if another order of the pixels fits significantly better (variance ratio test).

    Points of a regular shape, such as the corners of a box, allow several equivalent orders.
    """
    if np.sqrt(found.squares / freedom) < _READ:
        return
    tried = list(_orders(found.residual))
    S, T = normaliser(points), normaliser(pixels)
    X, seen = transformed(S, points), transformed(T, pixels)
    rough = [_rough(X, seen[order]) for order, _ in tried]
    others: dict[str, float] = {}
    for k in np.argsort(rough)[:_REFINED]:
        order, words = tried[k]
        other = refit(points, pixels[order])
        if (other.camera.depth(points) > 0).all():  # no mirrored fits
            others[words] = max(other.squares, 1e-300)
    if not others:
        return
    words, least = min(others.items(), key=lambda item: item[1])
    if float(variance_ratio.sf(found.squares / least, freedom, freedom)) * len(tried) < chance:
        alike = least * float(variance_ratio.isf(_ALIKE, freedom, freedom))
        words += _or([name for name, squares in others.items() if name != words and squares <= alike])
        before, after = (np.sqrt(squares / len(points)) for squares in (found.squares, least))
        raise InputError(
            f"{words}: they fit to {before:.3g} px (rms) as they are, and to {after:.2g} px otherwise.", field="points"
        )


def refuse_misread(
    points: Float[np.ndarray, "n 3"],
    pixels: Float[np.ndarray, "n 2"],
    found: CameraFit,
    refit: Refit,
    freedom: int,
    sd_px: float | None,
    chance: float,
) -> str:
    """Raise InputError for an outlier, without which the others fit significantly better; return a note on a doubt.

    Externally studentised residual (Cook & Weisberg 1982, section 2.2.1), with two coordinates per point: F = (RSS -
    RSS_i) / 2 over RSS_i / (freedom - 2), Bonferroni-corrected by the number of points; RSS_i is that of a new fit.
    Points that explain it about as well are named, too. With `sd_px`, if the others agree with it, a chi-squared test
    of (RSS - RSS_i) / sd^2 with 2 degrees of freedom finds smaller misreadings; it gives only a note, since residuals
    of refraction look alike.
    """
    n, left = len(points), freedom - 2
    if left < 1:
        return ""
    # by how much the sum of squares falls without each point; 0 along directions in which the camera needs it
    kept = np.linalg.pinv(np.eye(2) - found.leverage, rcond=1e-9, hermitian=True)
    gain = np.einsum("ni,nij,nj->n", found.residual, kept, found.residual)
    # the others are not in a plane (`refuse_places`)
    without = {
        int(i): refit(np.delete(points, i, axis=0), np.delete(pixels, i, axis=0)) for i in np.argsort(-gain)[:_REFINED]
    }
    k = min(without, key=lambda i: without[i].squares)
    squares = max(without[k].squares, 1e-300)
    off = float(np.linalg.norm(pixels[k] - without[k].camera.project_with_jacobian(points[[k]])[0]))
    less = max(found.squares - squares, 0.0)
    alike = squares * float(variance_ratio.isf(_ALIKE, left, left))
    also = _or([f"points.{i}" for i, other in without.items() if i != k and other.squares <= alike])
    if off > _READ and float(variance_ratio.sf(less / 2 / (squares / left), 2, left)) * n < chance:
        raise InputError(
            f"is read {off:.3g} px off the camera of the other {n - 1} points, which fit to "
            f"{np.sqrt(squares / (n - 1)):.2g} px (rms). It is probably misread{also}: check its pixel, its "
            "position and their signs, or leave it out.",
            field=f"points.{k}",
        )
    if sd_px is None or chi2.sf(squares / sd_px**2, left) < 0.01 or chi2.sf(less / sd_px**2, 2) * n > chance:
        return ""
    return (
        f"points.{k}{also} is read {off:.2g} px off the camera of the others, which fit within sd_px: it may be "
        "misread, or this is the effect of refraction and the lens"
    )


def refuse_no_camera(pixels: Float[np.ndarray, "n 2"], found: CameraFit, freedom: int, estimated: bool) -> None:
    """Raise InputError if the residuals are too large for any camera."""
    sd, spread = np.sqrt(found.squares / freedom), np.sqrt(np.sum(axes(pixels) ** 2))
    if not sd < _GROSS * spread:
        out = "" if estimated else ', or estimate a strong lens (lens="k1")'
        raise InputError(
            f"fit no camera: {sd:.3g} px of residuals for {spread:.3g} px of spread. More than one of them is probably "
            f"misread or in another order; check that points and pixels correspond{out}.",
            field="points",
        )


def smallest_found(found: CameraFit, freedom: int, chance: float) -> tuple[float, int]:
    """Smallest detectable misreading [px] of the least sensitive point, and its index; inf: none is detectable."""
    n, left = len(found.residual), freedom - 2
    if left < 1 or chance <= 0:
        return np.inf, 0
    bound = 2 * variance_ratio.isf(chance / n, 2, left) * found.squares / freedom
    kept = np.linalg.eigvalsh(np.eye(2) - found.leverage)[:, 0]
    k = int(np.argmin(kept))
    return float(np.sqrt(bound / kept[k])) if kept[k] > 1e-9 else np.inf, k


def _or(names: list[str]) -> str:
    return f" (or else {' or '.join(names)})" if names else ""


def _orders(residual: Float[np.ndarray, "n 2"]) -> Iterator[tuple[list[int], str]]:
    """Plausible orders of the pixels, with their descriptions."""
    n = len(residual)
    worst = sorted(np.argsort(-np.sum(residual**2, axis=1))[:_TRIED].tolist())
    for i, j in combinations(worst, 2):
        order = list(range(n))
        order[i], order[j] = j, i
        yield order, f"points.{i} and points.{j} are probably swapped"
    yield list(reversed(range(n))), "the pixels are probably in the opposite order"
    for k in range(1, n):
        start = f"the pixels are probably in another order: that of points.0 is pixels.{k}, and so on"
        yield [(i + k) % n for i in range(n)], start


def _rough(points: Float[np.ndarray, "n 3"], pixels: Float[np.ndarray, "n 2"]) -> float:
    """Sum of squared residuals of the linear camera, for normalised pixels and points."""
    h = np.column_stack([points, np.ones(len(points))]) @ linear(points, pixels)[0].T
    return float(np.sum((h[:, :2] / h[:, 2:] - pixels) ** 2))
