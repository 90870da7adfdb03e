r"""A soft actuator that answers pressure with hysteresis and inertia, from recordings of pressure and displacement.

$$ y(s) = G(s) \sum_j S_j (H_j - H_{j+1}), \quad G = \frac{\omega_n^2}{s^2 + 2\zeta\omega_n s + \omega_n^2} $$

(of another order, or with zeros, as in `dynamics`), with plays H_j of growing width (H_0 = p) and slopes S_j, the sums
of the first weights (Xiong et al. 2025, eqs. 2 to 5). The displacement is linear in the slopes, which must not be
negative: where one is, the hysteresis has no inverse. Gains of hysteresis and transfer function are one: of the paper's
14 numbers 11 are identifiable.

Where pressures are commands, the valve comes first, with what is asked for of its dead band, its resolution and its
slew limit (`Stiction`, `SlewLimit`). The displacement may be late by a dead time, any part of a sample: it is that of
pressures joined by straight lines, between its samples too.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.signal import find_peaks

from nectosome.core import Block
from nectosome.drives import Chain, DeadTime, PrandtlIshlinskii, SlewLimit, TransferFunction
from nectosome.units import InputError
from nectosome.units.ranges import Ranges

from ..fits.identifiability import Interval, identifiability
from ..fits.intervals import stepwise_threshold
from ..fits.separable import Separable, Separated
from . import valve as valves
from .dynamics import Ratio, derivatives_of, discrete, filter_of, ratio_of, whole_samples
from .trials import DEAD_TIME, LATE_SAMPLES, PressureTrial, check_trial, longest_dead_time, missed_dead_time
from .valve import Recorded, driven, earlier, padded, stiction_of, sums_of_squares

_PLAYS = 9  # steps of the thresholds: one play fewer, since that of the largest pressure never moves
_FREQUENCY, _DAMPING = (0.5, 500.0), (0.05, 20.0)  # rad/s, -
_SLOWEST = 0.02  # of the steepest command: a slew limit below it leaves nothing of the signal
_VALVE = "dead_band", "resolution", "slew"
_LIMITS = 0.1, 0.2, 0.4, 0.6, 0.8, 1.5, 4.0  # of the steepest command: slew limits to begin with
_STUCK = 1e-5, 0.5  # of the largest command: a dead band, a resolution
_LATE = 0.0, 0.05, 0.2  # of the longest: dead times to begin with
_BANDS = 0.01, 0.03, 0.06, 0.12, 0.25  # of the largest command: the same to begin with
_TURN = 0.05  # of the largest command: as far the pressure turns back
_KEPT = (500, 1), (150, 3), (30, 3), (30, 1)  # cells divided next, best parts of each
_LEAD = 0.5  # s: largest of a zero
_ROUGH = 1e-3  # of the displacements' sum of squares: enough to choose by
HIGHEST = 6  # order of the transfer function
_POLISHED, _BETTER = 4, 0.1  # turns at most in which the best pair is looked for nearby; of chi2: as good
_STEP = 1e-3  # relative, of differences by what the valve has
_CORRELATED = 0.5  # of neighbouring residuals: they are no white noise
_SEEN = 0.98  # of the highest slew limit that is looked for: one above is none that is seen
_HELD = 10.0  # of the steepest command: a slew limit that held commands still show
_UNSEEN = 2e-3  # of the largest command: a dead band or a resolution below is none that is seen
_TOLD = 0.2  # of itself: one of both is known within as much, or they are not told apart


class Identified(NamedTuple):
    """The actuator's parameters that fit recordings."""

    theta: dict[str, float]  # frequency [rad/s] and damping of each part, zeros; then what was fitted of the dead time
    # [s] and of the valve [Pa, Pa, Pa/s]
    intervals: dict[str, Interval]  # of these and of the slopes: 95 %, if residuals are white noise
    thresholds: Float[np.ndarray, "k"]  # r [Pa], growing from above 0
    slopes: Float[np.ndarray, "k+1"]  # S [m/Pa]
    noise: float  # root mean square of the residuals [m]
    order: int
    warnings: tuple[str, ...]
    units: tuple[str, str] = ("Pa", "m")  # of command and measurement

    def block(self) -> Block:
        """The model, from pressure [Pa] to displacement [m]; with the valve first if something of it was fitted.

        A dead time is last: within a sample it counts by straight lines between displacements.
        """
        sticks = stiction_of(self.theta)
        limit = (SlewLimit(jnp.asarray(self.theta["slew"])),) if "slew" in self.theta else ()
        delay = (DeadTime(jnp.asarray(self.theta[DEAD_TIME]), LATE_SAMPLES),) if DEAD_TIME in self.theta else ()
        return Chain((*(() if sticks is None else (sticks,)), *limit, self.hysteresis(), self.dynamics(), *delay))

    def hysteresis(self) -> PrandtlIshlinskii:
        """From pressure [Pa] to what drives the dynamics [m]."""
        weights = jnp.asarray(np.diff(self.slopes))
        return PrandtlIshlinskii(jnp.asarray(self.slopes[0]), jnp.asarray(self.thresholds), weights)

    def dynamics(self) -> TransferFunction:
        """Of gain 1."""
        zeros = sum(name.startswith("zero") for name in self.theta)
        return TransferFunction(*map(jnp.asarray, ratio_of(np.array([*self.theta.values()]), self.order, zeros)))


