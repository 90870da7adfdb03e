"""Gaps filled where that is asked for, and marked; nothing else is touched."""

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
    """Fill gaps (NaN) of which the values beside them are at most `longest` [s] apart; the mask is True where filled.

    Every column on its own, from its own values; never before the first or after the last. `linear`, or `cubic`: a
    spline with continuous second derivatives (not-a-knot) through the values between gaps that are too long, which
    carries the noise of its neighbours' slopes into the gap. Angles must be unwrapped; rotations have `fill_rotations`.
    Raises ValueError for times that do not increase, infinite values, and a `longest` that is not above 0.
    """
    if how not in ("linear", "cubic"):
        raise ValueError(f'fill: how is "{how}"; "linear" or "cubic" is expected.')
    time, out = _checked("fill", time, values, longest)
    columns = out.reshape(len(time), -1)
    filled = np.zeros(columns.shape, bool)
    for k in range(columns.shape[1]):
        there = ~np.isnan(columns[:, k])
        for known, missing in _pieces(time, there, longest):
            x, y = time[known], columns[known, k]
            smooth = how == "cubic"
            columns[missing, k] = CubicSpline(x, y)(time[missing]) if smooth else np.interp(time[missing], x, y)
            filled[missing, k] = True
    return columns.reshape(out.shape), filled.reshape(out.shape)


def fill_rotations(
    time: Float[np.ndarray, "t"], rotations: Float[np.ndarray, "t 3 3"], longest: float
) -> tuple[Float[np.ndarray, "t 3 3"], Bool[np.ndarray, "t"]]:
    """Fill gaps of rotations as `fill` does, turning at a constant rate about one axis (Shoemake 1985, slerp).

    A rotation with a NaN in it is missing. A body that turned by more than half a turn in a gap is taken the short way.
    Raises ValueError as `fill`, and for matrices that are no rotations.
    """
    time, out = _checked("fill_rotations", time, rotations, longest)
    if out.shape[1:] != (3, 3):
        raise ValueError(f"fill_rotations: rotations are {out.shape}, and [t, 3, 3] is expected.")
    there = ~np.any(np.isnan(out), axis=(1, 2))
    known = out[there]
    off = np.abs(known @ known.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2), initial=0)
    bad = np.flatnonzero((off > 1e-6) | (np.linalg.det(known) < 0))
    if len(bad):
        raise ValueError(f"fill_rotations: at {time[there][bad[0]]:.6g} s there is no rotation (R R^T = 1, det R = 1).")
    filled = np.zeros(len(time), bool)
    for kept, missing in _pieces(time, there, longest):
        out[missing] = Slerp(time[kept], Rotation.from_matrix(out[kept]))(time[missing]).as_matrix()
        filled[missing] = True
    return out, filled


def _pieces(
    time: Float[np.ndarray, "t"], there: Bool[np.ndarray, "t"], longest: float
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Indices of values, and of what is missing between them, of stretches whose gaps are all short enough."""
    known = np.flatnonzero(there)
    short = (np.diff(known) == 1) | (np.diff(time[known]) <= longest * (1 + 1e-9))
    for part in np.split(known, np.flatnonzero(~short) + 1):
        if len(part) > 1 and part[-1] - part[0] >= len(part):
            missing = np.arange(part[0], part[-1] + 1)
            yield part, missing[~there[missing]]


def _checked(
    function: str, time: Float[np.ndarray, "t"], values: Float[np.ndarray, "t *shape"], longest: float
) -> tuple[Float[np.ndarray, "t"], Float[np.ndarray, "t *shape"]]:
    """Times, and a copy of the values."""
    time, out = np.asarray(time, float), np.array(values, float)
    if time.ndim != 1 or out.shape[:1] != time.shape:
        raise ValueError(f"{function}: {time.shape} times do not go with values of shape {out.shape}.")
    bad = np.flatnonzero(~(np.diff(time) > 0))
    if len(bad):
        raise ValueError(
            f"{function}: time goes from {time[bad[0]]:.9g} s to {time[bad[0] + 1]:.9g} s; it must increase."
        )
    if np.isinf(out).any():
        raise ValueError(f"{function}: a value is infinite; what is missing must be NaN.")
    if not longest > 0:
        raise ValueError(f"{function}: longest is {longest:g} s; it must be above 0.")
    return time, out
