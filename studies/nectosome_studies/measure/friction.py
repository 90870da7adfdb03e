"""Friction tests of two pneumatic actuators (3D-printed-pneumatic-actuator, E. Zillen, TU Delft; CC0).

The logs ship beside this file, as they are in her repository (`pneumatic.LICENSE`).

An actuator under constant pressure is drawn out and let back, ten times; half the difference of both directions is
friction. Dahl's model is fitted to every other run and compared with the rest.
"""

from collections.abc import Sequence
from importlib.resources import as_file, files
from itertools import pairwise
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
import xarray as xr
from jaxtyping import Array, Float
from scipy.ndimage import median_filter
from scipy.special import stdtrit

from nectosome.core import Block
from nectosome.drives import Chain, Curve, Dahl, Gain, Parallel, Polynomial, respond
from nectosome.identification.fits.errors import range_errors
from nectosome.identification.fits.misfit import Misfit, Response, output_misfit
from nectosome.measure import calibrate, read
from nectosome.measure.signals import StrokeWindow, split, strokes
from nectosome.units.ranges import Ranges

TESTS = {"circle": "Circle_3bar.csv", "kdn": "KDN_3bar.csv"}  # by the shape of the actuator
_EXCURSION = 10e-3  # m, between turning points
_PLACES = np.linspace(5e-3, 30e-3, 26)  # m, at which strokes out and back are compared; turns lie outside
_SENSORS = {"laser": "distance", "pressure_sensor": "pressure", "force_sensor": "force"}
_SAMPLES = (40, 240, 160)  # before a run, on its stroke out and back: one in about 20 ms
_BEFORE = 1.0  # s of the stroke before: it brings the friction to its state
_SPIKES = 5  # samples of the distance of which the middle one counts: the laser jumps by 0.6 mm for one at a time
_NAMES = ("limit", "stiffness", "offset", "slope", "area")  # [N, N/m, N, N/m, m2]
RANGES = Ranges(_NAMES, [0.1, 1e2, 0, -2e3, 0], [100, 1e7, 500, 2e3, 2e-3], log=_NAMES[:2])
MODELS = {  # where a fit begins, and which parameters stay fixed there
    "dahl": (np.array([5.0, 2e4, 150.0, 0.0, 0.0]), ("area",)),
    "dahl-pressure": (np.array([5.0, 2e4, 0.0, 0.0, 5e-4]), ("offset", "slope")),
}


class FrictionTest(NamedTuple):
    """A recording and its runs; arrays by run."""

    recording: xr.Dataset
    runs: list[tuple[StrokeWindow, StrokeWindow]]  # strokes out and back
    friction: np.ndarray  # half the mean difference of the pulls out and back [N]
    loop_area: np.ndarray  # work lost in a run between the first and the last place [J]
    pulls: np.ndarray  # pull on the strokes out and back at `places` [run, 2, place] [N]
    places: np.ndarray  # [m]
    calibrations: xr.Dataset  # gain and zero of each sensor, and what is left


class FrictionRun(NamedTuple):
    """A stroke out and back, and the end of the stroke before."""

    drawn: Float[np.ndarray, "n 2"]  # distance [m] and pressure [Pa]
    force: Float[np.ndarray, "n"]  # [N]
    begin: int  # sample from which on it counts


class Fitted(NamedTuple):
    """Parameters in the order of `RANGES`, and their errors of prediction."""

    theta: Float[np.ndarray, "5"]
    half: Float[np.ndarray, "5"]  # of 95 % intervals, from the scatter of the runs
    train: float  # root mean square error in percent of the range
    held_out: float
    correlation: float  # of neighbouring residuals of the runs held out


class Comparison(NamedTuple):
    """The fit of each model, by name, and errors of two plain predictions of the runs held out [percent]."""

    fits: dict[str, Fitted]
    curve: float  # of a straight line over the distance
    repeat: float  # of the mean of the runs fitted to, at the same share of the time of a stroke


def friction_test(name: str) -> FrictionTest:
    """One of the `TESTS`, split into runs, each a stroke out and back."""
    folder = files("nectosome_studies").joinpath("measure")
    with as_file(folder.joinpath(TESTS[name])) as log, as_file(folder.joinpath("pneumatic.yaml")) as sheet:
        recording = read(log, sheet)
    found = strokes(recording["distance"], _EXCURSION)
    pairs = [(a, b) for a, b in pairwise(found) if a.change > 0 > b.change]
    pulls = np.array([[_pull(part) for part in split(recording, pair)] for pair in pairs])
    difference = pulls[:, 0] - pulls[:, 1]
    return FrictionTest(
        recording,
        pairs,
        0.5 * difference.mean(axis=1),
        np.trapezoid(difference, _PLACES, axis=1),
        pulls,
        _PLACES,
        xr.concat(
            [calibrate(recording[sensor], recording[quantity]) for sensor, quantity in _SENSORS.items()],
            xr.DataArray(list(_SENSORS), dims="sensor", name="sensor"),
        ),
    )


def _pull(stroke: xr.Dataset) -> np.ndarray:
    """Pull at `_PLACES` on a stroke in one direction, but for noise [N]."""
    order = np.argsort(stroke["distance"].values, kind="stable")
    return np.interp(_PLACES, stroke["distance"].values[order], stroke["force"].values[order])


