"""What a motion, or a robot at rest in the water, is judged by: speed, torque, draught …, each differentiable."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from operator import attrgetter
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core import STANDARD_GRAVITY, DriveOutput, RodLoad
from nectosome.core.se3 import dot
from nectosome.loads import FluidChamber, Tendon
from nectosome.mechanism import Robot, bending_of
from nectosome.solve import CycleMeans, Equilibrium, water_velocity
from nectosome.solve.floating import Floating, float_freely, smaller_arm
from nectosome.solve.transport import battery_endurance, least_known
from nectosome.units import DIMENSIONS, InputError, did_you_mean, shorten
from nectosome.units.expression import Expression, Formula, FunctionFormula

_HEEL = float(np.radians(30.0))  # of the righting moment


@dataclass(frozen=True)
class AtRest:
    """A robot, and how it lies in the water with its joints as at the start."""

    robot: Robot

    @cached_property
    def lies(self) -> Floating:
        """How it floats, or hangs under water; worked out where it is asked for, and once."""
        return float_freely(self.robot)


class RestQuantity(NamedTuple):
    """Dimension, which is better, what it is, and how it follows."""

    dimension: str
    best: str
    about: str
    of: Callable[[AtRest], Float[Array, ""]]


def _righting_moment(s: AtRest) -> Float[Array, ""]:
    """To the side where it is smaller; its derivatives jump where both are the same."""
    return s.lies.weight * smaller_arm(s.robot, s.lies, _HEEL)


AT_REST = {
    "net_weight": RestQuantity("force", "low", "weight less the buoyancy of all of it", lambda s: s.lies.net_weight),
    "draught": RestQuantity("length", "low", "depth of the lowest point of what floats", lambda s: s.lies.draught),
    "trim": RestQuantity("angle", "low", "angle of the bow upwards, at rest in the water", lambda s: s.lies.trim),
    "heel": RestQuantity("angle", "low", "angle to starboard, at rest in the water", lambda s: s.lies.heel),
    "metacentric_height": RestQuantity(
        "length",
        "high",
        "moment that turns it back from a small heel, over weight and angle",
        lambda s: s.lies.metacentric_heights[0],
    ),
    "righting_moment": RestQuantity(
        "torque",
        "high",
        "moment that turns it back from a heel of 30 deg, to starboard or to port, whichever is smaller",
        _righting_moment,
    ),
}
"""Quantities of how a robot floats or hangs at rest, weight and buoyancy alone."""


@dataclass(frozen=True)
class SteadySwim(AtRest):
    """A steady motion and what it is judged against; forward is a unit vector of the world."""

    steady: Equilibrium
    forward: tuple[float, float, float]
    carried: Float[Array, "3"]  # velocity of the frame in which it is seen, as that of a current [m/s]

    @cached_property
    def whole(self) -> tuple[Array, Array]:
        """All coordinates and all velocities, prescribed ones too."""
        q, v, _ = self.robot.tree.complete(jnp.zeros(()), self.steady.state.q, self.steady.state.v)
        return q, v

    @cached_property
    def velocities(self) -> tuple[Array, Array, Array]:
        """Velocities of the body's first station in the world, through the water and over ground [m/s]; its axis."""
        tree, (q, v) = self.robot.tree, self.whole
        shape = tree.shape(q)
        velocity = dot(shape.rotation[0], tree.twists(shape, v)[0, 3:])
        flow = water_velocity(self.robot, jnp.zeros(1), shape.position[:1])[0]
        return velocity - flow, velocity + self.carried, dot(shape.rotation[0], jnp.asarray(self.robot.ahead))

    @cached_property
    def powered(self) -> tuple[DriveOutput, Array, Array, Array]:
        """What motors do, how fast they turn, and voltages and powers of all batteries."""
        robot, (q, v) = self.robot, self.whole
        found, _, voltage = robot.motors(jnp.zeros(()), q, v, self.steady.state.z)
        rates, powers = v[robot.powered.places(robot.tree, "v")], robot.powered.battery_powers(found.electrical)
        return found, rates, voltage, powers

    @cached_property
    def drives(self) -> tuple[Array, Array]:
        """Torques and rates of all drives, those with motors behind those of a given motion."""
        motors, rates, *_ = self.powered
        torque = jnp.concatenate([self.steady.reaction, motors.torque])
        return torque, jnp.concatenate([self.whole[1][self.robot.tree.prescribed_v], rates])


