"""What a steady or periodic motion is judged by: speed, torque, power and what follows, each differentiable."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from operator import attrgetter
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import STANDARD_GRAVITY, DriveOutput, RodLoad
from nectosome.core.se3 import dot
from nectosome.loads import FluidChamber, Tendon
from nectosome.mechanism import Robot, bending_of
from nectosome.solve import CycleMeans, Equilibrium, water_velocity
from nectosome.solve.transport import battery_endurance, least_known
from nectosome.units import DIMENSIONS, InputError, did_you_mean, shorten
from nectosome.units.expression import Expression, Formula, FunctionFormula

from .at_rest import AT_REST, AtRest


@dataclass(frozen=True)
class SteadySwim(AtRest):
    """A steady motion and what it is judged against; forward is a unit vector of the world."""

    robot: Robot
    steady: Equilibrium
    forward: tuple[float, float, float]
    carried: Float[Array, "3"]  # velocity of the frame in which it is seen, as that of a current [m/s]


@dataclass(frozen=True)
class PeriodicSwim(AtRest):
    """A periodic motion and what it is judged against; forward is a unit vector of the world."""

    means: CycleMeans
    forward: Float[Array, "3"]
    robot: Robot
    times: Float[Array, "n"]  # of the cycle [s]


@dataclass(frozen=True)
class Resting(AtRest):
    """A robot that is not asked to move."""

    robot: Robot


@dataclass(frozen=True)
class MotionQuantity:
    """A number of a motion, or of the robot at rest; `best` is "high" or "low"."""

    name: str
    dimension: str  # a key of `DIMENSIONS`
    best: str
    about: str
    of_steady: Callable[[SteadySwim], Float[Array, ""]]
    of_cycle: Callable[[PeriodicSwim], Float[Array, ""]]

    @property
    def unit(self) -> str:
        """SI unit, "1" of a number."""
        return DIMENSIONS[self.dimension].unit or "1"


def _velocities(s: SteadySwim) -> tuple[Array, Array, Array]:
    """Velocities of the body's first station in the world, through the water and over ground [m/s]; its direction."""
    tree, x, zero = s.robot.tree, s.steady.state, jnp.zeros(())
    q, v, _ = tree.complete(zero, x.q, x.v)
    shape = tree.shape(q)
    velocity = dot(shape.rotation[0], tree.twists(shape, v)[0, 3:])
    flow = water_velocity(s.robot, zero[None], shape.position[:1])[0]
    return velocity - flow, velocity + s.carried, dot(shape.rotation[0], jnp.asarray(s.robot.ahead))


def _speed(s: SteadySwim) -> Array:
    return jnp.sum(_velocities(s)[0] * jnp.asarray(s.forward))


def _speed_over_ground(s: SteadySwim) -> Array:
    return jnp.sum(_velocities(s)[1] * jnp.asarray(s.forward))


def _forward_speed(s: SteadySwim) -> Array:
    through, _, ahead = _velocities(s)
    return jnp.sum(through * ahead)


def _body_lengths(s: SteadySwim) -> Array:
    return _forward_speed(s) / s.robot.body_length


def _rates(s: SteadySwim) -> Array:
    tree, x = s.robot.tree, s.steady.state
    _, v, _ = tree.complete(jnp.zeros(()), x.q, x.v)
    return v[tree.prescribed_v]


def _motors(s: SteadySwim) -> tuple[DriveOutput, Array, Array]:
    """What motors do, how fast they turn, and the powers of all batteries."""
    robot, x = s.robot, s.steady.state
    q, v, _ = robot.tree.complete(jnp.zeros(()), x.q, x.v)
    found, *_ = robot.motors(jnp.zeros(()), q, v, x.z)
    return found, v[robot.powered.places(robot.tree, "v")], robot.powered.battery_powers(found.electrical)


