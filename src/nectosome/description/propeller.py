"""Propellers, free or in a duct, by their open-water lines."""

import math
from typing import Literal, Self

from pydantic import model_validator

from nectosome.description import fields
from nectosome.description.fields import Axis
from nectosome.description.loads import RIGID, LoadDescription
from nectosome.description.mirror import Mirror, along
from nectosome.io.schema.described import wrong

Hand = Literal["right", "left"]


def other_hand(hand: Hand) -> Hand:
    """Return the hand of the image of a propeller."""
    return "left" if hand == "right" else "right"


class ThrusterLoad(LoadDescription):
    """A propeller, free or in a duct, on the part that turns with it: the joint of that part drives it."""

    kind: Literal["thruster"]
    diameter: fields.Length
    """Diameter of the propeller."""
    thrust: fields.PositiveNumber
    """Thrust coefficient in water at rest, by density, speed in turns per second squared and diameter to the fourth."""
    thrust_slope: fields.PositiveNumber
    """Fall of the thrust coefficient with the advance ratio, inflow over speed and diameter."""
    torque: fields.PositiveNumber
    """Torque coefficient in water at rest, by density, speed squared and diameter to the fifth. Tables often print ten
    times of it."""
    torque_slope: fields.NonNegativeNumber
    """Fall of the torque coefficient with the advance ratio."""
    backward_thrust: fields.PositiveNumber | None = None
    """Thrust coefficient in water at rest of one that turns backward; without it that of one that turns forward."""
    backward_torque: fields.PositiveNumber | None = None
    """Torque coefficient in water at rest of one that turns backward; without it that of one that turns forward."""
    direction: Axis = (1.0, 0.0, 0.0)
    """Direction of the thrust as it turns forward, and its axis, through the centre of the part's shape. Direction in
    the part's own frame: x, y, z or three numbers."""
    hand: Hand = "right"
    """Hand of the propeller: a right one pushes along the direction as it turns about it like a right-handed screw."""
    on = RIGID
    mirror = Mirror(direction=along, hand=other_hand)

    @model_validator(mode="after")
    def _takes_more_than_it_gives(self) -> Self:
        backward = "backward_thrust" if self.backward_torque is None else "backward_torque"
        ways = (self.thrust, self.torque), (self.backward_thrust, self.backward_torque)
        for field, (given, asked) in zip(("torque", backward), ways, strict=True):
            thrust, torque = given or self.thrust, asked or self.torque
            gains = thrust + 2 * math.pi * self.torque_slope
            least = gains**2 / (8 * math.pi * self.thrust_slope)
            if torque < least:
                why = f"at an advance ratio of {gains / (2 * self.thrust_slope):.3g} the thrust gives more power"
                torque_of = "torque" if field == "torque" else "backward torque"
                raise wrong(
                    field,
                    f"{why} than the shaft takes. With these lines a {torque_of} of {least:.4g} or more is needed. "
                    "Check all coefficients.",
                )
        return self
