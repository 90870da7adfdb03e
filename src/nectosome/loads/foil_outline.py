"""Planforms of foils on plates by their outlines: span, chords and leading edge are those of the plate."""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core.described import number
from nectosome.description.foil_planform import FoilLoad
from nectosome.description.plates import PlateShape
from nectosome.mechanism.shapes.plates import outline_moments, outline_range, outline_widths

from .places import Carrier


class OutlinePlanform(NamedTuple):
    """A planform in sections across the span, places from the centre of the plate's area."""

    span: Float[Array, ""]  # [m]
    offset: Float[Array, ""]  # of its middle, along it [m]
    mean_chord: Float[Array, ""]  # [m]
    ratio: Float[Array, ""]  # aspect ratio of lift and added mass
    chord: Float[Array, "k"]  # [m]
    ahead: Float[Array, "k"]  # places of the mid-chords along `ahead` [m]
    along: Float[Array, "k"]  # the same along the span [m]


def outline_planform(described: FoilLoad, part: Carrier, s: Float[np.ndarray, "k"]) -> OutlinePlanform:
    """Planform of a foil without a chord of its own, at fractions s of the span: that of the plate that it acts on."""
    shape = part.limb.shape if part.limb.kind == "rigid" else None
    assert isinstance(shape, PlateShape)
    points = jnp.asarray(shape.outline, float)
    moments = outline_moments(points)
    of_span, of_chord = shape.plane.index(described.span_along), shape.plane.index(described.ahead[-1])
    turned = (points - moments.centre)[:, np.array([of_span, of_chord])]
    turned = turned * np.array([1.0, -1.0 if described.ahead[0] == "-" else 1.0])
    start, end = outline_range(turned)
    span = end - start
    along = start + span * s
    chord, ahead = outline_widths(turned, along)
    ratio = span**2 / moments.area if described.aspect_ratio is None else number(described.aspect_ratio)
    return OutlinePlanform(span, 0.5 * (start + end), moments.area / span, ratio, chord, ahead, along)
