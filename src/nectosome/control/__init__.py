"""What makes a rig or a robot follow a reference: references, controllers, loops, tuning and margins."""

from .asked import SHAPES, Range, Wanted, read_beat, read_range
from .beat import Beat, BeatMean, beat_of, moments_of
from .controller import Controller, Regulator
from .feedforward import Feedforward, HystereticModel, hysteretic
from .followed import Followed
from .following import Measuring, Ongoing, follow
from .found_gains import relay_gains
from .kalman import KalmanFilter, kalman
from .learning import Learned, learned
from .loop import Loop, Track, run_lanes, scattered
from .margins import Margins, margins, open_loop
from .metrics import StepResponse, rms_error, step_response
from .motor import VariableGainPI
from .pid import PID, PIDRegulator, Reach, Scheduled, pid_of
from .predictive import Predictive
from .reachable import check_reachable
from .references import chirp, eased, local_frequency, sine, times, triangle, varying
from .rehearsal import gentler, paced, smooth_pid
from .relay import Relay, Ultimate, ultimate
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
