"""Experiments on rigs, simulated and real: the same loop, guards and log for all of them.

Rigs of devices are in modules of their own, which load their drivers when they are opened.
"""

from nectosome._renamed import former

from .actuator_bench import actuator_bench
from .bench import Bench, Pair
from .devices.simulated_robot import ReadingSensor, SimulatedRobot
from .experiment import Experiment, RigRun
from .guards import CommandLimits, Limits, MeasurementLimits
from .laws import Loop, Played, Tracked
from .log import recovered
from .rig import Devices, Rig, RigError
from .robot_bench import robot_bench
from .simulated_rig import SimulatedRig

__getattr__ = former(__name__)
