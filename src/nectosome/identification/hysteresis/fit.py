r"""A soft actuator that answers pressure with hysteresis and inertia, from recordings of pressure and displacement.

$$ y(s) = G(s) \sum_j S_j (H_j - H_{j+1}), \quad G = \frac{\omega_n^2}{s^2 + 2\zeta\omega_n s + \omega_n^2} $$

(of another order with as many such factors, and one of a single pole where it is odd), with plays H_j of growing width
(H_0 = p) and slopes S_j, the sums of the first weights (Xiong et al. 2025, eqs. 2 to 5). The displacement is linear in
the slopes, which must not be negative: where one is, the hysteresis has no inverse. Gains of hysteresis and transfer
function are one: of the paper's 14 numbers 11 are identifiable.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.signal import cont2discrete, lfilter

from nectosome.core import Block, Line
from nectosome.drives import Chain, PrandtlIshlinskii, SlewLimit, TransferFunction
from nectosome.units import InputError
from nectosome.units.ranges import Ranges

from ..fits.identifiability import Interval, identifiability
from ..fits.separable import Separable

_PLAYS = 9  # steps of the thresholds: one play fewer, since that of the largest pressure never moves
_FREQUENCY, _DAMPING = (0.5, 500.0), (0.05, 20.0)  # rad/s, -
_SLOWEST = 0.02  # of the steepest command: a slew limit below it leaves nothing of the signal
_LIMITS = 0.1, 0.2, 0.4, 0.6, 0.8  # of the steepest command: slew limits to begin with
_ROUGH = 1e-3  # of the displacements' sum of squares: enough to choose by
_HIGHEST = 6  # order of the transfer function
_STEP = 1e-3  # relative, of differences by the slew limit
Ratio = tuple[Float[np.ndarray, "m"], Float[np.ndarray, "n"]]  # numbers above and below, highest power first
_LEAST = 50  # samples
_CORRELATED = 0.5  # of neighbouring residuals: they are no white noise
_SEEN = 0.98  # of the steepest command: a slew limit above is none that is seen


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

    theta: dict[str, float]  # frequency [rad/s] and damping of each part, slew [Pa/s] if fitted
    intervals: dict[str, Interval]  # of these and of the slopes: 95 %, if residuals are white noise
    thresholds: Float[np.ndarray, "k"]  # r [Pa], growing from above 0
    slopes: Float[np.ndarray, "k+1"]  # S [m/Pa]
    noise: float  # root mean square of the residuals [m]
    order: int
    warnings: tuple[str, ...]

    def block(self) -> Block:
        """The model, from pressure [Pa] to displacement [m]; with the slew limit first if that was fitted."""
        limit = (SlewLimit(jnp.asarray(self.theta["slew"])),) if "slew" in self.theta else ()
        return Chain((*limit, self.hysteresis(), self.dynamics()))

    def hysteresis(self) -> PrandtlIshlinskii:
        """From pressure [Pa] to what drives the dynamics [m]."""
        weights = jnp.asarray(np.diff(self.slopes))
        return PrandtlIshlinskii(jnp.asarray(self.slopes[0]), jnp.asarray(self.thresholds), weights)

    def dynamics(self) -> TransferFunction:
        """Of gain 1."""
        return TransferFunction(*(jnp.asarray(x) for x in _ratio(np.array([*self.theta.values()]), self.order)))


def fit_hysteresis(
    trials: Sequence[PressureTrial],
    order: int = 2,
    slew: bool = False,
    start: Float[np.ndarray, "n"] | None = None,
) -> Identified:
    """Fit of the model to several recordings at once.

    Frequencies, dampings and slew limit are searched for, with the best slopes for each (variable projection).

    `order` is that of the transfer function. With `slew` the pressure is a command that the valve follows at a limited
    rate, which is fitted too. `start` are frequency and damping of each part [rad/s, -], and the slew limit [Pa/s].
    Raises InputError for recordings that are too short, constant, NaN or infinite, for a start out of its range, and
    where the displacement goes against the pressure.
    """
    if not 1 <= order <= _HIGHEST:
        raise InputError(f"is {order}; it must be from 1 to {_HIGHEST}.", field="order")
    for trial in trials:
        _check(trial)
    if not trials:
        raise InputError("there is no recording to fit.", field="trials")
    model = HysteresisModel(tuple(trials), order, slew)
    first = model.first_guess() if start is None else np.asarray(start, dtype=float)
    if first.shape != (len(model.names),):
        raise InputError(f"{first.size} numbers, where {', '.join(model.names)} are needed.", field="start")
    found = model.problem.fit(first)
    return model.identified(found.theta, found.weights, found.chi2)


@dataclass(frozen=True)
class HysteresisModel:
    """The model as a separable problem, for some recordings."""

    trials: tuple[PressureTrial, ...]
    order: int = 2
    slew: bool = False

    @property
    def names(self) -> tuple[str, ...]:
        """Of what the displacement is not linear in."""
        if self.order == 2:
            parts = ["frequency", "damping"]
        else:
            parts = [f"{what}{k + 1}" for k in range(self.order // 2) for what in ("frequency", "damping")]
            parts += [f"frequency{self.order // 2 + 1}"] if self.order % 2 else []
        return (*parts, *(["slew"] if self.slew else []))

    @property
    def start(self) -> Float[np.ndarray, "n"]:
        """Middle of the ranges, on their scales; parts of higher order apart from each other."""
        u = np.full(len(self.names), 0.5)
        frequencies = [k for k, name in enumerate(self.names) if name.startswith("frequency")]
        u[frequencies] = np.linspace(0.5, 0.9, len(frequencies))
        return self.ranges.values(u)

    def first_guess(self) -> Float[np.ndarray, "n"]:
        """Where to begin. A slew limit is the best of some fixed ones: far too low ones are no start."""
        if not self.slew:
            return self.start
        projected, found, enough = self.problem.projected(), [], _ROUGH * float(self.problem.data @ self.problem.data)
        for share in _LIMITS:
            theta = self.start
            theta[-1] = share * self.steepest
            found.append(projected.fit(theta, fixed=("slew",), gain=enough))
        return min(found, key=lambda one: one.chi2).theta

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
        """All on logarithmic scales."""
        of = {"frequency": _FREQUENCY, "damping": _DAMPING, "slew": (_SLOWEST * self.steepest, self.steepest)}
        ends = [of[name.rstrip("0123456789")] for name in self.names]
        return Ranges(self.names, *zip(*ends, strict=True), log=self.names)

    @cached_property
    def problem(self) -> Separable:
        """Displacements of all recordings, one after the other."""
        data = np.concatenate([trial.displacement for trial in self.trials])
        return Separable(self.basis, self.jacobian, data, self.ranges)

    def basis(self, theta: Float[np.ndarray, "n"]) -> Float[np.ndarray, "r k+1"]:
        """Displacement by unit slopes."""
        return self._filtered(_ratio(theta, self.order), self._driven(theta))

    def jacobian(self, theta: Float[np.ndarray, "n"], weights: Float[np.ndarray, "k+1"]) -> Float[np.ndarray, "r n"]:
        """Jacobian of the displacement by theta: derivatives of the transfer function are transfer functions too."""
        inputs = [driven @ weights for driven in self._driven(theta)]
        columns = [self._filtered(ratio, inputs) for ratio in _derivatives(theta, self.order)]
        if self.slew:
            h = _STEP * np.eye(len(theta))[-1] * theta[-1]
            ends = [self.basis(np.minimum(theta + side * h, self.ranges.bounds[:, 1])) @ weights for side in (1, -1)]
            width = min(theta[-1] + h[-1], self.ranges.bounds[-1, 1]) - (theta - h)[-1]
            columns.append((ends[0] - ends[1]) / width)
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
        intervals = identifiability(whole, everything).intervals()
        left = whole.at(whole.places(everything)[None])[0]
        more = list(warnings)
        if float(left[1:] @ left[:-1]) > _CORRELATED * float(left @ left):
            more.append("residuals are correlated: the model lacks something, and intervals are too short")
        on = np.flatnonzero(slopes <= 1e-6 * slopes.max())
        if len(on):
            more.append(f"slopes {', '.join(str(k) for k in on)} are at 0: the hysteresis has no inverse there")
        if self.slew and theta[-1] > _SEEN * self.steepest:
            more.append("no slew limit is seen: the valve follows every command")
        names = (*self.names, *(f"slope{k}" for k in range(len(slopes))))
        values, named = dict(zip(self.names, theta.tolist(), strict=True)), dict(zip(names, intervals, strict=True))
        return Identified(values, named, self.thresholds, slopes, noise, self.order, tuple(more))

    def _filtered(self, ratio: Ratio, inputs: list[Float[np.ndarray, "n *k"]]) -> Float[np.ndarray, "r *k"]:
        """Answers to the inputs of all recordings, one after the other."""
        filters = {dt: _filter(ratio, dt) for dt in {trial.dt for trial in self.trials}}
        return np.concatenate([filters[trial.dt](x) for x, trial in zip(inputs, self.trials, strict=True)])

    def _driven(self, theta: Float[np.ndarray, "n"]) -> list[Float[np.ndarray, "n k+1"]]:
        """What unit slopes make of the pressure: differences of plays that follow each other."""
        return self._moved(float(theta[-1])) if self.slew else self._still

    @cached_property
    def _still(self) -> list[Float[np.ndarray, "n k+1"]]:
        return self._moved(np.inf)

    def _moved(self, limit: float) -> list[Float[np.ndarray, "n k+1"]]:
        longest = max(len(trial.pressure) for trial in self.trials)
        padded = np.stack([np.pad(one.pressure, (0, longest - len(one.pressure)), mode="edge") for one in self.trials])
        most = np.array([limit * trial.dt for trial in self.trials])
        plays = np.asarray(_plays(jnp.asarray(padded), jnp.asarray(most), jnp.asarray(self.thresholds)))
        steps = plays - np.concatenate([plays[..., 1:], np.zeros_like(plays[..., :1])], axis=-1)
        return [one[: len(trial.pressure)] for one, trial in zip(steps, self.trials, strict=True)]


@eqx.filter_jit
def _plays(pressure: Array, most: Array, thresholds: Array) -> Float[Array, "trials n k+1"]:
    """The pressure, followed at most so far from sample to sample, and its plays."""
    plays = PrandtlIshlinskii(jnp.zeros(()), thresholds, jnp.zeros_like(thresholds))

    def one(u: Array, most: Array) -> Array:
        def step(carry: tuple[Array, Array], command: Array) -> tuple[tuple[Array, Array], Array]:
            p = jnp.clip(command, carry[0] - most, carry[0] + most)
            state, _ = plays.step(carry[1], Line(p, p))
            return (p, state), jnp.concatenate([p[None], state])

        return jax.lax.scan(step, (jnp.zeros(()), plays.initial()), u)[1]

    return jax.vmap(one)(pressure, most)


def _parts(theta: Float[np.ndarray, "n"], order: int) -> list[tuple[Ratio, list[Ratio]]]:
    """Of each factor of G: itself, and its relative derivatives by the logarithms of its parameters."""
    parts: list[tuple[Ratio, list[Ratio]]] = []
    for k in range(order // 2):
        w, z = theta[2 * k : 2 * k + 2]
        below = np.array([1.0, 2 * z * w, w**2])
        by = [(np.array([2.0, 2 * z * w, 0.0]), below), (np.array([-2 * z * w, 0.0]), below)]
        parts.append(((np.array([w**2]), below), by))
    if order % 2:
        w = theta[order - 1]
        parts.append(((np.array([w]), np.array([1.0, w])), [(np.array([1.0, 0.0]), np.array([1.0, w]))]))
    return parts


def _ratio(theta: Float[np.ndarray, "n"], order: int) -> Ratio:
    """G, of gain 1."""
    above = below = np.ones(1)
    for (b, a), _ in _parts(theta, order):
        above, below = np.polymul(above, b), np.polymul(below, a)
    return above, below


def _derivatives(theta: Float[np.ndarray, "n"], order: int) -> list[Ratio]:
    """dG/d theta."""
    above, below = _ratio(theta, order)
    every = [by for _, derivatives in _parts(theta, order) for by in derivatives]
    return [(np.polymul(above, b) / x, np.polymul(below, a)) for x, (b, a) in zip(theta[:order], every, strict=True)]


def _filter(ratio: Ratio, dt: float) -> Callable[[Float[np.ndarray, "n *k"]], Float[np.ndarray, "n *k"]]:
    """Answer of a transfer function, from rest, to even samples joined by lines: exact."""
    first: Any = cont2discrete(ratio, dt, method="foh")
    zero: Any = cont2discrete(ratio, dt, method="zoh")
    above, below = np.ravel(first[0]), np.ravel(first[1])
    line = np.cumsum(above - np.ravel(zero[0]))[:-1]  # what a line up to the first sample would leave behind

    def answer(x: Float[np.ndarray, "n *k"]) -> Float[np.ndarray, "n *k"]:
        y: Any = lfilter(above, below, x, axis=0)
        if not np.any(x[0]):
            return y
        impulse = np.zeros(len(x))  # the filter takes it that a line from 0 led to the first sample too
        impulse[0] = 1.0
        return y - np.multiply.outer(np.asarray(lfilter(line, below, impulse)), x[0])

    return answer


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
