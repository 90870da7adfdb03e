"""Experiments on rigs, simulated and real: the same loop, guards and log for all of them.

Rigs of devices are in modules of their own, which load their drivers when they are opened.
"""

from .bench import CONTROLLERS, Bench, BenchRun
from .experiment import Experiment, RigRun
from .guards import Limits
from .log import recovered
from .rig import Rig, RigError
from .simulated_rig import SimulatedRig

__all__ = [
    "CONTROLLERS",
    "Bench",
    "BenchRun",
    "Experiment",
    "Limits",
    "Rig",
    "RigError",
    "RigRun",
    "SimulatedRig",
    "recovered",
]
