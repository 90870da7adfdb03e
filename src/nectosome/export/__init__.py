"""Robots and runs in formats of other programs: tables, folders, URDF, MuJoCo, FMUs, files of rerun and MCAP."""

from .fluid_fit import FluidFit, fit_fluid
from .fmu import HeldRobot, write_fmu
from .mcap_file import write_mcap
from .mjcf import MuJoCoModel, mjcf_of
from .rerun_file import write_rerun
from .rigid_bodies import RigidBody, joined_rigidly, mass_properties, rigid_bodies
from .robot_folder import FoundFiles, mesh_files, robot_files
from .run_table import run_table
from .urdf import UrdfText, urdf_of
