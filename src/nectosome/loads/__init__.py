"""What acts on bodies in water."""

from .added_mass import (
    AddedMass,
    CylinderAddedMass,
    GivenAddedMass,
    SpheroidAddedMass,
    StripAddedMass,
    lamb_coefficients,
)
from .bumper import Bumper
from .buoyancy import Buoyancy, Weight
from .contact import Contact
from .drag import LumpedDrag, PlateDrag, StripDrag
from .forces import LineForce, PointForce
from .jet import Jet, Motor, Pulse
from .leg import Leg, Stride
from .muscle import Muscle
from .near_floor import NearFloor
from .places import Places
from .springs import Damper, Flexure, Spring
from .stoppers import LowerStop, UpperStop
from .threads import Chamber, Tendon, Thread
from .thruster import PulsedThrust
from .tie import End, Tie
from .touch import Beads, Friction, Touch
from .trailing_edge import TrailingEdge

__all__ = [
    "AddedMass",
    "Beads",
    "Bumper",
    "Buoyancy",
    "Chamber",
    "Contact",
    "CylinderAddedMass",
    "Damper",
    "End",
    "Flexure",
    "Friction",
    "GivenAddedMass",
    "Jet",
    "Leg",
    "LineForce",
    "LowerStop",
    "LumpedDrag",
    "Motor",
    "Muscle",
    "NearFloor",
    "Places",
    "PlateDrag",
    "PointForce",
    "Pulse",
    "PulsedThrust",
    "SpheroidAddedMass",
    "Spring",
    "Stride",
    "StripAddedMass",
    "StripDrag",
    "Tendon",
    "Thread",
    "Tie",
    "Touch",
    "TrailingEdge",
    "UpperStop",
    "Weight",
    "lamb_coefficients",
]
