"""Experiments on rigs, simulated and real: the same loop, guards and log for all of them."""

from .rig import Rig, RigError

__all__ = ["Rig", "RigError"]
