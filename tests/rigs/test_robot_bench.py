"""A robot's controller on its rig: rehearsed as the rig would run it, then run, with the rig's guards."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from tests.small_robots import SLIDE

from nectosome.controllers import ActuatorLimits, ControlTask, RobotLoop, eased, pid_of, rms_error, wave
from nectosome.description import parse_robot, with_values
from nectosome.rigs import (
    CommandLimits,
    Devices,
    Limits,
    Loop,
    MeasurementLimits,
    Pair,
    ReadingSensor,
    SimulatedRobot,
    robot_bench,
)
from nectosome.rigs.bench import Bench, tracked
from nectosome.solve import SampledPlant
from nectosome.units import InputError

from .controlled import SHAKEN

DT = 0.05
ROBOT = parse_robot(SLIDE)
LIMITS = Limits(
    {"tank.push": CommandLimits(-3.0, 3.0, 200.0)}, {"tank.x": MeasurementLimits(-0.5, 0.5, error=0.2)}
)  # fmt: skip
PAIR = Pair("tank.push", "tank.x")


def rig(robot=ROBOT, **sensor) -> Devices:
    sensors = {"x": ReadingSensor("body.position", **sensor), "v": ReadingSensor("velocity.x")}
    return Devices({"tank": SimulatedRobot(robot, {"push": "push"}, sensors, DT)})


def bench(on: Devices | None = None, limits: Limits = LIMITS, **options) -> Bench:
    given = {"command": "push=-2..2N", "measure": "body.position", "reference": "0.1 m", "gains": (20, 30, 10)}
    task = ControlTask.parse(ROBOT, **(given | {"rate": 1 / DT} | options))
    law = task.find_law(2.0, slew=limits.commands["tank.push"].slew)
    assert law is not None
    on = on or rig()
    return robot_bench([task], [law], 2.0, on, limits, [Pair("tank.push", "tank.x")])


def test_on_a_rig_that_is_the_robot_the_run_is_the_closed_loop_of_the_model(tmp_path):
    """A step of 0.1 m after the first sample; the rehearsal to the bit, `RobotLoop` to rounding."""
    one = bench()
    (rehearsed,), (run,) = one.rehearse(), one.runs([tmp_path / "run.nc"])
    assert run.status == "finished" and run.data.sizes["time"] == 41
    for name in ("tank.x", "tank.push.command", "tank.x.reference"):
        np.testing.assert_array_equal(rehearsed[name].values, run.data[name].values)
    loop = one.loops["tank.push"]
    assert loop.reference[0] == 0.0 and (loop.reference[1:] == 0.1).all()
    task = ControlTask.parse(ROBOT, command="push=-2..2N", measure="body.position", reference="0.1 m", rate=1 / DT)
    found = RobotLoop(task.robot).run(loop.controller, loop.reference)
    np.testing.assert_allclose(run.data["tank.x"].values, found.output, atol=1e-9)
    np.testing.assert_allclose(run.data["tank.push.command"].values, found.command, atol=1e-7)
    assert 0.1 < found.output.max() < 0.12


@pytest.mark.parametrize("controller", ["scheduled", "ff-pid", "mpc"])
def test_what_was_found_on_the_model_does_the_same_on_a_rig_that_is_the_robot(controller, tmp_path):
    gains = "1Hz: 20, 30, 10; 2Hz: 10, 20, 5" if controller == "scheduled" else (20, 30, 10)
    one = bench(controller=controller, gains=gains)
    (rehearsed,), (run,) = one.rehearse(), one.runs([tmp_path / "run.nc"])
    assert run.status == "finished"
    for name in ("tank.x", "tank.push.command"):
        np.testing.assert_array_equal(rehearsed[name].values, run.data[name].values)
    loop = one.loops["tank.push"]
    found = RobotLoop(SampledPlant(ROBOT, "push", "body.position", DT)).run(loop.controller, loop.reference)
    np.testing.assert_allclose(run.data["tank.x"].values, found.output, atol=1e-9)


def test_learning_goes_on_from_run_to_run_on_a_rig_that_is_heavier(tmp_path):
    """What its feedforward lacks is learned there, to less than half of the error; the rehearsal learns too."""
    reference = eased(wave("sine", 5.0, DT, amplitude=0.05, frequency=0.4), 1.5, DT)
    task = ControlTask.parse(
        ROBOT, command="push=-2..2N", measure="body.position", reference=reference, rate=1 / DT,
        gains=(20, 30, 10), controller="ilc", rounds=4,
    )  # fmt: skip
    law = task.find_law(5.0)
    assert law is not None
    one = robot_bench([task], [law], 5.0, rig(with_values(ROBOT, {"m": 2.6})), LIMITS, [PAIR])
    runs = [*one.runs([tmp_path / f"{k}.nc" for k in range(4)])]
    assert [run.status for run in runs] == ["finished"] * 4
    errors = [rms_error(*tracked(run.data, "tank.x")) for run in runs]
    assert all(later < before for before, later in pairwise(errors)) and errors[-1] < 0.5 * errors[0]
    assert len(one.rehearse(2)) == 2


def test_a_rig_that_is_heavier_than_the_model_has_other_errors(tmp_path):
    one = bench(rig(with_values(ROBOT, {"m": 4.0}), noise="0.1 mm"))
    (rehearsed,), (run,) = one.rehearse(), one.runs([tmp_path / "run.nc"])
    (on_model, reference), (on_rig, same) = (tracked(data, "tank.x") for data in (rehearsed, run.data))
    np.testing.assert_array_equal(reference, same)
    assert run.status == "finished" and 5e-3 < np.abs(on_rig - on_model).max() < 0.05
    assert on_rig.max() > on_model.max() + 5e-3  # it overshoots further


@pytest.mark.parametrize(
    ("follows", "on_model"), [(None, None), ("tank.push", "tank.push"), ("none", "none"), ("tank.x", "none")]
)
def test_on_the_model_a_measurement_follows_no_command_that_it_lacks(follows, on_model):
    """It would count as frozen when another one moves."""
    limits = replace(LIMITS, measurements={"tank.x": MeasurementLimits(-0.5, 0.5, error=0.2, follows=follows)})
    one = replace(bench(), limits=limits)
    assert one._limits_of(one.model).measurements["tank.x"].follows == on_model


def test_what_the_guards_would_end_on_the_model_does_not_begin():
    """It overshoots 0.1 m by far with these gains, and 0.12 m are allowed."""
    narrow = replace(LIMITS, measurements={"tank.x": MeasurementLimits(-0.12, 0.12, error=0.2)})
    on = rig()
    with pytest.raises(
        InputError, match=r"on the model it would end, nothing was moved: at 0\.\d+ s the measurement tank.x"
    ):
        bench(on, narrow, gains=(60, 200, 0)).rehearse()
    assert on.now() == 0.0 and not on.commanded


def test_a_measurement_that_goes_out_of_its_range_on_the_rig_only_ends_that_run(tmp_path):
    one = bench(rig(range="-80..80 mm"))
    one.rehearse()
    (run,) = one.runs([tmp_path / "run.nc"])
    assert run.status == "aborted" and "tank.x is nan" in run.reason


def test_a_sine_begins_at_the_start_of_the_model_and_its_slew_limit_is_the_rig_s(tmp_path):
    slow = replace(LIMITS, commands={"tank.push": CommandLimits(-3.0, 3.0, 2.0)}, saturated_time=10.0)
    one = bench(limits=slow, reference="sine", amplitude="50 mm", frequency="1 Hz", gains=(60, 100, 20))
    np.testing.assert_allclose(
        one.loops["tank.push"].reference, wave("sine", 2.0, DT, amplitude=0.05, frequency=1.0), atol=1e-12
    )
    (run,) = one.runs([tmp_path / "run.nc"])
    steps = np.abs(np.diff(run.data["tank.push.command"].values))
    assert steps.max() == pytest.approx(2.0 * DT)
    assert int(run.data.attrs["slowed"]) == 0  # the controller keeps to it by itself


def test_two_loops_at_once(tmp_path):
    """Of two slides, one on the other: each on its own reference, on the model as on the rig."""
    robot = parse_robot(SLIDE.partition("aliases")[0] + TOP)
    limits = ActuatorLimits(-3.0, 3.0, 200.0)
    pid, k = pid_of([20.0, 30.0, 10.0], 0.05, limits), np.arange(60)
    loops = {"p": Loop("x", pid, np.where(k, 0.1, 0.0)), "q": Loop("y", pid, -0.05 * np.sin(0.1 * k))}
    sensors = {"x": ReadingSensor("body.position"), "y": ReadingSensor("top.position")}
    commands = {"p": "body.joint.force.value", "q": "limbs.top.joint.force.value"}
    models = [SimulatedRobot(robot, commands, sensors, DT) for _ in range(2)]
    own = CommandLimits(-3.0, 3.0, 200.0)
    guards = Limits({"p": own, "q": own}, {name: MeasurementLimits(-0.5, 0.5, error=0.2) for name in "xy"})
    one = Bench(models[0], guards, DT, loops, "both", models[1])
    (rehearsed,), (run,) = one.rehearse(), one.runs([tmp_path / "run.nc"])
    for name in "xy":
        np.testing.assert_array_equal(rehearsed[name].values, run.data[name].values)
        measured, reference = tracked(run.data, name)
        assert np.abs(measured - reference)[-20:].max() < 0.02
    assert run.status == "finished"


TOP = """
limbs:
  top:
    on: body
    kind: rigid
    shape: point
    mass: 1 kg
    volume: 0 m3
    joint: {kind: prismatic, axis: x, stiffness: 5 N/m, damping: 4 N s/m, force: {kind: constant, value: 0 N}}
