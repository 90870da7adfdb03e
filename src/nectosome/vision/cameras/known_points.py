"""Which of the known points was misread, or swapped with another, as far as the equations that are over can tell."""

from collections.abc import Callable, Iterator
from itertools import combinations

import numpy as np
from jaxtyping import Float
from scipy.spatial.distance import pdist
from scipy.stats import chi2
from scipy.stats import f as variance_ratio

from nectosome.units import InputError

from .least_squares import CameraFit, linear, moved, normaliser

FLAT = 0.02  # points that lie nearer to a plane or a line, of their spread, tell too little across it [-]
Refit = Callable[[np.ndarray, np.ndarray], CameraFit]  # of points and pixels
_READ = 0.5  # px: a reading that is nearer to where it should be was not misread
_GROSS = 0.05  # residuals of more of the points' spread in the picture are those of no camera [-]
_ALIKE = 0.05  # chance at which one of two explanations fits better by as much [-]
_REFINED = 8  # of what is tried, the best by the linear camera are fitted
_TRIED = 30  # points among which all pairs are swapped; of more, as many that are furthest off


def refuse_few(n: int, unknowns: int) -> None:
    """Raise InputError where there is no equation more than unknowns."""
    least = unknowns // 2 + 1
    if n < least:
        what = "the eleven numbers of a camera" if unknowns == 11 else f"a camera and its lens ({unknowns} numbers)"
        out = "" if unknowns == 11 else ", or say what the lens is"
        raise InputError(
            f"{n} points give {2 * n} equations, and {what} need {least} points, better eight or more: add "
            f"points{out}.",
            field="points",
        )


def refuse_numbers(
    points: Float[np.ndarray, "n 3"], pixels: Float[np.ndarray, "n 2"], size: tuple[int, int] | None
) -> None:
    """Raise InputError for what is no finite number, and for pixels outside the picture."""
    for name, values in (("points", points), ("pixels", pixels)):
        for k in np.flatnonzero(~np.isfinite(values).all(axis=1)):
            raise InputError(f"{_row(values[k])} has no number: leave the point out.", field=f"{name}.{k}")
    if size is not None:
        for k in np.flatnonzero(((pixels < -0.5) | (pixels > np.array(size) - 0.5)).any(axis=1)):
            raise InputError(
                f"{_row(pixels[k])} lies outside the picture of {size[0]} x {size[1]} pixels: u is counted from the "
                "left, v from the top.",
                field=f"pixels.{k}",
            )


def refuse_places(points: Float[np.ndarray, "n 3"], pixels: Float[np.ndarray, "n 2"]) -> None:
    """Raise InputError for points that are the same, on a line, or in a plane, all or all but one."""
    seen = axes(pixels)
    if seen[0] < 1:
        raise InputError(
            f"lie within {seen[0]:.2g} px (rms) of their middle: no camera can be told from that. Numbers of pixels "
            "are expected, not parts of the picture's size.",
            field="pixels",
        )
    if seen[1] < FLAT * seen[0]:
        raise InputError(
            f"lie on a line, {seen[1]:.2g} px (rms) off it: no camera sees points that fill a space so. Look at which "
            "numbers are u and v.",
            field="pixels",
        )
    spread = axes(points)
    refuse_same(points, "points")
    if spread[1] < FLAT * spread[0]:
        raise InputError(
            f"lie on a line, {_far(spread[1], spread[0])}: they tell nothing across it. Choose points all around the "
            "workspace.",
            field="points",
        )
    out = "From a plane no camera follows: add points that are clearly off it, best by half of their spread."
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
    """Raise InputError where two points are the same."""
    near = pdist(points) <= 1e-9 * np.abs(points).max()
    if near.any():
        i, j = (int(index[np.argmax(near)]) for index in np.triu_indices(len(points), 1))
        raise InputError(f"is the same place as {name}.{i}: leave one of them out.", field=f"{name}.{j}")


