"""The language of robot files: descriptions of robots and missions, their quantities by path, settings, URDF."""

from nectosome.io.schema.quantity import Quantity
from nectosome.io.schema.structure import numeric_paths, numeric_values

from .fields import DIRECTIONS, Angle, AngularSpeed, Coordinate
from .joints import FixedJoint, FreeJoint, JointDescription, PlanarJoint, PrismaticJoint, RevoluteJoint, ServoLimits
from .loads import AddedMassLoad, ForceLoad, LoadDescription
from .parts import STRAIN_NAMES, Rigid, Rod, SoftPlate
from .period import (
    check_no_ramps,
    check_no_update_rate,
    check_updates,
    drive_frequencies,
    drive_period,
    driving_signals,
    like_periods,
    samples_at_updates,
    update_rates,
    without_ramps,
)
from .robot import RobotDescription, check_numbers, get_value, resolve, with_values
from .robot_file import (
    Samples,
    apply_settings,
    dump_robot,
    load_robot,
    parse_robot,
    robot_of_run,
    save_robot,
    with_recordings,
)
from .signals import ConstantSignal, RateSignal, SignalDescription
from .urdf import import_urdf
from .water import WaterDescription
