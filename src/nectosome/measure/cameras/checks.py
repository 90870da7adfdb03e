"""Whether known points can tell a camera, before anything is computed; each refusal says the way out."""

import numpy as np
from jaxtyping import Float
from scipy.spatial.distance import pdist

from nectosome.io.errors import InputError

FLAT = 0.02  # points that lie nearer to a plane or a line, of their spread, tell too little across it [-]


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
