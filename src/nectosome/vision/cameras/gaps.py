"""Interpolation over gaps; filled values are marked, all others unchanged."""

from collections.abc import Iterator
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation, Slerp

How = Literal["linear", "cubic"]


def fill(
    time: Float[np.ndarray, "t"], values: Float[np.ndarray, "t *shape"], longest: float, how: How = "linear"
) -> tuple[Float[np.ndarray, "t *shape"], Bool[np.ndarray, "t *shape"]]:
    """Fill gaps (NaN) whose neighbours are at most `longest` [s] apart; the mask is True for filled values.

    Each column is filled from its own values, never beyond the first or last. `linear`, or `cubic`: a not-a-knot spline
    through the values between longer gaps, which amplifies noise near the gap. Angles must be unwrapped; for rotations
    see `fill_rotations`. Raises ValueError for times that do not increase, infinite values, and a `longest` that is not
    positive.
    """
    if how not in ("linear", "cubic"):
        raise ValueError(f'fill: how is "{how}"; "linear" or "cubic" is expected.')
    time, out = _checked("fill", time, values, longest)
    columns = out.reshape(len(time), -1)
    filled = np.zeros(columns.shape, bool)
    for k in range(columns.shape[1]):
        known_at = ~np.isnan(columns[:, k])
        for known, missing in _pieces(time, known_at, longest):
            x, y = time[known], columns[known, k]
            at = time[missing]
            columns[missing, k] = CubicSpline(x, y)(at) if how == "cubic" else np.interp(at, x, y)
            filled[missing, k] = True
    return columns.reshape(out.shape), filled.reshape(out.shape)


def fill_rotations(
    time: Float[np.ndarray, "t"], rotations: Float[np.ndarray, "t 3 3"], longest: float
) -> tuple[Float[np.ndarray, "t 3 3"], Bool[np.ndarray, "t"]]:
    """Fill gaps of rotations as `fill`, with a constant rate about one axis (slerp, Shoemake 1985).

    A rotation with a NaN is missing. A rotation of more than half a turn in a gap is filled the short way. Raises
    ValueError as `fill`, and for matrices that are not rotations.
    """
    time, out = _checked("fill_rotations", time, rotations, longest)
    if out.shape[1:] != (3, 3):
        raise ValueError(f"fill_rotations: rotations are {out.shape}, and [t, 3, 3] is expected.")
    known_at = ~np.any(np.isnan(out), axis=(1, 2))
    known = out[known_at]
    off = np.abs(known @ known.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2), initial=0)
    bad = np.flatnonzero((off > 1e-6) | (np.linalg.det(known) < 0))
    if len(bad):
        raise ValueError(f"fill_rotations: {time[known_at][bad[0]]:.6g} s: not a rotation (R R^T = 1, det R = 1).")
    filled = np.zeros(len(time), bool)
    for kept, missing in _pieces(time, known_at, longest):
        out[missing] = Slerp(time[kept], Rotation.from_matrix(out[kept]))(time[missing]).as_matrix()
        filled[missing] = True
    return out, filled


def _pieces(
    time: Float[np.ndarray, "t"], known_at: Bool[np.ndarray, "t"], longest: float
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Indices of known values, and of the missing ones between them, for each stretch with short gaps only."""
    known = np.flatnonzero(known_at)
    short = (np.diff(known) == 1) | (np.diff(time[known]) <= longest * (1 + 1e-9))
    for part in np.split(known, np.flatnonzero(~short) + 1):
        if len(part) > 1 and part[-1] - part[0] >= len(part):
            missing = np.arange(part[0], part[-1] + 1)
            yield part, missing[~known_at[missing]]


def _checked(
    function: str, time: Float[np.ndarray, "t"], values: Float[np.ndarray, "t *shape"], longest: float
) -> tuple[Float[np.ndarray, "t"], Float[np.ndarray, "t *shape"]]:
    """Times, and a copy of the values."""
    time, out = np.asarray(time, float), np.array(values, float)
    if time.ndim != 1 or out.shape[:1] != time.shape:
        raise ValueError(f"{function}: times of shape {time.shape} do not match values of shape {out.shape}.")
    bad = np.flatnonzero(~(np.diff(time) > 0))
    if len(bad):
        raise ValueError(
            f"{function}: time goes from {time[bad[0]]:.9g} s to {time[bad[0] + 1]:.9g} s; it must increase."
        )
    if np.isinf(out).any():
        raise ValueError(f"{function}: a value is infinite; missing values must be NaN.")
    if not longest > 0:
        raise ValueError(f"{function}: longest is {longest:g} s; it must be positive.")
    return time, out
