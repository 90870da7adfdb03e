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
from .by_name import CONTROLLERS, WITH_MODEL, Pace, controller_of, schedule_of
from .closed_loop import ClosedLoopRecord, ClosedLoopRun, SensorModel, run_closed_loop
from .commands import CommandRange
from .contract import Controller, Regulator
from .feedforward import Feedforward, HystereticModel, Learned, Learner, check_reachable, hysteretic, learned
from .gains import PIDGains
from .linear_model import RobotModel, fit_linear, robot_model
from .margins import Margins, margins, open_loop
from .pid import PID, ActuatorLimits, GainSchedule, PIDRegulator, VariableGainPI, pid_of
from .predictive import KalmanFilter, Predictive, kalman
from .references import Reference, chirp, eased, local_frequency, sine, times, triangle, varying
from .robot_control import ControlResult, ControlTask, FoundController, LoopGains, control
from .tracking_errors import StepResponse, rms_error, step_response

__all__ = [
    "CONTROLLERS",
    "PID",
    "WITH_MODEL",
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
    "FoundController",
    "GainSchedule",
    "HystereticModel",
    "KalmanFilter",
    "Learned",
    "Learner",
    "LoopGains",
    "Margins",
    "PIDGains",
    "PIDRegulator",
    "Pace",
    "Predictive",
    "Reference",
    "Regulator",
    "Relay",
    "RelayGains",
    "RobotModel",
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
    "controller_of",
    "detune",
    "eased",
    "fit_linear",
    "hysteretic",
    "instants_per_sample",
    "kalman",
    "learned",
    "local_frequency",
    "margins",
    "open_loop",
    "perturbed",
    "pid_of",
    "relay_gains",
    "rms_error",
    "robot_model",
    "run_batch",
    "run_closed_loop",
    "schedule_of",
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
