"""A robot some of whose numbers change with time: one program, whatever they do."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import State, System
from nectosome.loads import Leg, WallContact
from nectosome.mechanism import Robot, in_plane
from nectosome.model import Template, instantiate

from .readings import place_of


class Ramps(NamedTuple):
    """Numbers that go over evenly, each from a start to an end in its time, and then stay."""

    start: Float[Array, "k"]
    end: Float[Array, "k"]
    since: Float[Array, "k"]  # when they began [s]
    seconds: Float[Array, "k"]  # how long they take [s]

    def at(self, t: Float[Array, ""]) -> Float[Array, "k"]:
        """Their values at time t."""
        lasting = self.seconds > 0
        share = jnp.where(lasting, jnp.clip((t - self.since) / jnp.where(lasting, self.seconds, 1.0), 0.0, 1.0), 1.0)
        return self.start + share * (self.end - self.start)


class RampedRobot(System):
    """A robot whose numbers at some paths follow ramps. Forces feel the numbers of each moment.

    What a change of a number does by itself is not told: a mass or an inertia that changes takes its momentum along.
    """

    blueprint: Template
    numbers: Float[Array, "n"]
    varying: tuple[int, ...] = eqx.field(static=True)  # which of them follow the ramps
    ramps: Ramps
    flat: bool = eqx.field(static=True)  # it moves in a plane

    def robot(self, t: Float[Array, ""]) -> Robot:
        """The robot as it is at time t."""
        now = dict(zip(self.varying, self.ramps.at(t), strict=True))
        return instantiate(self.blueprint, [now.get(i, x) for i, x in enumerate(self.numbers)])

    def initial(self) -> State:
        """State to start from, with the numbers as they are then."""
        return self.robot(jnp.zeros(())).initial()

    def rates(self, t: Float[Array, ""], x: State, u: None = None) -> State:
        """Time derivative of the state."""
        robot = self.robot(t)
        return (in_plane(robot) if self.flat else robot).rates(t, x)


class Measures(NamedTuple):
    """Where a robot's body is, how it moves, and what it touches."""

    position: Float[Array, "*n 3"]  # of the body's first station, world frame [m]
    velocity: Float[Array, "*n 3"]  # of the same [m/s]
    pitch: Float[Array, "*n"]  # of the body's x axis over the horizon [rad]
    heading: Float[Array, "*n"]  # of the same axis seen from above, from the world's x towards y, -pi to pi [rad]
    tilt: Float[Array, "*n"]  # of the body's z axis from straight above [rad]
    feet: Float[Array, "*n"]  # how deep the foot that is deepest is in the floor [m]; -inf where there is none
    surface: Float[Array, "*n"]  # how high the highest station's edge is over the surface [m]; -inf without one
    low_wall: Float[Array, "*n"]  # how deep a hull is in the wall at the smaller x [m]; -inf where there is none
    high_wall: Float[Array, "*n"]  # and in that at the larger x


def measures(system: RampedRobot, t: Float[Array, ""], x: State) -> Measures:
    """What a mission looks at."""
    robot = system.robot(t)
    tree, water, none = robot.tree, robot.water, -jnp.inf * jnp.ones(())
    q, v, _ = tree.complete(t, x.q, x.v)
    shape = tree.shape(q)
    R, p = shape.rotation, shape.position
    place = place_of(R[0], p[0], tree.twists(shape, v)[0])
    feet, walls, top = [none], [jnp.stack([none, none])], none
    for attached, z in zip(robot.loads, x.z, strict=True):
        first, load = tree.layout[attached.part].stations.start, attached.load
        if isinstance(load, Leg) and water.floor is not None:
            ahead, above = load.foot(z.crank)[0]
            arm = load.hip + jnp.stack([ahead, jnp.zeros(()), above])
            feet.append(water.floor - p[first, 2] - R[first, 2] @ arm)
        if isinstance(load, WallContact) and water.walls is not None:
            walls.append(load.depths(p[first, 0], water))
    if water.surface is not None:
        half = jnp.concatenate([part.body.half_width for part in tree.parts])
        edge = jnp.sqrt(jnp.sum((half * R[:, 2, 1:]) ** 2, axis=1))
        top = jnp.max(p[:, 2] + edge) - water.surface
    low, high = jnp.max(jnp.stack(walls), axis=0)
    return Measures(
        position=p[0],
        velocity=jnp.stack([place[f"velocity.{axis}"] for axis in "xyz"]),
        **{name: place[name] for name in ("pitch", "heading", "tilt")},
        feet=jnp.max(jnp.stack(feet)),
        surface=top,
        low_wall=low,
        high_wall=high,
    )


def measured(system: RampedRobot, t: Float[Array, "n"], x: State) -> Measures:
    """The same at n moments."""
    return jax.vmap(lambda t, x: measures(system, t, x))(t, x)
