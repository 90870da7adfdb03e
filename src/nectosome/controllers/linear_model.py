r"""A linear model of a robot between a command and a reading, from a run of the robot, for controllers that need one.

$$ y = G(s)\,e^{-s d \Delta t}\,(u - u_0), \quad G = \frac{K}{s^i (a_m s^m + \dots + a_1 s + 1)} $$

with i integrators and m further poles, i + m at most 3, and a delay of d samples. Commands are held from sample to
sample. K, u_0 and what remains of the motion at the start are linear in the output: they follow from the poles by
least squares (Golub and Pereyra 1973). Poles are stable, complex ones included.
"""

import math
from collections.abc import Iterator
from itertools import product
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from scipy.optimize import least_squares
from scipy.signal import lfilter

from nectosome.core import Status
from nectosome.drives import Curve, Polynomial, TransferFunction
from nectosome.units import InputError

from .closed_loop import RobotLoop
from .contract import ActuatorLimits, Pace, Progress
from .feedforward import Learned
from .hysteretic_model import HystereticModel
from .pid import PID
from .predictive import discrete, kalman

_STRUCTURES = (0, 1), (1, 0), (0, 2), (1, 1), (2, 0), (0, 3), (1, 2), (2, 1)  # (i, m), simple ones first
_ENOUGH = 0.99999  # of the effect of the command: no other structure is looked for
_AS_GOOD = 1.1  # of the least rms of residuals: the first structure within it is taken
_EXPLAINED = 0.8  # of the effect of the command: less is no model
_MOST_DELAY = 8  # samples
_SHAKEN = 0.25  # of half the range of the command, by which it is shaken
_SHORTEST = 2  # samples for which it is held
_FEWEST, _MOST = 200, 2000  # samples
_DAMPINGS = 0.1, 0.4, 1.0
_TIMES = 12  # to begin with
_NEAR = 10  # times the least sum of squares of the grid: delays whose poles are looked for downhill
_LEAST_WIDTH = 8  # samples, over which references are smoothed
_DOUBLINGS = 5
_WANDERS = 25
_BEYOND = 0.05  # of the time, for which a reference may need commands out of range
_HORIZONS = 10, 40  # samples
_WEIGHT = 0.01  # of inputs against outputs, squared, for an input that moves the output by 1 within the horizon

Poles = Float[np.ndarray, "m"]  # logarithms: of a time constant [s], of a frequency [rad/s] and a damping, or of all


