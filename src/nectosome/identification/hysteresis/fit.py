r"""A soft actuator that answers pressure with hysteresis and inertia, from recordings of pressure and displacement.

$$ y(s) = G(s) \sum_j S_j (H_j - H_{j+1}), \quad G = \frac{\omega_n^2}{s^2 + 2\zeta\omega_n s + \omega_n^2} $$

(of another order, or with zeros, as in `dynamics`), with plays H_j of growing width (H_0 = p) and slopes S_j, the sums
of the first weights (Xiong et al. 2025, eqs. 2 to 5). The displacement is linear in the slopes, which must not be
negative: where one is, the hysteresis has no inverse. Gains of hysteresis and transfer function are one: of the paper's
14 numbers 11 are identifiable.

Where pressures are commands, the valve comes first, with what is asked for of its dead band, its resolution and its
slew limit (`Stiction`, `SlewLimit`).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core import Block, Line
from nectosome.drives import Chain, PrandtlIshlinskii, SlewLimit, Stiction, TransferFunction
from nectosome.units import InputError
from nectosome.units.ranges import Ranges

from ..fits.identifiability import Interval, identifiability
from ..fits.separable import Separable, Separated
from .dynamics import Ratio, derivatives_of, filter_of, ratio_of
from .valve_steps import stepwise_interval

_PLAYS = 9  # steps of the thresholds: one play fewer, since that of the largest pressure never moves
_FREQUENCY, _DAMPING = (0.5, 500.0), (0.05, 20.0)  # rad/s, -
_SLOWEST = 0.02  # of the steepest command: a slew limit below it leaves nothing of the signal
_VALVE = "dead_band", "resolution", "slew"
_LIMITS = 0.1, 0.2, 0.4, 0.6, 0.8  # of the steepest command: slew limits to begin with
_STUCK = 0.001, 0.5  # of the largest command: a dead band, a resolution
_BANDS = 0.01, 0.03, 0.06, 0.12, 0.25  # of the largest command: the same to begin with
_STEPS_UP = np.arange(2.0, 60.0, 0.15)  # to the largest command, of resolutions to begin with
_NEARER = 2e-2, 4e-3, 8e-4, 2e-4  # of a resolution: widths in which better ones are looked for
_TRIED = 21  # resolutions in each
_LEAD = 0.5  # s: largest of a zero
_ROUGH = 1e-3  # of the displacements' sum of squares: enough to choose by
HIGHEST = 6  # order of the transfer function
_STEP = 1e-3  # relative, of differences by what the valve has
_LEAST = 50  # samples
_CORRELATED = 0.5  # of neighbouring residuals: they are no white noise
_SEEN = 0.98  # of the steepest command: a slew limit above is none that is seen
_UNSEEN = 2.0  # times its least: a dead band or a resolution below is none that is seen


class PressureTrial(NamedTuple):
    """Pressure and displacement at even times, from rest; between the samples both are straight."""

    name: str
    dt: float  # [s]
    pressure: Float[np.ndarray, "n"]  # [Pa]
    displacement: Float[np.ndarray, "n"]  # [m]
    notes: tuple[str, ...] = ()  # what was done to the recording
    file: str = ""


class Identified(NamedTuple):
    """The actuator's parameters that fit recordings."""

    theta: dict[str, float]  # frequency [rad/s] and damping of each part; of the valve [Pa, Pa, Pa/s] what was fitted
    intervals: dict[str, Interval]  # of these and of the slopes: 95 %, if residuals are white noise
    thresholds: Float[np.ndarray, "k"]  # r [Pa], growing from above 0
    slopes: Float[np.ndarray, "k+1"]  # S [m/Pa]
    noise: float  # root mean square of the residuals [m]
    order: int
    warnings: tuple[str, ...]

    def block(self) -> Block:
        """The model, from pressure [Pa] to displacement [m]; with the valve first if something of it was fitted."""
        sticks = _stiction(self.theta)
        limit = (SlewLimit(jnp.asarray(self.theta["slew"])),) if "slew" in self.theta else ()
        return Chain((*(() if sticks is None else (sticks,)), *limit, self.hysteresis(), self.dynamics()))

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
) -> Identified:
    """Fit of the model to several recordings at once.

    Frequencies, dampings and slew limit are searched for, with the best slopes for each (variable projection).

    `order` is that of the transfer function, `zeros` how many zeros it has. With `slew` the pressure is a command that
    the valve follows at a limited rate, which is fitted too, with `dead_band` after a dead band on reversals, with
    `resolution` in steps, one of both. `start` are frequency and damping of each part [rad/s, -], coefficients of the
    zeros [s, s2, ...], and of the valve what is fitted: dead band [Pa], resolution [Pa], slew limit [Pa/s].
    Raises InputError for recordings that are too short, constant, NaN or infinite, for a start out of its range, and
    where the displacement goes against the pressure.
    """
    if not 1 <= order <= HIGHEST:
        raise InputError(f"is {order}; it must be from 1 to {HIGHEST}.", field="order")
    if not 0 <= zeros < order:
        raise InputError(f"is {zeros}; it must be from 0 to {order - 1}, less than the order.", field="zeros")
    if dead_band and resolution:
        why = (
            "is not fitted together with a resolution: many pairs of them fit nearly as well, and no search was found "
            "that tells the right one. Ask for one of both, the one without which more is left."
        )
        raise InputError(why, field="dead_band")
    for trial in trials:
        _check(trial)
    if not trials:
        raise InputError("there is no recording to fit.", field="trials")
    model = HysteresisModel(tuple(trials), order, slew, zeros, dead_band, resolution)
    first = model.first_guess() if start is None else np.asarray(start, dtype=float)
    if first.shape != (len(model.names),):
        raise InputError(f"{first.size} numbers, where {', '.join(model.names)} are needed.", field="start")
    found = model.fit(first)
    return model.identified(found.theta, found.weights, found.chi2)


