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
from .drag import LumpedDrag, PlateDrag, StripDrag
from .forces import LineForce, PointForce
from .jet import Jet, Motor, Pulse
from .springs import Damper, Flexure, Spring
from .stoppers import LowerStop, UpperStop

__all__ = [
    "AddedMass",
    "Buoyancy",
    "CylinderAddedMass",
    "Damper",
    "Flexure",
    "GivenAddedMass",
    "Jet",
    "LineForce",
    "LowerStop",
    "LumpedDrag",
    "Motor",
    "PlateDrag",
    "PointForce",
    "Pulse",
    "SpheroidAddedMass",
    "Spring",
    "StripAddedMass",
    "StripDrag",
    "UpperStop",
    "Weight",
    "lamb_coefficients",
]
