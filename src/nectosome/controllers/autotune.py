"""Gains for a robot, from a relay experiment on its model."""

from collections.abc import Callable
from itertools import pairwise
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from nectosome.core import Status
from nectosome.solve import SampledPlant
from nectosome.units import InputError

from .closed_loop import PLAIN, SensorModel, run_closed_loop
from .contract import Controller, Regulator
from .pid import PID, ActuatorLimits, pid_of

_STEADY = 0.15  # by how much the last swings may differ
_SWINGS = 4  # that are looked at
_ALIKE = 0.05  # by how much the means of these and of as many before may differ, where samples are too few for more


class Relay(Controller):
    """One command or its opposite, by the sign of the error; it turns when the error is beyond a band."""

    amplitude: Float[Array, ""]  # of the command
    band: Float[Array, ""]  # half of it, of the output: more than the noise

    def planned(self, reference: Float[np.ndarray, "n"], dt: float) -> Regulator:
        """Along a reference, which is best left at 0."""
        return _Turns(jnp.asarray(reference, dtype=float), self.amplitude, self.band)


class _Turns(Regulator):
    reference: Float[Array, "n"]
    amplitude: Float[Array, ""]
    band: Float[Array, ""]

    def initial(self, command: Float[ArrayLike, ""] = 0.0, measured: Float[ArrayLike, ""] = 0.0) -> tuple[Array, Array]:
        """Upwards, unless the command was below 0."""
        return jnp.zeros((), dtype=int), jnp.where(jnp.asarray(command) < 0, -self.amplitude, self.amplitude)

    def step(self, state: tuple[Array, Array], measured: Float[Array, ""]) -> tuple[tuple[Array, Array], Array]:
        """The command, turned where the error is beyond the band on the other side."""
        k, command = state
        error = self.reference[jnp.minimum(k, len(self.reference) - 1)] - measured
        turned = jnp.where(error > self.band, self.amplitude, jnp.where(error < -self.band, -self.amplitude, command))
        return (k + 1, turned), turned


class Ultimate(NamedTuple):
    """Where a loop begins to swing under a gain alone."""

    gain: float  # K_u, command per output
    period: float  # T_u [s]

    def pid(self) -> Float[np.ndarray, "3"]:
        """K_p, K_i, K_d by Tyreus and Luyben (1992): K_u/2.2, T_i = 2.2 T_u, T_d = T_u/6.3."""
        kp = self.gain / 2.2
        return np.array([kp, kp / (2.2 * self.period), kp * self.period / 6.3])

    def pi(self) -> Float[np.ndarray, "3"]:
        """The same without a derivative: K_u/3.2, T_i = 2.2 T_u."""
        kp = self.gain / 3.2
        return np.array([kp, kp / (2.2 * self.period), 0.0])


def ultimate(measured: Float[np.ndarray, "n"], command: Float[np.ndarray, "n"], dt: float, band: float) -> Ultimate:
    r"""From the swing under a relay: $K_u = 4 d/(\pi \sqrt{a^2 - \epsilon^2})$ of the amplitudes d of the command and a
    of the output, and the band epsilon.

    Raises InputError where it does not swing evenly within the recording.
    """
    ups = np.flatnonzero((command[1:] > 0) & (command[:-1] < 0)) + 1
    if len(ups) < _SWINGS + 1:
        raise InputError(f"the relay turned up {len(ups)} times; {_SWINGS + 1} are needed. Give it more time.")
    swings = np.array([0.5 * np.ptp(measured[a:b]) for a, b in pairwise(ups[-2 * _SWINGS - 1 :])])
    periods = np.diff(ups[-2 * _SWINGS - 1 :]) * dt
    alike = all(len(x) == 2 * _SWINGS and _alike(x[:_SWINGS], x[_SWINGS:]) for x in (swings, periods))
    last, swings, periods = ups[-_SWINGS - 1 :], swings[-_SWINGS:], periods[-_SWINGS:]
    for what, values in (("amplitudes", swings), ("periods", periods)):
        if not alike and np.ptp(values) > _STEADY * values.mean() + (2 * dt if what == "periods" else 0.0):
            told = ", ".join(f"{x:.3g}" for x in values)
            raise InputError(
                f"the swing is not steady: the last {what} are {told}. Give it more time, or a wider band."
            )
    a, d = float(swings.mean()), float(np.abs(command[last[0] : last[-1]]).max())
    if a <= band:
        raise InputError(f"the output swings by {a:.3g}, within the band of {band:.3g}: the loop does not answer.")
    return Ultimate(4 * d / (np.pi * np.sqrt(a**2 - band**2)), float(periods.mean()))