@dataclass(frozen=True)
class HysteresisModel:
    """The model as a separable problem, for some recordings."""

    trials: tuple[PressureTrial, ...]
    order: int = 2
    slew: bool = False
    zeros: int = 0
    dead_band: bool = False
    resolution: bool = False

    @property
    def names(self) -> tuple[str, ...]:
        """Of what the displacement is not linear in."""
        if self.order == 2:
            parts = ["frequency", "damping"]
        else:
            parts = [f"{what}{k + 1}" for k in range(self.order // 2) for what in ("frequency", "damping")]
            parts += [f"frequency{self.order // 2 + 1}"] if self.order % 2 else []
        return (*parts, *(f"zero{k}" for k in range(1, self.zeros + 1)), *self.valve)

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

        So is then a dead band, and meanwhile all else of the valve is as good as none.
        """
        theta, names = self.start, self.names
        projected, enough = self.problem.projected(), _ROUGH * float(self.problem.data @ self.problem.data)
        # a resolution is looked for in `fit`, when all else is known
        shares = {"slew": np.array(_LIMITS) * self.steepest, "dead_band": np.array(_BANDS) * self.largest}
        for name in self.valve:
            theta[names.index(name)] = self.ranges.bounds[names.index(name), int(name == "slew")]
        for name in (one for one in shares if one in self.valve):
            found = []
            for value in shares[name]:
                theta[names.index(name)] = value
                found.append(projected.fit(theta, fixed=self.valve, gain=enough))
            theta = min(found, key=lambda one: one.chi2).theta.copy()
        return theta

    def fit(self, theta: Float[np.ndarray, "n"]) -> Separated:
        """Fit from theta on.

        Least squares go to the end of a slope, and by the resolution there are many: with another one the pressure
        steps at other times. It is looked for over all its range, then nearer and nearer, all else fitted to
        first order for each, and then wholly.
        """
        if not self.resolution:
            return self.problem.fit(theta)
        k = self.names.index("resolution")

        def best(theta: Float[np.ndarray, "n"], values: Float[np.ndarray, "m"]) -> Float[np.ndarray, "n"]:
            tried = np.clip([theta[k], *values], *self.ranges.bounds[k])
            chosen = theta.copy()
            chosen[k] = tried[int(np.argmin(self._by_resolution(theta, 1.0)(tried)))]
            return chosen

        found = self.problem.fit(theta, ("resolution",))
        theta = best(found.theta, self.largest / _STEPS_UP)
        for width in _NEARER:
            found = self.problem.fit(theta, ("resolution",))
            theta = best(found.theta, found.theta[k] * (1 + width * np.linspace(-1, 1, _TRIED)))
        return self.problem.fit(theta, ("resolution",))

    @cached_property
    def largest(self) -> float:
        """Largest pressure [Pa]."""
        return max(float(np.abs(trial.pressure).max()) for trial in self.trials)

    @cached_property
    def steepest(self) -> float:
        """Largest rate of the pressure [Pa/s]."""
        return max(float(np.abs(np.diff(trial.pressure)).max()) / trial.dt for trial in self.trials)

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
        """All on logarithmic scales, but zeros, which may be to either side."""
        of = {"frequency": _FREQUENCY, "damping": _DAMPING, "slew": (_SLOWEST * self.steepest, self.steepest)}
        of |= {f"zero{k}": (-(_LEAD**k), _LEAD**k) for k in range(1, self.zeros + 1)}
        of |= dict.fromkeys(_VALVE[:2], tuple(share * self.largest for share in _STUCK))
        ends = [of[name] if name in of else of[name.rstrip("0123456789")] for name in self.names]
        log = [name for name in self.names if not name.startswith("zero")]
        return Ranges(self.names, *zip(*ends, strict=True), log=log)

    @cached_property
    def problem(self) -> Separable:
        """Displacements of all recordings, one after the other."""
        data = np.concatenate([trial.displacement for trial in self.trials])
        return Separable(self.basis, self.jacobian, data, self.ranges)

    def basis(self, theta: Float[np.ndarray, "n"]) -> Float[np.ndarray, "r k+1"]:
        """Displacement by unit slopes."""
        return self._filtered(ratio_of(theta, self.order, self.zeros), self._driven(theta))

    def jacobian(self, theta: Float[np.ndarray, "n"], weights: Float[np.ndarray, "k+1"]) -> Float[np.ndarray, "r n"]:
        """Jacobian of the displacement by theta: derivatives of the transfer function are transfer functions too."""
        inputs = [driven @ weights for driven in self._driven(theta)]
        columns = [self._filtered(ratio, inputs) for ratio in derivatives_of(theta, self.order, self.zeros)]
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
    ) -> Identified:
        """Parameters with intervals and warnings. Raises InputError where no slope is above 0."""
        if not slopes.any():
            how = "Turn one of them in the campaign (sign: -1), or give another start."
            raise InputError(f"the displacement does not follow the pressure: no slope is above 0. {how}")
        count = len(self.problem.data)
        noise = float(np.sqrt(chi2 / max(count - len(theta) - len(slopes), 1)))
        error = max(noise, 1e-9 * self.largest * self.gain)  # some, where the model has made the data
        scaled = Separable(self.basis, self.jacobian, self.problem.data, self.ranges, error)
        whole = scaled.whole(2 * float(slopes.max()))
        everything = np.concatenate([theta, slopes])
        intervals = [*identifiability(whole, everything).intervals()]
        if self.resolution:
            k = self.names.index("resolution")
            intervals[k] = stepwise_interval(self._by_resolution(theta, error), float(theta[k]), self.ranges.bounds[k])
        left = whole.at(whole.places(everything)[None])[0]
        more = list(warnings)
        if float(left[1:] @ left[:-1]) > _CORRELATED * float(left @ left):
            more.append("residuals are correlated: the model lacks something, and intervals are too short")
        on = np.flatnonzero(slopes <= 1e-6 * slopes.max())
        if len(on):
            more.append(f"slopes {', '.join(str(k) for k in on)} are at 0: the hysteresis has no inverse there")
        if self.slew and theta[-1] > _SEEN * self.steepest:
            more.append("no slew limit is seen: the valve follows every command")
        for name in self.valve:
            if name != "slew" and theta[self.names.index(name)] < _UNSEEN * _STUCK[0] * self.largest:
                more.append(
                    f"no {name.replace('_', ' ')} is seen: what the valve has is too small for these recordings"
                )
        names = (*self.names, *(f"slope{k}" for k in range(len(slopes))))
        values, named = dict(zip(self.names, theta.tolist(), strict=True)), dict(zip(names, intervals, strict=True))
        return Identified(values, named, self.thresholds, slopes, noise, self.order, tuple(more))

    def _by_resolution(self, theta: Float[np.ndarray, "n"], error: float) -> Callable[[np.ndarray], np.ndarray]:
        """chi2 by the resolution, slopes fitted, all else fitted to first order from theta."""
        projected, k = self.problem.projected(), self.names.index("resolution")
        others = np.delete(projected.derivatives(projected.places(theta)), k, axis=1)
        Q = np.linalg.qr(others).Q

        def chi2(values: Float[np.ndarray, "m"]) -> Float[np.ndarray, "m"]:
            rows = np.repeat(theta[None], len(values), axis=0)
            rows[:, k] = values
            left = projected.at(self.ranges.places(rows)) / error
            return np.sum(left**2, axis=1) - np.sum((left @ Q) ** 2, axis=1)

        return chi2

    def _filtered(self, ratio: Ratio, inputs: list[Float[np.ndarray, "n *k"]]) -> Float[np.ndarray, "r *k"]:
        """Answers to the inputs of all recordings, one after the other."""
        filters = {dt: filter_of(ratio, dt) for dt in {trial.dt for trial in self.trials}}
        return np.concatenate([filters[trial.dt](x) for x, trial in zip(inputs, self.trials, strict=True)])

    def _driven(self, theta: Float[np.ndarray, "n"]) -> list[Float[np.ndarray, "n k+1"]]:
        """What unit slopes make of the pressure: differences of plays that follow each other."""
        if not self.valve:
            return self._still
        return self._moved(dict(zip(self.names, theta.tolist(), strict=True)))

    @cached_property
    def _still(self) -> list[Float[np.ndarray, "n k+1"]]:
        return self._moved({})

    def _moved(self, valve: Mapping[str, float]) -> list[Float[np.ndarray, "n k+1"]]:
        longest = max(len(trial.pressure) for trial in self.trials)
        padded = np.stack([np.pad(one.pressure, (0, longest - len(one.pressure)), mode="edge") for one in self.trials])
        most = np.array([valve.get("slew", np.inf) * trial.dt for trial in self.trials])
        thresholds = jnp.asarray(self.thresholds)
        plays = np.asarray(_plays(jnp.asarray(padded), jnp.asarray(most), thresholds, _stiction(valve)))
        steps = plays - np.concatenate([plays[..., 1:], np.zeros_like(plays[..., :1])], axis=-1)
        return [one[: len(trial.pressure)] for one, trial in zip(steps, self.trials, strict=True)]


def _stiction(valve: Mapping[str, float]) -> Stiction | None:
    """Stiction of a valve; None where nothing of it was fitted."""
    if not {*_VALVE[:2]} & {*valve}:
        return None
    return Stiction(*(jnp.asarray(valve.get(name, 0.0)) for name in _VALVE[:2]))


@eqx.filter_jit
def _plays(pressure: Array, most: Array, thresholds: Array, sticks: Stiction | None) -> Float[Array, "trials n k+1"]:
    """The pressure, followed at most so far from sample to sample, and its plays."""
    plays = PrandtlIshlinskii(jnp.zeros(()), thresholds, jnp.zeros_like(thresholds))

    def one(u: Array, most: Array) -> Array:
        def step(carry: tuple[Array, Array], command: Array) -> tuple[tuple[Array, Array], Array]:
            p = jnp.clip(command, carry[0] - most, carry[0] + most)
            state, _ = plays.step(carry[1], Line(p, p))
            return (p, state), jnp.concatenate([p[None], state])

        if sticks is not None:
            u = jax.lax.scan(lambda state, command, valve=sticks: valve.at(state, command), sticks.initial(), u)[1]
        return jax.lax.scan(step, (jnp.zeros(()), plays.initial()), u)[1]

    return jax.vmap(one)(pressure, most)


def _check(trial: PressureTrial) -> None:
    """Raise InputError where a recording is not what it should be."""
    count = len(trial.pressure)
    if count != len(trial.displacement):
        raise InputError(f"{count} pressures and {len(trial.displacement)} displacements.", field=trial.name)
    if count < _LEAST:
        raise InputError(f"{count} samples are too few; at least {_LEAST} are needed.", field=trial.name)
    if not trial.dt > 0:
        raise InputError(f"the samples are {trial.dt:g} s apart; it must be more than 0 s.", field=trial.name)
    for what, values in (("pressure", trial.pressure), ("displacement", trial.displacement)):
        if not np.isfinite(values).all():
            k = int(np.flatnonzero(~np.isfinite(values))[0])
            raise InputError(f"the {what} is NaN or infinite at sample {k + 1}.", field=trial.name)
        if np.ptp(values) == 0:
            raise InputError(f"the {what} is {values[0]:g} throughout: it identifies nothing.", field=trial.name)
