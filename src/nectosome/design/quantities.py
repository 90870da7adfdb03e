"""What a steady motion is judged by: speed, torque, power and what follows from them, each differentiable."""

from collections.abc import Callable
from dataclasses import dataclass

import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import STANDARD_GRAVITY
from nectosome.core.se3 import dot
from nectosome.mechanism import Robot
from nectosome.solve import Equilibrium


@dataclass(frozen=True)
class Swim:
    """A steady motion and what it is judged against; forward is a unit vector of the world."""

    robot: Robot
    steady: Equilibrium
    forward: tuple[float, float, float]


@dataclass(frozen=True)
class Quantity:
    """A number of a steady motion; `best` is "high" or "low"."""

    name: str
    dimension: str  # a key of `io.dimensions.DIMENSIONS`
    unit: str
    best: str
    about: str
    of: Callable[[Swim], Float[Array, ""]]


def _velocity(s: Swim) -> Array:
    """Velocity of the body's first station in the world [m/s]."""
    tree, x = s.robot.tree, s.steady.state
    q, v, _ = tree.complete(jnp.zeros(()), x.q, x.v)
    shape = tree.shape(q, v)
    return dot(shape.rotation[0], tree.twists(shape, v)[0, 3:])


def _speed(s: Swim) -> Array:
    return jnp.sum(_velocity(s) * jnp.asarray(s.forward))


def _rates(s: Swim) -> Array:
    tree, x = s.robot.tree, s.steady.state
    _, v, _ = tree.complete(jnp.zeros(()), x.q, x.v)
    return v[tree.prescribed_v]


def _torque(s: Swim) -> Array:
    """What the drives give, in the sense in which they turn; of several the largest."""
    return _largest(s.steady.reaction * jnp.where(_rates(s) < 0, -1.0, 1.0))


def _power(s: Swim) -> Array:
    return jnp.sum(s.steady.reaction * _rates(s))


def _thrust(s: Swim) -> Array:
    """Forward force that the rest of the robot gives to its body: minus the loads on the body."""
    robot, x = s.robot, s.steady.state
    acting = robot.forces(jnp.zeros(()), x, jnp.zeros_like(x.v))
    here = robot.tree.layout[0].stations
    force = jnp.zeros(3)
    for attached, w in zip(robot.loads, acting.wrenches, strict=True):
        if attached.part == 0 and w is not None:
            force += jnp.sum(dot(acting.shape.rotation[here], w[:, 3:]), axis=0)
    return -jnp.sum(force * jnp.asarray(s.forward))


def _efficiency(s: Swim) -> Array:
    return _thrust(s) * _speed(s) / _power(s)


def _cost(s: Swim) -> Array:
    return _power(s) / (jnp.sum(s.robot.weight()) * STANDARD_GRAVITY * _speed(s))


def _drive_rate(s: Swim) -> Array:
    return _largest(jnp.abs(_rates(s)))


def _largest(x: Array) -> Array:
    """Largest of what may be nothing: a robot without drives has no torque and no rate."""
    return jnp.max(x) if x.size else jnp.zeros(())


QUANTITIES = {
    quantity.name: quantity
    for quantity in (
        Quantity("speed", "speed", "m/s", "high", "speed of the body along forward", _speed),
        Quantity("torque", "torque", "N m", "low", "largest torque (or force) of a drive", _torque),
        Quantity("power", "power", "W", "low", "power of all drives", _power),
        Quantity("thrust", "force", "N", "high", "forward force on the body by the rest of the robot", _thrust),
        Quantity("efficiency", "number", "1", "high", "thrust on the body times speed over power", _efficiency),
        Quantity("cost_of_transport", "number", "1", "low", "power over weight in air times speed", _cost),
        Quantity("drive_rate", "angular_speed", "rad/s", "low", "largest rate of a drive", _drive_rate),
    )
}