def axes(points: Float[np.ndarray, "n d"]) -> Float[np.ndarray, "d"]:
    """How far points lie from their middle along their main axes, root mean square, the longest first."""
    left = points - points.mean(axis=0)
    out = np.zeros(points.shape[1])
    singular = np.linalg.svd(left, compute_uv=False) / np.sqrt(len(points))
    out[: len(singular)] = singular
    return out


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
    """Raise InputError where another order of the pixels fits so much better that it is no chance (variance ratio).

    Markers of a regular shape, such as the corners of a box, leave several explanations that are as good.
    """
    if np.sqrt(found.squares / freedom) < _READ:
        return
    tried = list(_orders(found.residual))
    S, T = normaliser(points), normaliser(pixels)
    X, seen = moved(S, points), moved(T, pixels)
    rough = [_rough(X, seen[order]) for order, _ in tried]
    others: dict[str, float] = {}
    for k in np.argsort(rough)[:_REFINED]:
        order, words = tried[k]
        other = refit(points, pixels[order])
        if (other.camera.depth(points) > 0).all():  # what fits as in a mirror, or turned inside out, is no explanation
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
    """Raise InputError for a point without which the others fit so much better that it is no chance; return a doubt.

    The test is that of the externally studentised residual (Cook & Weisberg 1982, section 2.2.1), with two coordinates
    a point: F = (RSS - RSS_i) / 2 over RSS_i / (freedom - 2), times the number of points; RSS_i by fitting anew. Points
    that explain it about as well are named too: with few points several often do. With `sd_px` (RSS - RSS_i) / sd^2 by
    chi squared of 2, where the others agree with sd_px, tells smaller ones; it is a doubt and no refusal, since what
    refraction leaves looks alike.
    """
    n, left = len(points), freedom - 2
    if left < 1:
        return ""
    without = _without(points, pixels, found, refit)
    k = min(without, key=lambda i: without[i].squares)
    squares = max(without[k].squares, 1e-300)
    off = float(np.linalg.norm(pixels[k] - without[k].camera.projected(points[[k]])[0]))
    less = max(found.squares - squares, 0.0)
    alike = squares * float(variance_ratio.isf(_ALIKE, left, left))
    also = _or([f"points.{i}" for i, other in without.items() if i != k and other.squares <= alike])
    if off > _READ and float(variance_ratio.sf(less / 2 / (squares / left), 2, left)) * n < chance:
        raise InputError(
            f"is read {off:.3g} px from where the other {n - 1} points put it; they fit to "
            f"{np.sqrt(squares / (n - 1)):.2g} px (rms). It is probably misread{also}: look at its pixel, at its "
            "place and at their signs, or leave it out.",
            field=f"points.{k}",
        )
    if sd_px is None or chi2.sf(squares / sd_px**2, left) < 0.01 or chi2.sf(less / sd_px**2, 2) * n > chance:
        return ""
    return (
        f"points.{k}{also} is read {off:.2g} px from where the others put it, and they fit within sd_px: it may be "
        "misread, or refraction and the lens leave as much"
    )


def _without(
    points: Float[np.ndarray, "n 3"], pixels: Float[np.ndarray, "n 2"], found: CameraFit, refit: Refit
) -> dict[int, CameraFit]:
    """Fits without the points that most probably make them better; the others are in no plane (`refuse_places`)."""
    gain = np.einsum("ni,nij,nj->n", found.residual, _inverse(found.leverage), found.residual)
    fits = {}
    for k in np.argsort(-gain)[:_REFINED]:
        others = np.delete(np.arange(len(points)), k)
        fits[int(k)] = refit(points[others], pixels[others])
    return fits


def refuse_no_camera(pixels: Float[np.ndarray, "n 2"], found: CameraFit, freedom: int, estimated: bool) -> None:
    """Raise InputError where the residuals are those of no camera."""
    sd, spread = np.sqrt(found.squares / freedom), np.sqrt(np.sum(axes(pixels) ** 2))
    if not sd < _GROSS * spread:
        out = "" if estimated else ', or that a strong lens bends the picture (lens="k1")'
        raise InputError(
            f"fit no camera: {sd:.3g} px are left of {spread:.3g} px of spread. More than one of them is probably "
            f"misread or in another order; see that points and pixels belong together{out}.",
            field="points",
        )


def smallest_found(found: CameraFit, freedom: int, chance: float) -> tuple[float, int]:
    """Misreading [px] that would be refused, at the point where it shows least, and which point; inf: none would."""
    n, left = len(found.residual), freedom - 2
    if left < 1 or chance <= 0:
        return np.inf, 0
    bound = 2 * variance_ratio.isf(chance / n, 2, left) * found.squares / freedom
    kept = np.linalg.eigvalsh(np.eye(2) - found.leverage)[:, 0]
    k = int(np.argmin(kept))
    return float(np.sqrt(bound / kept[k])) if kept[k] > 1e-9 else np.inf, k


def _or(names: list[str]) -> str:
    return f" (or else {' or '.join(names)})" if names else ""


def _inverse(leverage: Float[np.ndarray, "n 2 2"]) -> Float[np.ndarray, "n 2 2"]:
    """(1 - H)^-1, 0 along directions in which a point is needed to determine the camera at all."""
    return np.linalg.pinv(np.eye(2) - leverage, rcond=1e-9, hermitian=True)


def _orders(residual: Float[np.ndarray, "n 2"]) -> Iterator[tuple[list[int], str]]:
    """Orders in which the pixels may have been meant, and what that would be called."""
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
    """Sum of the squares of the linear camera's residuals; pixels and points are normalised."""
    h = np.column_stack([points, np.ones(len(points))]) @ linear(points, pixels)[0].T
    return float(np.sum((h[:, :2] / h[:, 2:] - pixels) ** 2))
