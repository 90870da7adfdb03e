"""The quantities of robot files, each with its dimension and its range."""

import math
from typing import Annotated

from nectosome.io.schema.quantity import Quantity


def _positive(dimension: str) -> Quantity:
    return Quantity(dimension, minimum=0, exclusive=True)


Number = Annotated[float, Quantity("number")]
NonNegativeNumber = Annotated[float, Quantity("number", minimum=0)]
PositiveNumber = Annotated[float, _positive("number")]
Fraction = Annotated[float, Quantity("number", minimum=0, maximum=1)]
Share = Annotated[float, Quantity("number", minimum=0.05, maximum=0.95)]
Poisson = Annotated[float, Quantity("number", minimum=0, maximum=0.5)]
Length = Annotated[float, _positive("length")]
Coordinate = Annotated[float, Quantity("length")]
Area = Annotated[float, Quantity("area", minimum=0)]
PositiveArea = Annotated[float, _positive("area")]
Volume = Annotated[float, Quantity("volume", minimum=0)]
NonNegativeMass = Annotated[float, Quantity("mass", minimum=0)]
Density = Annotated[float, _positive("density")]
PositiveInertia = Annotated[float, _positive("inertia")]
ProductOfInertia = Annotated[float, Quantity("inertia")]
NonNegativeInertia = Annotated[float, Quantity("inertia", minimum=0)]
Pressure = Annotated[float, _positive("pressure")]
AnyPressure = Annotated[float, Quantity("pressure")]
Elastance = Annotated[float, Quantity("elastance", minimum=0)]
Viscosity = Annotated[float, Quantity("viscosity", minimum=0)]
Angle = Annotated[float, Quantity("angle")]
Bend = Annotated[float, Quantity("angle", minimum=-2 * math.pi, maximum=2 * math.pi)]
Curvature = Annotated[float, Quantity("curvature")]
Time = Annotated[float, Quantity("time")]
Duration = Annotated[float, Quantity("time", minimum=0)]
PositiveTime = Annotated[float, _positive("time")]
Frequency = Annotated[float, Quantity("frequency", minimum=0)]
PositiveFrequency = Annotated[float, _positive("frequency")]
AngularSpeed = Annotated[float, Quantity("angular_speed")]
Speed = Annotated[float, Quantity("speed")]
PositiveSpeed = Annotated[float, _positive("speed")]
Gravity = Annotated[float, Quantity("acceleration", minimum=0)]
Force = Annotated[float, Quantity("force")]
Torque = Annotated[float, Quantity("torque")]
LineForce = Annotated[float, Quantity("line_force")]
AngularStiffness = Annotated[float, Quantity("angular_stiffness", minimum=0)]
PositiveTorque = Annotated[float, _positive("torque")]
PositiveAngularSpeed = Annotated[float, _positive("angular_speed")]
PositiveAngle = Annotated[float, _positive("angle")]
Current = Annotated[float, Quantity("current", minimum=0)]
AngularDamping = Annotated[float, Quantity("angular_damping", minimum=0)]
Stiffness = Annotated[float, Quantity("stiffness", minimum=0)]
PositiveStiffness = Annotated[float, _positive("stiffness")]
QuadraticDrag = Annotated[float, Quantity("quadratic_drag", minimum=0)]
Damping = Annotated[float, Quantity("damping", minimum=0)]