@dataclass(frozen=True)
class PeriodicSwim(AtRest):
    """A periodic motion and what it is judged against; forward is a unit vector of the world."""

    means: CycleMeans
    forward: Float[Array, "3"]
    times: Float[Array, "n"]  # of the cycle [s]


def _of_cycles_only(_: SteadySwim) -> Array:
    return jnp.full((), jnp.nan)


@dataclass(frozen=True)
class MotionQuantity:
    """A number of a motion, or of the robot at rest; `best` is "high" or "low".

    Of a cycle it is the mean of its name, unless `cyclic` gives it.
    """

    name: str
    dimension: str  # a key of `DIMENSIONS`
    best: str
    about: str
    of_steady: Callable[[SteadySwim], Float[Array, ""]] = _of_cycles_only
    cyclic: Callable[[PeriodicSwim], Float[Array, ""]] | None = None

    @property
    def of_cycle(self) -> Callable[[PeriodicSwim], Float[Array, ""]]:
        """How it follows from a cycle."""
        return self.cyclic or attrgetter(f"means.{self.name}")

    @property
    def unit(self) -> str:
        """SI unit, "1" of a number."""
        return DIMENSIONS[self.dimension].unit or "1"


def _speed(s: SteadySwim) -> Array:
    return jnp.sum(s.velocities[0] * jnp.asarray(s.forward))


def _speed_over_ground(s: SteadySwim) -> Array:
    return jnp.sum(s.velocities[1] * jnp.asarray(s.forward))


def _forward_speed(s: SteadySwim) -> Array:
    through, _, ahead = s.velocities
    return jnp.sum(through * ahead)


def _torque(s: SteadySwim) -> Array:
    """What the drives give, in the sense in which they turn; of several the largest."""
    given, turning = s.drives
    return _largest(given * jnp.where(turning < 0, -1.0, 1.0))


def _power(s: SteadySwim) -> Array:
    torque, rate = s.drives
    return jnp.sum(torque * rate)


def _positive(s: SteadySwim) -> Array:
    torque, rate = s.drives
    return jnp.sum(jnp.maximum(torque * rate, 0.0))


def _thrust(s: SteadySwim) -> Array:
    """Forward force that the rest of the robot gives to its body: minus the loads on the body."""
    robot, x = s.robot, s.steady.state
    acting = robot.forces(jnp.zeros(()), x, jnp.zeros_like(x.v))
    here = robot.tree.layout[0].stations
    own = robot.on_stations(acting.wrenches)[here, 3:]
    force = jnp.sum(dot(acting.shape.rotation[here], own), axis=0)
    return -jnp.sum(force * jnp.asarray(s.forward))


def _known(drawn: Array) -> Array:
    return jnp.sum(drawn if drawn.size else jnp.full(1, jnp.nan))


def _endurance(s: SteadySwim) -> Array:
    *_, voltage, power = s.powered
    return least_known(battery_endurance(*s.robot.powered.stored, voltage[None], power[None], jnp.ones(1)))


def _stress(s: SteadySwim) -> Array:
    bent = bending_of(s.robot, s.whole[0])
    return _largest_known(bent.hinge_stress, bent.stress)


def _tension(s: SteadySwim) -> Array:
    in_rods = _largest_signal(s.robot, jnp.zeros(1), Tendon, "tension")
    return jnp.maximum(in_rods, _largest(s.robot.tendons(*s.whole, s.steady.state.z).tension))


def _pressure(s: SteadySwim) -> Array:
    return _largest_signal(s.robot, jnp.zeros(1), FluidChamber, "pressure")


def _mean_speed(s: PeriodicSwim) -> Array:
    return jnp.sum((s.means.velocity[0] - s.means.water_velocity) * s.forward)


