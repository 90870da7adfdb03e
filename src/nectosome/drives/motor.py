r"""DC motors behind gears, and servos made of them, as their joint feels them.

With the back-EMF constant K and the resistance R of the winding, the current at a voltage U and a velocity v is
$i = (U - K v)/R$, and the motor gives $M = K i$. Friction $T_f$ and what the gear takes leave

$$ T = M - w\, T_f - s(v)\, (1 - \eta) |M| $$

with the state w of `DryFriction` that holds within 0.1 deg of the joint, and is the sign of the velocity where it
slips; and with $s(v) = v/\sqrt{v^2 + v_t^2}$, that sign, smooth over 1 % of the no-load speed (of a motor that is
described by its constants: of R/K times 1 A). So the gear passes on the share $\eta$ of what the motor gives, and a
load that drives it meets the share $1/(2 - \eta)$ of itself at the motor. Tooth friction would let $2 - 1/\eta$ through
and lock below 0.5: a worm holds here by $T_f$ alone. A data sheet has the rated voltage U, the stall torque $T_s$, the
no-load speed $v_0$, and the currents $i_s$ and $i_0$ of both, so that (the line from one to the other is that of the
sheet)

$$ R = \frac{U}{i_s}, \quad K = \frac{U - R i_0}{v_0}, \quad \eta = \frac{T_s}{K (i_s - i_0)}, \quad T_f = \eta K i_0 $$

A gear of ratio n behind that shaft multiplies K and $T_f$ by n, and the inertia of the rotor by n squared.

The loop of a servo is continuous, or sampled: at t = k/rate it reads coordinate, velocity and signal, computes the
share of the supply's voltage, and holds it until the next update (zero-order hold); the motor and its supply are
continuous all the same.
"""

from abc import abstractmethod
from dataclasses import replace
from typing import Any, NamedTuple, Self

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import Constant, Drive, DriveOutput, Signal, signal_of
from nectosome.core.described import is_zero, number
from nectosome.core.dry_friction import ANGLE_SLIP, DryFriction
from nectosome.description import drives as dd

_FRICTION_SPEED = 0.01  # of the no-load speed, over which the loss of the gear changes its sign
_SETS_IN = 0.01  # of the duty cycle, over which a motor gets its voltage beyond the dead band
SATURATION_WIDTH = 0.005  # of a limit, over which it sets in


def saturated(x: Float[Array, ""], most: Float[Array, ""] | float = 1.0) -> Float[Array, ""]:
    """x within plus and minus `most`, smooth over 0.5 % of it: at |x| = `most` it is 0.25 % less."""
    y = x / most
    return 0.5 * most * (jnp.sqrt((y + 1) ** 2 + SATURATION_WIDTH**2) - jnp.sqrt((y - 1) ** 2 + SATURATION_WIDTH**2))


