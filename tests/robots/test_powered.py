"""Robots with motors: run-up, holding torque, sagging batteries and steady rotation by their closed forms."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.core import State, Status
from nectosome.description import drive_period, parse_robot
from nectosome.mechanism import in_plane
from nectosome.model import build
from nectosome.solve import periodic, reading, simulate, static, steady, tracking_warnings

K, R, J = 0.5, 2.0, 0.02  # N m/A, ohm, kg m2
I = 0.08  # of the wheel [kg m2]
MOTOR = f"torque_constant: {K} N m/A, resistance: {R} ohm, inertia: {J} kg m2"
WHEEL = f"""
name: wheel
water: {{gravity: 0 m/s2}}
body:
  kind: rigid
  shape: point
  mass: 1 kg
  inertia: [{I} kg m2, {I} kg m2, {I} kg m2]
  joint:
    kind: revolute
    axis: x
    motor: {{{MOTOR}, voltage: {{kind: constant, value: 6 V}}}}
  loads: {{water: {{kind: lumped_drag, drag_area: [0 m2, 0 m2, 0 m2], rotational: [DRAG kg m2, 0 kg m2, 0 kg m2]}}}}
"""
ARM = f"""
name: arm
water: {{gravity: 9.81 m/s2}}
batteries: {{pack: {{voltage: 12 V, resistance: 0.4 ohm, idle_power: 2 W, TAKES}}}}
body:
  kind: rigid
  shape: point
  mass: 0.6 kg
  volume: 0 m3
  centre_of_mass: [0.3 m, 0 m, 0 m]
  joint:
    kind: revolute
    axis: y
    motion: MOTION
    servo: {{{MOTOR}, full_voltage_at: 10 deg, battery: pack}}
"""


def wheel(drag=0.0):
    return parse_robot(WHEEL.replace("DRAG", str(drag)))


def arm(motion, takes="regenerative: true"):
    return parse_robot(ARM.replace("MOTION", motion).replace("TAKES", takes))


def test_a_wheel_runs_up_with_the_time_constant_of_its_motor():
    """omega = U/K (1 - exp(-t/tau)), tau = (I + J) R/K^2 = 0.8 s; electrical in = kinetic energy + heat."""
    run = simulate(wheel(), 2.0, samples=401, rtol=1e-8, atol=1e-10)
    data = run.to_dataset()
    tau = (I + J) * R / K**2
    wanted = 6.0 / K * (1 - np.exp(-data["time"] / tau))
    np.testing.assert_allclose(data["v"].values[:, 0], wanted, atol=1e-5)
    np.testing.assert_allclose(data["energy"].sum("form"), 0.5 * (I + J) * wanted**2, atol=1e-4)
    assert float(data["power_balance"].max()) < 1e-12
    put_in, lost = (
        float(np.trapezoid(data[name].values[:, 0], data["time"])) for name in ("electrical_power", "motor_heat")
    )
    assert put_in == pytest.approx(float(data["energy"].sum("form")[-1]) + lost, rel=1e-4)


def test_a_motor_against_drag_has_a_steady_speed():
    """K (U - K omega)/R = c omega^2, whatever the inertias."""
    c = 0.01
    found = steady(wheel(c))
    assert int(found.status) == Status.SOLVED
    omega = (-(K**2) / R + np.sqrt((K**2 / R) ** 2 + 4 * c * K * 6.0 / R)) / (2 * c)
    np.testing.assert_allclose(found.state.v, [omega], rtol=1e-9)
    data = found.to_dataset()
    assert float(data["current"].squeeze()) == pytest.approx((6.0 - K * omega) / R, rel=1e-9)


def test_a_servo_holds_an_arm_with_the_error_that_its_torque_needs():
    """m g a cos(x) = K U e/(R e_f), of the battery's voltage under the current and the idle power."""
    found = static(arm("{kind: constant, value: 20 deg}"))
    assert int(found.status) == Status.SOLVED
    data = found.to_dataset()
    x, U = float(found.state.q[0]), float(data["battery_voltage"].squeeze())
    torque = -0.6 * 9.81 * 0.3 * np.cos(x)
    current = torque / K
    assert float(data["current"].squeeze()) == pytest.approx(current, rel=1e-9)
    assert pytest.approx(12.0 - 0.4 * (2.0 + R * current**2) / U, rel=1e-12) == U
    assert U * (np.radians(20) - x) / np.radians(10) == pytest.approx(R * current, rel=1e-4)
    assert float(data["battery_power"].squeeze()) == pytest.approx(2.0 + R * current**2, rel=1e-9)