def _torque_peak(s: PeriodicSwim) -> Array:
    """Of the drives that move: what holds a robot is no drive."""
    moving = jnp.where(s.means.drive_velocity_peak > 0, s.means.reaction_peak, 0.0)
    return _largest(jnp.concatenate([moving, s.means.motor_torque_peak]))


def _mean_thrust(s: PeriodicSwim) -> Array:
    """Momentum comes back after a cycle, so that the body feels on the mean what the loads do to all other parts."""
    return jnp.sum(s.means.load_force[:, 1:], axis=(0, 1)) @ s.forward


def _drive_rate_peak(s: PeriodicSwim) -> Array:
    return _largest(jnp.concatenate([s.means.drive_velocity_peak, s.means.motor_rate_peak]))


def _stress_peak(s: PeriodicSwim) -> Array:
    return _largest_known(s.means.hinge_stress_peak, s.means.bending_stress_peak)


def _tension_peak(s: PeriodicSwim) -> Array:
    return jnp.maximum(_largest_signal(s.robot, s.times, Tendon, "tension"), _largest(s.means.tension_peak))


def _pressure_peak(s: PeriodicSwim) -> Array:
    return _largest_signal(s.robot, s.times, FluidChamber, "pressure")


def _largest(x: Array) -> Array:
    """Largest of what may be nothing: a robot without drives has no torque and no rate."""
    return jnp.max(x) if x.size else jnp.zeros(())


def _largest_known(*values: Array) -> Array:
    """Largest magnitude; NaN counts as nothing: there a robot does not bend, or a motor has no loop."""
    x = jnp.concatenate([x.reshape(-1) for x in values])
    return _largest(jnp.abs(jnp.where(jnp.isnan(x), 0.0, x)))


def _largest_signal(robot: Robot, times: Float[Array, "n"], kind: type[RodLoad], name: str) -> Array:
    """Largest magnitude, at some times, of a signal of all loads of a kind; 0 where the robot has none."""
    groups = [g for g in robot.load_groups.in_rods if isinstance(g.load, kind)]
    values = [jax.vmap(lambda t, g=g: g.map(lambda load: getattr(load, name)(t)[0]))(times) for g in groups]
    return _largest(jnp.abs(jnp.concatenate([jnp.zeros(0), *(x.ravel() for x in values)])))


def _cost_of_transport(about: str, power: Callable[[SteadySwim], Array], kind: str = "") -> MotionQuantity:
    """Cost of transport of a power; of what motors or batteries give NaN where there are none."""

    def cost(s: SteadySwim) -> Array:
        return power(s) / (jnp.sum(s.robot.weight()) * STANDARD_GRAVITY * _speed(s))

    return MotionQuantity(f"cost_of_transport{kind}", "number", "low", f"{about} over weight in air times speed", cost)


