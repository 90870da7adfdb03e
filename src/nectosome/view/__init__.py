"""What people look at: the report of all studies, the page of a run, recordings as they were read."""

from .correction import show_correction
from .experiment import show_experiment
from .film import write_film, write_still
from .following import show_following
from .gaits import show_gait
from .hysteresis import show_hysteresis
from .mission import show_mission
from .recordings import show_recordings
from .report import show_run, write_figures, write_report
from .robot_fit import show_robot_fit
from .standing import standing
from .still import show_still
from .sweeps import show_sweep
from .swimming import show_surge
from .track import show_track

__all__ = [
    "show_correction",
    "show_experiment",
    "show_following",
    "show_gait",
    "show_hysteresis",
    "show_mission",
    "show_recordings",
    "show_robot_fit",
    "show_run",
    "show_still",
    "show_surge",
    "show_sweep",
    "show_track",
    "standing",
    "write_figures",
    "write_film",
    "write_report",
    "write_still",
]