def _alike(before: Float[np.ndarray, "n"], after: Float[np.ndarray, "n"]) -> bool:
    return bool(abs(after.mean() - before.mean()) <= _ALIKE * after.mean())


_PATIENCE = 8  # samples without a turn, before the other sign is tried
_STAYS = 0.9  # of an error half that time ago: less is a way towards the reference
_MOST = 1500  # samples
_SLOW = 3  # samples that a swing must take for a derivative by samples to tell of its phase


class RelayGains(NamedTuple):
    """Gains, and the experiment that they come from."""

    gains: Float[np.ndarray, "3"]  # K_p, K_i, K_d, with the sign in which the robot answers
    ultimate: Ultimate
    time: float  # that the experiment took [s]


def relay_gains(
    robot: SampledPlant,
    low: float,
    high: float,
    about: float,
    measuring: SensorModel = PLAIN,
    *,
    progress: Callable[[float], bool | None] | None = None,
) -> RelayGains | None:
    """Gains by Tyreus and Luyben's rules, from the swing of the model under a relay about a reference.

    Without a derivative where the swing takes few samples, which tell too little of its phase. The relay goes from one
    end of the range to the other. The sign in which the robot answers is found on the way. None where `progress`
    returns False. Raises InputError where the robot does not come to the reference, and where it does not come to swing
    evenly.
    """
    middle, size, quiet = 0.5 * (low + high), 0.5 * (high - low), measuring._replace(noise=0.0)

    def swing(measured: np.ndarray, command: np.ndarray) -> Ultimate:
        return ultimate(measured - about, command - middle, robot.dt, band=0.0)

    def enough(measured: np.ndarray, command: np.ndarray) -> bool:
        if len(command) < 2 or command[-1] == command[-2]:
            return False
        try:
            swing(measured, command)
        except InputError:
            return False
        return True

    relay = Relay(jnp.asarray(size), jnp.zeros(()))
    controller = _BothWays(relay, jnp.asarray(middle))
    run = run_closed_loop(robot, controller, np.full(_MOST, about), quiet, progress=progress, enough=enough)
    if run.status == Status.CANCELLED:
        return None
    if run.status != Status.SOLVED:
        raise InputError(f"no gains were found: under a relay, at {run.time[-1]:.3g} s, it {run.status.reason}.")
    sides = np.sign(run.measured - about)
    if np.all(sides[1:] == sides[1]):
        first, last = run.measured[0], run.measured[-1]
        told = f"went from {first:.4g} to {last:.4g} (SI) in {run.time[-1]:.3g} s and did not come to the reference"
        raise InputError(f"no gains were found: driven by a relay it {told}. Is that out of reach?")
    try:
        found = swing(run.measured, run.command)
    except InputError:
        told = f"no gains were found: under a relay it does not swing evenly within {run.time[-1]:.3g} s"
        raise InputError(f"{told}. Give gains of your own, or choose another command or measurement.") from None
    last = -int(np.ceil(4 * found.period / robot.dt))
    sign = -np.sign(np.sum((run.command[last:] - middle) * (run.measured[last:] - about)))
    gains = found.pid() if found.period > _SLOW * robot.dt else found.pi()
    return RelayGains(float(sign) * gains, found, float(run.time[-1]))


