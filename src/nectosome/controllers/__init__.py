"""What makes a rig or a robot follow a reference: references, controllers, loops, tuning and margins."""

from .autotune import Relay, Ultimate, detune, relay_gains, smooth_pid, time_scaled, ultimate
from .beat import Beat, BeatMean, beat_of, instants_per_sample
from .block_loop import BlockLoop, BlockLoopRecord, perturbed, run_batch
from .closed_loop import ClosedLoopRecord, ClosedLoopRun, SensorModel, run_closed_loop
from .contract import Controller, Regulator
from .feedforward import Feedforward, HystereticModel, hysteretic
from .kalman import KalmanFilter, kalman
from .learning import Learned, learned
from .margins import Margins, margins, open_loop
from .motor_speed import VariableGainPI
from .pid import PID, ActuatorLimits, GainSchedule, PIDRegulator, pid_of
from .predictive import Predictive
from .reachable import check_reachable
from .references import (
    SHAPES,
    CommandRange,
    Reference,
    chirp,
    eased,
    local_frequency,
    read_beat,
    read_range,
    sine,
    times,
    triangle,
    varying,
)
from .tracking_errors import StepResponse, rms_error, step_response
from .tuning import Tuned, tune

__all__ = [
    "PID",
    "SHAPES",
    "ActuatorLimits",
    "Beat",
    "BeatMean",
    "BlockLoop",
    "ClosedLoopRecord",
    "ClosedLoopRun",
    "CommandRange",
    "Controller",
    "Feedforward",
    "GainSchedule",
    "HystereticModel",
    "KalmanFilter",
    "Learned",
    "Margins",
    "PIDRegulator",
    "Predictive",
    "Reference",
    "Regulator",
    "Relay",
    "SensorModel",
    "StepResponse",
    "BlockLoopRecord",
    "Tuned",
    "Ultimate",
    "VariableGainPI",
    "beat_of",
    "check_reachable",
    "chirp",
    "detune",
    "eased",
    "hysteretic",
    "kalman",
    "learned",
    "local_frequency",
    "margins",
    "instants_per_sample",
    "open_loop",
    "perturbed",
    "pid_of",
    "read_beat",
    "read_range",
    "relay_gains",
    "rms_error",
    "run_batch",
    "run_closed_loop",
    "sine",
    "smooth_pid",
    "step_response",
    "time_scaled",
    "times",
    "triangle",
    "tune",
    "ultimate",
    "varying",
]
