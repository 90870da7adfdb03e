"""Which experiment to make next: spread evenly, where the least is known, or where the best may be; and why."""

from dataclasses import replace
from typing import Literal, NamedTuple

import numpy as np
from jaxtyping import Float, Int
from scipy.special import ndtr

from ..fits.errors import SIDES
from .gaussian_process import Surface
from .grids import GridTable
from .method import Corrected, SimToReal
from .observe import Experiments

Aim = Literal["error", "highest", "lowest"]
_SAME = 1e-6  # boxes: conditions as near are the same
_UNLIKELY = 1e-3  # probability below which a value is not expected to better another


class Next(NamedTuple):
    """An experiment worth making."""

    conditions: Float[np.ndarray, "d"]
    expected: float
    error: float  # of what is expected; NaN where the method gives none
    reason: str


def uniform_plan(
    x: Float[np.ndarray, "n d"], count: int, made: Float[np.ndarray, "k d"] | None = None
) -> Int[np.ndarray, "m"]:
    """Points of the unit box, spread evenly: each the farthest from those before and from all `made` (Mueller 2001).

    The first is the most central one. Longer plans begin with shorter ones: no experiment is lost when more are made.
    """
    taken: list[int] = []
    for _ in range(min(count, len(x))):
        others = x[taken] if made is None else np.concatenate([made, x[taken]])
        apart = np.round(_distance(x, others), 9) if len(others) else -np.sum((x - 0.5) ** 2, axis=1)
        taken.append(int(np.argmax(apart)))
    return np.array(taken, int)


def next_experiments(
    how: SimToReal, table: GridTable, experiments: Experiments, count: int, aim: Aim = "error"
) -> list[Next]:
    """The next experiments, at points of the table where none was made.

    Each is chosen as if those before it had given what is expected of them. For "error" it is where the corrected
    simulator is known least; for "highest" or "lowest" where the best value may be bettered most (expected improvement,
    Jones et al. 1998). Where the method gives no errors it is the point farthest from all experiments.
    """
    x, chosen = table.in_box(table.points), list[Next]()
    for _ in range(count):
        made = table.in_box(experiments.conditions)
        free = np.flatnonzero(_distance(x, made) > _SAME)
        if not free.size:
            break
        fitted = how.fit(table, experiments)
        found = fitted.predict(table.points[free])
        if np.isfinite(found.error).all():
            k = int(np.argmax(found.error))
            reason = f"least known: within {SIDES * found.error[k]:.3g} {table.unit} at 95 %"
            if aim != "error":
                k, reason = _best(found, fitted, experiments, aim)
        else:
            k = int(uniform_plan(x[free], 1, made)[0])
            reason = f"{_distance(x[free], made)[k]:.2f} of the range away from all others" if len(made) else "central"
        one = Next(table.points[free[k]], float(found.mean[k]), float(found.error[k]), reason)
        chosen.append(one)
        experiments = _believing(fitted, experiments, one)
    return chosen


def _best(found: Surface, fitted: Corrected, experiments: Experiments, aim: Aim) -> tuple[int, str]:
    """Where the best value so far is expected to be bettered most; where the least is known if nothing may do so."""
    sign, unit = (1.0 if aim == "highest" else -1.0), fitted.table.unit
    best = float(np.max(sign * fitted.predict(experiments.conditions).mean))
    error = np.maximum(found.error, 1e-300)
    z = (sign * found.mean - best) / error
    gain = error * (z * ndtr(z) + np.exp(-(z**2) / 2) / np.sqrt(2 * np.pi))
    k = int(np.argmax(gain))
    if ndtr(z[k]) < _UNLIKELY:
        return int(np.argmax(found.error)), f"least known, since nothing is likely to better the {aim} so far"
    return k, f"may better the {aim} so far, {sign * best:.3g} {unit}, by {gain[k]:.2g} {unit} on the mean"


def _believing(fitted: Corrected, experiments: Experiments, one: Next) -> Experiments:
    """The experiments with one more that gave what is expected of it, with the noise that the others have."""
    noise, estimate = _noise(experiments.errors, experiments.values), experiments.estimate
    if estimate is not None:
        parameter = fitted.parameter(one.conditions[None]).mean
        errors = np.append(estimate.errors, _noise(estimate.errors, estimate.values) * np.abs(parameter))
        estimate = replace(estimate, values=np.append(estimate.values, parameter), errors=errors)
    return Experiments(
        np.concatenate([experiments.conditions, one.conditions[None]]),
        np.append(experiments.values, one.expected),
        np.append(experiments.errors, noise * abs(one.expected)),
        estimate,
    )


def _noise(errors: Float[np.ndarray, "m"], values: Float[np.ndarray, "m"]) -> float:
    """Usual error of one value, relative to it; 0 where there is none."""
    known = np.isfinite(errors) & np.isfinite(values) & (values != 0)
    return float(np.median(np.abs(errors[known] / values[known]))) if known.any() else 0.0


def _distance(x: Float[np.ndarray, "n d"], others: Float[np.ndarray, "k d"]) -> Float[np.ndarray, "n"]:
    """Distance of each point from the nearest of the others [boxes]; infinite without others."""
    return np.sqrt(np.min(np.sum((x[:, None] - others) ** 2, axis=-1), axis=1, initial=np.inf))
