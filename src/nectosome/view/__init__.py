"""Pages, plots and pictures of any run, sweep, design, fit or recording. A page is loaded when it is first used."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .closed_loop import show_closed_loop, show_experiment
    from .corrected_grid import show_correction
    from .film import write_film, write_still
    from .gait import show_gait
    from .hysteresis import show_hysteresis
    from .mission import show_mission
    from .recordings import show_recordings
    from .robot_fit import show_robot_fit
    from .run_page import show_run
    from .start import standing
    from .still import show_still
    from .surge import show_surge
    from .sweep import show_sweep
    from .track import show_track

_HOME = {
    "show_closed_loop": "closed_loop",
    "show_correction": "corrected_grid",
    "show_experiment": "closed_loop",
    "show_gait": "gait",
    "show_hysteresis": "hysteresis",
    "show_mission": "mission",
    "show_recordings": "recordings",
    "show_robot_fit": "robot_fit",
    "show_run": "run_page",
    "show_still": "still",
    "show_surge": "surge",
    "show_sweep": "sweep",
    "show_track": "track",
    "standing": "start",
    "write_film": "film",
    "write_still": "film",
}

__all__ = [
    "show_closed_loop",
    "show_correction",
    "show_experiment",
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
    "write_film",
    "write_still",
]


def __getattr__(name: str) -> Any:
    if name in _HOME:
        return getattr(import_module(f".{_HOME[name]}", __name__), name)
    raise AttributeError(f"{__name__} has no {name}")
