"""What acts on bodies in water."""

from .added_mass import (
    AddedMass,
    CylinderAddedMass,
    GivenAddedMass,
    SpheroidAddedMass,
    StripAddedMass,
    lamb_coefficients,
)
from .buoyancy import Buoyancy, Weight
from .drag import LumpedDrag, StripDrag
from .forces import LineForce, PointForce
from .springs import Damper, Spring

__all__ = [
    "AddedMass",
    "Buoyancy",
    "CylinderAddedMass",
    "Damper",
    "GivenAddedMass",
    "LineForce",
    "LumpedDrag",
    "PointForce",
    "SpheroidAddedMass",
    "Spring",
    "StripAddedMass",
    "StripDrag",
    "Weight",
    "lamb_coefficients",
]
