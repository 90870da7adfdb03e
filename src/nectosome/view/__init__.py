"""Pages, plots and pictures of any run, sweep, design, fit or recording. A page is loaded when it is first used."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .closed_loop import show_closed_loop, show_experiment
    from .corrected_grid import show_correction
    from .film import write_film, write_still
    from .fit_pages import show_gait, show_hysteresis, show_robot_fit, show_surge, show_thruster
    from .intervals import show_intervals
    from .loops_side_by_side import show_side_by_side
    from .means_page import show_means
    from .mission import show_mission
    from .recording_pages import show_recordings, show_track
    from .run_page import show_run
    from .still import righting_panel, show_still, standing
    from .sweep import show_sweep

_PAGES = {
    "closed_loop": ("show_closed_loop", "show_experiment"),
    "corrected_grid": ("show_correction",),
    "film": ("write_film", "write_still"),
    "fit_pages": ("show_gait", "show_hysteresis", "show_robot_fit", "show_surge", "show_thruster"),
    "intervals": ("show_intervals",),
    "loops_side_by_side": ("show_side_by_side",),
    "means_page": ("show_means",),
    "mission": ("show_mission",),
    "recording_pages": ("show_recordings", "show_track"),
    "run_page": ("show_run",),
    "still": ("righting_panel", "show_still", "standing"),
    "sweep": ("show_sweep",),
}
_HOME = {name: page for page, inside in _PAGES.items() for name in inside}


def __getattr__(name: str) -> Any:
    if name in _HOME:
        return getattr(import_module(f".{_HOME[name]}", __name__), name)
    raise AttributeError(f"{__name__} has no {name}")
