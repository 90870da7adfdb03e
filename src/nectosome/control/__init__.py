"""What makes a rig follow a reference: references, controllers, loops, tuning and margins."""

from .controller import Controller, Regulator
from .feedforward import Feedforward, HystereticModel, hysteretic
from .kalman import KalmanFilter, kalman
from .learning import Learned, learned
from .loop import Loop, Track, run_lanes, scattered
from .margins import Margins, margins, open_loop
from .motor import VariableGainPI
from .pid import PID, PIDRegulator, Reach, Scheduled, pid_of
from .predictive import Predictive
from .reachable import check_reachable
from .references import chirp, eased, local_frequency, sine, times, triangle, varying
from .relay import Relay, Ultimate, ultimate
from .tuning import Tuned, tune

__all__ = [
    "PID",
    "Controller",
    "Feedforward",
    "HystereticModel",
    "KalmanFilter",
    "Learned",
    "Loop",
    "Margins",
    "PIDRegulator",
    "Predictive",
    "Reach",
    "Regulator",
    "Relay",
    "Scheduled",
    "Track",
    "Tuned",
    "Ultimate",
    "VariableGainPI",
    "check_reachable",
    "chirp",
    "eased",
    "hysteretic",
    "kalman",
    "learned",
    "local_frequency",
    "margins",
    "open_loop",
    "pid_of",
    "run_lanes",
    "scattered",
    "sine",
    "times",
    "triangle",
    "tune",
    "ultimate",
    "varying",
]