_DEMAND = "share of its supply's voltage that a servo asks for; above 1 it cannot follow its motion"
_AHEAD = "speed through the water along the robot's own forward axis; negative where it swims tail first"
_INSIDE = "largest pressure in a chamber, over that outside, after its hysteresis"
_Q = MotionQuantity
_ALL = (
    _Q("speed", "speed", "high", "speed of the body along forward, through the water", _speed, _mean_speed),
    _Q(
        "speed_over_ground",
        "speed",
        "high",
        "the same over ground, in a current",
        _speed_over_ground,
        lambda s: jnp.sum(s.means.velocity[0] * s.forward),
    ),
    _Q("forward_speed", "speed", "high", _AHEAD, _forward_speed),
    _Q("torque", "torque", "low", "largest torque (or force) of a drive", _torque, _torque_peak),
    _Q("power", "power", "low", "power of all drives", _power),
    _Q("thrust", "force", "high", "forward force on the body by the rest", _thrust, _mean_thrust),
    _Q(
        "efficiency",
        "number",
        "high",
        "what it costs to tow the body, over power",
        lambda s: _thrust(s) * _speed(s) / _power(s),
    ),
    _cost_of_transport("power", _power),
    _cost_of_transport("power of all drives that cannot take power back,", _positive, "_positive"),
    _cost_of_transport("power that motors take,", lambda s: _known(s.powered[0].electrical), "_electrical"),
    _cost_of_transport("power that batteries give,", lambda s: _known(s.powered[-1]), "_battery"),
    _Q(
        "energy_per_metre",
        "energy_per_length",
        "low",
        "energy that all drives give for each metre",
        lambda s: _power(s) / _speed(s),
    ),
    _Q("endurance", "time", "high", "time until the first battery is empty", _endurance),
    _Q(
        "body_lengths_per_second",
        "number",
        "high",
        "forward speed over the body's length",
        lambda s: _forward_speed(s) / s.robot.body_length,
    ),
    _Q(
        "frequency",
        "frequency",
        "high",
        "cycles per second, such as the pulses of a jet",
        cyclic=lambda s: 1 / s.times[-1],
    ),
    _Q("stride_length", "number", "high", "body lengths that a cycle brings forward"),
    _Q("tail_amplitude", "length", "low", "half the distance of the rearmost end from side to side"),
    _Q("strouhal", "number", "low", "twice the tail amplitude over period and speed"),
    _Q("slip", "number", "high", "forward speed over that of the wave of bending along the robot"),
    _Q("froude_efficiency", "number", "high", "mean thrust times forward speed, over power"),
    _Q("range", "length", "high", "distance until then", lambda s: _endurance(s) * _speed(s)),
    _Q(
        "drive_rate",
        "angular_speed",
        "low",
        "largest rate of a drive",
        lambda s: _largest(jnp.abs(s.drives[1])),
        _drive_rate_peak,
    ),
    _Q("stress", "pressure", "low", "largest stress in a part or hinge that bends", _stress, _stress_peak),
    _Q(
        "current",
        "current",
        "low",
        "largest current of a motor",
        lambda s: _largest(jnp.abs(s.powered[0].current)),
        lambda s: _largest(s.means.current_peak),
    ),
    _Q(
        "electrical_power",
        "power",
        "low",
        "power that motors take from their supplies",
        lambda s: jnp.sum(s.powered[0].electrical),
        lambda s: jnp.sum(s.means.electrical_power),
    ),
    _Q(
        "battery_power",
        "power",
        "low",
        "power that batteries give, to the electronics too",
        lambda s: jnp.sum(s.powered[-1]),
        lambda s: jnp.sum(s.means.battery_power),
    ),
    _Q(
        "voltage_demand",
        "number",
        "low",
        _DEMAND,
        lambda s: _largest_known(s.powered[0].demand),
        lambda s: _largest_known(s.means.voltage_demand_peak),
    ),
    _Q("tension", "force", "low", "largest tension of a tendon", _tension, _tension_peak),
    _Q("pressure", "pressure", "low", _INSIDE, _pressure, _pressure_peak),
    *(_Q(name, q.dimension, q.best, q.about, q.of, q.of) for name, q in AT_REST.items()),
)
QUANTITIES = {quantity.name: quantity for quantity in _ALL}


Objective = str | Callable[[Mapping[str, Any]], Any]  # a quantity, an expression of some, or a function of a mapping


def formula_of(objective: Objective, field: str) -> Formula:
    """Formula of an objective. Raises InputError, which names the field, for what is none of `QUANTITIES`."""
    text = isinstance(objective, str)
    formula = Expression(objective, field) if text else FunctionFormula(objective, QUANTITIES, field)
    for name in formula.names:
        check_quantity(name, field)
    if not formula.names:
        raise InputError(f'"{shorten(formula.text)}" depends on no quantity of the motion.', field=field)
    return formula


def check_quantity(name: str, field: str | None = None) -> None:
    """Raise InputError, which names the field, for what is none of `QUANTITIES`."""
    if name not in QUANTITIES:
        near = did_you_mean(name, QUANTITIES)
        words = f'"{shorten(name)}" is no quantity of a motion.{near} There are {", ".join(QUANTITIES)}.'
        raise InputError(words, field=field)