class GearedMotor(eqx.Module):
    """A DC motor with all of its gears, along a joint's coordinate."""

    constant: Float[Array, ""]  # K [V s/rad, V s/m]
    resistance: Float[Array, ""]  # R [ohm]
    friction: DryFriction | None  # T_f
    efficiency: Float[Array, ""]  # eta [-]
    friction_speed: Float[Array, ""]  # v_t [rad/s, m/s]
    inertia: Float[Array, ""]  # [kg m2, kg]
    most: Float[Array, ""] | None  # current that the controller lets through [A]

    @classmethod
    def of(cls, d: dd.MotorDescription) -> "GearedMotor":
        """Of a description."""
        if d.rated_voltage is not None:
            U, v0, stall = (number(x) for x in (d.rated_voltage, d.no_load_speed, d.stall_torque))
            i0 = number(d.no_load_current)
            # without a stall current: of a motor whose gear passes on all torque
            most = stall * v0 / U + i0 if d.stall_current is None else number(d.stall_current)
            R = U / most
            K = (U - R * i0) / v0
            share = stall / (K * (most - i0))
            friction = share * K * i0
        else:
            K, R, friction = (number(x) for x in (d.torque_constant, d.resistance, d.friction))
            share = jnp.ones(())
            v0 = R / K  # its voltage is not known: of 1 A in the winding
        radius = number(1.0 if d.radius is None else d.radius)
        n = number(d.gear_ratio) / radius
        gear = number(d.efficiency)
        limits = [] if d.current_limit is None else [number(d.current_limit)]
        if isinstance(d, dd.ServoDrive) and d.torque_limit is not None:
            limits.append(number(d.torque_limit) / (K * n * share * gear))
        least = limits[0] if len(limits) == 1 else jnp.minimum(*limits) if limits else None
        slow = _FRICTION_SPEED * v0 / n
        smooth = is_zero(d.no_load_current) and is_zero(d.friction)
        dry = None if smooth else DryFriction(friction * n * gear, ANGLE_SLIP * radius)
        return cls(K * n, R, dry, share * gear, slow, number(d.inertia) * n**2, least)

    def initial(self) -> Any:
        """State of its dry friction, which bears nothing yet; () without any."""
        return () if self.friction is None else jnp.zeros(())

    def rate(self, w: Any, v: Float[Array, ""]) -> Any:
        """Rate of that state."""
        return () if self.friction is None else self.friction.rate(w, v)

    def torque_line(self, voltage: Float[Array, ""]) -> tuple[Float[Array, "2"], Float[Array, "2"]]:
        """Speeds and torques at rest, and without a load, at a constant voltage; no limit of the current is in it."""
        friction = 0.0 if self.friction is None else self.friction.limit
        no_load = voltage / self.constant - self.resistance * friction / (self.efficiency * self.constant**2)
        stall = self.efficiency * self.constant * voltage / self.resistance - friction
        zero = jnp.zeros(())
        return jnp.stack([zero, no_load]), jnp.stack([stall, zero])

    def at_voltage(self, reference: Array, voltage: Float[Array, ""], v: Float[Array, ""], w: Any) -> DriveOutput:
        """What it does at a voltage, a velocity and the state of its friction, but for what a loop has."""
        current = (voltage - self.constant * v) / self.resistance
        if self.most is not None:
            current = saturated(current, self.most)
        voltage = self.resistance * current + self.constant * v
        M = self.constant * current
        lost = v / jnp.sqrt(v**2 + self.friction_speed**2) * (1 - self.efficiency) * jnp.abs(M)
        if self.friction is not None:
            lost += self.friction.force(w, v)
        heat = self.resistance * current**2 + lost * v
        none = jnp.asarray(jnp.nan)
        return DriveOutput(reference, M - lost, current, voltage, voltage * current, heat, none, none)


class GearedDrive(Drive):
    """A geared motor and the signal that it follows: what all drives share."""

    motor: GearedMotor
    signal: Signal

    @property
    def inertia(self) -> Float[Array, ""]:
        """That of the motor."""
        return self.motor.inertia

    def initial(self) -> Any:
        """State of the motor's friction."""
        return self.motor.initial()

    def stored(self, z: Any) -> Float[Array, ""]:
        """By the motor's friction."""
        return jnp.zeros(()) if self.motor.friction is None else self.motor.friction.energy(z)

    def frozen(self) -> "Drive":
        """With the value of its signal at t = 0."""
        return eqx.tree_at(lambda d: d.signal, self, Constant(self.signal(jnp.zeros(()))[0]))


