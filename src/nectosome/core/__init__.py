"""Contracts, signals, water, and SE(3) mathematics; switches JAX to float64."""

from . import runtime as _runtime  # noqa: F401  first: sets up JAX
from .block import Block, Line, Memoryless, Pointwise, RateIndependent, Stepper
from .se3 import safe_norm
from .signals import (
    Constant,
    Cycle,
    Handover,
    Rate,
    Recording,
    Shaped,
    Signal,
    Sine,
    SmoothRecording,
    Stack,
    Steps,
    Stroke,
    Wave,
    signal_of,
)
from .solution import Solution, Status
from .system import JointLoad, Load, Mechanical, PairLoad, ReshapingLoad, RodLoad, State, Stations, Strips, System
from .water import STANDARD_GRAVITY, UniformCurrent, Water

__all__ = [
    "STANDARD_GRAVITY",
    "Block",
    "Constant",
    "Cycle",
    "Handover",
    "JointLoad",
    "Line",
    "Load",
    "Mechanical",
    "Memoryless",
    "PairLoad",
    "Pointwise",
    "Rate",
    "RateIndependent",
    "Recording",
    "ReshapingLoad",
    "RodLoad",
    "Shaped",
    "Signal",
    "Sine",
    "SmoothRecording",
    "Solution",
    "Stack",
    "State",
    "Stations",
    "Status",
    "Stepper",
    "Steps",
    "Strips",
    "Stroke",
    "System",
    "UniformCurrent",
    "Water",
    "Wave",
    "safe_norm",
    "signal_of",
]
