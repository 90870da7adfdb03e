"""Parameters of a walking robot from features of its gait, in one trial or in several that differ in what is known."""

from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import xarray as xr
from jaxtyping import Float

from nectosome._renamed import former
from nectosome.description import RobotDescription, get_value
from nectosome.description.variables import Box, Variable
from nectosome.search import BatchTask, Optimiser, Start, make_optimiser
from nectosome.units import DIMENSIONS, InputError
from nectosome.units.ranges import Ranges

from ..fits.identifiability import Identifiability
from ..fits.misfit import Misfit
from .walks import FEATURES, UNITS, Walked, Walks, discrepancy

_STEP = 1e-3  # of finite differences, as a share of the ranges: contacts make features rough


@dataclass(frozen=True)
class GaitTrial:
    """What was measured of one gait: features as `Gait` has them, and quantities that differ from the robot's."""

    target: tuple[float, float, float, float]
    changes: Mapping[str, float]  # by path or alias, SI


@dataclass(frozen=True, eq=False)
class GaitFit:
    """A robot, its unknown quantities, and the gaits that it is fitted to.

    Raises InputError for what `Walks` refuses, and for what is both unknown and given in a trial.

    - seconds: of a walk, a whole number of windows [s]; of the last one features are taken.
    - error: relative standard error of the features, for the identifiability of the parameters.
    - executor: where walks are computed; in threads of this process unless given.
    """

    description: RobotDescription
    variables: tuple[Variable, ...]
    trials: tuple[GaitTrial, ...]
    seconds: float = 25.0
    window: float = 5.0
    error: float = 0.01
    executor: Executor | None = None

    def __post_init__(self):
        _ = self._walks  # raises before anything is begun

    @cached_property
    def ranges(self) -> Ranges:
        """Of the unknown."""
        return Box(self.variables)

    def walked(self, rows: Float[np.ndarray, "m n"]) -> list[Walked]:
        """Walks with each row of parameters, trial by trial."""
        m, own = len(rows), self._changed
        given = [[(own | dict(trial.changes))[name] for name in own] for trial in self.trials]
        found = self._walks(np.concatenate([np.column_stack([rows, np.tile(values, (m, 1))]) for values in given]))
        return [Walked(*(x[k * m : (k + 1) * m] for x in found)) for k in range(len(self.trials))]

    def by_trial(self, rows: Float[np.ndarray, "m n"]) -> Float[np.ndarray, "m trials"]:
        """Discrepancy of each trial (eq. 13); inf where it is NaN."""
        targets = [np.array(trial.target) for trial in self.trials]
        walked = zip(self.walked(rows), targets, strict=True)
        found = np.stack([discrepancy(one.gait, target, one.fell, self.seconds) for one, target in walked], axis=1)
        return np.where(np.isnan(found), np.inf, found)

    def task(self, by_trial: bool = False) -> BatchTask:
        """The least discrepancy of all trials together, or of each as an objective of its own."""
        if by_trial:
            return BatchTask(self.by_trial, self.ranges, len(self.trials), self.key)
        return BatchTask(lambda rows: self.by_trial(rows).sum(axis=1), self.ranges, text=self.key)

    @property
    def misfit(self) -> Misfit:
        """Features against the targets, in their standard errors."""

        def residuals(rows: Float[np.ndarray, "m n"]) -> Float[np.ndarray, "m r"]:
            walked = zip(self.walked(rows), self.trials, strict=True)
            return np.concatenate([(one.gait / trial.target - 1) / self.error for one, trial in walked], axis=1)

        return Misfit(residuals, self.ranges, step=_STEP)

    @property
    def key(self) -> str:
        """The same for the same fit only."""
        trials = [(trial.target, sorted(trial.changes.items())) for trial in self.trials]
        return f"{self.description.model_dump_json()} {trials} {self.seconds} {self.window}"

    @cached_property
    def _changed(self) -> dict[str, float]:
        """The robot's own values of the quantities that differ between trials."""
        names = tuple(dict.fromkeys(name for trial in self.trials for name in trial.changes))
        for name in names:
            if name in self.ranges.names:
                raise InputError("varies, and cannot be given too.", field=name)
        return {name: float(get_value(self.description, name)) for name in names}

    @cached_property
    def _walks(self) -> Walks:
        names = (*self.ranges.names, *self._changed)
        how = {"seconds": self.seconds, "window": self.window}
        return Walks(self.description, names, **how, executor=self.executor)


def gait_optimiser(name: str = "cmaes", evaluations: int = 3000) -> Optimiser:
    """An optimiser by its name for `GaitFit.task`: it looks everywhere, since features are rough and have many minima.

    Raises InputError as `make_optimiser` does.
    """
    everywhere = {"spread": 0.3, "restarts": 20, "unsolved": "last"} if name == "cmaes" else {}
    everywhere |= {"objective_tolerance": 0.0} if name != "nsga2" else {}  # features stay the same over wide ranges
    return make_optimiser(name, evaluations=evaluations, **everywhere)


class GaitResult(NamedTuple):
    """A walking robot, fitted to features of its gaits."""

    fit: GaitFit
    search: Start  # all candidates; of several objectives their sum
    walked: list[Walked]  # the best candidate's walk in each trial
    identifiability: Identifiability  # by the features
    as_good: float  # candidates of at most this discrepancy are as good

    def to_dataset(self) -> xr.Dataset:
        """Parameters, features, motion and history, in SI units.

        - over `parameter`: the best `value`, its range `low` to `high`; `good_low` to `good_high`, between which
          candidates are as good; `identifiable`, whether the features determine it.
        - over `trial` and `feature`: `target`, `reached`. Over `trial` and `sample`: `position.x` and `position.z` of
          the body, and its `tilt`, in the window.
        - over `evaluation`: `discrepancy` (eq. 13), of all trials together.
        """
        fit, known, summed = self.fit, self.identifiability, self.search.summed()
        good = fit.ranges.values(np.array([e.u for e in summed.close(self.as_good)]))
        series = np.stack([one.series[0] for one in self.walked])
        time = np.linspace(0.0, fit.window, series.shape[1])
        return xr.Dataset(
            {
                "value": ("parameter", good[0]),
                "low": ("parameter", fit.ranges.bounds[:, 0]),
                "high": ("parameter", fit.ranges.bounds[:, 1]),
                "good_low": ("parameter", good.min(axis=0)),
                "good_high": ("parameter", good.max(axis=0)),
                "identifiable": ("parameter", known.identifiable),
                "target": (("trial", "feature"), np.array([trial.target for trial in fit.trials])),
                "reached": (("trial", "feature"), np.stack([one.gait[0] for one in self.walked])),
                "unit_of_feature": ("feature", list(UNITS)),
                "position.x": (("trial", "sample"), series[..., 0], {"units": "m"}),
                "position.z": (("trial", "sample"), series[..., 1], {"units": "m"}),
                "tilt": (("trial", "sample"), series[..., 2], {"units": "rad"}),
                "discrepancy": ("evaluation", summed.values),
            },
            {
                "parameter": list(fit.ranges.names),
                "feature": list(FEATURES),
                "time": ("sample", time, {"units": "s"}),
                "unit": ("parameter", [DIMENSIONS[v.dimension].unit for v in fit.variables]),
            },
            {"rank": known.rank, "as_good": self.as_good, "good": len(good), "ended": self.search.message},
        )


__getattr__ = former(__name__)
