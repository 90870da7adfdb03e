"""A robot some of whose numbers follow ramps."""

from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core import Gaps, Mechanical, State
from nectosome.mechanism import Robot, from_rest, in_plane
from nectosome.model import Template, instantiate


class Ramps(NamedTuple):
    """Numbers that go over evenly, each from a start to an end in its time, and then stay."""

    start: Float[Array, "k"]
    end: Float[Array, "k"]
    since: Float[Array, "k"]  # when they began [s]
    seconds: Float[Array, "k"]  # how long they take [s]

    def at(self, t: Any, xp: Any = jnp) -> Float[Array, "k"] | Float[np.ndarray, "*n k"]:
        """Their values at time t, or at times [n, 1] with NumPy for `xp`."""
        lasting = self.seconds > 0
        share = xp.where(lasting, xp.clip((t - self.since) / xp.where(lasting, self.seconds, 1.0), 0.0, 1.0), 1.0)
        return self.start + share * (self.end - self.start)


class RampedRobot(Mechanical):
    """A robot whose numbers at some paths follow ramps; forces are those of the present numbers.

    The rates of the numbers are ignored: a mass or an inertia that changes takes its momentum along.
    """

    template: Template
    numbers: Float[Array, "n"]
    varying: tuple[int, ...] = eqx.field(static=True)  # which of them follow the ramps
    ramps: Ramps
    flat: bool = eqx.field(static=True)  # it moves in a plane

    def robot(self, t: Float[Array, ""]) -> Robot:
        """The robot as it is at time t."""
        now = dict(zip(self.varying, self.ramps.at(t), strict=True))
        return instantiate(self.template, [now.get(i, x) for i, x in enumerate(self.numbers)])

    @property
    def update_rates(self) -> Float[Array, "k"] | None:
        """Those of the robot, which no mode sets."""
        return self.robot(jnp.zeros(())).update_rates

    def next_jump(self, t: Float[Array, ""]) -> Float[Array, ""] | None:
        """That of the robot as it is at time t."""
        return self.robot(t).next_jump(t)

    def updated(self, t: Float[Array, ""], x: State) -> State:
        """Update the loops of the robot as it is at time t."""
        return self.robot(t).updated(t, x)

    def initial(self) -> State:
        """State to start from, with the numbers as they are then, from rest."""
        robot, t = self.robot(jnp.zeros(())), jnp.zeros(())
        return from_rest(robot, t, robot.initial()).state

    def equations(self, t: Float[Array, ""]) -> Mechanical:
        """Those of the robot as it is at time t."""
        robot = self.robot(t)
        return in_plane(robot) if self.flat else robot

    def rates(self, t: Float[Array, ""], x: State, u: Any = None) -> State:
        """Time derivative of the state."""
        return self.equations(t).rates(t, x, u)

    def residual(self, t: Float[Array, ""], x: State, a: Float[Array, "nv"], u: Any = None) -> Float[Array, "nv"]:
        """Unbalanced generalised force [N or N m]."""
        return self.equations(t).residual(t, x, a, u)

    def state_rates(self, t: Float[Array, ""], x: State, u: Any = None) -> Any:
        """Rates of the load states."""
        return self.equations(t).state_rates(t, x, u)

    def advance(self, q: Float[Array, "nq"], v: Float[Array, "nv"], step: Float[Array, ""]) -> Float[Array, "nq"]:
        """Advance the coordinates as the robot, by no number of it."""
        return self.robot(jnp.zeros(())).advance(q, v, step)

    def gaps(self, t: Float[Array, ""], x: State) -> Gaps | None:
        """Gaps of the robot as it is at time t."""
        return self.robot(t).gaps(t, x)