def _torque(s: SteadySwim) -> Array:
    """What the drives give, in the sense in which they turn; of several the largest."""
    motors, rates, _ = _motors(s)
    given, turning = (jnp.concatenate(x) for x in ((s.steady.reaction, motors.torque), (_rates(s), rates)))
    return _largest(given * jnp.where(turning < 0, -1.0, 1.0))


def _power(s: SteadySwim) -> Array:
    motors, rates, _ = _motors(s)
    return jnp.sum(s.steady.reaction * _rates(s)) + jnp.sum(motors.torque * rates)


def _thrust(s: SteadySwim) -> Array:
    """Forward force that the rest of the robot gives to its body: minus the loads on the body."""
    robot, x = s.robot, s.steady.state
    acting = robot.forces(jnp.zeros(()), x, jnp.zeros_like(x.v))
    here = robot.tree.layout[0].stations
    own = robot.on_stations(acting.wrenches)[here, 3:]
    force = jnp.sum(dot(acting.shape.rotation[here], own), axis=0)
    return -jnp.sum(force * jnp.asarray(s.forward))


def _efficiency(s: SteadySwim) -> Array:
    return _thrust(s) * _speed(s) / _power(s)


def _positive(s: SteadySwim) -> Array:
    motors, rates, _ = _motors(s)
    each = jnp.concatenate([s.steady.reaction * _rates(s), motors.torque * rates])
    return jnp.sum(jnp.maximum(each, 0.0))


def _per_metre(s: SteadySwim) -> Array:
    return _power(s) / _speed(s)


def _cost_of(power: Callable[[SteadySwim], Array]) -> Callable[[SteadySwim], Array]:
    """Cost of transport of a power; of what motors or batteries give NaN where there are none."""
    return lambda s: power(s) / (jnp.sum(s.robot.weight()) * STANDARD_GRAVITY * _speed(s))


def _known(drawn: Array) -> Array:
    return drawn if drawn.size else jnp.full(1, jnp.nan)


def _endurance(s: SteadySwim) -> Array:
    robot, x = s.robot, s.steady.state
    q, v, _ = robot.tree.complete(jnp.zeros(()), x.q, x.v)
    found, _, voltage = robot.motors(jnp.zeros(()), q, v, x.z)
    power = robot.powered.battery_powers(found.electrical)
    return least_known(battery_endurance(*robot.powered.stored, voltage[None], power[None], jnp.ones(1)))


def _range(s: SteadySwim) -> Array:
    return _endurance(s) * _speed(s)


def _drive_rate(s: SteadySwim) -> Array:
    return _largest(jnp.abs(jnp.concatenate([_rates(s), _motors(s)[1]])))


def _stress(s: SteadySwim) -> Array:
    q, *_ = s.robot.tree.complete(jnp.zeros(()), s.steady.state.q, s.steady.state.v)
    bent = bending_of(s.robot, q)
    return _largest_known(bent.hinge_stress, bent.stress)


def _current(s: SteadySwim) -> Array:
    return _largest(jnp.abs(_motors(s)[0].current))


def _electrical(s: SteadySwim) -> Array:
    return jnp.sum(_motors(s)[0].electrical)


def _battery(s: SteadySwim) -> Array:
    return jnp.sum(_motors(s)[2])


def _current_peak(s: PeriodicSwim) -> Array:
    return _largest(s.means.current_peak)


def _mean_electrical(s: PeriodicSwim) -> Array:
    return jnp.sum(s.means.electrical_power)


def _mean_battery(s: PeriodicSwim) -> Array:
    return jnp.sum(s.means.battery_power)


def _demand(s: SteadySwim) -> Array:
    return _largest_known(_motors(s)[0].demand)


def _demand_peak(s: PeriodicSwim) -> Array:
    return _largest_known(s.means.voltage_demand_peak)


def _mean_speed(s: PeriodicSwim) -> Array:
    return jnp.sum((s.means.velocity[0] - s.means.water_velocity) * s.forward)


def _mean_speed_over_ground(s: PeriodicSwim) -> Array:
    return jnp.sum(s.means.velocity[0] * s.forward)


