"""Pages, plots and pictures of any run, sweep, design, fit or recording. A page is loaded when it is first used."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .closed_loop import show_closed_loop as show_closed_loop
    from .closed_loop import show_experiment as show_experiment
    from .corrected_grid import show_correction as show_correction
    from .film import write_film as write_film
    from .film import write_still as write_still
    from .fit_pages import show_hysteresis as show_hysteresis
    from .fit_pages import show_robot_fit as show_robot_fit
    from .fit_pages import show_surge as show_surge
    from .gait import show_gait as show_gait
    from .mission import show_mission as show_mission
    from .recording_pages import show_recordings as show_recordings
    from .recording_pages import show_track as show_track
    from .run_page import show_run as show_run
    from .still import righting_panel as righting_panel
    from .still import show_still as show_still
    from .still import standing as standing
    from .sweep import show_sweep as show_sweep

_HOME = {
    "show_closed_loop": "closed_loop",
    "show_correction": "corrected_grid",
    "show_experiment": "closed_loop",
    "show_gait": "gait",
    "show_hysteresis": "fit_pages",
    "show_mission": "mission",
    "show_recordings": "recording_pages",
    "show_robot_fit": "fit_pages",
    "show_run": "run_page",
    "righting_panel": "still",
    "show_still": "still",
    "show_surge": "fit_pages",
    "show_sweep": "sweep",
    "show_track": "recording_pages",
    "standing": "still",
    "write_film": "film",
    "write_still": "film",
}


def __getattr__(name: str) -> Any:
    if name in _HOME:
        return getattr(import_module(f".{_HOME[name]}", __name__), name)
    raise AttributeError(f"{__name__} has no {name}")
