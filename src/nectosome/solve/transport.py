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

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from nectosome.core import STANDARD_GRAVITY
from nectosome.mechanism import Robot

KINDS = ("", "_positive", "_electrical", "_battery")
"""Endings of the names of energies per metre and of costs of transport."""


def ratio(defined: Bool[Array, "*#n"], a: Float[Array, "*#n"], b: Float[Array, "*#n"]) -> Array:
    """a/b where it is defined, else NaN, without NaN in the derivatives of other results."""
    return jnp.where(defined, a / jnp.where(defined, b, 1.0), jnp.nan)


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


def battery_endurance(robot: Robot, voltage: Float[Array, "n b"], power: Float[Array, "n b"]) -> Float[Array, "b"]:
    """Time [s] for which each battery gives these powers [W] at these voltages [V] again and again.

    NaN of one that says neither its charge nor its energy, and of one that is not drawn on.
    """
    b = robot.powered.batteries
    if b is None:
        return jnp.zeros(0)
    drawn = b.voltage * jnp.mean(power / voltage, axis=0)
    return ratio((drawn > 0) & ~jnp.isnan(b.energy), jnp.where(jnp.isnan(b.energy), 0.0, b.energy), drawn)


def least_known(times: Float[Array, "b"]) -> Float[Array, ""]:
    """Least of those that are not NaN; NaN of none."""
    known = ~jnp.isnan(times)
    least = jnp.min(jnp.where(known, times, jnp.inf), initial=jnp.inf)
    return jnp.where(jnp.any(known), least, jnp.nan)