def _torque_peak(s: PeriodicSwim) -> Array:
    """Of the drives that move: what holds a robot is no drive."""
    moving = jnp.where(s.means.drive_velocity_peak > 0, s.means.reaction_peak, 0.0)
    return _largest(jnp.concatenate([moving, s.means.motor_torque_peak]))


def _mean_thrust(s: PeriodicSwim) -> Array:
    """Momentum comes back after a cycle, so that the body feels on the mean what the loads do to all other parts."""
    return jnp.sum(s.means.load_force[:, 1:], axis=(0, 1)) @ s.forward


def _largest(x: Array) -> Array:
    """Largest of what may be nothing: a robot without drives has no torque and no rate."""
    return jnp.max(x) if x.size else jnp.zeros(())


def _largest_known(*values: Array) -> Array:
    """Largest magnitude; NaN counts as nothing: there a robot does not bend, or a motor has no loop."""
    x = jnp.concatenate([x.reshape(-1) for x in values])
    return _largest(jnp.abs(jnp.where(jnp.isnan(x), 0.0, x)))


def _drive_rate_peak(s: PeriodicSwim) -> Array:
    return _largest(jnp.concatenate([s.means.drive_velocity_peak, s.means.motor_rate_peak]))


def _stress_peak(s: PeriodicSwim) -> Array:
    return _largest_known(s.means.hinge_stress_peak, s.means.bending_stress_peak)


def _largest_signal(robot: Robot, times: Float[Array, "n"], kind: type[RodLoad], name: str) -> Array:
    """Largest magnitude, at some times, of a signal of all loads of a kind; 0 where the robot has none."""
    groups = [g for g in robot.load_groups.in_rods if isinstance(g.load, kind)]
    values = [jax.vmap(lambda t, g=g: g.map(lambda load: getattr(load, name)(t)[0]))(times) for g in groups]
    return _largest(jnp.abs(jnp.concatenate([jnp.zeros(0), *(x.ravel() for x in values)])))


def _tension(s: SteadySwim) -> Array:
    x = s.steady.state
    q, v, _ = s.robot.tree.complete(jnp.zeros(()), x.q, x.v)
    in_rods = _largest_signal(s.robot, jnp.zeros(1), Tendon, "tension")
    return jnp.maximum(in_rods, _largest(s.robot.tendons(q, v, x.z).tension))


def _tension_peak(s: PeriodicSwim) -> Array:
    return jnp.maximum(_largest_signal(s.robot, s.times, Tendon, "tension"), _largest(s.means.tension_peak))


def _pressure(s: SteadySwim) -> Array:
    return _largest_signal(s.robot, jnp.zeros(1), FluidChamber, "pressure")


def _pressure_peak(s: PeriodicSwim) -> Array:
    return _largest_signal(s.robot, s.times, FluidChamber, "pressure")


_mean_forward_speed, _mean_power, _mean_efficiency, _mean_cost = (
    attrgetter(f"means.{name}") for name in ("forward_speed", "power", "efficiency", "cost_of_transport")
)


def _cost(name: str, about: str, of_steady: Callable[[SteadySwim], Array]) -> MotionQuantity:
    """Cost of transport of a power, by the name of its mean."""
    name = f"cost_of_transport_{name}"
    about = f"{about}, over weight in air times speed"
    return MotionQuantity(name, "number", "low", about, _cost_of(of_steady), attrgetter(f"means.{name}"))


def _of_a_beat(name: str, dimension: str, best: str, about: str) -> MotionQuantity:
    """Of a cycle only, by the name of its mean: NaN of a steady motion."""
    return MotionQuantity(name, dimension, best, about, lambda s: jnp.full((), jnp.nan), attrgetter(f"means.{name}"))


