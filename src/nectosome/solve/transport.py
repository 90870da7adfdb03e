r"""What it costs to go on: energy per metre, cost of transport, endurance and range.

With the speed U, the mass m of the robot and standard gravity, for each mean power P:

- energy per metre $P/U$ [J/m],
- cost of transport $P/(m g U)$ (Gabrielli and von Karman 1950; Tucker 1975).

P is that of all drives, that of drives which cannot take power back (`_positive`), what motors take from their
supplies (`_electrical`), or what batteries give to drives and electronics (`_battery`). The last two count motors
alone, whatever other drives the robot has.

A battery is empty after $E/\overline{U_0 I}$ with its current $I = P_b/U_b$ and the energy E that its charge is worth
at its voltage without a current, $U_0$: what is lost in its own resistance counts.
"""

from collections.abc import Iterator
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from nectosome.core import STANDARD_GRAVITY
from nectosome.mechanism import Robot

Numbers = Any  # an array of NumPy, or of JAX where it is derived
_NOWHERE = 1e-6  # length of the mean of unit vectors that point nowhere on the mean
KINDS = ("", "_positive", "_electrical", "_battery")
"""Endings of the names of energies per metre and of costs of transport."""


def ratio(defined: Numbers, a: Numbers, b: Numbers) -> Numbers:
    """a/b where it is defined, else NaN, without NaN in the derivatives of other results."""
    where = b.__array_namespace__().where
    return where(defined, a / where(defined, b, 1.0), jnp.nan)


def direction(axis: np.ndarray, rotation: Numbers, weights: Numbers) -> tuple[Numbers, Numbers]:
    """Mean of the directions R e of an axis e [3], for rotations R [n, 3, 3] and weights [n] of samples, of length 1.

    With whether it points anywhere, which a direction that goes round does not; a null vector then.
    """
    mean = weights @ (rotation @ axis)
    square = mean @ mean
    points = square > _NOWHERE**2
    return points * mean / (square + ~points) ** 0.5, points


def costs(
    robot: Robot, speed: Array, travels: Bool[Array, ""], mechanical: Float[Array, "2"], taken: Array, given: Array
) -> Iterator[tuple[str, Float[Array, ""]]]:
    """Energies per metre and costs of transport by name, from the means of powers [W].

    `mechanical` is that of all drives and its positive part, `taken` that of each motor, `given` that of each battery.
    NaN where the body does not travel, and without motors or batteries.
    """
    electrical = jnp.stack([jnp.sum(x) if x.size else jnp.asarray(jnp.nan) for x in (taken, given)])
    powers = jnp.concatenate([mechanical, electrical])
    there = travels & ~jnp.isnan(powers)
    per_metre = ratio(there, jnp.where(there, powers, 0.0), speed)
    weight = jnp.sum(robot.weight()) * STANDARD_GRAVITY
    for k, kind in enumerate(KINDS):
        yield f"energy_per_metre{kind}", per_metre[k]
        yield f"cost_of_transport{kind}", per_metre[k] / weight


def battery_endurance(
    energy: Numbers, open_voltage: Numbers, voltage: Numbers, power: Numbers, weights: Numbers
) -> Numbers:
    """Time [s] for which batteries [b] give these powers [n, b; W] at these voltages [n, b; V] again and again.

    `energy` [J] and `open_voltage` [V], that without a current, are those of each battery; `weights` those of the
    samples in a mean. NaN of one whose energy is NaN, and of one that is not drawn on.
    """
    drawn = open_voltage * (weights @ (power / voltage))
    known = (drawn > 0) & (energy == energy)
    return ratio(known, drawn.__array_namespace__().where(known, energy, 0.0), drawn)


def least_known(times: Float[Array, "b"]) -> Float[Array, ""]:
    """Least of those that are not NaN; NaN of none."""
    known = ~jnp.isnan(times)
    least = jnp.min(jnp.where(known, times, jnp.inf), initial=jnp.inf)
    return jnp.where(jnp.any(known), least, jnp.nan)
