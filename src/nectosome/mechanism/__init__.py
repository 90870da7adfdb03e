"""Joints, rigid links, soft rods, and their kinematic tree: kinematics and equations of motion."""

from .diagnose import Diagnosis, bending_of, diagnose, load_names
from .joints import SLIDES, Fixed, Free, Joint, Planar, Prismatic, Revolute, Spherical
from .load_groups import Attached, Paired
from .part_weights import PartWeight, check_inertia, weigh
from .parts import Link, TreePart, node_at
from .plane import InPlane
from .powered import Attachment, Battery, PoweredDrives
from .reduce import continuous_loops, in_plane, moves_in_plane, reduced, stand_in
from .ritz_plates import RitzPlate
from .robot import Robot, make_robot
from .rods import SoftRod, make_rod
from .start import ImpulsiveStart, from_rest
from .tendons import Cord, Crank, JointTendon, TendonOutput
from .tree import Tree
from .webs import Web
