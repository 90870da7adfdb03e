"""Experiments on rigs, simulated and real: the same loop, guards and log for all of them.

Rigs of devices are in modules of their own, which load what they need when they are opened.
"""

from .dry_run import rehearse
from .experiment import Experiment, RigRun
from .limits import Limits
from .recover import recovered
from .rig import Rig, RigError
from .simulated_rig import SimulatedRig

__all__ = ["Experiment", "Limits", "Rig", "RigError", "RigRun", "SimulatedRig", "recovered", "rehearse"]
