"""What people look at: the report of all studies, the page of a run, recordings as they were read.

A page is loaded when it is first asked for: that of a recording needs no more than a tenth of what the report does.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
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
    from .starting import standing
    from .still import show_still
    from .sweeps import show_sweep
    from .swimming import show_surge
    from .track import show_track

_HOME = {
    "show_correction": "correction",
    "show_experiment": "experiment",
    "show_following": "following",
    "show_gait": "gaits",
    "show_hysteresis": "hysteresis",
    "show_mission": "mission",
    "show_recordings": "recordings",
    "show_robot_fit": "robot_fit",
    "show_run": "report",
    "show_still": "still",
    "show_surge": "swimming",
    "show_sweep": "sweeps",
    "show_track": "track",
    "standing": "starting",
    "write_figures": "report",
    "write_film": "film",
    "write_report": "report",
    "write_still": "film",
}

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


def __getattr__(name: str) -> Any:
    if name in _HOME:
        return getattr(import_module(f".{_HOME[name]}", __name__), name)
    raise AttributeError(f"{__name__} has no {name}")
