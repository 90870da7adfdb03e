"""Robots under a controller, against the same loop about a transfer function, and what a sensor does to it."""

import json

import jax.numpy as jnp
import numpy as np
import pytest
from tests.small_robots import LOOSE, SLIDE

from nectosome.controllers import (
    ActuatorLimits,
    BlockLoop,
    RobotLoop,
    SensorModel,
    detune,
    pid_of,
    relay_gains,
    smooth_pid,
    step_response,
    time_scaled,
    wave,
)
from nectosome.core import Status
from nectosome.description import parse_robot, with_values
from nectosome.solve import SampledPlant
from nectosome.view.saved import check_drawable, saved_run

from .simple_loops import quiet

MASS, DRAG, MOST, DT = 2.0, 4.0, 2.0, 0.05  # kg, N s/m, N, s
FREE = with_values(parse_robot(SLIDE), {"m": MASS, "body.joint.stiffness": LOOSE, "body.joint.damping": DRAG})
PI = pid_of([10.0, 20.0, 0.0], 0.0, ActuatorLimits(-MOST, MOST))


@pytest.fixture(scope="module")
def slide():
    """Its velocity answers as 1/(m s + c)."""
    return SampledPlant(FREE, "push", "velocity.x", DT, instants=2, rtol=1e-9, atol=1e-11)


def test_a_robot_answers_as_its_transfer_function_saturated_or_not(slide):
    """A sine of 0.45 m/s, where 2 N hold 0.5 m/s at most: the same loop, the same integral that stands still."""
    from nectosome.drives import TransferFunction

    reference = wave("sine", 5.0, DT, amplitude=0.45, frequency=0.4)
    plant = TransferFunction(jnp.asarray([1.0]), jnp.asarray([MASS, DRAG]))
    exact = BlockLoop(plant, quiet(), DT, substeps=1).run(PI, reference)
    found = RobotLoop(slide).run(PI, reference)
    assert found.status == Status.SOLVED
    np.testing.assert_allclose(found.output, exact.output, atol=1e-8)
    np.testing.assert_allclose(found.command, exact.command, atol=1e-7)
    assert np.abs(found.command).max() == MOST
    assert np.mean(np.abs(found.command) == MOST) > 0.2


def test_the_run_comes_with_moments_between_the_samples(slide):
    """Held force: v goes to u/c with exp(-c t/m), half a sample on too."""
    found = RobotLoop(slide).run(PI, np.full(21, 0.3))
    signals = found.signals()
    assert dict(signals.sizes) == {"sample": 21, "time": 41, "station": 1, "axis": 3}
    v, u = signals["reading"].values, signals["command"].values[:-1]
    half = np.exp(-DRAG * DT / 2 / MASS)
    np.testing.assert_allclose(v[1::2], half * v[:-1:2] + (1 - half) * u / DRAG, atol=1e-9)
    np.testing.assert_allclose(found.output, v[::2], atol=1e-12)
    assert signals["command"].attrs["units"] == "N" and signals["reading"].attrs["units"] == "m/s"
    late = found.last(0.5)
    np.testing.assert_array_equal(late.time, found.time[-10:])
    np.testing.assert_array_equal(late.instants, found.instants[found.instants > 0.5 + 1e-9])


def test_what_is_kept_is_a_run_like_any(slide):
    """From the first sample on; the held force is told as a drive, and all powers balance."""
    found = RobotLoop(slide).run(PI, np.full(21, 0.3))
    data = found.to_dataset({"rate": 20.0})
    saved_run(data, "kept")
    check_drawable(data, "kept")
    np.testing.assert_allclose(data["time"].values, found.instants[1:])
    np.testing.assert_allclose(data["v"].values[:, 0], data["reading"].values, atol=1e-12)
    x = data["position"].sel(axis="x").values[:, 0]
    np.testing.assert_allclose(x, found.signals()["position"].values[1:, 0, 0], atol=1e-12)
    pushed = data["load_power"].sel(load="drive").sum("part").values / data["v"].values[:, 0]
    np.testing.assert_allclose(pushed[1::2], data["command"].values[:-1], rtol=1e-9)
    assert float(data["power_balance"].max()) < 1e-12
    assert json.loads(data.attrs["provenance"])["settings"] == {"rate": 20.0}


