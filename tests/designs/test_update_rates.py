"""Designs, sweeps, missions, loops and fits of a robot whose servo has an update rate."""

import numpy as np
import pytest
from tests.small_robots import SERVO

from nectosome.description import parse_robot
from nectosome.description.mission import parse_mission
from nectosome.description.variables import read_variable
from nectosome.designs import MotionDesign, sweep
from nectosome.identification import identify
from nectosome.solve import SampledPlant, periodic
from nectosome.units import InputError

ROBOT = parse_robot(SERVO.replace("inertia: 20 g m2", "inertia: 20 g m2, update_rate: 50 Hz"))
RATE, FULL, F = "body.joint.servo.update_rate", "body.joint.servo.full_voltage_at", "body.joint.motion.frequency"
NO_CHANGE = "neither changes within a motion nor has derivatives: updates come or go one by one."


def design(**ranges):
    variables = tuple(read_variable(name, text, ROBOT) for name, text in ranges.items())
    return MotionDesign(ROBOT, variables, "torque")


@pytest.mark.slow
def test_the_gradient_of_a_cycle_with_updates_is_that_of_differences():
    evaluate = design(**{FULL: "10..30deg"}).prepare()
    here, h = np.array([0.4]), 1e-2  # above the noise of cycles
    (given,) = evaluate(here, True, None).gradient
    up, down = (evaluate(here + d, False, None).objective for d in (h, -h))
    assert given == pytest.approx((up - down) / (2 * h), rel=2e-3)
    assert abs(given) > 0.1


@pytest.mark.slow
def test_a_sweep_over_rates_finds_the_cycle_of_each():
    found = sweep(ROBOT, {RATE: [20.0, 50.0]}, samples=201)
    means = periodic(ROBOT, settings=[f"{RATE}=20Hz"], samples=201).means()
    np.testing.assert_allclose(found["electrical_power"].values[0], means.electrical_power, rtol=1e-3)
    assert found["electrical_power"].values[0] > 1.05 * found["electrical_power"].values[1]


@pytest.mark.parametrize(
    ("refused", "said"),
    [
        (lambda: design(**{RATE: "20..100Hz"}), f"{RATE}: {NO_CHANGE} Set it, or sweep a list of rates."),
        (lambda: design(**{F: "0.5..2Hz"}).prepare(), f"{F}: changes the period, in which updates of a servo's loop"),
        (lambda: sweep(ROBOT, {F: [1.0, 1.2]}), "update_rate: at 50 Hz a loop has 41.67 updates in a period of"),
        (lambda: parse_mission(f"modes: [{{name: go, set: {{{RATE}: 20 Hz}}, until: 1 s}}]", ROBOT), NO_CHANGE),
        (lambda: SampledPlant(ROBOT, RATE, "body.angle", 0.02), f"{RATE}: {NO_CHANGE}"),
        (lambda: identify(ROBOT, {"t": [0.0, 1.0]}, vary={RATE: "20..100Hz"}, compare={"y": "body.angle"}), NO_CHANGE),
    ],
)
def test_what_is_not_possible_with_updates_is_told(refused, said):
    with pytest.raises(InputError) as told:
        refused()
    assert said in str(told.value)