class VoltageMotor(GearedDrive):
    """A geared motor with a voltage that follows a signal, within that of its supply."""

    by_duty_cycle: bool = eqx.field(static=True)  # the signal is a duty cycle
    dead_band: Float[Array, ""] | None  # of the duty cycle; None: none
    described_by = dd.MotorDrive

    @classmethod
    def from_description(cls, described: dd.MotorDrive) -> "VoltageMotor":
        """Of a description."""
        signal = described.voltage if described.duty_cycle is None else described.duty_cycle
        assert signal is not None
        band = None if is_zero(described.dead_band) else number(described.dead_band)
        return cls(GearedMotor.of(described), signal_of(signal), described.duty_cycle is not None, band)

    def output(self, t: Array, x: Array, v: Array, supply: Array | None, z: Any) -> tuple[DriveOutput, Any]:
        """At the voltage of the signal."""
        voltage, _, _ = self.signal(t)
        if self.by_duty_cycle:
            assert supply is not None
            duty = jnp.clip(voltage, -1.0, 1.0)
            if self.dead_band is not None:
                beyond = jnp.clip((jnp.abs(duty) - self.dead_band) / _SETS_IN, 0.0, 1.0)
                duty = beyond**2 * (3 - 2 * beyond) * duty
            voltage = supply * duty
        elif supply is not None:
            voltage = saturated(voltage, supply)
        return self.motor.at_voltage(jnp.asarray(jnp.nan), voltage, v, z), self.motor.rate(z, v)


class LoopOutput(NamedTuple):
    """What the loop of a servo computes at one time."""

    demand: Float[Array, ""]  # share of the supply's voltage, before its limit
    rates: Any  # of the loop's own state
    reference: Float[Array, ""]  # as in `DriveOutput`
    speed_error: Float[Array, ""]


class ServoState(NamedTuple):
    """State of a servo."""

    loop: Any  # of its loop; () without one
    friction: Any  # of its motor's friction; () without one


class SampledState(NamedTuple):
    """State of a sampled loop between two updates."""

    demand: Float[Array, ""]  # of the last update
    own: Any  # state of the loop itself; () without one


class _Servo(GearedDrive):
    """A geared motor whose share of the supply's voltage a loop computes, at all times or at its updates."""

    update_rate: Float[Array, ""] | None  # [Hz]; None: continuous
    always: bool = eqx.field(static=True, kw_only=True, default=False)  # continuous, whatever the update rate

    @property
    def updates(self) -> Float[Array, ""] | None:
        """Its update rate [Hz]."""
        return None if self.always else self.update_rate

    @abstractmethod
    def begin(self) -> Any:
        """Initial state of the loop itself; () without one."""

    @abstractmethod
    def loop(self, t: Array, x: Array, v: Array, own: Any) -> LoopOutput:
        """Output of the loop at a coordinate x and a velocity v, with its own state."""

    def initial(self) -> Any:
        """At rest; no voltage before the first update of its loop."""
        loop = self.begin() if self.update_rate is None else SampledState(jnp.zeros(()), self.begin())
        return ServoState(loop, self.motor.initial())

    def stored(self, z: Any) -> Float[Array, ""]:
        """By its friction."""
        return super().stored(z.friction)

    def continuous(self) -> "Drive":
        """With a loop that is continuous; what is its demand of the last update follows the demand as fast."""
        return self if self.update_rate is None else replace(self, always=True)

    def updated(self, t: Array, x: Array, v: Array, z: Any) -> Any:
        """The demand at t, and the loop's own state further by its rate times the time between two updates."""
        if self.update_rate is None:
            return z
        own, rate = z.loop.own, self.update_rate
        loop = self.loop(t, x, v, own)
        sampled = SampledState(loop.demand, jax.tree.map(lambda a, b: a + b / rate, own, loop.rates))
        return ServoState(sampled, z.friction)

    def output(self, t: Array, x: Array, v: Array, supply: Array | None, z: Any) -> tuple[DriveOutput, Any]:
        """At the voltage that its loop gives, or gave at its last update."""
        sampled, before = self.update_rate is not None, z.loop
        loop = self.loop(t, x, v, before.own if sampled else before)
        demand, rates = loop.demand, loop.rates
        if sampled and self.always:
            rates = SampledState((demand - before.demand) * self.update_rate, rates)
        elif sampled:
            demand, rates = before.demand, jax.tree.map(jnp.zeros_like, before)
        assert supply is not None
        motor = self.motor.at_voltage(loop.reference, supply * saturated(demand), v, z.friction)
        rates = ServoState(rates, self.motor.rate(z.friction, v))
        return motor._replace(speed_error=loop.speed_error, demand=demand), rates


