"""Constants of motors and servos from recordings of angle, current and voltage on a bench, made from known ones."""

import numpy as np
import pytest
from tests.small_robots import SERVO

from nectosome.description import parse_robot, with_values
from nectosome.identification import identify
from nectosome.identification.robot import step_errors
from nectosome.solve import reading, simulate

K, R, FRICTION, ROTOR = 0.5, 2.0, 0.05, 5e-3  # N m/A, ohm, N m, kg m2
TIME = np.linspace(0.0, 3.0, 151)
VOLTAGE = 6.0 * np.sin(2 * np.pi * 0.8 * TIME) * (1 + 0.5 * TIME / 3.0)
ANGLE, CURRENT, SAG = 2e-3, 0.02, 5e-3  # standard errors: rad, A, V
DRAWS = 30  # of noise
# a motor on a bench, with nothing at its shaft
BENCH = f"""
name: motor on a bench
water: {{gravity: 0 m/s2}}
body:
  kind: rigid
  shape: point
  mass: 0.1 kg
  inertia: [1e-7 kg m2, 1e-7 kg m2, 1e-7 kg m2]
  joint:
    kind: revolute
    axis: x
    motor:
      torque_constant: {K} N m/A
      resistance: {R} ohm
      friction: {FRICTION} N m
      inertia: {ROTOR} kg m2
      voltage: {{kind: recording, times: [{", ".join(f"{t!r} s" for t in TIME.tolist())}],
        values: [{", ".join(f"{u!r} V" for u in VOLTAGE.tolist())}]}}
"""
MOTOR = "body.joint.motor."
CONSTANTS = {"torque_constant": K, "resistance": R, "friction": FRICTION, "inertia": ROTOR}
SPANS = ("0.2..1N m/A log", "0.5..8ohm log", "0.0125..0.2N m log", "1.25..20g m2 log")


@pytest.fixture(scope="module")
def recorded():
    """Recordings of angle and current of the motor with noise, and of the voltage that drove it."""
    run = simulate(parse_robot(BENCH), float(TIME[-1]), samples=TIME.size, rtol=1e-7, atol=1e-9)
    angle, current = reading(run, "body.angle"), reading(run, "current.body.angle")
    noise = np.random.default_rng(0).normal(size=(DRAWS, 2, TIME.size))
    each = ({"angle": angle + ANGLE * a, "current": current + CURRENT * b} for a, b in noise)
    return [{"time": TIME, "volts": (VOLTAGE, "V"), **one} for one in each]


def fitted(recorded, compare, errors):
    """Constants from other values than those that the recording was made with."""
    before = with_values(parse_robot(BENCH), {MOTOR + "resistance": 3.0, MOTOR + "inertia": 3e-3})
    vary = {MOTOR + name: span for name, span in zip(CONSTANTS, SPANS, strict=True)}
    drive = {"volts": "body.joint.motor.voltage"}
    return identify(before, [recorded], vary=vary, compare=compare, errors=errors, drive=drive, starts=1)


@pytest.mark.parametrize(("draws", "most"), [(2, 2), pytest.param(DRAWS, 12, marks=pytest.mark.slow)])
def test_angle_and_current_tell_all_constants(recorded, draws: int, most: int):
    """Of 4 and 60 pairs of intervals of 95 % more than 1 and 6 miss with probabilities of 0.014 and 0.03.

    One in six missed by steps at 1e-5, whose errors are more than those of the noise: friction reverses within 0.1 deg.
    """
    compare, missed = {"angle": "body.angle", "current": "current.body.angle"}, 0
    for one in recorded[:draws]:
        found = fitted(one, compare, {"angle": ANGLE, "current": CURRENT})
        assert found.identifiability.identifiable.all()
        np.testing.assert_allclose(found.theta, [*CONSTANTS.values()], rtol=0.025)
        ends = zip(found.identifiability.intervals(), CONSTANTS.values(), strict=True)
        missed += sum(not one.low < true < one.high for one, true in ends)
    assert missed <= most


def test_a_fit_whose_exact_steps_do_not_end_says_so(recorded, monkeypatch):
    """Steps as exact as rounding become too short: what the errors of those taken do to intervals is not known."""
    monkeypatch.setattr(step_errors, "_TIGHTER", 1e-15)
    found = fitted(
        recorded[0], {"angle": "body.angle", "current": "current.body.angle"}, {"angle": ANGLE, "current": CURRENT}
    )
    assert step_errors.UNKNOWN in found.warnings


def test_the_angle_alone_tells_only_ratios_to_the_resistance(recorded):
    """J v' = K (U - K v)/R - T_f s(v) stays what it is where J, 1/R and T_f have a common factor."""
    found = fitted(recorded[0], {"angle": "body.angle"}, {"angle": ANGLE})
    assert found.identifiability.identifiable.tolist() == [True, False, False, False]
    assert found.identifiability.rank == 3
    k, r, friction, rotor = found.theta
    np.testing.assert_allclose([k, r * friction, r * rotor], [K, R * FRICTION, R * ROTOR], rtol=0.02)
    (told,) = [line for line in found.identifiability.words() if "only in combination" in line]
    assert all(name in told for name in ("resistance", "friction", "inertia"))


@pytest.mark.slow
def test_a_servo_on_a_battery_is_found_by_its_data_sheet():
    """Stall torque, loop and the battery's resistance, from angle, current and voltage of the battery."""
    servo = parse_robot(SERVO)
    true = {"body.joint.servo.stall_torque": 6.2, "body.joint.servo.full_voltage_at": np.radians(9.0)}
    true |= {"batteries.pack.resistance": 0.25}
    readings = {"angle": "body.angle", "current": "current.body.angle", "volts": "battery_voltage.pack"}
    errors = {"angle": ANGLE, "current": CURRENT, "volts": SAG}
    run = simulate(with_values(servo, true), 2.0, samples=101, rtol=1e-7, atol=1e-9)
    rng = np.random.default_rng(1)
    recorded = {name: reading(run, of) + errors[name] * rng.normal(size=101) for name, of in readings.items()}
    vary = dict(zip(true, ("4..7.5N m", "4..20deg", "0.05..1ohm"), strict=True))
    recording = {"time": np.linspace(0.0, 2.0, 101), **recorded}
    found = identify(servo, [recording], vary=vary, compare=readings, errors=errors, starts=1)
    assert found.warnings == ()
    for one, value in zip(found.identifiability.intervals(), true.values(), strict=True):
        assert one.low < value < one.high
    np.testing.assert_allclose(found.theta, [*true.values()], rtol=0.02)