def fit_hysteresis(
    trials: Sequence[PressureTrial],
    order: int = 2,
    slew: bool = False,
    start: Float[np.ndarray, "n"] | None = None,
    *,
    zeros: int = 0,
    dead_band: bool = False,
    resolution: bool = False,
    dead_time: bool = False,
) -> Identified:
    """Fit of the model to several recordings at once.

    Frequencies, dampings and slew limit are searched for, with the best slopes for each (variable projection).

    `order` is that of the transfer function, `zeros` how many zeros it has. With `slew` the pressure is a command that
    the valve follows at a limited rate, which is fitted too, with `dead_band` after a dead band on reversals, with
    `resolution` in steps. With `dead_time` the displacement answers later, by a time that is fitted. `start` are
    frequency and damping of each part [rad/s, -], coefficients of the zeros [s, s2, ...], the dead time [s] if it is
    fitted, and of the valve what is fitted: dead band [Pa], resolution [Pa], slew limit [Pa/s].
    Raises InputError for recordings that are too short, constant, NaN or infinite, for a start out of its range, and
    where the displacement goes against the pressure.
    """
    if not 1 <= order <= HIGHEST:
        raise InputError(f"is {order}; it must be from 1 to {HIGHEST}.", field="order")
    if not 0 <= zeros < order:
        raise InputError(f"is {zeros}; it must be from 0 to {order - 1}, less than the order.", field="zeros")
    for trial in trials:
        check_trial(trial)
    if not trials:
        raise InputError("there is no recording to fit.", field="trials")
    model = HysteresisModel(tuple(trials), order, slew, zeros, dead_band, resolution, dead_time)
    first = model.first_guess() if start is None else np.asarray(start, dtype=float)
    if first.shape != (len(model.names),):
        raise InputError(f"{first.size} numbers, where {', '.join(model.names)} are needed.", field="start")
    found, others = model.fit(first)
    return model.identified(found.theta, found.weights, found.chi2, others=others)


