"""A mission and a closed loop of a joint that a servo moves: what modes and commands set is the servo's setpoint."""

import numpy as np
import pytest
from tests.small_robots import SERVO

from nectosome.controllers import control
from nectosome.core import Status
from nectosome.description import parse_robot
from nectosome.description.mission import parse_mission
from nectosome.solve import mission_data, run_mission, simulate

UPRIGHT = SERVO.replace("axis: x", "axis: z")  # so that its heading is the angle of the servo
AMPLITUDE = "body.joint.motion.amplitude"


def test_a_mission_of_a_servo_is_the_simulation_of_its_motion_and_its_account_closes():
    """In a first mode as it is described; in a second one with twice the amplitude, in half a second."""
    robot = parse_robot(UPRIGHT)
    modes = ("30 deg}, until: 1 s", "60 deg in 0.5 s}, until: 0.5 s")
    each = ", ".join(f"{{name: mode_{k}, set: {{{AMPLITUDE}: {rest}}}" for k, rest in enumerate(modes))
    run = run_mission(parse_mission(f"modes: [{each}]", robot))
    assert run.reason == "" and [one.mode for one in run.passed] == ["mode_0", "mode_1"]
    same = simulate(robot, 1.0, samples=2001, rtol=1e-7, atol=1e-9).to_dataset()
    first = run.time <= 1.0
    np.testing.assert_allclose(
        np.interp(same["time"], run.time[first], run.measures.heading[first]), same["q"].values[:, 0], atol=2e-4
    )
    drawn = run.weight * run.measures.battery_power[:, 0]
    by_samples = np.trapezoid(same["battery_power"].values[:, 0], same["time"])
    np.testing.assert_allclose(drawn[first].sum(), by_samples, rtol=2e-5)
    assert float(same["power_balance"].max()) < 1e-10
    assert float(mission_data(run)["battery_energy"].sel(battery="pack")) == pytest.approx(drawn.sum(), rel=1e-12)
    assert np.abs(run.measures.heading[~first]).max() > np.abs(run.measures.heading[first]).max()


def test_a_loop_steers_the_setpoint_of_a_servo_which_is_held_within_samples():
    """At the end of each sample the reference is the command of that sample; the electrical account is closed."""
    robot = parse_robot(
        SERVO.replace("{kind: sine, amplitude: 30 deg, frequency: 1 Hz}", "{kind: constant, value: 0 deg}")
    )
    loop = {"command": "body.joint.motion.value=-45..45deg", "measure": "body.angle", "rate": "20Hz"}
    found = control(robot, **loop, reference="20deg", gains="0.5,2,0", time="3s")
    assert found.status == Status.SOLVED
    assert found.record.output[-1] == pytest.approx(np.radians(20), abs=np.radians(0.5))
    data = found.to_dataset()
    at = np.searchsorted(data["sample"].values, data["time"].values[1:] - 1e-6, side="right") - 1
    np.testing.assert_allclose(data["motor_reference"].values[1:, 0], data["command"].values[at], rtol=1e-12)
    balance = data["electrical_power"] - data["motor_torque"] * data["motor_rate"] - data["motor_heat"]
    np.testing.assert_allclose(balance, 0.0, atol=1e-9)
    assert float(data["power_balance"].max()) < 1e-10


def test_a_motor_in_a_loop_that_is_updated_often_follows_as_the_servo_does():
    """A duty cycle that is held between updates; what its angle differs by falls with the time between them."""
    motion, loop = "    motion: {kind: sine, amplitude: 30 deg, frequency: 1 Hz}\n", "full_voltage_at: 12 deg"
    motor = SERVO.replace(motion, "").replace("servo:", "motor:")
    robot = parse_robot(motor.replace(loop, "duty_cycle: {kind: constant, value: 0}"))
    ideal = simulate(parse_robot(SERVO), 2.0, samples=201).to_dataset()["motor_position"].values[:, 0]
    sampled = {"command": "body.joint.motor.duty_cycle.value=-1..1", "measure": "body.angle", "reference": "sine"}
    sampled |= {"amplitude": "30deg", "frequency": "1Hz", "gains": f"{1 / 12},0,0", "time": "2s"}
    off = []
    for rate in ("100Hz", "200Hz"):
        data = control(robot, **sampled, rate=rate).to_dataset()
        angle = np.interp(np.linspace(0, 2, 201), data["time"], data["motor_position"].values[:, 0])
        off.append(np.abs(angle - ideal).max())
    assert off[0] < np.radians(1)
    assert off[1] == pytest.approx(off[0] / 2, rel=0.1)
