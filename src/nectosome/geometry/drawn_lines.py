"""Lines of drawings, before they are joined into an outline."""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

MOST_LINES = 2000  # of a drawing: pieces of which some make up the outline
MOST_PLACES = 10_000  # of all its lines, from which on no outline is looked for


class DrawnLine(NamedTuple):
    """A line of a drawing, open or closed: its points in the drawing's own units, y up, for a tolerance in these."""

    names: tuple[str, ...]  # its label and its id, or its layer; the first one is shown
    points: Callable[[float], Float[np.ndarray, "k 2"]]


class Drawing(NamedTuple):
    """Lines of a drawing, and what one of its units is [m], where it says so."""

    lines: list[DrawnLine]
    unit: float | None
    named_by: str  # how lines are told apart: id, layer
    down: bool = False  # whether its own y runs down


def straightened(bend: float, tolerance: float, coarse: int = 8) -> int:
    """Return into how many straight lines a curve is cut that leaves a single one by `bend` at most, a parabola."""
    return coarse if math.isinf(tolerance) else max(1, min(math.ceil(math.sqrt(bend / tolerance)), MOST_PLACES))
