"""What every drive with a motor promises, held against every one there is; a new one without an example here fails."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.flatten_util import ravel_pytree

from nectosome.core import Constant, Drive, Sine
from nectosome.core.described import number
from nectosome.description.drives import AngularServo, LinearServo, MotorDrive, servos
from nectosome.drives import PositionServo, VoltageMotor
from nectosome.drives.motor import VelocityServo
from nectosome.units import parse_quantity

SHEET = {
    "rated_voltage": 6.0, "stall_torque": 1.1, "no_load_speed": 5.2, "stall_current": 2.1, "no_load_current": 0.33
}  # fmt: skip
CONSTANTS = {"torque_constant": 0.02, "resistance": 1.5, "friction": 1e-3}
GEAR = {"gear_ratio": 3.0, "efficiency": 0.8, "inertia": 2e-5}
TARGET = Sine(*(number(x) for x in (0.4, 1.5, 0.3, 0.1)))


def of_voltage(volts, **data):
    return VoltageMotor.from_description(MotorDrive(voltage={"kind": "constant", "value": volts}, **data))


def servo(**data):
    return PositionServo.from_description(AngularServo(**{"full_voltage_at": 0.2, "supply": 6.0, **data}), TARGET)


LOOP = {"full_voltage_at": 2.0, "integral_time": 0.3}
GAINS = ({"at": 0.5, "factor": 3.0}, {"at": 2.0, "factor": 1.0})
ALL = {"derivative": 0.05, "dead_band": 0.01, "current_limit": 1.0, "torque_limit": 0.04}
SLIDE = LinearServo(full_voltage_at=0.01, supply=6.0, radius=0.02, **SHEET)
SHARE = MotorDrive(duty_cycle={"kind": "constant", "value": 0.7}, supply=6.0, **SHEET)
EXAMPLES = {
    "a motor by its sheet": of_voltage(4.0, **SHEET),
    "a motor by its constants, behind a gear": of_voltage(4.0, **CONSTANTS, **GEAR),
    "a motor that moves a slide": of_voltage(4.0, radius=0.02, **SHEET),
    "a motor with a duty cycle": VoltageMotor.from_description(SHARE),
    "a motor with a limited current": of_voltage(4.0, current_limit=0.8, **SHEET),
    "a servo": servo(**SHEET),
    "a servo with all of it": servo(**CONSTANTS, **GEAR, **ALL),
    "a servo with an update rate": servo(**SHEET, update_rate=50.0),
    "a servo with a velocity loop": servo(**SHEET, full_voltage_at=None, velocity_loop=LOOP),
    "a servo that sums up": servo(**SHEET, full_voltage_at=None, velocity_loop=LOOP, update_rate=50.0),
    "a servo with gains by speed": servo(**SHEET, full_voltage_at=None, velocity_loop={**LOOP, "schedule": GAINS}),
    "a servo of a slide": PositionServo.from_description(SLIDE, TARGET),
}
SPEEDS = jnp.array([-9.0, -2.0, -0.01, 0.0, 0.003, 1.0, 6.0, 15.0])
SUPPLY = number(6.0)
SERVOS = PositionServo, VelocityServo


def output(drive, v, t=0.2, x=0.3, supply=SUPPLY, slips=True):
    """At these velocities, where friction slips, or holds with a fiftieth of itself; and the rate of what is stored."""
    z = jax.tree.map(lambda x: x + 0.02, drive.initial())

    def at(v):
        here = z
        if slips and drive.motor.friction is not None:
            here = z._replace(friction=jnp.sign(v)) if isinstance(drive, SERVOS) else jnp.sign(v)
        found, rates = drive.output(number(t), number(x), v, supply, here)
        return found, jax.jvp(drive.stored, (here,), (rates,))[1]

    found, stored = jax.jit(jax.vmap(at))(v)
    return found if slips else (found, stored)


def kinds_of(cls):
    return {kind for own in cls.__subclasses__() for kind in kinds_of(own)} or {cls}


def test_every_drive_has_an_example():
    assert kinds_of(Drive) == {type(drive) for drive in EXAMPLES.values()}


@pytest.mark.parametrize("drive", EXAMPLES.values(), ids=EXAMPLES)
def test_the_account_of_energy_is_closed(drive):
    """Electrical power = torque times velocity + heat, which is never negative but for what comes out of store."""
    found, stored = output(drive, SPEEDS, slips=False)
    np.testing.assert_allclose(found.electrical, found.torque * SPEEDS + found.heat, rtol=1e-12, atol=1e-12)
    assert np.all(found.heat >= stored) and np.all(np.isfinite(found.torque))
    assert np.all(output(drive, SPEEDS).heat >= 0)
    assert float(drive.stored(drive.initial())) == 0


@pytest.mark.parametrize("drive", EXAMPLES.values(), ids=EXAMPLES)
def test_without_a_voltage_it_only_brakes(drive):
    """A dead supply of a servo, or a signal of 0."""
    servo = isinstance(drive, SERVOS)
    dead = drive if servo else eqx.tree_at(lambda d: d.signal, drive, Constant(number(0.0)))
    supply = number(1e-12) if servo else SUPPLY
    power = output(dead, SPEEDS, supply=supply).torque * SPEEDS
    assert np.all(power <= 1e-9) and float(power[0]) < -1e-3
    held, stored = output(dead, SPEEDS, supply=supply, slips=False)
    assert np.all(held.torque * SPEEDS + stored <= 1e-9)


@pytest.mark.parametrize("drive", EXAMPLES.values(), ids=EXAMPLES)
def test_gradients_are_those_of_finite_differences(drive):
    """By all numbers of the drive, the coordinate, the velocity and the supply."""
    numbers, unravel = ravel_pytree((eqx.filter(drive, eqx.is_inexact_array), number(0.31), number(1.3), SUPPLY))
    static = eqx.filter(drive, eqx.is_inexact_array, inverse=True)

    @jax.jit
    def torque(numbers):
        moving, x, v, supply = unravel(numbers)
        return eqx.combine(moving, static).output(number(0.2), x, v, supply, drive.initial())[0].torque

    given = jax.grad(torque)(numbers)
    size = 1 + float(jnp.max(jnp.abs(given)))
    for k in range(numbers.size):
        h = 1e-6 * max(1.0, abs(float(numbers[k])))
        wanted = (torque(numbers.at[k].add(h)) - torque(numbers.at[k].add(-h))) / (2 * h)
        assert float(given[k]) == pytest.approx(float(wanted), rel=2e-5, abs=1e-8 * size)


def test_a_motor_by_its_sheet_gives_what_the_sheet_says():
    """Nothing without a load; the stall torque as soon as it turns; currents and powers of both."""
    drive, v0 = of_voltage(6.0, **SHEET), 5.2
    found = output(drive, jnp.array([v0, 0.5 * v0]), supply=None)
    np.testing.assert_allclose(found.current, [0.33, 0.5 * (0.33 + 2.1)], rtol=1e-12)
    np.testing.assert_allclose(found.torque, [0.0, 0.5 * 1.1], atol=2e-4)  # of the smooth sign of the gear's loss
    still = output(drive, jnp.zeros(1), supply=None)
    assert float(still.current[0]) == pytest.approx(2.1, rel=1e-12)
    assert float(still.electrical[0]) == pytest.approx(6.0 * 2.1, rel=1e-12)
    # without a load, half of the voltage gives less than half of the speed: friction takes the same current
    half = output(
        of_voltage(3.0, **SHEET), jnp.array([v0 * (3.0 - 0.33 * 6 / 2.1) / (6.0 - 0.33 * 6 / 2.1)]), supply=None
    )
    assert float(half.torque[0]) == pytest.approx(0.0, abs=2e-4)


@pytest.mark.parametrize("drive", EXAMPLES.values(), ids=EXAMPLES)
def test_what_is_updated_is_what_the_continuous_drive_does_then(drive):
    """After an update the output is that of the loop at its coordinate and velocity; it is the same until the next."""
    t, x, v = number(0.2), number(0.31), number(1.3)
    z = jax.tree.map(lambda x: x + 0.02, drive.initial())
    now = drive.updated(t, x, v, z)
    if drive.updates is None:
        assert drive.continuous() is drive and now is z
        return
    expected, rates = drive.continuous().output(t, x, v, SUPPLY, z)
    found, held = drive.output(t, x, v, SUPPLY, now)
    for a, b in zip(found, expected, strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-14)
    later, _ = drive.output(t + 0.1, x + 0.4, v, SUPPLY, now)
    assert float(later.demand) == float(found.demand) != float(drive.output(t, x, v, SUPPLY, z)[0].demand)
    assert not any(map(float, jax.tree.leaves(held.loop))) and now.friction == z.friction
    for a, b, rate in zip(*map(jax.tree.leaves, (now.loop.own, z.loop.own, rates.loop.own)), strict=True):
        assert float(a) == pytest.approx(float(b + rate / drive.updates), rel=1e-14)


@pytest.mark.parametrize("name", servos())
def test_the_catalogue_gives_the_stall_torque_that_it_prints(name):
    sheet = servos()[name]
    drive = of_voltage(1.0, model=name)
    volts = parse_quantity(sheet["rated_voltage"], "voltage")
    stall = parse_quantity(sheet["stall_torque"], "torque")
    slow = 0.1 * parse_quantity(sheet["no_load_speed"], "angular_speed")
    found = drive.motor.at_voltage(number(0.0), number(volts), number(slow), number(1.0))
    assert float(found.torque) == pytest.approx(0.9 * stall, rel=6e-3)
    assert sheet["source"]


def test_a_gear_multiplies_torque_and_inertia_and_divides_speed():
    bare, geared = (of_voltage(1.0, **CONSTANTS, **more).motor for more in ({}, GEAR))
    n, share = GEAR["gear_ratio"], GEAR["efficiency"]
    assert float(geared.inertia) == pytest.approx(n**2 * GEAR["inertia"], rel=1e-12)
    one, other = (m.at_voltage(*map(number, (0.0, 6.0, v, 1.0))) for m, v in ((bare, 90.0), (geared, 30.0)))
    assert float(other.current) == pytest.approx(float(one.current), rel=1e-12)
    assert float(other.torque) == pytest.approx(n * share * float(one.torque), rel=1e-3)


def test_a_servo_gets_all_of_the_voltage_at_its_error_and_none_in_its_dead_band():
    drive = servo(**SHEET, dead_band=0.05)
    reference = float(TARGET(number(0.2))[0])
    for error, share in ((0.0, 0.0), (0.01, 0.0), (0.15, 0.5), (0.5, 1.0), (-0.5, -1.0)):
        found = output(drive, jnp.zeros(1), x=reference - error)
        assert float(found.voltage[0]) == pytest.approx(6.0 * share, abs=0.01)
        assert float(found.reference[0]) == pytest.approx(reference, rel=1e-12)
    limited = servo(**SHEET, torque_limit=0.3)
    pushed = output(limited, jnp.full(1, 0.5), x=reference - 1.0)
    assert float(pushed.torque[0]) < 0.3 * 1.02