def test_a_delay_of_whole_samples_and_noise_are_what_the_controller_is_told(slide):
    reference = np.full(41, 0.2)
    late = RobotLoop(slide, SensorModel(delay=3 * DT)).run(PI, reference)
    np.testing.assert_allclose(late.measured[3:], late.output[:-3], atol=1e-12)
    np.testing.assert_allclose(late.measured[:3], late.output[0], atol=1e-12)
    noisy = RobotLoop(slide, SensorModel(noise=1e-3)).run(PI, reference)
    error = noisy.measured - noisy.output
    assert 0.7e-3 < error.std() < 1.3e-3 and abs(error.mean()) < 0.5e-3


def test_gains_of_a_relay_have_the_sign_in_which_it_answers(slide):
    """Sampled, with a held force, a gain makes it swing from (1 + a) c/(1 - a) on, with a = exp(-c dt/m)."""
    found = relay_gains(RobotLoop(slide), -MOST, MOST, 0.0)
    assert found is not None
    a = np.exp(-DRAG * DT / MASS)
    swings = (1 + a) * DRAG / (1 - a)
    assert found.ultimate.period == pytest.approx(2 * DT)
    assert found.ultimate.gain == pytest.approx(4 / np.pi * swings, rel=0.05)  # of the first harmonic of a square
    assert (found.gains >= 0).all()
    limits = ActuatorLimits(-MOST, MOST)
    answer = step_response(*_step(RobotLoop(slide).run(pid_of(found.gains, 0.0, limits), np.full(101, 0.3))))
    assert answer is not None
    assert answer.overshoot < 0.05 and answer.settling < 1.0 and abs(answer.steady_error) < 1e-4


def _step(run):
    return run.time, run.output, run.reference


def test_what_answers_downwards_gets_gains_below_nothing(slide):
    """The same robot, seen from behind: its relay turns the other way after a few samples."""

    class Behind:
        dt, initial_command, parts, coordinates, displacements = (
            DT,
            0.0,
            slide.parts,
            slide.coordinates,
            slide.displacements,
        )
        start = staticmethod(slide.start)

        @staticmethod
        def hold(state, command):
            return slide.hold(state, -command)

    found = relay_gains(RobotLoop(Behind()), -MOST, MOST, 0.1)  # type: ignore[arg-type]
    assert found is not None
    assert (found.gains <= 0).all() and found.gains[0] < 0


def test_a_gentler_pace_is_the_same_motion_stretched_in_time():
    """Of a mass alone, sampled half as often: sample by sample the same."""
    free = with_values(FREE, {"body.joint.damping": LOOSE})
    gains, runs = np.array([8.0, 3.0, 6.0]), []
    for pace in (1.0, 0.5):
        robot = SampledPlant(free, "push", "position.x", DT / pace, rtol=1e-9, atol=1e-11)
        pid = smooth_pid(time_scaled(gains, pace), ActuatorLimits(-1e3, 1e3), robot.dt)
        runs.append(RobotLoop(robot).run(pid, np.full(101, 0.1)).output)
    assert 0.11 < runs[0].max() < 0.2
    np.testing.assert_allclose(runs[1], runs[0], atol=1e-9)


def test_gains_are_made_gentler_until_the_reference_is_followed_worse(slide):
    """Ten times what makes it swing with each sample is too much, a tenth is not."""
    wild, calm = (np.array([k, k, 0.0]) for k in (200.0, 4.0))
    reference = np.full(101, 0.3)
    loop, limits = RobotLoop(slide), ActuatorLimits(-MOST, MOST)
    pace = detune(loop, wild, limits, reference)
    assert pace is not None and pace <= 0.5
    assert detune(loop, calm, limits, reference) == 1.0
    assert detune(loop, calm, limits, reference, progress=lambda share: share < 0.1) is None


def test_a_run_that_is_cancelled_keeps_what_was_done(slide):
    told = []
    found = RobotLoop(slide).run(PI, np.full(201, 0.1), progress=lambda share: told.append(share) or share < 0.5)
    assert found.status == Status.CANCELLED
    assert 90 < found.time.size < 110 and told[-1] >= 0.5
    assert found.reference.shape == found.command.shape == found.time.shape