class _BothWays(Controller):
    """A relay about a command, for what answers upwards or downwards."""

    relay: Relay
    middle: Float[Array, ""]

    def planned(self, reference: Float[np.ndarray, "n"], dt: float) -> Regulator:
        """About a reference that stays what it is."""
        first = jnp.asarray(reference[0], dtype=float)
        return _Swings(self.relay.planned(np.zeros(len(reference)), dt), self.middle, first)


class _Swings(Regulator):
    relay: Regulator
    middle: Float[Array, ""]
    about: Float[Array, ""]

    def initial(self, command: Float[ArrayLike, ""] = 0.0, measured: Float[ArrayLike, ""] = 0.0) -> Any:
        """Upwards, for what answers so; after so many samples without a turn it may be the other way."""
        relay = self.relay.initial()
        return relay, jnp.ones(()), relay[1], *map(jnp.asarray, (0, _PATIENCE, 0.0, 0))

    def step(self, state: Any, measured: Float[Array, ""]) -> tuple[Any, Float[Array, ""]]:
        """The other sign is tried where no turn has come for long, and the error grows or stays.

        Not once it has turned there and back: then it swings, and an error that grows will come back.
        """
        relay, sign, before, since, patience, halfway, turns = state
        off = measured - self.about
        stays = (since > 0) & (since % patience == 0) & (jnp.abs(off) > _STAYS * halfway)
        wrong = stays & (turns < 2)
        sign = jnp.where(wrong, -sign, sign)
        patience = jnp.where(wrong, 4 * patience, patience)  # what was pushed away needs time to come back
        relay, command = self.relay.step(relay, sign * off)
        turns = jnp.where(wrong, 0, jnp.where(command == before, turns, turns + 1))
        since = jnp.where(command == before, since + 1, 0)
        halfway = jnp.where(since % patience == patience // 2, jnp.abs(off), halfway)
        return (relay, sign, command, since, patience, halfway, turns), self.middle + command


_PACES = (1.0, 0.8, 0.65, 0.5, 0.4, 0.3)
_SMOOTH = 10  # the derivative of the error is cut off at K_d/(10 K_p)


def smooth_pid(gains: Float[np.ndarray, "3"], low: float, high: float, dt: float) -> PID:
    """PID of these gains whose command stays in a range, its derivative cut off at a tenth of K_d/K_p."""
    kp, _, kd = gains
    return pid_of(gains, kd / (_SMOOTH * kp) if kp else dt, ActuatorLimits(*map(jnp.asarray, (low, high, np.inf))))


def detune(
    robot: SampledPlant,
    gains: Float[np.ndarray, "3"],
    low: float,
    high: float,
    reference: Float[np.ndarray, "n"],
    measuring: SensorModel = PLAIN,
    *,
    progress: Callable[[float], bool | None] | None = None,
) -> float | None:
    r"""Pace p at which a reference is followed best: with K_p p^2, K_i p^3 and K_d p, see `paced`.

    Gains from a relay are those of large motions. In small ones a quadratic drag vanishes, and what was well damped
    overshoots or swings for ever. So the reference is rehearsed, without noise, at slower and slower paces, until the
    integral of time times magnitude of error grows (Graham and Lathrop 1953): $\int t |e| dt$. None where `progress`
    returns False.
    """
    best, least = 1.0, np.inf
    for k, pace in enumerate(_PACES):
        told = None if progress is None else lambda share, k=k: progress((k + share) / len(_PACES))
        controller = smooth_pid(time_scaled(gains, pace), low, high, robot.dt)
        run = run_closed_loop(robot, controller, reference, measuring._replace(noise=0.0), progress=told)
        if run.status == Status.CANCELLED:
            return None
        error = float(np.sum(run.time * np.abs(run.output - run.reference)))
        if run.status == Status.SOLVED and error >= least:
            break
        if run.status == Status.SOLVED:
            best, least = pace, error
    return best


def time_scaled(gains: Float[np.ndarray, "3"], pace: float) -> Float[np.ndarray, "3"]:
    """Gains that make the same motion slower in a plant that integrates twice: all times are longer by 1/p."""
    return gains * np.array([pace**2, pace**3, pace])
