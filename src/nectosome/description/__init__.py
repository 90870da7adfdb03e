"""The language of robot files: descriptions of robots and missions, their quantities by path, settings, URDF."""

from .fields import Angle, AngularSpeed, Coordinate, Quantity, Torque
from .files import dump_robot, json_schema, load_robot, parse_robot, save_robot
from .joints import (
    FixedJoint,
    FreeJoint,
    JointDescription,
    PlanarJoint,
    PrismaticJoint,
    RevoluteJoint,
    ServoLimits,
    SphericalJoint,
)
from .loads import (
    AddedMassLoad,
    CylinderAddedMassLoad,
    DistributedForceLoad,
    DragLoad,
    ForceLoad,
    GivenAddedMassLoad,
    LoadDescription,
    LumpedDragLoad,
    PlateDragLoad,
    SpheroidAddedMassLoad,
)
from .parts import STRAIN_NAMES, Rigid, Rod
from .paths import get_value, resolve, with_values
from .period import drive_frequencies, drive_period, driving_signals
from .robot import RobotDescription, WaterDescription
from .settings import Samples, apply_settings, parse_setting, with_recordings
from .signals import (
    ConstantSignal,
    CycleSignal,
    RateSignal,
    RecordingSignal,
    SignalDescription,
    SineSignal,
    SmoothRecordingSignal,
    StrokeSignal,
    WaveSignal,
)
from .structure import numeric_paths, numeric_values
from .urdf import import_urdf

__all__ = [
    "STRAIN_NAMES",
    "AddedMassLoad",
    "Angle",
    "AngularSpeed",
    "ConstantSignal",
    "Coordinate",
    "CycleSignal",
    "CylinderAddedMassLoad",
    "DistributedForceLoad",
    "DragLoad",
    "FixedJoint",
    "ForceLoad",
    "FreeJoint",
    "GivenAddedMassLoad",
    "JointDescription",
    "LoadDescription",
    "LumpedDragLoad",
    "PlanarJoint",
    "PlateDragLoad",
    "PrismaticJoint",
    "Quantity",
    "RateSignal",
    "RecordingSignal",
    "RevoluteJoint",
    "Rigid",
    "RobotDescription",
    "Rod",
    "Samples",
    "ServoLimits",
    "SignalDescription",
    "SineSignal",
    "SmoothRecordingSignal",
    "SphericalJoint",
    "SpheroidAddedMassLoad",
    "StrokeSignal",
    "Torque",
    "WaterDescription",
    "WaveSignal",
    "apply_settings",
    "drive_frequencies",
    "drive_period",
    "driving_signals",
    "dump_robot",
    "get_value",
    "import_urdf",
    "json_schema",
    "load_robot",
    "numeric_paths",
    "numeric_values",
    "parse_robot",
    "parse_setting",
    "resolve",
    "save_robot",
    "with_recordings",
    "with_values",
]
