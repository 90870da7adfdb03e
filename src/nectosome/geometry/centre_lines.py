"""Centre lines of curved rods: from points to curvatures as polynomials, and how well these meet the points."""

from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from nectosome.units import InputError, show_quantity

MET = 1e-3  # of the length, within which a line is met where no order is given
MISSED = 0.02  # of the root mean square of curvatures, which may be missed where no order is given
MOST_ORDER = 12  # of polynomials that are tried then
_LONGER = 0.01  # of its length, by which a line may be longer or shorter than its rod
_STEPS = 200  # along the line, each turned by the curvature in its middle
_DIRECTIONS = 0.1  # of the length: the weight of directions in a fit
_MOST_TRIES = 30  # of a fit
_EVEN = 1e-9  # of the length: a line that leaves its plane by less lies in it
_MIDDLES = (np.arange(_STEPS) + 0.5) / _STEPS
_ENDS = np.arange(_STEPS + 1) / _STEPS


class FittedLine(NamedTuple):
    """Curvatures [1/m] as coefficients of Legendre polynomials, and how they meet the points."""

    bending_y: tuple[float, ...]
    bending_z: tuple[float, ...]
    distance: float  # largest one of a point from its place on the line [m]
    turned: float  # angle by which the points were turned to begin along x [rad]


def fit_line(points: Float[np.ndarray, "n 3"], length: float, order: int | None = None) -> FittedLine:
    r"""Return the curvatures of a rod of a length [m] whose centre line goes through points [m], from root to tip.

    The points are moved and turned so that the line begins at the root along x. Sections do not twist along it: with
    $R' = R\,\widehat{(0, \kappa_y, \kappa_z)}$ and $p' = R\,e_x$ (Bishop 1975), coefficients and first direction solve
    $\min \int |p - \hat p|^2 + (L/10)^2 |p' - \hat p'|^2\, ds$ (Levenberg and Marquardt) for the cubic spline $\hat p$
    through the points: directions keep polynomials from swinging between points. A line in the plane x-y or x-z bends
    in it alone. Without an order it is the lowest one that meets all points within a thousandth of the length.

    Raises InputError for fewer than four points, two at one place, a line of another length, and for one that no
    order meets.
    """
    at, line = _along(points, length)
    across = [k for k in (1, 2) if np.ptp(points[:, k]) > _EVEN * length] or [1]
    start, curvature = _transported(line, across)
    most, found = len(points) - 3, None
    for one in range(min(MOST_ORDER, most) + 1) if order is None else [min(order, most)]:
        rows, first = _fitted(line, start, curvature, across, one)
        drawn = _line(first, _curvatures(rows, across))
        off = float(np.linalg.norm(_at(drawn, at) - (points - points[0]) / length, axis=-1).max())
        found = rows, first, off
        if off <= MET:
            break
    assert found is not None
    rows, first, off = found
    if order is None and off > MET:
        shown, last = show_quantity(off * length, "length"), min(MOST_ORDER, most)
        way_out = "Draw it smoother or with more points, or give an order to take it as it is"
        raise InputError(f"polynomials of order {last} miss the line by {shown}. {way_out}.")
    known = {k: tuple((row / length).tolist()) for k, row in zip(across, rows, strict=True)}
    angle = float(np.arccos(np.clip(0.5 * (np.trace(first) - 1), -1, 1)))
    return FittedLine(known.get(2, ()), known.get(1, ()), float(off * length), angle)


def _along(points: Float[np.ndarray, "n 3"], length: float) -> tuple[np.ndarray, np.ndarray]:
    """Fractions of the line at which the points lie, and places at the ends of its steps, of a line of length 1."""
    from scipy.interpolate import CubicSpline

    if len(points) < 4:
        raise InputError(f"has {len(points)} points, and a curved line needs at least 4.")
    chord = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    if not np.all(np.diff(chord) > 0):
        k = int(np.flatnonzero(np.diff(chord) <= 0)[0])
        raise InputError(f"has two points at one place, {k + 1} and {k + 2}. Leave one out.")
    spline = CubicSpline(chord, points)
    fine = np.linspace(0.0, chord[-1], 20 * _STEPS + 1)
    speed = np.linalg.norm(spline(0.5 * (fine[1:] + fine[:-1]), 1), axis=1)
    arc = np.concatenate([[0.0], np.cumsum(speed * np.diff(fine))])
    if abs(arc[-1] / length - 1) > _LONGER:
        long, own = (show_quantity(x, "length") for x in (float(arc[-1]), length))
        raise InputError(f"is a line of {long}, and the rod is {own} long. Give the rod the length of its line.")
    line = spline(np.interp(_ENDS * arc[-1], arc, fine))
    return np.interp(chord, fine, arc) / arc[-1], (line - line[0]) / length


def _transported(line: Float[np.ndarray, "m 3"], across: list[int]) -> tuple[np.ndarray, np.ndarray]:
    """First rotation, and curvatures times length between steps, of frames that do not twist."""
    way = np.diff(line, axis=0)
    way /= np.linalg.norm(way, axis=1)[:, None]
    R = _least_turn(np.array([1.0, 0.0, 0.0]), way[0], 3 - across[0])
    first, found = R, []
    for before, after in pairwise(way):
        axis = np.cross(before, after)
        angle = np.arctan2(np.linalg.norm(axis), before @ after)
        turn = axis * (angle / max(float(np.linalg.norm(axis)), 1e-300))
        found.append(R.T @ turn * _STEPS)
        R = _rotations(turn) @ R
    return first, np.array(found)


