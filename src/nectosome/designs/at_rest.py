"""Quantities of how a robot floats or hangs at rest, weight and buoyancy alone, each differentiable."""

from collections.abc import Callable
from functools import cached_property
from typing import NamedTuple

import numpy as np
from jaxtyping import Array, Float

from nectosome.mechanism import Robot
from nectosome.solve.floating import Floating, float_freely, smaller_arm

HEEL = float(np.radians(30.0))  # of the righting moment


class AtRest:
    """A robot, and how it lies in the water with its joints as at the start."""

    robot: Robot

    @cached_property
    def lies(self) -> Floating:
        """How it floats, or hangs under water; worked out where it is asked for, and once."""
        return float_freely(self.robot)


class RestQuantity(NamedTuple):
    """Dimension, which is better, what it is, and how it follows."""

    dimension: str
    best: str
    about: str
    of: Callable[[AtRest], Float[Array, ""]]


def _righting_moment(s: AtRest) -> Float[Array, ""]:
    """To the side where it is smaller; its derivatives jump where both are the same."""
    return s.lies.weight * smaller_arm(s.robot, s.lies, HEEL)


AT_REST = {
    "net_weight": RestQuantity("force", "low", "weight less the buoyancy of all of it", lambda s: s.lies.net_weight),
    "draught": RestQuantity("length", "low", "depth of the lowest point of what floats", lambda s: s.lies.draught),
    "trim": RestQuantity("angle", "low", "angle of the bow upwards, at rest in the water", lambda s: s.lies.trim),
    "heel": RestQuantity("angle", "low", "angle to starboard, at rest in the water", lambda s: s.lies.heel),
    "metacentric_height": RestQuantity(
        "length",
        "high",
        "moment that turns it back from a small heel, over weight and angle",
        lambda s: s.lies.metacentric_heights[0],
    ),
    "righting_moment": RestQuantity(
        "torque",
        "high",
        "moment that turns it back from a heel of 30 deg, to starboard or to port, whichever is smaller",
        _righting_moment,
    ),
}
"""Quantities by their names."""
