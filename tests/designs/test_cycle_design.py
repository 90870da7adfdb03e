"""Designs of motions that repeat themselves, against a driven oscillator's transfer function."""

from dataclasses import replace

import numpy as np
import pytest
from tests.small_robots import DRIVEN, M0, I

from nectosome.description import load_robot, parse_robot, with_values
from nectosome.description.variables import read_variable
from nectosome.designs import QUANTITIES, Limit, MotionDesign, read_constraint
from nectosome.designs.quantities import AT_REST
from nectosome.model import build
from nectosome.robots import describe
from nectosome.robots.shipped import starter_of
from nectosome.search import Gradient
from nectosome.search.evaluations import Recorder
from nectosome.solve import periodic
from nectosome.units import InputError

RANGES = {"c": "0.05 N m s/rad .. 0.4 N m s/rad log", "f": "0.6 Hz .. 1.6 Hz", "k": "0.5 N m/rad .. 2 N m/rad"}


def power(x):
    """Mean power c |v|^2 / 2 of the oscillator."""
    c, f, k = x
    w = 2 * np.pi * f
    return 0.5 * c * abs(1j * w * M0 / (k - I * w**2 + 1j * c * w)) ** 2


@pytest.fixture(scope="module")
def oscillator():
    """The task to take as little power as may be, and at least 4 mW; and its compiled evaluation."""
    robot = with_values(parse_robot(DRIVEN), {"c": 0.1})
    variables = tuple(read_variable(name, text, robot) for name, text in RANGES.items())
    task = MotionDesign(robot, variables, "power", (read_constraint("power >= 4 mW"),))
    return task, task.prepare()


def test_power_and_its_slopes_are_those_of_the_transfer_function(oscillator):
    """The period changes with the frequency."""
    task, evaluate = oscillator
    for u in np.random.default_rng(0).uniform(size=(3, 3)):
        e = evaluate(u, True, None)
        assert e.objective == pytest.approx(power(task.box.values(u)), rel=2e-5)
        expected = [(power(task.box.values(u + h)) - power(task.box.values(u - h))) / 2e-5 for h in 1e-5 * np.eye(3)]
        np.testing.assert_allclose(e.gradient, expected, rtol=1e-4, atol=1e-4 * np.abs(expected).max())
        assert e.outputs["speed"] == 0
        assert task.accepts(e) in ("", "power >= 0.004 W is not kept")


def test_the_limit_is_reached_between_grid_points(oscillator):
    task, evaluate = oscillator
    recorder = Recorder(task, evaluate)
    assert recorder.drive(Gradient().search(task.space, np.array([0.5, 0.6, 0.4]), 1)).converged
    best = recorder.evaluations[-1]
    assert power(task.box.values(best.u)) == pytest.approx(4e-3, rel=5e-5)


def test_what_a_motion_does_not_have_is_no_number(oscillator):
    task, _ = oscillator
    evaluation = replace(task, objective="efficiency").prepare()(np.full(3, 0.5), False, None)
    assert evaluation.reason == "efficiency is not defined for this motion"
    assert np.isnan(evaluation.objective)


ARM = """
name: arm
body:
  kind: rod
  section: circle
  length: 0.2 m
  radius: 8 mm
  young: 0.3 MPa
  density: 1000 kg/m3
  strains: {bending_z: 1}
  loads:
    drag: {kind: drag, normal: 1.2}
    left: {kind: tendon, place: [6 mm, 0 m], tension: {kind: sine, amplitude: 1 N, offset: 1.5 N, frequency: 1 Hz}}
    right: {kind: tendon, place: [-6 mm, 0 m], tension: {kind: constant, value: 1 N}}
    bellows:
      kind: chamber
      place: [0 m, 0 m]
      area: 10 mm2
      pressure: {kind: sine, amplitude: 20 kPa, frequency: 1 Hz}
aliases:
  pull: [body.loads.left.tension.amplitude]
  blow: [body.loads.bellows.pressure.amplitude]
"""


@pytest.mark.slow
def test_tension_and_pressure_are_the_peaks_of_their_signals():
    """Offset and amplitude together, with a derivative of 1 by each; of two tendons the larger one."""
    robot = parse_robot(ARM)
    ranges = {"pull": "0.5 N .. 1.4 N", "blow": "10 kPa .. 40 kPa"}
    variables = tuple(read_variable(name, text, robot) for name, text in ranges.items())
    limits = (read_constraint("tension <= 2 N"), read_constraint("pressure <= 30 kPa"))
    found = MotionDesign(robot, variables, "power", limits).prepare()(np.array([0.5, 0.5]), True, None)
    tension, pressure = 1.5 + 0.95, 25e3
    np.testing.assert_allclose(found.constraints, [tension / 2 - 1, pressure / 30e3 - 1], rtol=1e-3)
    np.testing.assert_allclose(found.jacobian, [[0.9 / 2, 0], [0, 30 / 30]], rtol=1e-3, atol=1e-9)


