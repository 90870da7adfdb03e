"""Signal processing of recordings: pure functions that propagate standard errors and record their settings."""

from .align import Alignment, align, align_at
from .correlation import Period, find_period
from .cycles import average_cycles, loop_area, regular_starts, split_cycles
from .events import (
    StrokeWindow,
    Window,
    crossings,
    peaks,
    split,
    split_at_idle,
    split_at_resets,
    strokes,
    windows_where,
)
from .features import features, mean, rms, slope
from .filters import detrend, lowpass, smooth
from .metadata import SE, processing
from .repeated_runs import average_repeats, combine, propagate
from .resample import resample
from .spectra import FittedSine, ValueWithError, dominant_frequency, sine, spectrum

__all__ = [
    "SE",
    "Alignment",
    "FittedSine",
    "Period",
    "StrokeWindow",
    "ValueWithError",
    "Window",
    "align",
    "align_at",
    "average_cycles",
    "average_repeats",
    "combine",
    "crossings",
    "detrend",
    "dominant_frequency",
    "features",
    "find_period",
    "loop_area",
    "lowpass",
    "mean",
    "peaks",
    "processing",
    "propagate",
    "regular_starts",
    "resample",
    "rms",
    "sine",
    "slope",
    "smooth",
    "spectrum",
    "split",
    "split_at_idle",
    "split_at_resets",
    "split_cycles",
    "strokes",
    "windows_where",
]