def test_a_battery_without_regeneration_keeps_what_braking_gives():
    """The mean power of a servo to and fro is larger by what it gives back; both accounts are closed."""
    sine = "{kind: sine, amplitude: 40 deg, frequency: 1 Hz}"
    both = [periodic(arm(sine, f"regenerative: {word}"), samples=257).to_dataset() for word in ("true", "false")]
    assert drive_period(arm(sine, "regenerative: true")) == 1.0
    for data in both:
        assert float(data["power_balance"].max()) < 1e-10
        balance = data["electrical_power"] - data["motor_torque"] * data["v"].values - data["motor_heat"]
        np.testing.assert_allclose(balance, 0.0, atol=1e-10)
        U, P = data["battery_voltage"], data["battery_power"]
        np.testing.assert_allclose(U, 12.0 - 0.4 * P / U, rtol=1e-12)
    assert float(both[0]["electrical_power"].min()) < -0.1
    np.testing.assert_allclose(
        both[0]["battery_power"].squeeze(), 2.0 + both[0]["electrical_power"].squeeze(), rtol=1e-9
    )
    assert float(both[1]["battery_power"].min()) == pytest.approx(2.0, rel=1e-12)


def warnings_of(robot, data):
    """Those of the largest errors of a run."""
    names = ("tracking_error", "speed_error", "voltage_demand")
    peaks = {name: np.abs(data[name].values).max(axis=0) for name in names}
    return tracking_warnings(robot, peaks | {"motor": data["motor"].values})


def regulated(rate):
    """The wheel on a velocity loop with an integral, in water."""
    loop = "velocity_loop: {full_voltage_at: 4 rad/s, integral_time: 0.3 s}"
    drive = f"motion: {{kind: rate, rate: {rate} rad/s}}\n    servo: {{{MOTOR}, supply: 6 V, {loop}}}"
    text = WHEEL.replace("DRAG", "0.002")
    before = text[text.index("motor: ") : text.index("\n  loads")]
    return parse_robot(text.replace(before, drive))


def test_a_velocity_loop_comes_to_its_speed_without_an_error():
    """By its integral, against drag: steady and from rest, where its integral stops while the voltage is limited."""
    robot = regulated(9)
    found = steady(robot)
    assert int(found.status) == Status.SOLVED
    np.testing.assert_allclose(found.state.v, [9.0], rtol=1e-9)
    data = found.to_dataset()
    assert float(data["motor_torque"].squeeze()) == pytest.approx(0.002 * 81, rel=1e-9)
    assert abs(float(data["speed_error"].squeeze())) < 1e-8 and 0.5 < float(data["voltage_demand"].squeeze()) < 1
    assert warnings_of(robot, data) == []
    run = simulate(robot, 6.0, samples=301, rtol=1e-7, atol=1e-9)
    speed = np.asarray(run.value.state.v)[:, 0]
    assert speed[-1] == pytest.approx(9.0, rel=1e-4) and speed.max() < 1.15 * 9


def test_a_velocity_loop_at_its_full_voltage_tells_what_it_lacks():
    """K (U - K omega)/R = c omega^2 at what is left of 6 V by the smooth limit; it lacks 14 rad/s - omega."""
    robot = regulated(14)
    found = steady(robot)
    assert int(found.status) == Status.SOLVED
    data = found.to_dataset()
    U = float(data["motor_voltage"].squeeze())
    assert 0.99 * 6.0 < U <= 6.0
    c = 0.002
    omega = (-(K**2) / R + np.sqrt((K**2 / R) ** 2 + 4 * c * K * U / R)) / (2 * c)
    assert float(data["speed_error"].squeeze()) == pytest.approx(14.0 - omega, rel=1e-8)
    (told,) = warnings_of(robot, data)
    assert (
        told
        == f"the servo of body.angle cannot hold its speed: at its full voltage it lacks up to {14 - omega:.4g} rad/s"
    )


