"""The study of the fishtail."""

import time

from ..study import Progress, Study, printed, score
from . import fit

NAME = "fishtail"
TITLE = "Pneumatic fishtail"
ABOUT = (
    "A tail that two pneumatic muscles bend to either side. Its end answers the pressure with hysteresis, which plays "
    "describe, and with inertia, which a transfer function does. No recordings were published: these are synthetic, "
    "made with the parameters of Table 1 (a0 and a2, which it has exchanged, put right), a valve that changes the "
    "pressure by 3.8 bar/s at most, and 0.05 mm of noise. How well they are fitted says how the methods do, not how "
    "well the model describes the real tail."
)


def run(quick: bool, progress: Progress) -> Study:
    """All rows and figures; `quick` tries fewer starts."""
    began = time.perf_counter()
    book, made = printed(NAME), fit.part(quick, progress)
    progress("scorecard", 1.0)
    rows = [score(row, entry, made.numbers[row], "synthetic") for row, entry in book.items()]
    return Study(NAME, TITLE, ABOUT, rows, made.runs, time.perf_counter() - began, made.data)
