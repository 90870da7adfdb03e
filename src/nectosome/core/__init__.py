"""Contracts, signals, water, and SE(3) mathematics; switches JAX to float64."""

from . import runtime as _runtime  # first: sets up JAX
from .block import Block, Line, Memoryless, Pointwise, RateIndependent, Stepper
from .flow_fields import UniformCurrent, Waves, current_of
from .immersion import displaced, reach_up, wetted, wetting
from .one_sided import Gaps
from .recorded_signals import Recording, SmoothRecording, Steps
from .se3 import safe_norm
from .signals import (
    Chirp,
    Constant,
    Cycle,
    Handover,
    Jump,
    Multisine,
    Rate,
    Shaped,
    Signal,
    Sine,
    Stack,
    Stroke,
    Sum,
    Triangle,
    Varying,
    Wave,
    sampled,
    signal_of,
)
from .solution import Solution, Status
from .system import (
    Assumed,
    CrankRate,
    CrankState,
    Drive,
    DriveOutput,
    Flow,
    JointLoad,
    Load,
    Mechanical,
    PairLoad,
    ReshapingLoad,
    RodLoad,
    SectionedLoad,
    State,
    Stations,
    Strips,
    System,
)
from .water import REFERENCE_DENSITY, STANDARD_GRAVITY, Water
