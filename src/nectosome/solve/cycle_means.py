"""What a periodic motion gives over its cycle: means, peaks, speed, power, efficiency, cost of transport."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core import STANDARD_GRAVITY, State, safe_norm
from nectosome.core.remember import prepare
from nectosome.core.se3 import matmul3
from nectosome.loads import LineForce, PointForce, PulsedThrust
from nectosome.mechanism import Diagnosis, Robot, SoftRod, load_names
from nectosome.mechanism.diagnose import ADDED_MASS, DRIVE, SHAPE_CHANGE, VISCOUS, driving

from .results import VARIABLES, Data, Names, blank, diagnose_all, labels

_STAYS = 1e-9  # of the largest speed of a part: a body as slow stays where it is


class CycleMeans(NamedTuple):
    """Means over a cycle and the largest magnitudes in it; SI units, world frame."""

    velocity: Float[Array, "parts 3"]  # of each part's first station [m/s]
    load_force: Float[Array, "loads parts 3"]  # [N]
    load_power: Float[Array, "loads parts"]  # [W], positive into the robot
    force: Float[Array, "3"]  # of all loads on all parts [N]
    force_peak: Float[Array, "3"]  # the largest magnitude of each of its components [N]
    reaction: Float[Array, "prescribed"]  # what the drives of prescribed joints give [N m, N]
    reaction_power: Float[Array, "prescribed"]  # [W]
    energy: Float[Array, "3"]  # kinetic, of the water carried along, elastic [J]
    part_energy: Float[Array, "parts 3"]
    reaction_peak: Float[Array, "prescribed"]
    drive_velocity_peak: Float[Array, "prescribed"]  # [rad/s, m/s]
    hinge_strain_peak: Float[Array, "parts"]  # NaN where a part sits on no flexible layer
    hinge_stress_peak: Float[Array, "parts"]  # [Pa]
    bending_strain_peak: Float[Array, "parts"]  # along the part, at the ends of the half axes; NaN where it is rigid
    bending_stress_peak: Float[Array, "parts"]  # [Pa]
    power: Float[Array, ""]  # of all drives [W]
    speed: Float[Array, ""]  # [m/s]
    turn_rate: Float[Array, ""]  # [rad/s]
    efficiency: Float[Array, ""]
    cost_of_transport: Float[Array, ""]


def cycle_means(robot: Robot, times: Float[Array, "n"], states: State) -> CycleMeans:
    r"""What a cycle gives whose states are known at times spread evenly from 0 to the period T, both ends included.

    A mean is that of the first n - 1 samples, the trapezoid rule of a periodic function. With the place x and the
    rotation R of the root body's first station, the mean powers $\bar P_l$ of loads, $\bar P_r$ of reactions and
    $\bar P_d$ of driving forces, and the mass m of the robot:

    - force: minus what holds a robot that is held, since the rate of momentum has no mean; and better told by samples
      than the mean of the reactions, which feel every stop that is hit. Its peak is what a load cell shows behind a
      low pass that takes such blows away.
    - power $P = \sum \bar P_r + \sum \bar P_d$, of muscles, tendons and chambers too; what a drive gets back in a part
      of the cycle counts as given back.
    - speed $U = |x(T) - x(0)|/T$.
    - turn_rate $\mathrm{atan2}(Q_{yx} - Q_{xy}, Q_{xx} + Q_{yy})/T$, $Q = R(T) R(0)^T$: the heading gained, less
      than half a turn a cycle.
    - efficiency $-\sum \bar P_l / P$ of the loads on the root body, all but its added mass: what it costs to tow
      that body as it moves, of what the drives give. Near to the quasi-propulsive efficiency (Maertens et al. 2015),
      which tows at the mean speed. NaN where the body stays, the drives give no power, or that body is a rod, whose
      bending cannot be told from its towing.
    - cost_of_transport $P/(m g U)$ with standard gravity (Gabrielli and von Karman 1950; Tucker 1975). NaN where the
      body stays. It and the efficiency are NaN where a load changes the shape or is a given force or thrust: the power
      of what makes it is not among the drives'.

    Works under jit, vmap and derivatives.
    """
    return means_of(robot, times, diagnose_all(robot, times, states))


def means_of(robot: Robot, times: Float[Array, "n"], d: Diagnosis) -> CycleMeans:
    """`cycle_means` of a cycle that has been diagnosed at those times, leaves [n, ...]."""
    once = jax.tree.map(lambda x: x[:-1], d)  # the last sample is the first again
    mean = jax.tree.map(lambda x: jnp.mean(x, axis=0), once)
    power = jnp.sum(mean.reaction_power) + jnp.sum(mean.load_power[driving(robot)])
    speed = safe_norm(d.position[-1, 0] - d.position[0, 0]) / times[-1]
    fastest = jnp.max(safe_norm(jax.lax.stop_gradient(once.velocity)))
    # what turns the crank of a jet, or gives a force, is no drive of a joint: its power is not told here
    hull = not isinstance(robot.tree.parts[0].body, SoftRod)
    given = any(isinstance(attached.load, PointForce | LineForce | PulsedThrust) for attached in robot.loads)
    goes = (speed > _STAYS * fastest) & (SHAPE_CHANGE not in load_names(robot)) & (not given)
    return CycleMeans(
        velocity=mean.velocity,
        load_force=mean.load_force,
        load_power=mean.load_power,
        force=jnp.sum(mean.load_force, axis=(0, 1)),
        force_peak=_largest(jnp.sum(once.load_force, axis=(1, 2))),
        reaction=mean.reaction,
        reaction_power=mean.reaction_power,
        energy=mean.energy,
        part_energy=mean.part_energy,
        reaction_peak=_largest(once.reaction),
        drive_velocity_peak=_largest(once.drive_velocity),
        hinge_strain_peak=_largest(once.bending.hinge_strain),
        hinge_stress_peak=_largest(once.bending.hinge_stress),
        bending_strain_peak=_by_part(robot, once.bending.strain),
        bending_stress_peak=_by_part(robot, once.bending.stress),
        power=power,
        speed=speed,
        turn_rate=_heading(d) / times[-1],
        efficiency=_where(goes & (power > 0) & hull, _towing(robot, mean), power),
        cost_of_transport=_where(goes, power, jnp.sum(robot.weight()) * STANDARD_GRAVITY * speed),
    )


def _where(defined: Array, a: Array, b: Array) -> Array:
    """a/b where it is defined, else NaN, which spoils no derivative of the rest."""
    return jnp.where(defined, a / jnp.where(defined, b, 1.0), jnp.nan)


def _towing(robot: Robot, mean: Diagnosis) -> Float[Array, ""]:
    """Power [W] that the loads on the root body take out."""
    own = np.array([name not in (ADDED_MASS, SHAPE_CHANGE, VISCOUS, DRIVE) for name in load_names(robot)])
    return -jnp.sum(mean.load_power[own & ~driving(robot)[:, 0], 0])


def _heading(d: Diagnosis) -> Float[Array, ""]:
    """Angle about z [rad] by which the root body has turned: the twist of the rotation from start to end."""
    Q = matmul3(d.rotation[-1, 0], d.rotation[0, 0].T)
    return jnp.arctan2(Q[1, 0] - Q[0, 1], Q[0, 0] + Q[1, 1])


def _largest(x: Float[Array, "n *rest"]) -> Float[Array, "*rest"]:
    """Largest magnitude along the first axis; NaN where one is NaN, which spoils no derivative of the rest."""
    none = jnp.isnan(x)
    size = jnp.max(jnp.abs(jnp.where(none, 0.0, x)), axis=0)
    return jnp.where(jnp.any(none, axis=0), jnp.nan, size)


def _by_part(robot: Robot, x: Float[Array, "n stations 2"]) -> Float[Array, "parts"]:
    """Largest magnitude at any station of each part."""
    return jnp.stack([_largest(x[:, place.stations].reshape(-1)) for place in robot.tree.layout])


def prepare_means(robot: Robot, samples: int) -> None:
    """Get `cycle_means` ready for cycles of that many samples, beside what goes on."""
    prepare(cycle_means, robot, *blank(robot, samples))


_OF_A_CYCLE: dict[str, tuple[tuple[str, ...], str]] = {
    "bending_strain_peak": (("part",), "1"),
    "bending_stress_peak": (("part",), "Pa"),
    "force": (("axis",), "N"),
    "force_peak": (("axis",), "N"),
    "power": ((), "W"),
    "speed": ((), "m/s"),
    "turn_rate": ((), "rad/s"),
    "efficiency": ((), "1"),
    "cost_of_transport": ((), "1"),
}


def mean_data(robot: Robot, means: CycleMeans, dims: tuple[str, ...] = ()) -> tuple[Data, Names]:
    """The means with the dimensions and units of `Results.data`, and the names along them, as in `Results.names`.

    `dims` name the leading dimensions of the arrays: those of a sweep. Means have the names of what they are the mean
    of, largest magnitudes end in `_peak`.
    """
    data = {}
    for name, values in means._asdict().items():
        own, unit = _OF_A_CYCLE.get(name) or VARIABLES[name.removesuffix("_peak")]
        data[name] = ((*dims, *own), np.asarray(values), unit)
    used = {dim for own, _, _ in data.values() for dim in own}
    return data, {name: label for name, label in labels(robot).items() if name in used}
