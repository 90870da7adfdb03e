"""Gains: from a relay experiment on a model, detuned, or with the least errors over a batch of loops."""

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float, Int

from nectosome.core import Status
from nectosome.identification.fits.misfit import Misfit
from nectosome.units import InputError
from nectosome.units.ranges import Ranges

from .block_loop import BlockLoop, run_batch
from .contract import ActuatorLimits, Controller, Plant, Progress, Regulator
from .gains import PIDGains
from .pid import smooth_pid
from .references import local_frequency, times
from .tracking_errors import still_approaching

_PATIENCE = 8  # samples without a switch, after which the opposite sign is tried
_UNCHANGED = 0.9  # of the error half that time before: less is an approach to the reference
_MOST = 1500  # samples
_VARIATION = 0.15  # relative difference among the last oscillations that counts as even
_OSCILLATIONS = 4  # that are evaluated
_DRIFT = 0.05  # relative difference of their means from those before, for oscillations of few samples


class Relay(Controller):
    """Relay: one command or its opposite, by the sign of the error; it switches where the error leaves a band.

    If `seeking`, the plant may have a positive or a negative response: the opposite sign is tried after many samples
    without a switch in which the error did not decrease. Not after two switches: then the plant oscillates, and an
    error that grows will decrease again.
    """

    amplitude: Float[Array, ""]  # of the command
    band: Float[Array, ""]  # half width, of the output: more than the noise
    middle: Float[Array, ""] = eqx.field(converter=jnp.asarray, default=0.0)  # about which the command switches
    seeking: bool = eqx.field(static=True, default=False)

    def planned(self, reference: Float[np.ndarray, "n"], dt: float) -> Regulator:
        """Along a reference, best a constant one."""
        return _RelayRegulator(jnp.asarray(reference, dtype=float), self)


class _RelayState(NamedTuple):
    """State of a relay between two samples."""

    k: Int[Array, ""]
    sign: Float[Array, ""]  # of the response, 1 or -1
    command: Float[Array, ""]  # the last one, about the middle
    since: Int[Array, ""]  # samples since the last switch
    patience: Int[Array, ""]  # samples without a switch, after which the opposite sign is tried
    halfway: Float[Array, ""]  # magnitude of the error half of these samples ago
    switches: Int[Array, ""]  # since the sign was last changed


