"""The study of the tracker: rendered videos of a rowing paddle and of PoseiDRONE, tracked and identified."""

from dataclasses import replace
from importlib.util import find_spec

import numpy as np

from nectosome.description import get_value
from nectosome.robots import describe
from nectosome.view.style import Panel

from ..paddle.thrust import cycle
from ..study import Progress, Sets, StudyPart, gathered, printed, score
from . import figures, poseidrone, rowing
from .limits import limits
from .rowing import RowingMotion, Shot
from .tank import Filming, marker_errors, tracked

NAME = "track"
_ABSENT = "OpenCV and PyAV are not installed here: pip install 'nectosome[video]'."
_CYCLES = 5  # of the paddle, as in Fig. 4
_SWIM, _QUICK_SWIM = 12.0, 3.0  # s


def part(quick: bool, progress: Progress) -> StudyPart:
    """All rows and figures; `quick` films for a shorter time, with fewer pixels, and leaves the limits out.

    Without the packages that read videos rows without numbers.
    """
    if any(find_spec(package) is None for package in ("av", "cv2")):
        rows = [score(row, {**entry, "kind": "missing", "note": _ABSENT}, None) for row, entry in printed(NAME).items()]
        return StudyPart({}, rows=rows)
    motion = RowingMotion.of(cycle(3, 0.6), {part: _length(part) for part in rowing.PARTS})
    parts = [
        (0.2, lambda quick, tell: _angles(motion, quick, tell)),
        (0.4 if not quick else 0.8, _tank),
        (0.4 if not quick else 0.0, lambda quick, tell: _limits(motion, quick, tell)),
    ]
    return gathered(parts, quick, progress)


def panels(data: Sets, runs: Sets) -> list[Panel]:
    """All figures for which there is data."""
    return figures.panels(data)


def _length(part: str) -> float:
    return float(get_value(describe("paddle"), f"limbs.{part}.length"))


def _angles(motion: RowingMotion, quick: bool, progress: Progress) -> StudyPart:
    """Rows `angles`; data `angles` (phase, joint)."""
    frames = round((1 if quick else _CYCLES) * motion.period * rowing.RATE)
    out = {}
    found = None
    for row, shot in (("rms", Shot()), ("rectangle-rms", Shot(fit="rectangle"))):
        one = rowing.tracked(motion, shot, frames, lambda x: progress("the paddle's angles", x))
        turn, off = rowing.errors(one)
        out[f"track/angles/{row}"] = float(np.rad2deg(np.sqrt(np.nanmean(turn**2))))
        if found is None:
            found = one
            out["track/angles/places"] = 1e3 * float(np.sqrt(np.nanmean(off**2)))
            out["track/angles/seen"] = 100 * float(np.mean(np.isfinite(turn)))
    assert found is not None
    return StudyPart(out, {"angles": rowing.by_phase(found, motion), "rowing": found})


def _tank(quick: bool, progress: Progress) -> StudyPart:
    """Rows of markers, of the walk's features and of the swim's parameters; data `walk` and `swim`."""
    how = replace(Filming(), scale=2.15) if quick else Filming()
    seconds = _QUICK_SWIM if quick else _SWIM
    path, truth = poseidrone.walk()
    walked = tracked(path, how, poseidrone.WINDOW, lambda x: progress("the walk", 0.3 * x))
    swum = tracked(poseidrone.swim("train", seconds), how, seconds, lambda x: progress("the swim", 0.3 + 0.7 * x))
    off = np.concatenate([marker_errors(walked).ravel(), marker_errors(swum).ravel()])
    out: dict[str, float | None] = {"track/markers/rms": 1e3 * float(np.sqrt(np.nanmean(off**2)))}
    out |= poseidrone.numbers(walked, truth, poseidrone.identified(swum, "train", seconds))
    return StudyPart(out, {"walk": walked, "swim": swum})


def _limits(motion: RowingMotion, quick: bool, progress: Progress) -> StudyPart:
    if quick:
        return StudyPart({})
    path = poseidrone.swim("train", 2.0)
    return StudyPart({}, limits(motion, path, lambda x: progress("limits of the tracker", x)))
