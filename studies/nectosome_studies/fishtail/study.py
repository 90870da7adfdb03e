"""The study of the fishtail."""

import time

from ..study import Progress, Study, gathered, printed, scored
from . import control_study, figures, fit

NAME = "fishtail"
TITLE = "Pneumatic fishtail"
ABOUT = (
    "A tail that two pneumatic muscles bend to either side. Its end answers the pressure with hysteresis, which plays "
    "describe, and with inertia, which a transfer function does. No recordings were published: these are synthetic, "
    "made with the parameters of Table 1 (a0 and a2, which it has exchanged, put right), 0.05 mm of noise, and a valve "
    "that changes the pressure by 3.8 bar/s at most, an assumption: a wave of 0.6 bar at 1 Hz needs as much, and above "
    "1 Hz the paper sees the valve saturate. How well they are fitted says how the methods do, not how well the model "
    "describes the real tail. The paper's PID is run on the paper's model: its errors are held against measured ones. "
    "Controllers are compared on simulated tails that differ from the model they know."
)


def run(quick: bool, progress: Progress) -> Study:
    """All rows and figures; `quick` tries fewer starts, draws fewer plants, and leaves the errors by frequency out."""
    began = time.perf_counter()
    done = gathered(((0.4, fit.part), (0.6, control_study.part)), quick, progress)
    rows = scored(printed(NAME), done.numbers)
    return Study(
        NAME,
        TITLE,
        ABOUT,
        rows,
        {},
        time.perf_counter() - began,
        done.data,
        figures=lambda data, runs: figures.panels(data),
    )