"""


def test_a_mean_over_the_beat_is_taken_of_the_samples(tmp_path):
    """An arm shakes the slide by 13 mm at 2 Hz; the mean of ten samples is led as `RobotLoop` leads it."""
    robot = parse_robot(SHAKEN)
    given = {"command": "push=-2..2N", "measure": "body.position", "reference": "5 cm", "gains": (10, 20, 4)}
    task = ControlTask.parse(robot, **given, rate=20.0, mean=True)
    law = task.find_law(6.0)
    assert law is not None
    one = robot_bench([task], [law], 6.0, rig(robot), LIMITS, [PAIR])
    (rehearsed,), (run,) = one.rehearse(), one.runs([tmp_path / "run.nc"])
    np.testing.assert_array_equal(rehearsed["tank.x"].values, run.data["tank.x"].values)
    exact = task.loop.run(law.controller, one.loops["tank.push"].reference)
    x, push = run.data["tank.x"].values, run.data["tank.push.command"].values
    assert np.ptp(x[-10:]) > 0.01
    np.testing.assert_allclose(push, exact.command, atol=0.02)
    assert np.ptp(push) > 0.5


@pytest.mark.parametrize(
    ("given", "field", "message"),
    [
        ({"measure": "velocity.x", "reference": "0.1 m/s"}, "measure", "velocity.x of the robot is in m/s, and tank.x"),
        ({"command": "push=-5..5N"}, "command push", "-5 N to 5 N is beyond the limits of the rig"),
        ({"command": "m=1..3kg"}, "command", "m of the robot is in kg, and tank.push of the rig in N"),
    ],
)  # fmt: skip
def test_other_quantities_and_wider_ranges_are_refused(given, field, message):
    with pytest.raises(InputError) as told:
        bench(**given)
    assert told.value.field == field and told.value.message.startswith(message)
