r"""Added mass of a closed surface of any shape in potential flow, by panels.

The potential $\phi$ of the water around a body that moves with the velocity V along its normals obeys, at each point of
its surface, Green's identity with $G = -1/(4\pi r)$:

$$ \tfrac12 \phi + \int \phi\, \frac{\partial G}{\partial n}\, dA = \int G\, V\, dA, \qquad
   M_{kl} = -\rho \int \phi^{(k)}\, V^{(l)}\, dA $$

for each of the six motions. Even triangles of the surface (`even_triangles`) have one value of the potential each; the
equation holds on the mean of three points of each. Capytaine (Ancellin and Dias 2019) integrates over the panels, after
Hess and Smith (1964). A wall is the body's mirror image that moves along, a surface of the water that is left
no time to rise one that moves against it ($\phi = 0$ there).

The error of n panels goes as $n^{-1/2}$ at sharp edges and as $n^{-1}$ elsewhere. Result is what n and n/4 panels give
together if it went as $n^{-3/4}$. What this adds to the result of n panels is the error estimate: more than that is
left in neither case. It is a thousandth of the displaced mass at least, since along a slender hull large pressures
cancel: its added mass there is a few percent of that mass.

Of a body thinner than half a panel's side s the integrals over both sides nearly cancel, and neither result is near.
With its mean thickness $t = 2 V / A$ the error estimate is at least $0.4 (1 - 2 t / s)$ of the result.
"""

import hashlib
import logging
from functools import cache
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
from jaxtyping import Float

from nectosome.io.atomic import cache_folder, read_kept, write_kept
from nectosome.io.extras import is_installed, package
from nectosome.units import InputError

from . import even_triangles as even
from .touching import any_touch
from .triangles import Triangles, area_vectors, separate

_FEWEST, _MOST = 100, 5000  # panels: with fewer the error is not known, with more the matrices take over 1 GB
_POINTS = np.array([[4, 1, 1], [1, 4, 1], [1, 1, 4]]) / 6  # of each panel, from its corners (Strang and Fix)
_GAIN = 1 / (4**0.75 - 1)  # of the difference of both results, added to the better one
_COINCIDE = "bodies touch or overlap, or faces lie on one another. Unite the bodies where they were drawn."
_LEAST = 1e-3  # error estimate, over the displaced mass and its moments of inertia
_THIN = 0.5  # mean thickness over a panel's side, below which results are less exact
_LOST = 0.4  # error estimate of a body without thickness, over the result


class PanelAddedMass(NamedTuple):
    """Added mass about a point, over the water's density: rotation before translation, as twists are."""

    matrix: Float[np.ndarray, "6 6"]  # [m5 m4; m4 m3], symmetric
    error: Float[np.ndarray, "6 6"]  # about how far off each number may be, in its unit


class Boundary(NamedTuple):
    """A plane that ends the water on the side of its normal."""

    point: tuple[float, float, float]  # on it, in the axes of the surface [m]
    normal: tuple[float, float, float]  # out of the water, of any length
    kind: Literal["wall", "surface"]  # water cannot pass, or its surface is left no time to rise


def panel_added_mass(
    triangles: Triangles,
    about: tuple[float, float, float] = (0.0, 0.0, 0.0),
    *,
    panels: int = 1000,
    boundary: Boundary | None = None,
) -> PanelAddedMass:
    """Added mass of a closed surface about a point in its axes [m], in unbounded water or beside one plane.

    `panels` is the number of the finer ones, 100 to 5000. A floor, and a surface that stays level under slow motions,
    are a wall; a surface above fast motions (far above $\\sqrt{g/l}$ for a body of length l) is the other limit.
    Results are kept in the user's cache.

    Raises InputError without the extra `mesh`, for another number of panels, for triangles that enclose no volume, face
    inwards or lie on one another, and for a plane that they reach.
    """
    _check(triangles, panels, boundary)
    # of a volume of 1 about the origin, since the package knows lengths by numbers of its own
    middle, length = triangles.vertices.mean(axis=0), np.cbrt(triangles.solid.size)
    triangles = triangles._replace(vertices=(triangles.vertices - middle) / length)
    if boundary is not None:
        boundary = boundary._replace(point=tuple(((np.asarray(boundary.point) - middle) / length).tolist()))
    powers = length ** (np.add.outer([1, 1, 1, 0, 0, 0], [1, 1, 1, 0, 0, 0]) + 3)
    matrix, error = powers * _kept(triangles, panels, boundary)
    shift = _shift(np.asarray(about) - middle)
    return PanelAddedMass(shift.T @ matrix @ shift, np.abs(shift.T) @ error @ np.abs(shift))


def panels_for(volume: float, area: float) -> int:
    """How many panels a body of this volume [m3] and surface [m2] needs, so that it is no thinner than half of one."""
    return int(np.ceil(4 / np.sqrt(3) * area * (_THIN * area / (2 * volume)) ** 2))


def _check(triangles: Triangles, panels: int, boundary: Boundary | None) -> None:
    if not _FEWEST <= panels <= _MOST:
        raise InputError(f"{panels} panels: {_FEWEST} to {_MOST} are possible.")
    if not triangles.solid.size > 0:
        raise InputError("the triangles face inwards, or enclose no volume. Turn their normals outwards.")
    if any_touch(separate(triangles)):
        raise InputError(_COINCIDE)
    if boundary is not None and (beside := _beside(triangles.vertices, boundary).max()) >= 0:
        raise InputError(f"the body reaches {beside:.3g} m through the {boundary.kind}. Move one away from the other.")


