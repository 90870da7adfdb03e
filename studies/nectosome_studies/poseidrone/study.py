"""The study of PoseiDRONE, part by part."""

import time
from collections.abc import Callable

from nectosome.view.style import Panel

from ..study import Progress, Sets, Study, StudyPart, gathered, printed, scored
from . import crawl, crawl_motors, figures_crawl, figures_mission, figures_swim, mission, static_free, swim

NAME = "poseidrone"
TITLE = "PoseiDRONE"
ABOUT = (
    "An octopus-inspired robot that swims by a pulsed jet. Its added mass and drag are identified from speed and "
    "thrust. No recordings were published, so that estimators are tested on synthetic ones: they are made with the "
    "parameters of Table 1, and with a thrust whose shape follows from its standard errors. The robot crawls on legs "
    "driven by cranks: parameters are calibrated on four printed features of its gait, with a geometry of the legs "
    "that the paper does not print. Its cranks turn at a given speed, or are driven by motors with assumed numbers. A "
    "mission takes it from swimming to crawling and back, on a synthetic schedule; a second mission is the fastest "
    "across its tank and back."
)
_PARTS: dict[str, tuple[float, Callable[[bool, Progress], StudyPart]]] = {  # share of the time that each takes
    "swimming": (0.1, swim.part),
    "held and free": (0.2, static_free.part),
    "crawling": (0.46, crawl.part),
    "crawling on motors": (0.04, crawl_motors.part),
    "mission": (0.05, mission.part),
    "schedule": (0.15, mission.schedule_part),
}


def run(quick: bool, progress: Progress) -> Study:
    """All rows and figures; `quick` draws less noise."""
    began = time.perf_counter()
    done = gathered(_PARTS.values(), quick, progress)
    rows = scored(printed(NAME), done.numbers)
    return Study(NAME, TITLE, ABOUT, rows, done.runs, time.perf_counter() - began, done.data, figures=_figures)


def _figures(data: Sets, runs: Sets) -> list[Panel]:
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
