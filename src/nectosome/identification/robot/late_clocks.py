r"""Residuals that look like clocks that are late, or run fast or slow, where that is not free.

Readings that are late by $\tau$ leave residuals along their own rates; those of a clock that is fast by the share
$\rho$, along the rates times the time. What of these the free parameters cannot take, $s = (1 - J J^+)\,\partial
r/\partial \tau$, is regressed on the residuals r (the score test of Rao 1948, Proc. Cambridge Phil. Soc. 44, 50, for a
parameter that was left out):

$$ \hat\tau = -\frac{s^T r}{s^T s} $$

Columns of one named clock are tested together, all others one by one. Where this is not chance, the fit is made again
with the shifts free, and with those drifts that are not chance beside them. What is then further from 0 than chance
puts it, by what the residuals of that fit are and how they are correlated, is told. Chance is one in a thousand.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.special import chdtri

from nectosome.description.variables import Variable
from nectosome.measure.signals.noise import correlation_time
from nectosome.units import InputError, show_quantity

from ..fits.errors import SIDES
from ..fits.identifiability import identifiability
from .misfit import RobotMisfit
from .trial_clocks import DRIFT, SHIFT, TrialClock
from .trials import RobotTrial

_CHANCE = 1e-3  # of a warning, with a clock that is right
_CANDIDATE = 0.05  # the same, of trying: where much else is wrong as well, the first regression is rough
_LEAST = 0.01  # of the time between samples: less is how exactly a motion is computed
_WIDE, _SAMPLES = 3.0, 5  # range of a shift: times its first estimate, and samples
_SHARE = 0.25  # of a recording, the most that a shift may be
_COARSE = 1e-3  # gain of chi2 by the last step
_TAKEN = 1e-6  # of a derivative: what is left of one that the free parameters take
_NAMED = 3  # recordings in a sentence


class _Unit(NamedTuple):
    """Columns of a trial that have one clock, as far as it is known."""

    trial: int
    device: str  # name of their clock; empty where it has none
    columns: tuple[int, ...]
    label: str  # in sentences
    beside: str  # name of the column beside which a clock is to be named; empty where none is

    def clock(self, what: str) -> str:
        """Name of its shift or drift in a fit."""
        return f"{what} beside {self.label}"


class _Slopes(NamedTuple):
    """Residuals, and their derivatives by the parameters, and by the shift and the drift of each unit."""

    residuals: Float[np.ndarray, "r"]
    parameters: Float[np.ndarray, "r p"]
    shifts: Float[np.ndarray, "r u"]
    drifts: Float[np.ndarray, "r u"]


class _Estimate(NamedTuple):
    """How late [s] or how fast a unit is."""

    unit: _Unit
    value: float
    error: float


def late_clocks(
    problem: RobotMisfit,
    theta: Float[np.ndarray, "p"],
    errors: Float[np.ndarray, "k"],
    found: Sequence[Variable],
) -> list[str]:
    """Sentences where readings seem late or early, or their clocks fast or slow: by how much, and how to free that.

    `errors` are standard errors of the columns, `found` the robot's own variables. Nothing where no fit with that free
    can be made, nor where rows are shapes at rest.
    """
    if any(trial.rows is not None for trial in problem.trials):
        return []
    units = [unit for i, trial in enumerate(problem.trials) for unit in _units(i, trial, problem)]
    slopes = _slopes(problem, theta, errors, units)
    shifts, fast = _shifts(problem, slopes), _drifts(problem, slopes, units)
    free = _beyond(slopes.parameters, slopes.shifts)
    there = np.linalg.norm(free, axis=0) > _TAKEN * np.linalg.norm(slopes.shifts, axis=0)
    if shifts is None and not fast:
        return []
    late = {k: 0.0 if shifts is None else float(shifts[k]) for k in np.flatnonzero(there).tolist()}
    try:
        seen = _freed(problem, theta, errors, found, units, late, fast)
        if any(k not in seen[DRIFT] for k in fast):
            fast = {k: x for k, x in fast.items() if k in seen[DRIFT]}
            seen = _freed(problem, theta, errors, found, units, late, fast)
    except InputError:
        return []
    return [*_late(_whole(problem, units, [*seen[SHIFT].values()])), *_fast([*seen[DRIFT].values()])]


def _units(i: int, trial: RobotTrial, problem: RobotMisfit) -> list[_Unit]:
    named = {c: clock for clock in trial.clocks if clock.name for c in clock.columns}
    there = [c for c in range(len(problem.compared)) if np.isfinite(trial.measured[c]).any()]
    keys = dict.fromkeys(named[c].name if c in named else c for c in there)
    units = list[_Unit]()
    for key in keys:
        if isinstance(key, str):
            columns = tuple(c for c in there if c in named and named[c].name == key)
            units.append(_Unit(i, key, columns, f"{key} of {trial.name}", ""))
        else:
            column = problem.compared[key].column
            units.append(_Unit(i, "", (key,), f"{column} of {trial.name}", column))
    return units if len(units) > 1 or units[0].device else [units[0]._replace(label=trial.name, beside="")]


def _freed(
    problem: RobotMisfit,
    theta: Float[np.ndarray, "p"],
    errors: Float[np.ndarray, "k"],
    found: Sequence[Variable],
    units: Sequence[_Unit],
    late: Mapping[int, float],
    fast: Mapping[int, float],
) -> dict[str, dict[int, _Estimate]]:
    """What is not 0 of shifts and drifts in a fit with these free, by their kind and the places of their units.

    A shift that many units have, and that is free already, keeps its value: theirs are beside it. Raises InputError
    where there is no such fit.
    """
    values = dict(zip(problem.box.names, theta.tolist(), strict=True))
    freed = {SHIFT: {*late}, DRIFT: {*fast}}
    held = {
        getattr(clock, what).name
        for what, places in freed.items()
        for k in places
        for clock in problem.trials[units[k].trial].clocks
        if {*units[k].columns} <= {*clock.columns} and isinstance(getattr(clock, what), Variable)
    }
    trials, begins = list[RobotTrial](), dict(values)
    for i, trial in enumerate(problem.trials):
        step, length = float(np.median(np.diff(trial.time))), float(trial.time[-1])
        clocks = list[TrialClock]()
        for k, unit in ((k, unit) for k, unit in enumerate(units) if unit.trial == i):
            wide = min(_WIDE * abs(late.get(k, 0.0)) + _SAMPLES * step, _SHARE * length)
            share = min(_WIDE * abs(fast.get(k, 0.0)) + _SAMPLES * step / length, _SHARE)
            shift = Variable(unit.clock(SHIFT), -wide, wide, False, "time") if k in late else 0.0
            drift = Variable(unit.clock(DRIFT), -share, share, False, "number") if k in fast else 0.0
            begins |= {unit.clock(SHIFT): late.get(k, 0.0), unit.clock(DRIFT): fast.get(k, 0.0)}
            clocks.append(TrialClock(unit.device, unit.columns, shift, drift))
        own = [clock.known({name: values[name] for name in held}) for clock in trial.clocks]
        trials.append(trial.with_clocks([*clocks, *own]))
    free = RobotMisfit(trials, found, problem.compared, problem.bend, problem.rtol)
    free.each = problem.each
    names = free.box.names
    best = free.misfit(errors).fit(np.array([begins[name] for name in names]), gain=_COARSE).theta
    left = free.misfit(errors).at(free.box.places(best)[None])[0]
    tau = max(correlation_time(row) for row in _rows(free, left))
    scale = np.sqrt(tau * left @ left / max(left.size - len(names), 1))
    ends = identifiability(free.misfit(errors * scale), best).intervals()
    seen: dict[str, dict[int, _Estimate]] = {SHIFT: {}, DRIFT: {}}
    for what, places in freed.items():
        for k in places:
            low, high, below, above = ends[names.index(units[k].clock(what))]
            value, error = float(best[names.index(units[k].clock(what))]), (high - low) / (2 * SIDES)
            time = problem.trials[units[k].trial].time
            least = _LEAST * float(np.median(np.diff(time))) / (1.0 if what == SHIFT else float(time[-1]))
            if below and above and abs(value) > least and value**2 > chdtri(1, _CHANCE / len(units)) * error**2:
                seen[what][k] = _Estimate(units[k], value, error)
    return seen


def _whole(problem: RobotMisfit, units: Sequence[_Unit], seen: Sequence[_Estimate]) -> list[_Estimate]:
    """The same, with one for a recording all of whose columns are late by as much."""
    out = list[_Estimate]()
    for i, trial in enumerate(problem.trials):
        own = [one for one in seen if one.unit.trial == i]
        weights = np.array([one.error**-2 for one in own])
        mean = float(weights @ [one.value for one in own] / weights.sum()) if own else 0.0
        apart = sum(w * (one.value - mean) ** 2 for w, one in zip(weights, own, strict=True))
        same = len(own) > 1 and len(own) == sum(unit.trial == i for unit in units)
        if same and apart < chdtri(len(own) - 1, _CHANCE):
            unit = _Unit(i, "", tuple(range(len(problem.compared))), trial.name, "")
            own = [_Estimate(unit, mean, float(weights.sum() ** -0.5))]
        out += own
    return out


def _late(seen: Sequence[_Estimate]) -> list[str]:
    """A sentence of what is late or early."""
    if not seen:
        return []
    span = _round_up(2 * max(abs(one.value) for one in seen))
    plain = any(not one.unit.device and not one.unit.beside for one in seen)
    return [
        f"residuals look as if the clock of the readings were wrong: {_listed(seen, _how_late)}. If so, the parameters "
        f"are wrong too. Let the fit find it: {_freeing(seen, f'{SHIFT}: -{span}..{span} s')}"
        + (f", or --shift=-{span}..{span}s of all" if plain else "")
    ]


def _fast(seen: Sequence[_Estimate]) -> list[str]:
    """A sentence of clocks that run fast or slow."""
    if not seen:
        return []
    span = _round_up(200 * max(abs(one.value) for one in seen))
    return [
        f"residuals look as if the clock of the readings ran fast or slow: {_listed(seen, _how_fast)}. If so, the "
        f"parameters are wrong too. Let the fit find it: {_freeing(seen, f'{DRIFT}: -{span}..{span} %')}. A camera's "
        "29.97 frames/s taken for 30 make it slow by 0.1 %: time: {rate: 29.97 Hz} in its sheet mends that"
    ]


def _listed(seen: Sequence[_Estimate], how: Callable[[_Estimate], str]) -> str:
    largest = sorted(seen, key=lambda one: -abs(one.value))
    more = f" and {len(seen) - _NAMED} more" if len(seen) > _NAMED else ""
    return f"{', '.join(f'{one.unit.label} {how(one)}' for one in largest[:_NAMED])}{more}"


def _how_late(one: _Estimate) -> str:
    shown, *sides = (show_quantity(x, "time") for x in (abs(one.value), *_ends(one)))
    return f"{'late' if one.value > 0 else 'early'} by {shown} (95 %: {sides[0]} to {sides[1]})"


def _how_fast(one: _Estimate) -> str:
    way, (low, high) = "fast" if one.value > 0 else "slow", _ends(one)
    return f"{way} by {100 * abs(one.value):.2g} % (95 %: {100 * low:.2g} to {100 * high:.2g} %)"


def _ends(one: _Estimate) -> list[float]:
    return sorted(abs(one.value + side * SIDES * one.error) for side in (-1, 1))


def _freeing(seen: Sequence[_Estimate], field: str) -> str:
    """What frees clocks, and where it is written."""
    devices = dict.fromkeys(one.unit.device for one in seen if one.unit.device)
    columns = dict.fromkeys(one.unit.beside for one in seen if one.unit.beside)
    ways = [f"{field} under clocks.{name} in the campaign" for name in devices]
    ways += [f"clocks: {{{name}: {{{field}}}}} in the campaign and clock: {name} beside its column" for name in columns]
    if any(not one.unit.device and not one.unit.beside for one in seen):
        ways.append(f"{field} of a recording in the campaign")
    return "; ".join(ways)


def _shifts(problem: RobotMisfit, slopes: _Slopes) -> Float[np.ndarray, "u"] | None:
    """How late each unit seems to first order [s]; None where that is chance."""
    r, J, S, _ = slopes
    S = _beyond(J, S)
    late, left = _regressed(S, r)
    score = (r @ r - left @ left) / _variance(problem, left, J.shape[1] + late.size)
    return late if score > chdtri(late.size, _CANDIDATE) else None


def _drifts(problem: RobotMisfit, slopes: _Slopes, units: Sequence[_Unit]) -> dict[int, float]:
    """How fast units seem to first order, by their places, beside any lateness; those for which that is no chance."""
    r, J, S, R = slopes
    both = np.hstack([J, S])
    beyond, r = _beyond(both, R), _beyond(both, r[:, None])[:, 0]
    there = np.flatnonzero(np.linalg.norm(beyond, axis=0) > _TAKEN * np.linalg.norm(R, axis=0))
    rates, left = _regressed(beyond[:, there], r)
    inverse = np.linalg.pinv(beyond[:, there].T @ beyond[:, there])
    variance = _variance(problem, left, both.shape[1] + rates.size) * np.maximum(np.diag(inverse), 0.0)
    seen = rates**2 > chdtri(1, _CHANCE / len(units)) * variance
    return {int(k): float(rate) for k, rate, is_seen in zip(there, rates, seen, strict=True) if is_seen}


def _slopes(
    problem: RobotMisfit, theta: Float[np.ndarray, "p"], errors: Float[np.ndarray, "k"], units: Sequence[_Unit]
) -> _Slopes:
    misfit = problem.misfit(errors)
    u = problem.box.places(theta)
    r, J = misfit.at(u[None])[0], misfit.derivatives(u)
    S, R = np.zeros((2, r.size, len(units)))
    begin = 0
    for i, trial in enumerate(problem.trials):
        there, by_shift = np.isfinite(trial.measured), -problem.rates(i, theta) / errors[:, None]
        rows = slice(begin, begin + int(there.sum()))
        for k, unit in enumerate(units):
            if unit.trial == i:
                own = np.where(np.isin(np.arange(len(errors)), unit.columns)[:, None], by_shift, 0.0)
                S[rows, k], R[rows, k] = own[there], (own * trial.time)[there]
        begin = rows.stop
    return _Slopes(r, J, S, R)


def _regressed(A: Float[np.ndarray, "r u"], r: Float[np.ndarray, "r"]) -> tuple[np.ndarray, np.ndarray]:
    """What A must be taken by to leave least of r, and what is left."""
    x = -np.linalg.lstsq(A, r, rcond=None)[0]
    return x, r + A @ x


def _beyond(taken: Float[np.ndarray, "r k"], S: Float[np.ndarray, "r i"]) -> Float[np.ndarray, "r i"]:
    """What of the columns of S those of `taken` cannot take."""
    return S - taken @ np.linalg.lstsq(taken, S, rcond=None)[0]


def _variance(problem: RobotMisfit, left: Float[np.ndarray, "r"], parameters: int) -> float:
    """Variance of a residual, times the samples over which residuals are correlated."""
    tau = max(correlation_time(row) for row in _rows(problem, left))
    return float(tau * left @ left / max(left.size - parameters, 1))


def _rows(problem: RobotMisfit, residuals: Float[np.ndarray, "r"]) -> list[Float[np.ndarray, "_"]]:
    """Residuals of each column of each trial."""
    sizes = [int(np.isfinite(row).sum()) for trial in problem.trials for row in trial.measured]
    return [row for row in np.split(residuals, np.cumsum(sizes)[:-1]) if row.size > 1]


def _round_up(x: float) -> str:
    """One digit, at least x."""
    unit = 10.0 ** np.floor(np.log10(x))
    return f"{unit * np.ceil(x / unit):.0e}" if x < 1e-4 else f"{unit * np.ceil(x / unit):g}"
