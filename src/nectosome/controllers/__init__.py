"""What makes a rig or a robot track a reference: references, controllers, closed loops, tuning and margins."""

from nectosome._renamed import former

from .autotune import (
    LoopGains,
    Relay,
    RelayGains,
    Tuned,
    Ultimate,
    detune,
    find_gains,
    relay_gains,
    time_scaled,
    tune,
    ultimate,
)
from .beat import Beat, BeatAveraged, BeatMean, beat_of, instants_per_sample
from .block_loop import BlockLoop, BlockLoopRecord, perturbed, run_batch
from .closed_loop import ClosedLoopRecord, ClosedLoopRun, RobotLoop, SensorModel
from .commands import CommandRange
from .contract import ActuatorLimits, Controller, LoopData, Pace, Plant, Regulator, controller_named, controllers
from .feedforward import Feedforward, Learned, Learner, check_reachable, learned
from .gains import PIDGains
from .hysteretic_model import HystereticModel, hysteretic
from .linear_model import RobotModel, fit_linear, robot_model
from .margins import Margins, margins, open_loop
from .own import FunctionController, LimitedController
from .pid import PID, GainSchedule, PIDRegulator, VariableGainPI, pid_of, smooth_pid
from .predictive import KalmanFilter, Predictive, kalman
from .references import Reference, eased, local_frequency, times, wave
from .robot_control import ControlResult, ControlTask, FoundController, control
from .side_by_side import ControllerComparison, ControllerScore, compare
from .tracking_errors import StepResponse, rms_error, step_response, tracking_rows

__getattr__ = former(__name__)