class RobotModel(NamedTuple):
    """A linear model, and how well it explains the run that it comes from."""

    integrators: int  # i
    poles: Float[np.ndarray, "m+1"]  # a_m .. a_1, 1
    gain: float  # K [reading per command, and second for each integrator]
    command: float  # u_0 [SI]
    delay: int  # d, samples
    dt: float  # between samples [s]
    explained: float  # share of the effect of the command on the reading
    commands: Float[np.ndarray, "k"]  # of the run that it comes from
    outputs: Float[np.ndarray, "k"]

    def for_controllers(self) -> HystereticModel:
        """The same, whose input of the dynamics is |K| (u - u_0)."""
        size, sign = abs(self.gain), np.sign(self.gain)
        below = np.append(self.poles, np.zeros(self.integrators))
        dynamics = TransferFunction(jnp.asarray([sign]), jnp.asarray(below))
        there, back = (
            Curve(Polynomial(jnp.asarray(x))) for x in ((-size * self.command, size), (self.command, 1 / size))
        )
        return HystereticModel(there, back, dynamics, jnp.asarray(self.delay * self.dt))

    def pace(self, limits: ActuatorLimits, reference: Float[np.ndarray, "k"], noise: float) -> Pace:
        """Smoothing that the range of the command needs; a horizon in which the reading answers.

        Inputs are weighted by what they do within the horizon; what the model lacks wanders as in its run. The
        reference is smoothed over eight samples and twice the delay, or over 2, 4, ... times as long until its command
        stays in range for 95 % of the time.
        """
        model, dt = self.for_controllers(), self.dt
        least = (_LEAST_WIDTH + 2 * self.delay) * dt
        low, high = float(limits.low), float(limits.high)
        smoothing = least
        for _ in range(_DOUBLINGS):
            needed = model.dynamics_input(jnp.asarray(reference, dtype=float), dt, smoothing)
            command = np.asarray(model.command(needed, dt))
            if np.mean((command < low) | (command > high)) <= _BEYOND:
                break
            smoothing *= 2
        answer = float(self.poles[-2]) if len(self.poles) > 1 else 0.0
        horizon = int(np.clip(self.delay + round(3 * answer / dt), *_HORIZONS))
        held = _held(np.append(self.poles, np.zeros(self.integrators)), dt)
        reached = float(lfilter(*held, np.ones(horizon + 1))[-1])
        return Pace(smoothing, 2 * least, horizon, _WEIGHT * reached**2, self._wander(noise))

    def _wander(self, noise: float) -> float:
        """Steps of a disturbance of the input, by the noise of measurements, that make the run most likely.

        Both are what the model lacks: a Kalman filter predicts the run from sample to sample, with errors e of the
        variance s r^2, and r follows from them. The run has the `noise` of the sensor, too. Steps are of a grid over
        six decades.
        """
        linear = discrete(self.for_controllers().dynamics, self.dt)
        y = self.outputs + noise * np.random.default_rng(0).standard_normal(len(self.outputs))
        late = np.concatenate([np.full(self.delay, self.commands[0]), self.commands])
        v = abs(self.gain) * (late - self.command)
        steps = np.geomspace(1e-5, 10.0, _WANDERS) / np.abs(linear.C @ linear.B)
        filters = [kalman(linear, float(step), 1.0) for step in steps]
        A, B, C = (np.asarray(getattr(filters[0], name)) for name in "ABC")
        gains = np.stack([np.asarray(one.gain) for one in filters])
        z = np.zeros_like(gains) + np.linalg.pinv(C[None])[:, 0] * y[0]
        errors = np.empty((len(y), len(steps)))
        for k, measured in enumerate(y):
            errors[k] = measured - z @ C
            z = (z + gains * errors[k][:, None]) @ A.T + B * v[k]
        spread = 1 / (1 - gains @ C)  # s
        errors = errors[len(y) // 10 :]  # the start is not known
        return float(steps[np.argmin(np.log(np.mean(errors**2 / spread, axis=0)) + np.log(spread))])


def robot_model(
    loop: RobotLoop,
    pid: PID,
    reference: Float[np.ndarray, "k"],
    progress: Progress | None = None,
    beat: float = 0.0,
) -> RobotModel | None:
    """The model of a robot under a PID along a reference, its command shaken by a quarter of half its range.

    So it holds where the robot will be controlled. The run has at least 200 samples; it is without noise. The command
    is shaken for two samples at a time or more, and for a `beat` [s] where the robot has one. None where
    `progress` returns False. Raises InputError where the simulation fails, and where no model explains 80 % of what the
    command does.
    """
    robot, count = loop.robot, int(np.clip(len(reference), _FEWEST, _MOST))
    longer = np.pad(reference[:count], (0, count - len(reference[:count])), mode="edge")
    size = _SHAKEN * 0.5 * float(pid.limits.high - pid.limits.low)
    held = max(_SHORTEST, math.ceil(beat / robot.dt))
    shaken = Learned(pid, jnp.asarray(size * _steps(count, held)))
    run = loop.quiet().run(shaken, longer, progress=progress)
    if run.status == Status.CANCELLED:
        return None
    if run.status != Status.SOLVED:
        raise InputError(f"no model: shaken about the reference, at {run.time[-1]:.3g} s, it {run.status.reason}.")
    model = fit_linear(run.command, run.measured, robot.dt, robot.initial_command)
    if not model.explained >= _EXPLAINED:
        share = f"{_percent_below(model.explained)} % of what {robot.command} does to {robot.reading.name}"
        hint = "" if loop.sensor.beat else ", average over the beat of a swimmer"
        way_out = f"Take pid{hint}, or try a smaller range of --command or another --rate."
        raise InputError(
            f"a linear model explains {share}; {100 * _EXPLAINED:.0f} % are needed. {way_out}", field="controller"
        )
    return model


def _percent_below(share: float) -> str:
    """Percent of a share that is too small, with as many digits as show that it is."""
    percent = 100 * max(share, 0.0)
    texts = (f"{percent:.{digits}f}" for digits in range(10))
    return next((text for text in texts if float(text) < 100 * _EXPLAINED), f"less than {100 * _EXPLAINED:.0f}")


def fit_linear(
    command: Float[np.ndarray, "k"], output: Float[np.ndarray, "k"], dt: float, before: float = 0.0
) -> RobotModel:
    """The model of commands, each held for a sample, and of outputs at the samples; `before` is the command till then.

    Of all structures the simplest one that explains 99.999 % of what the command does, or whose residuals are within
    10 % of the least.
    """
    fits: list[_Fit] = []
    for structure in _STRUCTURES:
        fits.append(_fitted(*structure, command - before, output, dt))
        if fits[-1].explained >= _ENOUGH:
            break
    least = min(fit.rms for fit in fits)
    best = next((fit for fit in fits[:-1] if fit.rms <= _AS_GOOD * least), fits[-1])
    known = best.integrators, best.below, best.gain, before + best.shift, best.delay, dt, best.explained
    return RobotModel(*known, command, output)


class _Fit(NamedTuple):
    integrators: int
    below: Float[np.ndarray, "m+1"]
    delay: int
    gain: float
    shift: float  # u_0 [command], from the one before the start
    rms: float
    explained: float


def _fitted(i: int, m: int, u: Float[np.ndarray, "k"], y: Float[np.ndarray, "k"], dt: float) -> _Fit:
    """The best model of a structure: for each delay from the best of a grid of poles, then downhill."""
    grid = [(_Projected(i, poles, u, y, dt), poles) for poles in _grid(m, len(u), dt)]
    low, high = np.log([1e-3 * dt, 0.5 * len(u) * dt])  # of a time
    ends = {0: ([], []), 1: ([low], [high]), 2: ([-high, -4], [-low, 3]), 3: ([-high, -4, low], [-low, 3, high])}[m]

    def best(delay: int) -> tuple[float, Poles]:
        return min(((float(np.sum(one.left(delay) ** 2)), poles) for one, poles in grid), key=lambda found: found[0])

    def polished(delay: int, poles: Poles) -> _Fit:
        if m:
            start, left = np.clip(poles, *ends), lambda p: _Projected(i, p, u, y, dt).left(delay)
            poles = least_squares(left, start, bounds=ends, xtol=1e-9, max_nfev=40).x
        return _Projected(i, poles, u, y, dt).fit(delay)

    starts = {delay: best(delay) for delay in range(min(_MOST_DELAY, len(u) // 10) + 1)}
    least = min(size for size, _ in starts.values())
    near = [polished(delay, poles) for delay, (size, poles) in starts.items() if size <= _NEAR * least]
    return min(near, key=lambda fit: fit.rms)


class _Projected:
    """A structure with some poles: what its command does, less what needs no command (start, and constant input)."""

    def __init__(self, i: int, poles: Poles, u: Float[np.ndarray, "k"], y: Float[np.ndarray, "k"], dt: float):
        self.i, self.below = i, _polynomial(poles)
        above, discrete = _held(np.append(self.below, np.zeros(i)), dt)
        forced = lfilter(above, discrete, u)
        k = np.arange(len(y))
        impulse = (k == 0).astype(float)
        own = _held(self.below, dt)[1]
        modes = [lfilter(np.eye(1, n + 1, n)[0], own, impulse) for n in range(len(self.below) - 1)]
        ramp = (k * dt) ** i / (1, 1, 2)[i]  # the answer to a constant input, but for a motion of its own
        others = np.column_stack([ramp, *((k / len(k)) ** n for n in range(i)), *modes])
        self._scale = np.linalg.norm(others, axis=0) + 1e-300
        self._Q, self._R = np.linalg.qr(others / self._scale)
        self._y, self._forced = y, forced
        self._free = y - self._Q @ (self._Q.T @ y)

    def left(self, delay: int) -> Float[np.ndarray, "k"]:
        """Residuals with the best gain."""
        effect = self._effect(delay)
        return self._free - self._gain(effect) * effect

    def fit(self, delay: int) -> _Fit:
        """With the best gain and offset."""
        effect, free = self._effect(delay), float(self._free @ self._free)
        gain, left = self._gain(effect), self.left(delay)
        rest = self._y - gain * self._late(delay)
        weights = np.linalg.lstsq(self._R, self._Q.T @ rest, rcond=None)[0] / self._scale
        explained = 1 - float(left @ left) / free if free > 0 else 0.0
        shift = -float(weights[0]) / gain if gain else 0.0
        return _Fit(self.i, self.below, delay, gain, shift, float(np.sqrt(np.mean(left**2))), explained)

    def _late(self, delay: int) -> Float[np.ndarray, "k"]:
        return np.concatenate([np.zeros(delay), self._forced[: len(self._y) - delay]])

    def _effect(self, delay: int) -> Float[np.ndarray, "k"]:
        late = self._late(delay)
        return late - self._Q @ (self._Q.T @ late)

    def _gain(self, effect: Float[np.ndarray, "k"]) -> float:
        size = float(effect @ effect)
        return float(effect @ self._free) / size if size > 0 else 0.0


def _held(below: Float[np.ndarray, "n+1"], dt: float) -> tuple[np.ndarray, np.ndarray]:
    """Filter of 1/below for inputs that are held over a sample: exact, by a matrix exponential (Van Loan 1978)."""
    n = len(below) - 1
    if not n:
        return np.array([0.0, 1 / below[0]]), np.ones(1)
    rates = np.zeros((n + 1, n + 1))
    rates[: n - 1, 1:n] = np.eye(n - 1)
    rates[n - 1, :n] = -below[:0:-1] / below[0]
    rates[n - 1, n] = 1 / below[0]
    step = _exponential(rates * dt)
    A, B = step[:n, :n], step[:n, n]
    markov = [B]
    for _ in range(n - 1):
        markov.append(A @ markov[-1])
    discrete = np.poly(A)
    return np.convolve(discrete, [0.0, *(x[0] for x in markov)])[: n + 1], discrete


def _exponential(x: Float[np.ndarray, "n n"]) -> Float[np.ndarray, "n n"]:
    """By Taylor's series of a part small enough, and squares; on a busy machine SciPy's waits for threads of BLAS."""
    halvings = max(int(np.ceil(np.log2(np.abs(x).sum(axis=1).max() + 1e-300))) + 2, 0)
    part, total, term = x / 2.0**halvings, np.eye(len(x)), np.eye(len(x))
    for k in range(1, 15):
        term = term @ part / k
        total = total + term
    for _ in range(halvings):
        total = total @ total
    return total


def _polynomial(poles: Poles) -> Float[np.ndarray, "m+1"]:
    """a_m .. a_1, 1: of T; of a frequency and a damping; of both, the time last."""
    below = np.ones(1)
    if len(poles) > 1:
        w, z = np.exp(poles[:2])
        below = np.array([1 / w**2, 2 * z / w, 1.0])
    if len(poles) % 2:
        below = np.polymul(below, [np.exp(poles[-1]), 1.0])
    return below


def _grid(m: int, count: int, dt: float) -> Iterator[Poles]:
    times = np.log(np.geomspace(0.5 * dt, 0.5 * count * dt, _TIMES))
    pairs = [*product(-times[::2], np.log(_DAMPINGS))]
    every = {0: [()], 1: [(x,) for x in times], 2: pairs, 3: [(*pair, x) for pair in pairs for x in times[::4]]}[m]
    yield from (np.array(one, dtype=float) for one in every)


def _steps(count: int, shortest: int) -> Float[np.ndarray, "k"]:
    """Random signs, each held for a time from a wide range; 0 at first, for a start without a bump."""
    rng, signs, longest = np.random.default_rng(0), [0.0, 0.0], max(count / 10, 2 * shortest)
    while len(signs) < count:
        held = int(np.exp(rng.uniform(np.log(shortest), np.log(longest))))
        signs += [float(rng.choice((-1.0, 1.0)))] * held
    return np.array(signs[:count])