def _least_turn(a: np.ndarray, b: np.ndarray, axis: int) -> np.ndarray:
    """The smallest rotation from direction a to b; of opposite ones by half a turn about one of the axes."""
    normal = np.cross(a, b)
    size = float(np.linalg.norm(normal))
    if size < 1e-12:
        return np.eye(3) if a @ b > 0 else _rotations(np.pi * np.eye(3)[axis])
    return _rotations(normal * (np.arctan2(size, a @ b) / size))


def _fitted(
    line: np.ndarray, start: np.ndarray, curvature: np.ndarray, across: list[int], order: int
) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients by axis, and the first rotation; of a line of length 1."""
    from scipy.optimize import least_squares

    axes, shape = [3 - k for k in across], (len(across), order + 1)
    inner = np.polynomial.legendre.legvander(2 * _ENDS[1:-1] - 1, order)
    guess = np.linalg.lstsq(inner, curvature[:, axes], rcond=None)[0].T

    def first(x: np.ndarray) -> np.ndarray:
        angles = np.zeros((*x.shape[:-1], 3))
        angles[..., axes] = x[..., guess.size :]
        return start @ _rotations(angles)

    def off(x: np.ndarray) -> np.ndarray:
        rows = x[..., : guess.size].reshape(*x.shape[:-1], *shape)
        away = _line(first(x), _curvatures(rows, across)) - line
        turned = _DIRECTIONS * _STEPS * np.diff(away, axis=-2)
        return np.concatenate([away, turned], axis=-2).reshape(*x.shape[:-1], -1)

    def slopes(x: np.ndarray) -> np.ndarray:
        h = 1e-6
        both = off(x + h * np.concatenate([np.eye(x.size), -np.eye(x.size)]))
        return ((both[: x.size] - both[x.size :]) / (2 * h)).T

    begin = np.concatenate([guess.ravel(), np.zeros(len(axes))])
    how: dict[str, Any] = {"jac": slopes, "method": "lm", "xtol": 1e-6, "ftol": 1e-6, "max_nfev": _MOST_TRIES}
    x = least_squares(off, begin, **how).x
    return x[: guess.size].reshape(shape), first(x)


def _curvatures(rows: Float[np.ndarray, "*b k n"], across: list[int]) -> Float[np.ndarray, "*b m 3"]:
    """Curvatures about all axes in the middles of steps, from coefficients about those across."""
    P = np.polynomial.legendre.legvander(2 * _MIDDLES - 1, rows.shape[-1] - 1)
    kappa = np.zeros((*rows.shape[:-2], _STEPS, 3))
    kappa[..., [3 - k for k in across]] = np.moveaxis(rows @ P.T, -1, -2)
    return kappa


def _at(line: Float[np.ndarray, "m 3"], at: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n 3"]:
    """Places at fractions of a line."""
    return np.stack([np.interp(at, _ENDS, row) for row in line.T], axis=-1)


def _line(R: Float[np.ndarray, "*b 3 3"], kappa: Float[np.ndarray, "*b m 3"]) -> Float[np.ndarray, "*b m+1 3"]:
    """Places along a line of length 1 with these curvatures, whose first frame is R."""
    half = _rotations(0.5 * kappa / _STEPS)
    place = np.zeros((*kappa.shape[:-2], 3))
    found = [place]
    for k in range(kappa.shape[-2]):
        middle = R @ half[..., k, :, :]
        place = place + middle[..., 0] / _STEPS
        found.append(place)
        R = middle @ half[..., k, :, :]
    return np.stack(found, axis=-2)


def _rotations(vector: Float[np.ndarray, "*b 3"]) -> Float[np.ndarray, "*b 3 3"]:
    """Rotations by vectors (Rodrigues)."""
    x, y, z = np.moveaxis(vector, -1, 0)
    angle = np.sqrt(x * x + y * y + z * z)[..., None, None]
    zero = np.zeros_like(x)
    rows = [[zero, -z, y], [z, zero, -x], [-y, x, zero]]
    K = np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
    return np.eye(3) + np.sinc(angle / np.pi) * K + 0.5 * np.sinc(0.5 * angle / np.pi) ** 2 * (K @ K)


def fit_curvature(
    at: Float[np.ndarray, "n"], values: Float[np.ndarray, "n"], order: int | None = None
) -> tuple[tuple[float, ...], float]:
    """Return Legendre coefficients of values at fractions of a rod, joined by straight lines, and what they miss.

    The least mean square decides, and beyond the first and the last place values stay. What is missed is the root mean
    square over that of the values; without an order it is the lowest one that misses a fiftieth at most. Raises
    InputError where none does.
    """
    g, w = np.polynomial.legendre.leggauss(24)
    ends = np.unique([0.0, *at, 1.0])
    s = (ends[:-1, None] + np.diff(ends)[:, None] * 0.5 * (g + 1)).ravel()
    w = (np.diff(ends)[:, None] * 0.5 * w).ravel()
    f = np.interp(s, at, values)
    size, off, c = np.sqrt(w @ f**2), 1.0, np.zeros(1)
    for one in range(MOST_ORDER + 1) if order is None else [order]:
        P = np.polynomial.legendre.legvander(2 * s - 1, one)
        c = (P.T @ (w * f)) * (2 * np.arange(one + 1) + 1)
        off = float(np.sqrt(w @ (f - P @ c) ** 2) / size) if size > 0 else 0.0
        if off <= MISSED:
            break
    if order is None and off > MISSED:
        why = f"polynomials of order {MOST_ORDER} miss {100 * off:.2g} % of it"
        raise InputError(f"{why}. Give a smoother table, or an order to take it as it is.")
    return tuple(c.tolist()), off