def test_one_frequency_of_two_is_no_variable():
    robot = describe("beetle1")
    one = "limbs.left1_arm.joint.motion.frequency"
    task = MotionDesign(robot, (read_variable(one, "0.5 Hz .. 1 Hz", robot),))
    with pytest.raises(InputError, match="common period of the drives by leaps"):
        task.plan()


@pytest.mark.parametrize(
    ("settings", "name", "text", "jumps"),
    [
        ([], "forward_share", "0.3 .. 0.7", True),
        (["limbs.arm.joint.motion.forward_share=0.4"], "phase", "0 deg .. 90 deg", True),
        ([], "phase", "0 deg .. 90 deg", False),
        (["limbs.arm.joint.motion.forward_share=0.4"], "amplitude", "40 deg .. 70 deg", False),
    ],
)
def test_no_slopes_are_made_up_where_jumps_of_a_stroke_move(settings, name, text, jumps, monkeypatch):
    robot = describe("paddle", settings)
    variable = read_variable(f"limbs.arm.joint.motion.{name}", text, robot)
    evaluate = MotionDesign(robot, (variable,), "thrust").prepare()

    def asked(*_):
        raise LookupError("asked for a program")

    monkeypatch.setattr("nectosome.designs.motion.remembered", asked)
    refused = pytest.raises(InputError, match="derivatives are not exact")
    with refused if jumps else pytest.raises(LookupError, match="asked for a program"):
        evaluate(np.array([0.5]), True, None)


@pytest.mark.slow
def test_quantities_of_the_paddle_are_those_of_its_cycle():
    robot = describe("paddle", ["N=1", "A=60deg", "f=0.9Hz"])
    of_others = {"efficiency", "energy_per_metre", "endurance", "range", "tension", "pressure", "tail_amplitude"}
    of_others |= {"current", "electrical_power", "battery_power", "strouhal", "slip", "froude_efficiency"}
    names = tuple(
        x
        for x in QUANTITIES
        if x not in {"voltage_demand", *of_others, *AT_REST} and not x.startswith("cost_of_transport")
    )
    limits = tuple(Limit(name, True, 1.0) for name in names)  # a limit of 1 tells the quantity: excess + 1
    variable = read_variable("A", "40 deg .. 70 deg", robot)
    task = MotionDesign(robot, (variable,), "thrust", limits, "-y")
    u = task.box.design(robot)
    got = dict(zip(names, task.prepare()(u, False, None).constraints + 1, strict=True))
    means = periodic(build(robot), 1 / 0.9, samples=257).means()
    want = {
        "thrust": -float(means.force[1]),
        "power": float(means.power),
        "torque": float(means.reaction_peak[3]),
        "drive_rate": np.radians(60) * 2 * np.pi * 0.9,
        "stress": float(np.nanmax(means.hinge_stress_peak)),
        "speed": 0.0,
        **dict.fromkeys(("forward_speed", "body_lengths_per_second", "stride_length"), 0.0),
    }
    for name, value in want.items():
        assert got[name] == pytest.approx(value, rel=1e-3), name


@pytest.mark.slow
def test_a_swimmer_that_is_free_in_the_plane_has_derivatives():
    """Its place changes nothing, but for rounding: slopes by it need no small steps. Power by central differences."""
    robot = load_robot(starter_of("tail"))
    ranges = {"E": "0.5 MPa .. 2 MPa log", "L": "150 mm .. 250 mm"}
    task = MotionDesign(robot, tuple(read_variable(name, text, robot) for name, text in ranges.items()), "power")
    evaluate, u, h = task.prepare(), np.array([0.4, 0.6]), 0.02
    found = evaluate(u, True, None)
    steps = [[evaluate(u + s * d, False, found.memory).objective for s in (h, -h)] for d in np.eye(2)]
    np.testing.assert_allclose(found.gradient, [(a - b) / (2 * h) for a, b in steps], rtol=5e-3)
    # it goes where its body points on the mean, whatever its heading
    cycle = periodic(build(task.robot_at(u)), 1 / 1.5)
    assert found.outputs["speed"] == pytest.approx(float(cycle.means().speed), rel=1e-4)
    turned = found.memory + np.eye(found.memory.size)[2]
    assert evaluate(u, False, turned).outputs["speed"] == pytest.approx(found.outputs["speed"], rel=1e-5)