def test_the_plane_and_space_give_the_same_accelerations():
    robot = build(arm("{kind: sine, amplitude: 40 deg, frequency: 1 Hz}"))
    x = State(jnp.array([0.4]), jnp.array([-1.3]), robot.initial().z)
    t, a = jnp.asarray(0.23), jnp.array([0.7])

    @jax.jit
    def both(robot):
        return [(s.rates(t, x).v, s.residual(t, x, a)) for s in (robot, in_plane(robot))]

    space, plane = both(robot)
    for one, other in zip(space, plane, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-12)


def test_a_servo_starts_at_rest_where_its_motion_starts():
    robot = build(arm("{kind: sine, amplitude: 40 deg, frequency: 1 Hz, offset: 10 deg, phase: 90 deg}"))
    np.testing.assert_allclose(robot.initial().q, [np.radians(50)], rtol=1e-12)
    np.testing.assert_array_equal(robot.initial().v, [0.0])


@pytest.mark.parametrize(("name", "period"), [("tuna", 1 / 1.5), pytest.param("manta", 1.0, marks=pytest.mark.slow)])
def test_it_swims_forward_from_the_first_beat_within_its_battery(name, period):
    """Each beat goes further than the one before; the battery gives what drives take and the electronics."""
    run = simulate(name, 3 * period, samples=601)
    data = run.to_dataset()
    place = np.interp(period * np.arange(4), data["time"], data["position"].values[:, 0, 0])
    beats = np.diff(place)
    assert beats[0] > 1e-3 and np.all(np.diff(beats) > 0)
    assert float(data["momentum_balance"].max()) < 1e-12
    assert float(data["power_balance"].max()) < 1e-12
    taken, given = data["electrical_power"].sum("motor"), data["battery_power"].squeeze()
    np.testing.assert_allclose(given, 0.5 + np.maximum(taken, 0.0), rtol=1e-9)
    work = data["motor_torque"] * data["motor_rate"]
    np.testing.assert_allclose(taken, (work + data["motor_heat"]).sum("motor"), atol=1e-9)
    assert np.abs(data["tracking_error"]).max() < np.radians(6)


def test_readings_of_motors_and_batteries_are_those_of_the_results():
    run = static(arm("{kind: constant, value: 20 deg}"))
    data = run.to_dataset()
    names = {f"{kind}.body.angle": kind for kind in ("current", "motor_torque", "motor_voltage", "electrical_power")}
    names |= {f"{kind}.pack": kind for kind in ("battery_voltage", "battery_power")}
    for name, kind in names.items():
        assert float(data[kind].squeeze()) != 0
        np.testing.assert_allclose(reading(run, name), data[kind].values[:, 0], rtol=1e-12, err_msg=name)
        np.testing.assert_array_equal(reading(data, name), data[kind].values[:, 0])


def test_the_rotor_behind_a_slide_is_in_the_balance_of_momentum():
    """At first 2.4 A give 0.12 N m, 6 N at the pinion, and speed up 2 kg and 0.25 kg of rotor: 2.667 m/s2."""
    text = """
name: cart
water: {gravity: 0 m/s2}
body:
  {kind: rigid, shape: point, mass: 2 kg, volume: 0 m3, joint: {kind: prismatic, axis: x, motor: MOTOR}}
"""
    motor = "{torque_constant: 0.05 N m/A, resistance: 2.5 ohm, inertia: 1e-4 kg m2, radius: 20 mm, voltage: VOLTS}"
    volts = "{kind: constant, value: 6 V}"
    run = simulate(parse_robot(text.replace("MOTOR", motor.replace("VOLTS", volts))), 0.1, samples=5).to_dataset()
    assert float(run["a"][0, 0]) == pytest.approx(6 / 2.25, rel=1e-12)
    assert float(run["momentum_balance"].max()) < 1e-12
    assert float(run["power_balance"].max()) < 1e-12