class _RelayRegulator(Regulator):
    reference: Float[Array, "n"]
    relay: Relay

    def initial(self, command: Float[ArrayLike, ""] = 0.0, measured: Float[ArrayLike, ""] = 0.0) -> _RelayState:
        """The positive command, unless the held one is negative and the sign of the response is known."""
        low = (jnp.asarray(command) < 0) & (not self.relay.seeking)
        first = jnp.where(low, -self.relay.amplitude, self.relay.amplitude)
        return _RelayState(jnp.asarray(0), jnp.ones(()), first, *map(jnp.asarray, (0, _PATIENCE, 0.0, 0)))

    def step(self, state: _RelayState, measured: Float[Array, ""]) -> tuple[_RelayState, Float[Array, ""]]:
        """The command, switched where the error is beyond the band."""
        relay = self.relay
        error = measured - self.reference[jnp.minimum(state.k, len(self.reference) - 1)]
        waited = relay.seeking & (state.since > 0) & (state.since % state.patience == 0)
        wrong = waited & (jnp.abs(error) > _UNCHANGED * state.halfway) & (state.switches < 2)
        sign = jnp.where(wrong, -state.sign, state.sign)
        patience = jnp.where(wrong, 4 * state.patience, state.patience)  # the way back takes longer
        command = jnp.where(jnp.abs(error) > relay.band, -sign * jnp.sign(error) * relay.amplitude, state.command)
        same = command == state.command
        switches = jnp.where(wrong, 0, jnp.where(same, state.switches, state.switches + 1))
        since = jnp.where(same, state.since + 1, 0)
        halfway = jnp.where(since % patience == patience // 2, jnp.abs(error), state.halfway)
        return _RelayState(state.k + 1, sign, command, since, patience, halfway, switches), relay.middle + command


class Ultimate(NamedTuple):
    """Limit of stability of a loop under proportional gain alone."""

    gain: float  # K_u, command per output
    period: float  # T_u [s]

    def pid(self) -> Float[np.ndarray, "3"]:
        """K_p, K_i, K_d by Tyreus and Luyben (1992): K_u/2.2, T_i = 2.2 T_u, T_d = T_u/6.3."""
        kp = self.gain / 2.2
        return np.array([kp, kp / (2.2 * self.period), kp * self.period / 6.3])

    def pi(self) -> Float[np.ndarray, "3"]:
        """The same without derivative: K_u/3.2, T_i = 2.2 T_u."""
        kp = self.gain / 3.2
        return np.array([kp, kp / (2.2 * self.period), 0.0])


def ultimate(measured: Float[np.ndarray, "n"], command: Float[np.ndarray, "n"], dt: float, band: float) -> Ultimate:
    r"""Ultimate gain and period from the oscillation under a relay: $K_u = 4 d/(\pi \sqrt{a^2 - \epsilon^2})$.

    d is the amplitude of the command, a that of the output, epsilon the band. Both signals are about 0.

    Raises InputError where the recording has no even oscillation.
    """
    ups = np.flatnonzero((command[1:] > 0) & (command[:-1] < 0)) + 1
    if len(ups) < _OSCILLATIONS + 1:
        raise InputError(f"the relay switched up {len(ups)} times; {_OSCILLATIONS + 1} are needed. Give it more time.")
    amplitudes = np.array([0.5 * np.ptp(measured[a:b]) for a, b in pairwise(ups[-2 * _OSCILLATIONS - 1 :])])
    periods = np.diff(ups[-2 * _OSCILLATIONS - 1 :]) * dt
    n = _OSCILLATIONS
    settled = len(periods) == 2 * n and all(
        abs(x[n:].mean() - x[:n].mean()) <= _DRIFT * x[n:].mean() for x in (amplitudes, periods)
    )
    last, amplitudes, periods = ups[-n - 1 :], amplitudes[-n:], periods[-n:]
    for what, values in (("amplitudes", amplitudes), ("periods", periods)):
        if not settled and np.ptp(values) > _VARIATION * values.mean() + (2 * dt if what == "periods" else 0.0):
            listed = ", ".join(f"{x:.3g}" for x in values)
            raise InputError(
                f"the oscillation is not steady: the last {what} are {listed}. Give it more time, or a wider band."
            )
    a, d = float(amplitudes.mean()), float(np.abs(command[last[0] : last[-1]]).max())
    if a <= band:
        raise InputError(
            f"the output oscillates by {a:.3g}, within the band of {band:.3g}: it does not respond to the command."
        )
    return Ultimate(4 * d / (np.pi * np.sqrt(a**2 - band**2)), float(periods.mean()))


_RELAY = 0.2  # of the time of finding gains: the relay experiment
_ROWS = 3  # of a schedule
_ONE = 1.1  # highest by lowest frequency, below which they are one
_LEAST = 20  # samples of a course
_SHORT = 3  # samples of an oscillation, below which its derivative has no information on the phase


class RelayGains(NamedTuple):
    """PID gains, and the relay experiment that they come from."""

    gains: Float[np.ndarray, "3"]  # K_p, K_i, K_d, negative for a plant with negative response
    ultimate: Ultimate
    time: float  # length of the experiment [s]


def relay_gains(
    plant: Plant, low: float, high: float, setpoint: float, *, progress: Progress | None = None
) -> RelayGains | None:
    """Gains by the rules of Tyreus and Luyben, from a relay experiment about a setpoint, without noise.

    The relay switches between two commands. It finds the sign of the response. Gains have no derivative where a period
    takes three samples or fewer. None where `progress` returns False.

    Raises InputError where the plant does not cross the setpoint, and where it has no even oscillation.
    """
    middle, size, dt = 0.5 * (low + high), 0.5 * (high - low), plant.dt

    def stop(measured: np.ndarray, command: np.ndarray) -> bool:
        if len(command) < 2 or command[-1] == command[-2]:
            return False
        try:
            ultimate(measured - setpoint, command - middle, dt, band=0.0)
        except InputError:
            return False
        return True

    relay = Relay(jnp.asarray(size), jnp.zeros(()), jnp.asarray(middle), seeking=True)
    run = plant.quiet().run(relay, np.full(_MOST, setpoint), progress=progress, stop=stop)
    if run.status == Status.CANCELLED:
        return None
    error, command = np.asarray(run.measured) - setpoint, np.asarray(run.command) - middle
    time = dt * (len(error) - 1)
    if run.status != Status.SOLVED:
        raise InputError(f"no gains were found: under a relay, at {time:.3g} s, it {run.status.reason}.")
    signs = np.sign(error)
    if np.all(signs[1:] == signs[1]):
        first, last = error[0] + setpoint, error[-1] + setpoint
        moved = f"driven by a relay it went from {first:.4g} to {last:.4g} (SI) in {time:.3g} s"
        if still_approaching(error):
            way_out = "is still moving towards the reference. Take a nearer one, or give gains of your own"
        else:
            way_out = "did not come to the reference. Take a nearer one, or a wider range of the command"
        raise InputError(f"no gains were found: {moved} and {way_out}.")
    try:
        cycle = ultimate(error, command, dt, band=0.0)
    except InputError:
        raise InputError(
            f"no gains were found: under a relay it has no even oscillation within {time:.3g} s. "
            "Give gains of your own, or choose another command or measurement."
        ) from None
    last = -int(np.ceil(4 * cycle.period / dt))
    sign = -np.sign(np.sum(command[last:] * error[last:]))
    gains = cycle.pid() if cycle.period > _SHORT * dt else cycle.pi()
    return RelayGains(float(sign) * gains, cycle, float(time))


SPEEDS = (1.0, 0.8, 0.65, 0.5, 0.4, 0.3)  # of a detuned loop, relative to that of its gains


def detune(
    plant: Plant,
    gains: Float[np.ndarray, "3"],
    limits: ActuatorLimits,
    reference: Float[np.ndarray, "n"],
    *,
    progress: Progress | None = None,
) -> float | None:
    r"""Relative speed p with the least tracking error, for the gains K_p p^2, K_i p^3, K_d p (see `time_scaled`).

    Gains of a relay experiment belong to large motions. In small motions quadratic drag vanishes, and a loop that was
    well damped overshoots or has a limit cycle. So the reference is simulated, without noise, at slower and slower
    speeds until the integral of time times error grows, $\int t |e| dt$ (Graham and Lathrop 1953). None where
    `progress` returns False.
    """
    best, least = 1.0, np.inf
    for k, speed in enumerate(SPEEDS):
        report = None if progress is None else lambda share, k=k: progress((k + share) / len(SPEEDS))
        controller = smooth_pid(time_scaled(gains, speed), limits, plant.dt)
        run = plant.quiet().run(controller, reference, progress=report)
        if run.status == Status.CANCELLED:
            return None
        if run.status != Status.SOLVED:
            continue
        error = np.abs(np.asarray(run.output) - reference)
        size = float(np.sum(plant.dt * np.arange(len(error)) * error))
        if size >= least:
            break
        best, least = speed, size
    return best


class LoopGains(NamedTuple):
    """Gains, and where they come from: a relay experiment and detuning, or the user (None, 1)."""

    gains: PIDGains
    experiment: RelayGains | None = None
    speeds: tuple[float, ...] = (1.0,)  # of each detuned row, relative to that of the experiment's gains


def find_gains(
    plant: Plant,
    relay: tuple[float, float],
    setpoint: float,
    limits: ActuatorLimits,
    reference: Float[np.ndarray, "n"],
    *,
    schedule: bool = False,
    progress: Callable[[str, float], bool | None] | None = None,
) -> LoopGains | None:
    """Gains of a relay experiment between two commands about a setpoint, detuned along a reference.

    A `schedule` has rows, detuned along sines from the lowest to the highest frequency of the reference (see
    `schedule_of`). None where `progress(what, share)` returns False. Raises InputError where no gains are found.
    """

    def part(what: str, begun: float, ended: float) -> Progress | None:
        report = progress
        return report and (lambda share: report(what, begun + (ended - begun) * share))

    relayed = relay_gains(plant, *relay, setpoint, progress=part("finding gains", 0.0, _RELAY))
    if relayed is None:
        return None
    frequencies, courses = schedule_of(reference, plant.dt, setpoint) if schedule else (None, [reference])
    speeds, each = list[float](), (1 - _RELAY) / len(courses)
    for k, course in enumerate(courses):
        detuning = part("detuning", _RELAY + k * each, _RELAY + (k + 1) * each)
        speed = detune(plant, relayed.gains, limits, course, progress=detuning)
        if speed is None:
            return None
        speeds.append(speed)
    rows = np.stack([time_scaled(relayed.gains, speed) for speed in speeds])
    return LoopGains(PIDGains(rows, frequencies), relayed, tuple(speeds))


def schedule_of(
    reference: Float[np.ndarray, "k"], dt: float, start: float
) -> tuple[Float[np.ndarray, "m"], list[Float[np.ndarray, "n"]]]:
    """Frequencies of a schedule [Hz], from the lowest to the highest of a reference, and courses to find gains along.

    A course is two periods of a sine as large as the reference, about `start`. Raises InputError for a reference that
    is constant, or too short to turn twice.
    """
    every = local_frequency(reference, dt)
    every = every[every > 0]
    if not every.size:
        message = "a reference that is constant has no frequency. Take pid, or give gains by frequency."
        if np.ptp(reference) > 0:
            lasts = f"{len(reference) * dt:.3g} s"
            message = f"the reference turns less than twice in {lasts}, too short a time to see its frequency. Take a "
            message += "period or more (--time), pid, or give gains by frequency."
        raise InputError(message, field="controller")
    low, high = float(every.min()), float(every.max())
    frequencies = np.geomspace(low, high, _ROWS) if high > _ONE * low else np.array([low])
    size = 0.5 * float(np.ptp(reference))
    each = [(float(f), times(max(2 / float(f), _LEAST * dt), dt)) for f in frequencies]
    return frequencies, [start + size * np.sin(2 * np.pi * f * t) for f, t in each]


def time_scaled(gains: Float[np.ndarray, "3"], speed: float) -> Float[np.ndarray, "3"]:
    """Gains K_p p^2, K_i p^3, K_d p: the same motion of a double integrator, with all times longer by 1/p."""
    return gains * np.array([speed**2, speed**3, speed])


_LEAST_GAIN = 1e-3  # relative decrease of the sum of squares below which the search stops


class Tuned(NamedTuple):
    """Gains, and the rms error over all loops and references, relative to the range of each reference."""

    values: Float[np.ndarray, "p"]
    error_before: float
    error_after: float


def tune(
    make: Callable[[Float[Array, "p"]], Controller],
    ranges: Ranges,
    start: Float[np.ndarray, "p"],
    loops: BlockLoop,
    references: Sequence[Float[np.ndarray, "n"]],
) -> Tuned:
    """Least squares of the output errors over a batch of loops (such as `perturbed` plants); a local minimum.

    `make` maps numbers within `ranges` to a controller; planning is differentiated too. All references have the same
    weight.

    Raises InputError for a start outside of the ranges, a constant reference, and a loop whose error is not finite at
    the start.
    """

    for reference in references:
        if np.ptp(reference) == 0:
            message = f"is constant, {reference[0]:g}: errors are relative to its range, so it must vary."
            raise InputError(message, field="references")

    def residuals(theta: Array) -> Array:
        controller = make(theta)
        return jnp.concatenate([_errors(loops, controller, reference) for reference in references])

    batch: Any = jax.jit(jax.vmap(residuals))
    jacobian: Any = jax.jit(jax.jacfwd(residuals))
    misfit = Misfit(lambda rows: np.asarray(batch(rows)), ranges, lambda theta: np.asarray(jacobian(theta)))
    first = misfit.at(misfit.places(start)[None])[0]
    fit = misfit.fit(start, gain=_LEAST_GAIN * float(first @ first))
    error_before, error_after = (float(np.sqrt(x / len(references))) for x in (first @ first, fit.chi2))
    return Tuned(fit.theta, error_before, error_after)


def _errors(loops: BlockLoop, controller: Controller, reference: Float[np.ndarray, "n"]) -> Float[Array, "m"]:
    """Residuals whose squares sum to the mean square error, relative to the range of the reference."""
    regulator = controller.planned(reference, loops.dt)
    error = (run_batch(loops, regulator, reference).output - reference).ravel()
    return error / (np.ptp(reference) * np.sqrt(error.shape[0]))
