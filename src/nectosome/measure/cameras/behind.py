"""A camera in the air from known points in the water, behind a pane whose place is known."""

from dataclasses import replace
from typing import Any

import numpy as np
from jaxtyping import Float

from nectosome.io.errors import InputError

from .camera import Camera
from .dlt import calibrate
from .glass import Glass

_ROUNDS = 200
_SETTLED = 1e-10  # of the distance from the points


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