def friction(theta: Float[Array, "5"]) -> Block:
    r"""Pull F [N] over distance x [m] and pressure p [Pa]: $F = offset + slope\,x + area\,p + Dahl(x)$."""
    rubbing = Parallel((Curve(Polynomial(theta[2:4])), Dahl(theta[0], theta[1])))
    return Parallel((Chain((Gain(jnp.ones(2)), rubbing)), Gain(theta[4])))


def runs_of(test: FrictionTest) -> list[FrictionRun]:
    """Runs at as many samples each; of one that has a gap near its start what comes after it counts."""
    time = test.recording["time"].values
    distance = median_filter(test.recording["distance"].values, _SPIKES, mode="nearest")
    signals = (distance, test.recording["pressure"].values, test.recording["force"].values)
    after_gap = time[1 + int(np.argmax(np.diff(time)))]  # the longest of each file, in the first stroke
    out = []
    for stroke, back in test.runs:
        edges = (max(stroke.start - _BEFORE, time[0]), stroke.start, back.start, back.end)
        parts = [np.linspace(edges[k], edges[k + 1], n, endpoint=k == 2) for k, n in enumerate(_SAMPLES)]
        at = np.concatenate(parts)
        x, p, F = (np.interp(at, time, signal) for signal in signals)
        begin = int(np.searchsorted(at, after_gap)) if stroke.start < after_gap < stroke.end else 0
        out.append(FrictionRun(np.stack([x, p], axis=1), F, max(begin, _SAMPLES[0])))
    return out


def compare(runs: Sequence[FrictionRun]) -> Comparison:
    """Fit the models to every other run from the first on, and predict those between."""
    train, held_out = runs[::2], runs[1::2]
    misfit = output_misfit(
        friction,
        RANGES,
        [Response(f"run {2 * i + 1}", 1.0, run.drawn, run.force, 1.0, run.begin) for i, run in enumerate(train)],
    )
    measured = _counted(held_out)
    line = np.polyfit(np.concatenate([run.drawn[run.begin :, 0] for run in train]), _counted(train), 1)
    straight = np.polyval(line, np.concatenate([run.drawn[run.begin :, 0] for run in held_out]))
    whole = np.mean([run.force for run in train if run.begin == _SAMPLES[0]], axis=0)
    mean = np.concatenate([whole[run.begin :] for run in held_out])
    fits = {name: _fitted(misfit, name, train, held_out) for name in MODELS}
    return Comparison(fits, range_errors(straight, measured)[0], range_errors(mean, measured)[0])


def predicted(theta: Float[np.ndarray, "5"], run: FrictionRun) -> Float[np.ndarray, "n"]:
    """Pull from where a run counts [N]."""
    return np.asarray(respond(friction(jnp.asarray(theta)), run.drawn, 1.0))[run.begin :]


def to_dataset(runs: Sequence[FrictionRun], found: Comparison) -> xr.Dataset:
    """A run held out with its predictions, along `sample`, and numbers by `model` and `parameter`."""
    run = runs[5]
    models = list(found.fits.values())
    return xr.Dataset(
        {
            "distance": ("sample", run.drawn[run.begin :, 0], {"units": "m"}),
            "measured": ("sample", run.force[run.begin :], {"units": "N"}),
            "predicted": (("model", "sample"), [predicted(fit.theta, run) for fit in models], {"units": "N"}),
            "value": (("model", "parameter"), [fit.theta for fit in models]),
            "half": (("model", "parameter"), [fit.half for fit in models]),
            "held_out": ("model", [fit.held_out for fit in models], {"units": "%"}),
            "correlation": ("model", [fit.correlation for fit in models]),
        },
        coords={"model": list(found.fits), "parameter": list(RANGES.names)},
        attrs={"run": 6, "curve": found.curve, "repeat": found.repeat},
    )


def _fitted(misfit: Misfit, name: str, train: Sequence[FrictionRun], held_out: Sequence[FrictionRun]) -> Fitted:
    """The joint fit; half intervals of a mean by Student's t from fits to each run alone."""
    start, fixed = MODELS[name]
    theta = misfit.fit(start, fixed).theta
    ends = np.cumsum([0, *(len(run.force) - run.begin for run in train)])
    alone = [_only(misfit, slice(a, b)).fit(theta, fixed).theta for a, b in pairwise(ends)]
    n = len(train)
    half = stdtrit(n - 1, 0.975) * np.std(alone, axis=0, ddof=1) / np.sqrt(n)
    left = [predicted(theta, run) - run.force[run.begin :] for run in held_out]
    before, after = np.concatenate([e[:-1] for e in left]), np.concatenate([e[1:] for e in left])
    correlation = float(np.corrcoef(before, after)[0, 1])
    return Fitted(theta, half, _error(theta, train), _error(theta, held_out), correlation)


def _error(theta: Float[np.ndarray, "5"], runs: Sequence[FrictionRun]) -> float:
    return range_errors(np.concatenate([predicted(theta, run) for run in runs]), _counted(runs))[0]


def _only(misfit: Misfit, part: slice) -> Misfit:
    """Some of the residuals, by the same compiled program."""
    jacobian = misfit.jacobian
    assert jacobian is not None
    return Misfit(lambda rows: misfit.residuals(rows)[:, part], misfit.ranges, lambda theta: jacobian(theta)[part])


def _counted(runs: Sequence[FrictionRun]) -> Float[np.ndarray, "n"]:
    return np.concatenate([run.force[run.begin :] for run in runs])
