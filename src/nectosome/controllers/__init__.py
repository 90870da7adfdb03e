"""What makes a rig or a robot track a reference: references, controllers, closed loops, tuning and margins."""

from .autotune import (
    Relay,
    RelayGains,
    Tuned,
    Ultimate,
    block_relay_gains,
    detune,
    relay_gains,
    smooth_pid,
    time_scaled,
    tune,
    ultimate,
)
from .beat import Beat, BeatAveraged, BeatMean, beat_of, instants_per_sample
from .block_loop import BlockLoop, BlockLoopRecord, perturbed, run_batch
from .closed_loop import ClosedLoopRecord, ClosedLoopRun, SensorModel, run_closed_loop
from .commands import CommandRange, parse_gains
from .contract import Controller, Regulator
from .feedforward import Feedforward, HystereticModel, Learned, Learner, check_reachable, hysteretic, learned
from .margins import Margins, margins, open_loop
from .pid import PID, ActuatorLimits, GainSchedule, PIDRegulator, VariableGainPI, pid_of
from .predictive import KalmanFilter, Predictive, kalman
from .references import Reference, chirp, eased, local_frequency, sine, times, triangle, varying
from .robot_control import ControlResult, ControlTask, LoopGains, control
from .tracking_errors import StepResponse, rms_error, step_response

__all__ = [
    "PID",
    "ActuatorLimits",
    "Beat",
    "BeatAveraged",
    "BeatMean",
    "BlockLoop",
    "BlockLoopRecord",
    "ClosedLoopRecord",
    "ClosedLoopRun",
    "CommandRange",
    "ControlResult",
    "ControlTask",
    "Controller",
    "Feedforward",
    "GainSchedule",
    "HystereticModel",
    "KalmanFilter",
    "Learned",
    "Learner",
    "LoopGains",
    "Margins",
    "PIDRegulator",
    "Predictive",
    "Reference",
    "Regulator",
    "Relay",
    "RelayGains",
    "SensorModel",
    "StepResponse",
    "Tuned",
    "Ultimate",
    "VariableGainPI",
    "beat_of",
    "block_relay_gains",
    "check_reachable",
    "chirp",
    "control",
    "detune",
    "eased",
    "hysteretic",
    "instants_per_sample",
    "kalman",
    "learned",
    "local_frequency",
    "margins",
    "open_loop",
    "parse_gains",
    "perturbed",
    "pid_of",
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
