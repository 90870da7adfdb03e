"""Identification: Table 1, Figs. 3, 5 and 6."""

import equinox as eqx
import numpy as np
import xarray as xr

from nectosome.drives import Chain, respond
from nectosome.identification.fits.errors import range_errors
from nectosome.identification.hysteresis.files import HysteresisFit
from nectosome.identification.hysteresis.fit import HysteresisModel, Identified, fit_hysteresis
from nectosome.identification.hysteresis.trials import PressureTrial

from ..study import Progress, StudyPart, printed
from .plant import BAR, HELD_OUT, LARGEST, MM, RECORDED_DT, TRAIN, A, dynamics, hysteresis, plant, recorded, waves

STARTS, _QUICK = 20, 5
_SAME = 1e-6  # relative difference of what is left: the same optimum
_AREAS = np.geomspace(0.02, 3.0, 13)  # Hz
_SAMPLES = 2000  # of a period, for areas of loops
_SPAN = (0.05, 0.95)  # of the ranges, on their scales, from which starts are drawn


def part(quick: bool, progress: Progress) -> StudyPart:
    """Fits to six recordings as the paper makes them, with the valve's limit ignored, and fitted; two held out."""
    progress("recordings", 0.0)
    train = [recorded(f) for f in TRAIN]
    held_out = {f"val{round(10 * f):02d}": recorded(f) for f in HELD_OUT}
    progress("fits", 0.2)
    ignored, fitted = fit_hysteresis(train), fit_hysteresis(train, slew=True)
    progress("starts", 0.5)
    clean = [recorded(f, limit=False) for f in TRAIN]
    best = fit_hysteresis(clean)
    progress("loops", 0.9)
    numbers: dict[str, float | None] = {
        "fishtail/table1/omega_n": fitted.theta["frequency"],
        "fishtail/table1/zeta": fitted.theta["damping"],
        "fishtail/table1/gain": float(fitted.slopes[-1]) * BAR / MM,
        "fishtail/identify/starts": _same(clean, best, _QUICK if quick else STARTS),
        "fishtail/table1/a0": A[2],
        "fishtail/table1/a2": A[0],
        "fishtail/table1/c10": _without_the_last(),
        "fishtail/eq1/periods": 4,
        **{row: None for row, entry in printed("fishtail").items() if entry["kind"] == "missing"},
    }
    for prefix, found in (("", ignored), ("valve/", fitted)):
        for name, trials in {"train": train, **{name: [one] for name, one in held_out.items()}}.items():
            rms, largest = _errors(found, trials)
            row = f"fishtail/identify/{prefix}{name}"
            numbers |= {f"{row}/e_rmsp": rms, f"{row}/e_mp": largest}
    return StudyPart(
        numbers,
        {
            "fishtail_train": _series(train, ignored, fitted),
            "fishtail_held_out": _series([*held_out.values()], ignored, fitted),
            "fishtail_areas": areas(),
            "fishtail_told": HysteresisFit(fitted, tuple(train), (*held_out.values(),)).to_dataset(),
        },
    )


def areas() -> xr.Dataset:
    """Area of the loop of displacement over pressure under a sine of 0.6 bar, as a share of the box around it."""
    found = []
    for frequency in _AREAS:
        phase = 2 * np.pi * np.arange(4 * _SAMPLES + 1) / _SAMPLES
        p = LARGEST * np.sin(phase)
        y = np.asarray(respond(plant(), p, 1 / (frequency * _SAMPLES)))
        last = slice(-_SAMPLES - 1, None)
        found.append(-np.trapezoid(y[last], p[last]) / (np.ptp(p[last]) * np.ptp(y[last])))
    return xr.Dataset({"area": ("frequency", found)}, {"frequency": ("frequency", _AREAS, {"units": "Hz"})})


def _same(trials: list[PressureTrial], best: Identified, count: int) -> float:
    """Share of starts, drawn from the ranges, that end where the default one does [percent]."""
    model = HysteresisModel(tuple(trials))
    starts = model.ranges.values(np.random.default_rng(0).uniform(*_SPAN, size=(count, 2)))
    ends = [fit_hysteresis(trials, start=start).noise for start in starts]
    return 100 * sum(abs(end / best.noise - 1) < _SAME for end in ends) / count


def _without_the_last() -> float:
    """Largest change of the displacement, under the pressure of eq. 1, without the tenth play operator [mm]."""
    plays = hysteresis()
    fewer = eqx.tree_at(lambda one: one.weights, plays, plays.weights.at[-1].set(0.0))
    p = waves(TRAIN[0], RECORDED_DT)
    with_all, without = (np.asarray(respond(Chain((one, dynamics())), p, RECORDED_DT)) for one in (plays, fewer))
    return round(float(np.max(np.abs(with_all - without))) / MM, 9)  # less is rounding


def _modelled(found: Identified, trial: PressureTrial) -> np.ndarray:
    return np.asarray(respond(found.block(), trial.pressure, trial.dt))


def _errors(found: Identified, trials: list[PressureTrial]) -> tuple[float, float]:
    """Errors of all recordings together [percent of their range]."""
    model = np.concatenate([_modelled(found, trial) for trial in trials])
    return range_errors(model, np.concatenate([trial.displacement for trial in trials]))


def _series(trials: list[PressureTrial], ignored: Identified, fitted: Identified) -> xr.Dataset:
    """Command, displacement, and what both models make of it, over time; NaN after the end of the shorter ones."""
    longest = max(len(trial.pressure) for trial in trials)

    def rows(parts: list[np.ndarray]) -> np.ndarray:
        return np.stack([np.pad(x, (0, longest - len(x)), constant_values=np.nan) for x in parts])

    over = ("recording", "time")
    return xr.Dataset(
        {
            "pressure": (over, rows([trial.pressure for trial in trials]), {"units": "Pa"}),
            "displacement": (over, rows([trial.displacement for trial in trials]), {"units": "m"}),
            "ignored": (over, rows([_modelled(ignored, trial) for trial in trials]), {"units": "m"}),
            "fitted": (over, rows([_modelled(fitted, trial) for trial in trials]), {"units": "m"}),
        },
        {
            "recording": [trial.name for trial in trials],
            "time": ("time", trials[0].dt * np.arange(longest), {"units": "s"}),
        },
    )
