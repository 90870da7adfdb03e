"""What makes a rig or a robot follow a reference: references, controllers, loops, tuning and margins."""

from .autotune import Relay, Ultimate, gentler, paced, relay_gains, smooth_pid, ultimate
from .beat import Beat, BeatMean, beat_of, moments_of
from .block_loop import Loop, Track, run_lanes, scattered
from .closed_loop import Followed, Measuring, Ongoing, follow
from .controller import Controller, Regulator
from .feedforward import Feedforward, HystereticModel, hysteretic
from .kalman import KalmanFilter, kalman
from .learning import Learned, learned
from .margins import Margins, margins, open_loop
from .motor_speed import VariableGainPI
from .pid import PID, PIDRegulator, Reach, Scheduled, pid_of
from .predictive import Predictive
from .reachable import check_reachable
from .references import (
    SHAPES,
    Range,
    Wanted,
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
    "Beat",
    "BeatMean",
    "Controller",
    "Feedforward",
    "Followed",
    "HystereticModel",
    "KalmanFilter",
    "Learned",
    "Loop",
    "Margins",
    "Measuring",
    "Ongoing",
    "PIDRegulator",
    "Predictive",
    "Range",
    "Reach",
    "Regulator",
    "Relay",
    "Scheduled",
    "StepResponse",
    "Track",
    "Tuned",
    "Ultimate",
    "VariableGainPI",
    "Wanted",
    "beat_of",
    "check_reachable",
    "chirp",
    "eased",
    "follow",
    "gentler",
    "hysteretic",
    "kalman",
    "learned",
    "local_frequency",
    "margins",
    "moments_of",
    "open_loop",
    "paced",
    "pid_of",
    "read_beat",
    "read_range",
    "relay_gains",
    "rms_error",
    "run_lanes",
    "scattered",
    "sine",
    "smooth_pid",
    "step_response",
    "times",
    "triangle",
    "tune",
    "ultimate",
    "varying",
]