QUANTITIES = {
    quantity.name: quantity
    for quantity in (
        MotionQuantity(
            "speed", "speed", "high", "speed of the body along forward, through the water", _speed, _mean_speed
        ),
        MotionQuantity(
            "speed_over_ground",
            "speed",
            "high",
            "the same over ground, in a current",
            _speed_over_ground,
            _mean_speed_over_ground,
        ),
        MotionQuantity(
            "forward_speed",
            "speed",
            "high",
            "speed through the water along the robot's own forward axis; negative where it swims tail first",
            _forward_speed,
            _mean_forward_speed,
        ),
        MotionQuantity("torque", "torque", "low", "largest torque (or force) of a drive", _torque, _torque_peak),
        MotionQuantity("power", "power", "low", "power of all drives", _power, _mean_power),
        MotionQuantity("thrust", "force", "high", "forward force on the body by the rest", _thrust, _mean_thrust),
        MotionQuantity(
            "efficiency",
            "number",
            "high",
            "what it costs to tow the body, over power",
            _efficiency,
            _mean_efficiency,
        ),
        MotionQuantity(
            "cost_of_transport",
            "number",
            "low",
            "power over weight in air times speed",
            _cost_of(_power),
            _mean_cost,
        ),
        _cost("positive", "power of all drives that cannot take power back", _positive),
        _cost("electrical", "power that motors take", lambda s: jnp.sum(_known(_motors(s)[0].electrical))),
        _cost("battery", "power that batteries give", lambda s: jnp.sum(_known(_motors(s)[2]))),
        MotionQuantity(
            "energy_per_metre",
            "energy_per_length",
            "low",
            "energy that all drives give for each metre",
            _per_metre,
            attrgetter("means.energy_per_metre"),
        ),
        MotionQuantity(
            "endurance",
            "time",
            "high",
            "time until the first battery is empty",
            _endurance,
            attrgetter("means.endurance"),
        ),
        MotionQuantity(
            "body_lengths_per_second",
            "number",
            "high",
            "forward speed over the body's length",
            _body_lengths,
            attrgetter("means.body_lengths_per_second"),
        ),
        MotionQuantity(
            "frequency",
            "frequency",
            "high",
            "cycles per second, such as the pulses of a jet",
            lambda s: jnp.full((), jnp.nan),
            lambda s: 1 / s.times[-1],
        ),
        _of_a_beat("stride_length", "number", "high", "body lengths that a cycle brings forward"),
        _of_a_beat("tail_amplitude", "length", "low", "half the way of the rearmost end from side to side"),
        _of_a_beat("strouhal", "number", "low", "twice the tail amplitude over period and speed"),
        _of_a_beat("slip", "number", "high", "forward speed over that of the wave of bending along the robot"),
        _of_a_beat("froude_efficiency", "number", "high", "mean thrust times forward speed, over power"),
        MotionQuantity("range", "length", "high", "way until then", _range, attrgetter("means.range")),
        MotionQuantity("drive_rate", "angular_speed", "low", "largest rate of a drive", _drive_rate, _drive_rate_peak),
        MotionQuantity(
            "stress", "pressure", "low", "largest stress in a part or hinge that bends", _stress, _stress_peak
        ),
        MotionQuantity("current", "current", "low", "largest current of a motor", _current, _current_peak),
        MotionQuantity(
            "electrical_power",
            "power",
            "low",
            "power that motors take from their supplies",
            _electrical,
            _mean_electrical,
        ),
        MotionQuantity(
            "battery_power",
            "power",
            "low",
            "power that batteries give, to the electronics too",
            _battery,
            _mean_battery,
        ),
        MotionQuantity(
            "voltage_demand",
            "number",
            "low",
            "share of its supply's voltage that a servo asks for; above 1 it cannot follow its motion",
            _demand,
            _demand_peak,
        ),
        MotionQuantity("tension", "force", "low", "largest tension of a tendon", _tension, _tension_peak),
        MotionQuantity(
            "pressure",
            "pressure",
            "low",
            "largest pressure in a chamber, over that outside, after its hysteresis",
            _pressure,
            _pressure_peak,
        ),
        *(MotionQuantity(name, q.dimension, q.best, q.about, q.of, q.of) for name, q in AT_REST.items()),
    )
}


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
