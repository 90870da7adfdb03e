"""Gains for a robot, from a relay experiment on its model."""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from nectosome.core import Status
from nectosome.io import InputError
from nectosome.robots import Commanded

from .controller import Controller, Regulator
from .following import PLAIN, Measuring, follow
from .relay import Relay, Ultimate, ultimate

_PATIENCE = 8  # samples without a turn, before the other sign is tried
_STAYS = 0.9  # of an error half that time ago: less is a way towards the reference
_MOST = 1500  # samples
_SLOW = 3  # samples that a swing must take for a derivative by samples to tell of its phase


class Found(NamedTuple):
    """Gains, and the experiment that they come from."""

    gains: Float[np.ndarray, "3"]  # K_p, K_i, K_d, with the sign in which the robot answers
    ultimate: Ultimate
    time: float  # that the experiment took [s]


def relay_gains(
    robot: Commanded,
    low: float,
    high: float,
    about: float,
    measuring: Measuring = PLAIN,
    *,
    progress: Callable[[float], bool | None] | None = None,
) -> Found | None:
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
    run = follow(robot, controller, np.full(_MOST, about), quiet, progress=progress, enough=enough)
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
    return Found(float(sign) * gains, found, float(run.time[-1]))


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
