"""Loads on bodies in water, on joints, inside rods, and between bodies."""

from .added_mass import (
    CylinderAddedMass,
    GivenAddedMass,
    MeshAddedMass,
    SpheroidAddedMass,
    StripAddedMass,
    lamb_coefficients,
)
from .buoyancy import Buoyancy, MeshBuoyancy, Weight
from .bushing import Bushing, BushingEnd
from .drag import LumpedDrag, PlateDrag, StartingPlateDrag, StripDrag
from .foil import Foil, RigidFoil, RodFoil
from .forces import LineForce, PointForce, PulsedThrust
from .jet import Jet, Pulse
from .leg import GroundContact, Leg
from .near_floor import NearFloor
from .part_contact import Beads, Friction, PartContact
from .places import AttachedPlaces
from .rod_loads import FluidChamber, Tendon
from .skin_friction import SkinFriction
from .springs import Damper, FlexureSpring, JointFriction, LowerLimit, Spring, UpperLimit
from .stokes_drag import StokesDrag
from .trailing_edge import LaggedTrailingEdge, TrailingEdge
from .wall_contact import WallContact
