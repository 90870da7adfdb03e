"""Signal processing of recordings: pure functions that propagate standard errors and record their settings."""

from .correlation import Alignment, Period, align, align_at, find_period
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
from .hum import notch
from .metadata import SE, processing
from .repeated_runs import average_repeats, combine, propagate
from .resample import resample
from .spectra import FittedSine, ValueWithError, dominant_frequency, sine, spectrum