class PositionServo(_Servo):
    r"""A geared motor with a position loop: the share $(d(e) + T_d\,\dot e)/e_f$ of the supply's voltage.

    e is what the coordinate lacks of the signal, $e_f$ the error at which the motor gets all of the voltage, $T_d$ the
    derivative time, and d(e) the error without its dead band.
    """

    full: Float[Array, ""]  # e_f [rad, m]
    derivative: Float[Array, ""]  # T_d [s]
    dead_band: Float[Array, ""] | None  # [rad, m]
    described_by = dd.ServoDrive

    @classmethod
    def from_description(cls, described: dd.AngularServo | dd.LinearServo, motion: Signal) -> "Drive":
        """Of a description, and the motion that it follows; with a velocity loop a `VelocityServo`."""
        rate = None if described.update_rate is None else number(described.update_rate)
        if described.velocity_loop is not None:
            return VelocityServo.of(described.velocity_loop, GearedMotor.of(described), motion, rate)
        band = None if is_zero(described.dead_band) else number(described.dead_band)
        numbers = number(described.full_voltage_at), number(described.derivative)
        return cls(GearedMotor.of(described), motion, rate, *numbers, band)

    def begin(self) -> Any:
        """None."""
        return ()

    def loop(self, t: Array, x: Array, v: Array, own: Any) -> LoopOutput:
        """Of the error and its rate."""
        reference, rate, _ = self.signal(t)
        error = reference - x
        if self.dead_band is not None:
            error = error - saturated(error, self.dead_band)
        demand = (error + self.derivative * (rate - v)) / self.full
        return LoopOutput(demand, own, reference, jnp.asarray(jnp.nan))


class VelocityServo(_Servo):
    r"""A geared motor with a velocity loop (PI): the share $u = g (e + z/T_i)/e_f$ of the supply's voltage.

    e is what the velocity lacks of the signal's rate; $\dot z = e - (u - u_{lim}) e_f$, its integral, which stops where
    u is limited to between -1 and 1; $e_f$ the error at which the motor gets all of the voltage, and g a factor
    scheduled over the size of the velocity. A sampled loop sums up instead: $z \leftarrow z + \dot z/\mathrm{rate}$
    after each update.
    """

    full: Float[Array, ""]  # e_f [rad/s, m/s]
    integral_time: Float[Array, ""] | None  # T_i [s]
    speeds: Float[Array, "n"]  # of the schedule [rad/s, m/s]
    factors: Float[Array, "n"]

    @classmethod
    def of(
        cls,
        loop: dd.AngularVelocityLoop | dd.LinearVelocityLoop,
        motor: GearedMotor,
        motion: Signal,
        update_rate: Float[Array, ""] | None,
    ) -> Self:
        """Of a description of its loop."""
        time = None if loop.integral_time is None else number(loop.integral_time)
        table = [[number(getattr(gain, name)) for gain in loop.schedule] for name in ("at", "factor")]
        rows = [jnp.stack(row) if row else jnp.zeros(0) for row in table]
        return cls(motor, motion, update_rate, number(loop.full_voltage_at), time, *rows)

    def begin(self) -> Any:
        """No integral."""
        return () if self.integral_time is None else jnp.zeros(())

    def loop(self, t: Array, x: Array, v: Array, own: Any) -> LoopOutput:
        """Of the error of the velocity and its integral, the loop's own state."""
        _, rate, _ = self.signal(t)
        error = rate - v
        demand = error if self.integral_time is None else error + own / self.integral_time
        if self.factors.size:
            demand = demand * jnp.interp(jnp.abs(v), self.speeds, self.factors)
        demand = demand / self.full
        beyond = demand - jnp.clip(demand, -1.0, 1.0)
        rates = () if self.integral_time is None else error - beyond * self.full
        return LoopOutput(demand, rates, jnp.asarray(jnp.nan), error)
