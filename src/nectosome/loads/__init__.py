"""Loads on bodies in water, on joints, inside rods, and between bodies."""

from .added_mass import (
    CylinderAddedMass,
    GivenAddedMass,
    MeshAddedMass,
    NearFloor,
    SpheroidAddedMass,
    StripAddedMass,
    lamb_coefficients,
)
from .bell_jet import BellJet, BellWater
from .buoyancy import Buoyancy, MeshBuoyancy, Weight
from .bushing import Bushing, BushingEnd
from .contact import Beads, Friction, PartContact, WallContact
from .drag import LumpedDrag, PlateDrag, SkinFriction, StartingPlateDrag, StokesDrag, StripDrag
from .foil import Foil, RigidFoil, RodFoil
from .forces import LineForce, PointForce, PulsedThrust
from .jet import Jet, Pulse
from .leg import GroundContact, Leg
from .places import AttachedPlaces
from .propeller import Thruster
from .rod_loads import FluidChamber, Relaxation, Tendon
from .springs import Damper, FlexureSpring, JointFriction, LowerLimit, Spring, UpperLimit
from .trailing_edge import LaggedTrailingEdge, TrailingEdge
from .web_loads import Membrane, SheetAddedMass
