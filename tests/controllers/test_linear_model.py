"""A linear model of a robot from a run of it: known plants come back, and what is none is refused."""

import numpy as np
import pytest
from scipy.signal import cont2discrete, tf2ss
from tests.small_robots import SLIDE

from nectosome.controllers import ActuatorLimits, RobotLoop, SensorModel, fit_linear, robot_model, smooth_pid
from nectosome.description import parse_robot
from nectosome.drives import respond
from nectosome.solve import SampledPlant
from nectosome.units import InputError

DT, EXACT = 0.05, SensorModel()
PID = smooth_pid(np.array([0.8, 0.5, 0.1]), ActuatorLimits(-2.0, 2.0), DT)
STEPS = np.repeat(np.random.default_rng(3).choice((-1.0, 1.0), 60), np.random.default_rng(4).integers(2, 14, 60))[:300]

PLANTS = {
    "lag": ([2.0], [0.4, 1.0], 3),
    "integrator": ([0.7], [1.0, 0.0], 2),
    "damped": ([3.0], [1 / 9, 2 * 0.7 / 3, 1.0], 1),
    "oscillator": ([3.0], [1 / 16, 2 * 0.3 / 4, 1.0], 1),
    "lag and integrator": ([-1.5], [0.3, 1.0, 0.0], 0),
    "two integrators": ([1.2], [1.0, 0.0, 0.0], 2),
    "oscillator and lag": ([2.0], np.polymul([1 / 25, 2 * 0.4 / 5, 1.0], [0.5, 1.0]), 1),
    "oscillator and integrator": ([-2.0], np.polymul([1 / 25, 2 * 0.4 / 5, 1.0], [1.0, 0.0]), 0),
}


def answer(num, den, delay, u, start=0.0):
    """Output at the samples, by matrices of the plant; all its states are `start` at first."""
    A, B, C, _, _ = cont2discrete(tf2ss(num, den), DT)
    x, y = np.full(len(A), start), []
    for k in range(len(u)):
        y.append((C @ x).item())
        x = A @ x + B[:, 0] * (u[k - delay] if k >= delay else 0.0)
    return np.array(y)


@pytest.mark.parametrize("start", [0.0, 0.3])
@pytest.mark.parametrize("name", PLANTS)
def test_a_plant_comes_back_with_delay_offset_and_start(name, start):
    """From rest and in motion, about a command of 0.2 that does nothing."""
    num, den, delay = PLANTS[name]
    y = answer(num, den, delay, STEPS - 0.2, start)
    found = fit_linear(STEPS, y, DT, before=0.2)
    integrators = int(np.sum(np.asarray(den) == 0))
    known = np.trim_zeros(np.asarray(den, dtype=float), "b")
    assert (found.integrators, found.delay) == (integrators, delay)
    np.testing.assert_allclose(found.poles, known / known[-1], rtol=1e-5)
    assert found.gain == pytest.approx(num[0] / known[-1], rel=1e-5)
    assert found.command == pytest.approx(0.2, abs=1e-5)
    assert found.explained == pytest.approx(1.0, abs=1e-9)


def test_noise_leaves_a_model_that_says_how_much_it_explains():
    """White noise of 5 % of the output's deviation leaves 0.25 % unexplained."""
    y = answer(*PLANTS["damped"], STEPS)
    noisy = y + 0.05 * y.std() * np.random.default_rng(0).standard_normal(300)
    found = fit_linear(STEPS, noisy, DT)
    assert found.gain == pytest.approx(3.0, rel=0.02)
    assert 1 - found.explained == pytest.approx(0.0025, rel=0.3)


def test_for_controllers_is_the_same_plant():
    """Command to input and back, and its dynamics, along the steps."""
    y = answer([-1.5], [0.3, 1.0, 0.0], 0, STEPS - 0.2)
    known = fit_linear(STEPS, y, DT, before=0.2).for_controllers()
    v = respond(known.hysteresis, STEPS, DT)
    np.testing.assert_allclose(respond(known.inverse, v, DT), STEPS, atol=1e-9)
    np.testing.assert_allclose(v, 1.5 * (STEPS - 0.2), atol=1e-5)
    np.testing.assert_allclose(known.dynamics.denominator / known.dynamics.numerator[0], [-0.3, -1.0, 0.0], rtol=1e-5)


@pytest.fixture(scope="module")
def slide():
    return SampledPlant(parse_robot(SLIDE), "push", "body.position", DT)


def model_of(robot, sensor=EXACT):
    return robot_model(RobotLoop(robot, sensor), PID, np.full(60, 0.1))


def test_a_spring_and_a_damper_under_water_are_found_as_they_are(slide):
    """K = 1/k, a_2 = m/k, a_1 = c/k of the robot file; a measurement late by two samples is a delay of two."""
    found = model_of(slide, SensorModel(delay=2 * DT))
    assert (found.integrators, found.delay) == (0, 2)
    np.testing.assert_allclose(found.poles, [2 / 5, 4 / 5, 1.0], rtol=1e-4)
    assert found.gain == pytest.approx(1 / 5, rel=1e-4) and found.command == pytest.approx(0.0, abs=1e-4)


def test_the_run_can_be_cancelled(slide):
    assert robot_model(RobotLoop(slide), PID, np.full(60, 0.1), lambda share: False) is None


def test_what_the_command_does_not_move_has_no_model():
    robot = SampledPlant(parse_robot(SLIDE), "push", "position.y", DT)
    with pytest.raises(InputError, match=r"explains 0 % of what push does to position\.y; 80 % are needed\. Take pid"):
        model_of(robot)
