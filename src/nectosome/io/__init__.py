"""Units at the boundary, robot files and their paths, results, provenance, checkpoints, and the errors a user sees."""

from nectosome.io.atomic import write_atomic
from nectosome.io.checkpoint import load_checkpoint, save_checkpoint
from nectosome.io.describe_joints import (
    FixedJoint,
    FreeJoint,
    FreeStart,
    Joint,
    PlanarJoint,
    PlanarStart,
    PrismaticJoint,
    RevoluteJoint,
    ServoLimits,
    SphericalJoint,
    SphericalStart,
)
from nectosome.io.describe_loads import (
    AddedMassLoad,
    CylinderAddedMassLoad,
    DistributedForceLoad,
    DragLoad,
    ForceLoad,
    GivenAddedMassLoad,
    Load,
    LumpedDragLoad,
    PlateDragLoad,
    SpheroidAddedMassLoad,
)
from nectosome.io.describe_parts import STRAIN_NAMES, Limb, RestStrains, Rigid, Rod
from nectosome.io.describe_signals import (
    AngleSignal,
    ConstantAngle,
    ConstantForce,
    ConstantLength,
    ConstantTorque,
    ForceSignal,
    LengthSignal,
    RateAngle,
    RateLength,
    SineAngle,
    SineForce,
    SineLength,
    SineTorque,
    TorqueSignal,
)
from nectosome.io.description import RobotDescription, WaterDescription
from nectosome.io.errors import InputError, did_you_mean
from nectosome.io.fields import Quantity
from nectosome.io.files import dump_robot, json_schema, load_robot, parse_robot
from nectosome.io.paths import get_value, numeric_paths, resolve, with_values
from nectosome.io.period import drive_period
from nectosome.io.provenance import provenance
from nectosome.io.results import load_dataset, save_dataset
from nectosome.io.settings import apply_settings, parse_setting
from nectosome.io.units import format_quantity, parse_quantity, show_quantity

__all__ = [
    "STRAIN_NAMES",
    "AddedMassLoad",
    "AngleSignal",
    "ConstantAngle",
    "ConstantForce",
    "ConstantLength",
    "ConstantTorque",
    "CylinderAddedMassLoad",
    "DistributedForceLoad",
    "DragLoad",
    "FixedJoint",
    "ForceLoad",
    "ForceSignal",
    "FreeJoint",
    "FreeStart",
    "GivenAddedMassLoad",
    "InputError",
    "Joint",
    "LengthSignal",
    "Limb",
    "Load",
    "LumpedDragLoad",
    "PlanarJoint",
    "PlanarStart",
    "PlateDragLoad",
    "PrismaticJoint",
    "Quantity",
    "RateAngle",
    "RateLength",
    "RestStrains",
    "RevoluteJoint",
    "Rigid",
    "RobotDescription",
    "Rod",
    "ServoLimits",
    "SineAngle",
    "SineForce",
    "SineLength",
    "SineTorque",
    "SphericalJoint",
    "SphericalStart",
    "SpheroidAddedMassLoad",
    "TorqueSignal",
    "WaterDescription",
    "apply_settings",
    "did_you_mean",
    "drive_period",
    "dump_robot",
    "format_quantity",
    "get_value",
    "json_schema",
    "load_checkpoint",
    "load_dataset",
    "load_robot",
    "numeric_paths",
    "parse_quantity",
    "parse_robot",
    "parse_setting",
    "provenance",
    "resolve",
    "save_checkpoint",
    "save_dataset",
    "show_quantity",
    "with_values",
    "write_atomic",
]
