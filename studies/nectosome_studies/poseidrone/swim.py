"""Swimming of PoseiDRONE: Tables 1 and 2, Figs. 9 and 10, and the errors of its estimator on synthetic recordings."""

from typing import NamedTuple

import numpy as np
import xarray as xr
from jaxtyping import Float

from nectosome.identification.fits.linear import Estimate
from nectosome.identification.surge.estimators import Surge, SurgeRecording, fit_surge, physical
from nectosome.identification.surge.files import SurgeFit

from ..study import Progress, StudyPart, printed
from . import water
from .recordings import body, recording

_DRAWS = 200
_QUICK = 40
FASTEST = 15.0  # speed of the motor, section 3 [rad/s]
_SMOOTH = 0.22  # s, 11 samples: the paper prints neither the window nor the rate


class SwimEstimator(NamedTuple):
    """An estimator: its name in the rows, and the arguments of `surge`."""

    row: str
    method: str
    smooth: float | None = None


ESTIMATORS = {
    "as printed": SwimEstimator("printed", "finite_differences", _SMOOTH),
    "as printed, unfiltered": SwimEstimator("", "finite_differences"),
    "integral windows": SwimEstimator("", "integral_windows"),
    "instrumental variables": SwimEstimator("", "instrumental_variables"),
    "output error": SwimEstimator("recommended", "output_error"),
}


def part(quick: bool, progress: Progress) -> StudyPart:
    """Rows `table1`, `table2`, `swim`, `better-water`.

    Data `swim` and `swim_as_printed` (as datasets of `SurgeFit` have it), `swim_draws`.
    """
    mass, *_ = body()
    rng = np.random.default_rng(0)
    train, test = (recording(name, rng) for name in ("train", "test"))
    progress("swimming", 0.0)
    data = {
        key: SurgeFit(_found(ESTIMATORS[estimator], mass, train), (train,), (test,)).to_dataset()
        for key, estimator in (("swim", "output error"), ("swim_as_printed", "as printed"))
    }
    data["swim_draws"] = draws(_QUICK if quick else _DRAWS, progress)
    table2 = {row: None for row in printed("poseidrone") if row.startswith("poseidrone/table2/")}  # not published
    numbers = {**_table1(), **table2, **_alike(data["swim_as_printed"]), **_errors(data["swim_draws"])}
    numbers |= {"poseidrone/section3/pulses": FASTEST / (2 * np.pi)}
    return StudyPart(numbers | water.numbers(), data)


def of_statistics(computed: Float[np.ndarray, "n"], recorded: Float[np.ndarray, "n"]) -> dict[str, float]:
    """By how much mean, standard deviation and maximum of a computed signal differ from those recorded [percent].

    Tables 2 and 4 print three numbers each under these names, the maximum smaller than the mean. As percentages of one
    error signal that cannot be; as errors of three statistics, each in percent of that statistic, it can.
    """
    of = {"mean": np.mean, "std": np.std, "max": np.max}
    return {name: 100 * float(one(computed) / one(recorded) - 1) for name, one in of.items()}


def _alike(found: xr.Dataset) -> dict[str, float | None]:
    """What Table 2 is of synthetic recordings, by its reading in `of_statistics`."""
    numbers: dict[str, float | None] = {}
    for k, used in enumerate(found["used"].values):
        one = found.isel(sample=found["of"].values == k)
        off = of_statistics(one["computed"].values, one["measured"].values)
        numbers |= {f"poseidrone/swim/statistics/{used}/{name}": x for name, x in off.items()}
    return numbers


def _found(estimator: SwimEstimator, mass: float, swum: SurgeRecording) -> Surge:
    return fit_surge([swum], mass, estimator.method, estimator.smooth)


def draws(count: int, progress: Progress) -> xr.Dataset:
    """Parameters found in each of several draws of noise, by each estimator.

    `value`, `low`, `high` (estimator, draw, parameter), the latter ends of 95 % intervals; `truth` (parameter); `bias`
    of the mean and `coverage`, the share of intervals that contain the true value [percent] (estimator, parameter).
    """
    mass, *truth = body()
    rng = np.random.default_rng(1)
    found: list[list[Float[np.ndarray, "2 3"]]] = [[] for _ in ESTIMATORS]
    for k in range(count):
        progress("estimators on synthetic recordings", k / count)
        swum = recording("train", rng)
        for estimator, into in zip(ESTIMATORS.values(), found, strict=True):
            estimate = _found(estimator, mass, swum).physical
            into.append(np.column_stack([estimate.values, estimate.interval()]))
    values = np.array(found)
    dims = ("estimator", "draw", "parameter")
    made = xr.Dataset(
        {name: (dims, values[..., i]) for i, name in enumerate(("value", "low", "high"))}
        | {"truth": ("parameter", np.array(truth))},
        coords={"estimator": [*ESTIMATORS], "parameter": ["added_mass", "drag"], "unit": ("parameter", ["kg", "kg/m"])},
    )
    inside = (made["low"] <= made["truth"]) & (made["truth"] <= made["high"])
    return made.assign(bias=100 * (made["value"].mean("draw") / made["truth"] - 1), coverage=100 * inside.mean("draw"))


def _errors(made: xr.Dataset) -> dict[str, float | None]:
    """Bias and coverage by scorecard row; the coverage is that of the worse parameter."""
    numbers: dict[str, float | None] = {}
    for name, estimator in ESTIMATORS.items():
        if estimator.row:
            off = made["bias"].sel(estimator=name)
            numbers |= {
                f"poseidrone/swim/{estimator.row}/bias_mas": float(off.sel(parameter="added_mass")),
                f"poseidrone/swim/{estimator.row}/bias_lambda": float(off.sel(parameter="drag")),
                f"poseidrone/swim/{estimator.row}/coverage": float(made["coverage"].sel(estimator=name).min()),
            }
    return numbers


def _table1() -> dict[str, float | None]:
    """What Table 1's numbers come to, when its standard errors are those of gamma and alpha."""
    book = printed("poseidrone")
    mass, added, drag = body()
    sigma_gamma, sigma_alpha = (book[f"poseidrone/table1/sigma_{name}"]["printed"] for name in ("mas", "lambda"))
    gamma = 1 / (mass + added)
    theta = Estimate(np.array([-drag * gamma, gamma]), np.diag([sigma_alpha**2, sigma_gamma**2]), np.zeros(0))
    p_alpha, p_gamma = theta.percent
    found = physical(theta, mass)
    sigma_mas, sigma_lambda = found.errors
    p_mas, p_lambda = found.percent
    return {
        "poseidrone/table1/p_gamma": float(p_gamma),
        "poseidrone/table1/p_alpha": float(p_alpha),
        "poseidrone/table1/sigma_mas": float(sigma_mas),
        "poseidrone/table1/sigma_lambda": float(sigma_lambda),
        "poseidrone/table1/p_mas": float(p_mas),
        "poseidrone/table1/p_lambda": float(p_lambda),
    }