@dataclass(frozen=True)
class HysteresisModel:
    """The model as a separable problem, for some recordings."""

    trials: tuple[PressureTrial, ...]
    order: int = 2
    slew: bool = False
    zeros: int = 0
    dead_band: bool = False
    resolution: bool = False
    dead_time: bool = False

    @property
    def names(self) -> tuple[str, ...]:
        """Of what the displacement is not linear in."""
        if self.order == 2:
            parts = ["frequency", "damping"]
        else:
            parts = [f"{what}{k + 1}" for k in range(self.order // 2) for what in ("frequency", "damping")]
            parts += [f"frequency{self.order // 2 + 1}"] if self.order % 2 else []
        zeros = (f"zero{k}" for k in range(1, self.zeros + 1))
        return (*parts, *zeros, *([DEAD_TIME] if self.dead_time else []), *self.valve)

    @property
    def valve(self) -> tuple[str, ...]:
        """What of the valve is fitted."""
        return tuple(name for name in _VALVE if getattr(self, name))

    @property
    def start(self) -> Float[np.ndarray, "n"]:
        """Middle of the ranges, on their scales; parts of higher order apart from each other."""
        u = np.full(len(self.names), 0.5)
        frequencies = [k for k, name in enumerate(self.names) if name.startswith("frequency")]
        u[frequencies] = np.linspace(0.5, 0.9, len(frequencies))
        return self.ranges.values(u)

    def first_guess(self) -> Float[np.ndarray, "n"]:
        """Where to begin. A slew limit is the best of some fixed ones: far too low ones are no start.

        So is then a dead band, and meanwhile all else of the valve is as good as none. A dead time comes first.
        """
        theta, names = self.start, self.names
        projected, enough = self.problem.projected(), _ROUGH * float(self.problem.data @ self.problem.data)
        # a resolution is looked for in `fit`, when all else is known
        limits = self.steepest * np.array(_LIMITS)
        shares = {DEAD_TIME: np.array(_LATE) * longest_dead_time(self.trials), "slew": limits[limits < self.fastest]}
        shares |= {"dead_band": np.array(_BANDS) * self.largest}
        for name in self.valve:
            theta[names.index(name)] = self.ranges.bounds[names.index(name), int(name == "slew")]
        for name in (one for one in shares if one in names):
            found = []
            for value in shares[name]:
                theta[names.index(name)] = value
                found.append(projected.fit(theta, fixed=self.valve, gain=enough))
            theta = min(found, key=lambda one: one.chi2).theta.copy()
        return theta

    def fit(self, theta: Float[np.ndarray, "n"]) -> tuple[Separated, Float[np.ndarray, "m 2"]]:
        """Fit from theta on; pairs of dead band and resolution, from all over, that fit as well.

        Least squares go to the end of a slope, and by the resolution there are many: with other values the pressure
        steps at other times. Where there is a resolution, both are looked for over all their ranges (`valve_steps`),
        all else fitted to first order for each pair, and wholly for the best one before cells are divided again.
        """
        if not self.resolution:
            return self.problem.fit(theta), np.zeros((0, 2))
        theta = self.problem.fit(theta, ("resolution",)).theta
        cells = valves.first_cells(self.largest, self._turning, self._pair_bounds)
        pairs = np.concatenate([self._pair(theta)[None], cells])
        first, tried = np.arange(len(pairs)), list[np.ndarray]()
        for turn, (kept, parts) in enumerate(_KEPT, start=1):
            chi2 = self._by_pair(theta)(pairs)
            tried.append(np.column_stack([pairs, chi2]))
            best = valves.best_cells(chi2, first, kept, parts)
            pairs, first = pairs[best], first[best]
            theta = theta.copy()
            theta[self._sticky] = pairs[0][-len(self._sticky) :]
            theta = self.problem.fit(theta, _VALVE[:2]).theta
            if turn < len(_KEPT):
                pairs, first = valves.divided(pairs, turn, self.largest, self._pair_bounds), np.repeat(first, 9)
        found = self.problem.fit(theta, _VALVE[:2])
        for _ in range(_POLISHED):
            before = found
            error = float(np.sqrt(before.chi2 / len(self.problem.data)))
            theta = before.theta.copy()
            theta[self._sticky] = self._box(theta, max(error, self._exact), pairs)[0]
            found = min(before, self.problem.fit(theta, _VALVE[:2]), key=lambda one: one.chi2)
            if before.chi2 - found.chi2 <= _BETTER * error**2:
                break
        rows, error = np.concatenate(tried), found.chi2 / len(self.problem.data)
        return found, rows[rows[:, 2] <= found.chi2 + stepwise_threshold() * error, :2]

    @property
    def _exact(self) -> float:
        """Some noise [m], where the model has made the data."""
        return 1e-9 * self.largest * self.gain

    def _box(
        self, theta: Float[np.ndarray, "n"], error: float, others: Float[np.ndarray, "m 2"]
    ) -> tuple[Float[np.ndarray, "a"], tuple[Interval, ...]]:
        """Dead band and resolution, as far as they are fitted, that are best near theta or others; their intervals."""
        chi2, place = self._by_pair(theta), self._sticky

        def by(values: Float[np.ndarray, "m a"]) -> Float[np.ndarray, "m"]:
            return chi2(np.pad(values, ((0, 0), (2 - len(place), 0)))) / error**2

        return valves.stepwise_box(by, theta[place], self.ranges.bounds[place], others[:, -len(place) :])

    @property
    def _turning(self) -> Float[np.ndarray, "p"]:
        """Pressures where it turns back by more than a little; of minima the negative [Pa]."""
        sides = [sign * trial.pressure for trial in self.trials for sign in (1.0, -1.0)]
        return np.concatenate([side[find_peaks(side, prominence=_TURN * self.largest)[0]] for side in sides])

    @property
    def _sticky(self) -> list[int]:
        """Places of dead band and resolution, as far as they are fitted."""
        return [self.names.index(name) for name in self.valve if name != "slew"]

    @property
    def _pair_bounds(self) -> Float[np.ndarray, "2 2"]:
        """Ranges of dead band and resolution; one that is not fitted is 0."""
        bounds = np.zeros((2, 2))
        bounds[-len(self._sticky) :] = self.ranges.bounds[self._sticky]
        return bounds

    def _pair(self, theta: Float[np.ndarray, "n"]) -> Float[np.ndarray, "2"]:
        """Dead band and resolution; one that is not fitted is 0."""
        pair = np.zeros(2)
        pair[-len(self._sticky) :] = theta[self._sticky]
        return pair

    @cached_property
    def largest(self) -> float:
        """Largest pressure [Pa]."""
        return max(float(np.abs(trial.pressure).max()) for trial in self.trials)

    @cached_property
    def steepest(self) -> float:
        """Largest rate of the pressure [Pa/s]."""
        return max(float(np.abs(np.diff(trial.pressure)).max()) / trial.dt for trial in self.trials)

    @property
    def fastest(self) -> float:
        """Highest slew limit that is looked for [Pa/s]: commands that are held show it within their samples."""
        return self.steepest * (_HELD if any(trial.held for trial in self.trials) else 1.0)

    @cached_property
    def gain(self) -> float:
        """Displacement by pressure [m/Pa], as of the largest ones."""
        return max(float(np.abs(trial.displacement).max()) for trial in self.trials) / self.largest

    @cached_property
    def thresholds(self) -> Float[np.ndarray, "k"]:
        """Of the plays [Pa]: even steps to below the largest pressure."""
        return np.arange(1, _PLAYS) / _PLAYS * self.largest

    @cached_property
    def ranges(self) -> Ranges:
        """All on logarithmic scales, but zeros, which may be to either side, and a dead time, which may be none."""
        of = {"frequency": _FREQUENCY, "damping": _DAMPING, "slew": (_SLOWEST * self.steepest, self.fastest)}
        of |= {f"zero{k}": (-(_LEAD**k), _LEAD**k) for k in range(1, self.zeros + 1)}
        of |= {DEAD_TIME: (0.0, longest_dead_time(self.trials))}
        of |= dict.fromkeys(_VALVE[:2], tuple(share * self.largest for share in _STUCK))
        ends = [of[name] if name in of else of[name.rstrip("0123456789")] for name in self.names]
        log = [name for name in self.names if not name.startswith("zero") and name != DEAD_TIME]
        return Ranges(self.names, *zip(*ends, strict=True), log=log)

    @cached_property
    def problem(self) -> Separable:
        """Displacements of all recordings, one after the other."""
        data = np.concatenate([trial.displacement for trial in self.trials])
        return Separable(self.basis, self.jacobian, data, self.ranges)

    def basis(self, theta: Float[np.ndarray, "n"]) -> Float[np.ndarray, "r k+1"]:
        """Displacement by unit slopes."""
        return self._filtered(ratio_of(theta, self.order, self.zeros), self._driven(theta), self._late(theta))

    def jacobian(self, theta: Float[np.ndarray, "n"], weights: Float[np.ndarray, "k+1"]) -> Float[np.ndarray, "r n"]:
        """Jacobian of the displacement by theta: derivatives of the transfer function are transfer functions too.

        That by the dead time is -s G.
        """
        inputs, ratios = (
            [driven @ weights for driven in self._driven(theta)],
            derivatives_of(theta, self.order, self.zeros),
        )
        if self.dead_time:
            above, below = ratio_of(theta, self.order, self.zeros)
            ratios.append((-np.append(above, 0.0), below))
        columns = [self._filtered(ratio, inputs, self._late(theta)) for ratio in ratios]
        for name in self.valve:
            k = self.names.index(name)
            ends = np.stack([theta, theta])
            ends[:, k] = np.clip(theta[k] * (1 + _STEP * np.array([1, -1])), *self.ranges.bounds[k])
            apart = [self.basis(end) @ weights for end in ends]
            columns.append((apart[0] - apart[1]) / (ends[0, k] - ends[1, k]))
        return np.stack(columns, axis=1)

    def identified(
        self,
        theta: Float[np.ndarray, "n"],
        slopes: Float[np.ndarray, "k+1"],
        chi2: float,
        warnings: tuple[str, ...] = (),
        others: Float[np.ndarray, "m 2"] | None = None,
    ) -> Identified:
        """Parameters with intervals and warnings; `others` are pairs as from `fit`.

        Raises InputError where no slope is above 0.
        """
        if not slopes.any():
            how = "Turn one of them in the campaign (sign: -1), or give another start."
            raise InputError(f"the displacement does not follow the pressure: no slope is above 0. {how}")
        count = len(self.problem.data)
        noise = float(np.sqrt(chi2 / max(count - len(theta) - len(slopes), 1)))
        error = max(noise, self._exact)
        scaled = Separable(self.basis, self.jacobian, self.problem.data, self.ranges, error)
        whole = scaled.whole(2 * float(slopes.max()))
        everything = np.concatenate([theta, slopes])
        intervals = [*identifiability(whole, everything).intervals()]
        more = list(warnings)
        if self.resolution:
            ends = self._box(theta, error, np.zeros((0, 2)) if others is None else others)[1]
            for k, one in zip(self._sticky, ends, strict=True):
                intervals[k] = one
            if self.dead_band and all(one.high - one.low > _TOLD * one.high for one in ends):
                why = "other pairs of them fit as well. Record with less noise, or more and smaller reversals"
                more.append(f"dead band and resolution are not told apart: {why}")
        left = whole.at(whole.places(everything)[None])[0]
        if float(left[1:] @ left[:-1]) > _CORRELATED * float(left @ left):
            pair = ", or the search has missed dead band and resolution" if self.resolution else ""
            more.append(f"residuals are correlated: the model lacks something, and intervals are too short{pair}")
        on = np.flatnonzero(slopes <= 1e-6 * slopes.max())
        if len(on):
            more.append(f"slopes {', '.join(str(k) for k in on)} are at 0: the hysteresis has no inverse there")
        if self.slew and theta[-1] > _SEEN * self.fastest:
            more.append("no slew limit is seen: the valve follows every command")
        for name in self.valve:
            if name != "slew" and theta[self.names.index(name)] < _UNSEEN * self.largest:
                more.append(
                    f"no {name.replace('_', ' ')} is seen: what the valve has is too small for these recordings"
                )
        more += self._on_dead_time(theta, intervals, chi2)
        names = (*self.names, *(f"slope{k}" for k in range(len(slopes))))
        values, named = dict(zip(self.names, theta.tolist(), strict=True)), dict(zip(names, intervals, strict=True))
        return Identified(values, named, self.thresholds, slopes, noise, self.order, tuple(more))

    def _on_dead_time(self, theta: Float[np.ndarray, "n"], intervals: Sequence[Interval], chi2: float) -> list[str]:
        """Warning of a dead time that is none, or that was left out."""
        if self.dead_time:
            seen = intervals[self.names.index(DEAD_TIME)].below
            return [] if seen else ["no dead time is seen: 0 s is in its interval"]
        other, place, count = replace(self, dead_time=True), len(self.names) - len(self.valve), len(self.problem.data)
        error = max(float(np.sqrt(chi2 / count)), self._exact)
        return missed_dead_time(other.problem, np.insert(theta, place, 0.0), place, error, _VALVE[:2])

    def _by_pair(self, theta: Float[np.ndarray, "n"]) -> Callable[[np.ndarray], np.ndarray]:
        """Sum of squares by dead band and resolution, slopes fitted, all else fitted to first order from theta."""
        slopes = self.problem.fit(theta, self.names).weights
        others = np.linalg.qr(np.delete(self.jacobian(theta, slopes), self._sticky, axis=1)).Q
        ends = np.cumsum([len(trial.pressure) for trial in self.trials])[:-1]
        ratio, data = ratio_of(theta, self.order, self.zeros), [trial.displacement for trial in self.trials]
        delays = [whole_samples(self._late(theta), trial.dt) for trial in self.trials]
        before = [k for k, _ in delays]  # samples without an answer: all others count as so much earlier
        filters = [
            discrete(ratio, trial.dt, part if self.dead_time else None)
            for (_, part), trial in zip(delays, self.trials, strict=True)
        ]
        arrays = (
            *self._commands(float(theta[-1]) if self.slew else np.inf),
            padded(earlier(data, before)),
            padded(earlier([np.ones(len(one)) for one in data], before)),
            padded(earlier(np.split(others, ends), before)),
            *(np.stack(x) for x in zip(*((one.above, one.line, one.below) for one in filters), strict=True)),
            self.thresholds,
            slopes,
        )
        of = Recorded(*map(jnp.asarray, arrays))
        left = sum(float(y[:k] @ y[:k]) for y, k in zip(data, before, strict=True))
        return lambda pairs: left + sums_of_squares(of, pairs)

    def _filtered(
        self, ratio: Ratio, inputs: list[Float[np.ndarray, "n *k"]], delay: float
    ) -> Float[np.ndarray, "r *k"]:
        """Answers to the inputs of all recordings, one after the other, late by a delay [s]."""
        filters = {dt: filter_of(ratio, dt, delay) for dt in {trial.dt for trial in self.trials}}
        return np.concatenate([filters[trial.dt](x) for x, trial in zip(inputs, self.trials, strict=True)])

    def _late(self, theta: Float[np.ndarray, "n"]) -> float:
        """The dead time [s]."""
        return float(theta[self.names.index(DEAD_TIME)]) if self.dead_time else 0.0

    def _driven(self, theta: Float[np.ndarray, "n"]) -> list[Float[np.ndarray, "n k+1"]]:
        """What unit slopes make of the pressure: differences of plays that follow each other."""
        if not self.valve:
            return self._still
        return self._moved(dict(zip(self.names, theta.tolist(), strict=True)))

    @cached_property
    def _still(self) -> list[Float[np.ndarray, "n k+1"]]:
        return self._moved({})

    def _moved(self, valve: Mapping[str, float]) -> list[Float[np.ndarray, "n k+1"]]:
        pressure, most = self._commands(valve.get("slew", np.inf))
        moved = np.asarray(driven(pressure, most, jnp.asarray(self.thresholds), stiction_of(valve)))
        return [one[: len(trial.pressure)] for one, trial in zip(moved, self.trials, strict=True)]

    def _commands(self, slew: float) -> tuple[Float[Array, "t n"], Float[Array, "t"]]:
        """Pressures of all recordings, and how far the valve follows from sample to sample."""
        most = np.array([slew * trial.dt for trial in self.trials])
        return jnp.asarray(padded([trial.joined(slew) for trial in self.trials], "edge")), jnp.asarray(most)
