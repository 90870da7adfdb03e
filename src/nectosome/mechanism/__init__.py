"""Joints, rigid links, soft rods, and the tree they form: kinematics and equations of motion."""

from .diagnose import Diagnosis, diagnose, load_names
from .joints import Fixed, Free, Joint, Planar, Prismatic, Revolute, Spherical
from .links import Link
from .load_cell import held_force
from .plane import InPlane
from .reduce import in_plane, moves_in_plane, reduced
from .robot import Attached, Forces, Paired, Robot, make_robot
from .rods import STRAINS, SoftRod, make_rod
from .tree import PartShape, Tree, TreePart, node_at

__all__ = [
    "STRAINS",
    "Attached",
    "Diagnosis",
    "Fixed",
    "Forces",
    "Free",
    "InPlane",
    "Joint",
    "Link",
    "Paired",
    "PartShape",
    "Planar",
    "Prismatic",
    "Revolute",
    "Robot",
    "SoftRod",
    "Spherical",
    "Tree",
    "TreePart",
    "diagnose",
    "held_force",
    "in_plane",
    "load_names",
    "make_robot",
    "make_rod",
    "moves_in_plane",
    "node_at",
    "reduced",
]