def _beside(points: Float[np.ndarray, "n 3"], boundary: Boundary) -> Float[np.ndarray, "n"]:
    """How far points are beyond a plane [m]."""
    return (points - np.asarray(boundary.point)) @ np.asarray(boundary.normal) / np.linalg.norm(boundary.normal)


def _shift(to: Float[np.ndarray, "3"]) -> Float[np.ndarray, "6 6"]:
    """Twist at the origin of one at the point `to`, with the same axes."""
    x, y, z = to
    return np.block([[np.eye(3), np.zeros((3, 3))], [np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]), np.eye(3)]])


def _kept(triangles: Triangles, panels: int, boundary: Boundary | None) -> Float[np.ndarray, "2 6 6"]:
    """Matrix and error about the origin, from the cache if they are in it."""
    if not is_installed("capytaine"):
        _capytaine()  # says what to install
    folder = cache_folder()
    digest = hashlib.sha256(f"{panels} {boundary} {version('capytaine')}".encode())
    for part in (triangles.vertices, triangles.faces):
        digest.update(f"{part.shape}".encode() + np.ascontiguousarray(part, part.dtype.newbyteorder("<")).tobytes())
    for source in (__file__, even.__file__):
        digest.update(Path(source).read_bytes())
    file = folder and folder / "added_mass" / digest.hexdigest()
    raw = read_kept(file) if file else None
    if raw is not None:
        return np.frombuffer(raw, "<f8").reshape(2, 6, 6)
    _capytaine()
    few, many = (_computed(even.even_triangles(triangles, n), boundary) for n in (panels // 4, panels))
    gain = _GAIN * (many - few)
    own = triangles.solid
    least = np.diag(_LEAST * np.concatenate([np.diag(own.inertia), np.full(3, own.size)]))
    result = _no_less_than_nothing(many + gain)
    thin = np.sqrt(panels / panels_for(own.size, triangles.surface.size))  # thickness over half of a panel's side
    lost = _LOST * max(1 - thin, 0.0) * np.abs(result)
    both = np.stack([result, np.maximum(np.maximum(np.abs(gain), least), lost)])
    if file:
        write_kept(file, both.astype("<f8").tobytes())
    return both


def _no_less_than_nothing(matrix: Float[np.ndarray, "6 6"]) -> Float[np.ndarray, "6 6"]:
    """The nearest matrix by which no motion has a negative energy: a round body that turns about its axis has none."""
    values, vectors = np.linalg.eigh(matrix)
    return (vectors * np.maximum(values, 0.0)) @ vectors.T


def _computed(panels: Triangles, boundary: Boundary | None) -> Float[np.ndarray, "6 6"]:
    """Added mass about the origin by these panels. Raises InputError where there is none, as for two at one place."""
    greens = import_module("capytaine.green_functions.abstract_green_function")
    try:
        matrix = _added_mass(panels, boundary)
    except (greens.GreenFunctionEvaluationError, np.linalg.LinAlgError):
        matrix = np.full((6, 6), np.nan)
    if not np.isfinite(matrix).all():
        raise InputError(_COINCIDE)
    return matrix


def _added_mass(panels: Triangles, boundary: Boundary | None) -> Float[np.ndarray, "6 6"]:
    """Added mass about the origin by these panels."""
    corners, along = panels.corners, area_vectors(panels.corners)
    areas = np.linalg.norm(along, axis=1)
    normals = along / areas[:, None]
    motions = np.concatenate([np.cross(corners.mean(axis=1), normals), normals], axis=1)
    images = [(1.0, _mesh(panels))]
    if boundary is not None:
        images.append((1.0 if boundary.kind == "wall" else -1.0, _mesh(_mirrored(panels, boundary))))
    left, right = 0.5 * np.eye(len(areas)), np.zeros((len(areas), 6))
    for weights in _POINTS:
        points = weights @ corners
        for sign, image in images:
            potential, double = _green().evaluate_rankine_only(
                points, image, adjoint_double_layer=False, diagonal_term_in_double_layer=False
            )
            left += sign / len(_POINTS) * double
            right += sign / len(_POINTS) * (potential @ motions)
    added = -(motions * areas[:, None]).T @ np.linalg.solve(left, right)
    return 0.5 * (added + added.T)


def _mesh(panels: Triangles) -> Any:
    return _capytaine().Mesh(*panels, auto_clean=False, auto_check=False)


def _mirrored(panels: Triangles, boundary: Boundary) -> Triangles:
    if _beside(panels.vertices, boundary).max() >= 0:
        raise InputError(f"the body is nearer to the {boundary.kind} than its panels are exact. Use more panels.")
    normal = np.asarray(boundary.normal) / np.linalg.norm(boundary.normal)
    vertices = panels.vertices - 2 * _beside(panels.vertices, boundary)[:, None] * normal
    return Triangles(vertices, panels.faces[:, ::-1])


@cache
def _green() -> Any:
    """Capytaine's integrals over panels, without its tables for waves."""
    capytaine = _capytaine()
    logging.getLogger("capytaine").setLevel(logging.ERROR)  # it would tell of the tables
    return capytaine.Delhommeau(tabulation_nr=0, tabulation_nz=0, tabulation_cache_dir=None)


@cache
def _capytaine() -> Any:
    """The package; it sets up the logs of the whole program where it is imported, which is undone."""
    handlers, level = logging.root.handlers[:], logging.root.level
    capytaine = package("capytaine", "mesh")
    logging.root.handlers[:] = handlers
    logging.root.setLevel(level)
    return capytaine
