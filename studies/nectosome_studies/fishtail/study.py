"""The study of the fishtail."""

from nectosome.view.style import Panel

from ..study import Progress, Sets, StudyPart, gathered
from . import control_study, figures, fit


def part(quick: bool, progress: Progress) -> StudyPart:
    """All rows and figures; `quick` tries fewer starts, draws fewer plants, and leaves the errors by frequency out."""
    return gathered(((0.4, fit.part), (0.6, control_study.part)), quick, progress)


def panels(data: Sets, runs: Sets) -> list[Panel]:
    """Figures of both parts."""
    return figures.panels(data)
