"""The study of PoseiDRONE, part by part."""

from collections.abc import Callable

from nectosome.view.style import Panel

from ..study import Progress, Sets, StudyPart, gathered
from . import crawl, crawl_motors, figures_crawl, figures_mission, figures_swim, mission, static_free, swim

_PARTS: dict[str, tuple[float, Callable[[bool, Progress], StudyPart]]] = {  # share of the time that each takes
    "swimming": (0.1, swim.part),
    "held and free": (0.2, static_free.part),
    "crawling": (0.46, crawl.part),
    "crawling on motors": (0.04, crawl_motors.part),
    "mission": (0.05, mission.part),
    "schedule": (0.15, mission.schedule_part),
}


def part(quick: bool, progress: Progress) -> StudyPart:
    """All rows and figures; `quick` draws less noise."""
    return gathered(_PARTS.values(), quick, progress)


def panels(data: Sets, runs: Sets) -> list[Panel]:
    """Figures of the parts whose data are there."""
    parts = {
        "swim": figures_swim.panels,
        "static_free": figures_swim.jet_panels,
        "crawl_told": figures_crawl.panels,
        "crawl_motors": figures_crawl.motor_panels,
        "mission": figures_mission.panels,
        "schedule_cranks": figures_mission.schedule_panels,
    }
    return [panel for key, panels in parts.items() if key in data for panel in panels(data)]
