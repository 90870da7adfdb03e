"""What the studio answers for a robot: the motion it keeps, or what it does at first where it keeps none."""

import numpy as np
import pytest
from tests.small_robots import WHEEL

import nectosome as ns
from nectosome import solve
from nectosome.description import parse_robot
from nectosome.solve import periodic
from nectosome.studio.answers import AnswerSolver
from nectosome.units import InputError

G = 9.80665  # m/s2, as the water has it by default
BALL = """
name: ball
body:
  kind: rigid
  shape: point
  mass: 2 kg
  volume: 0 m3
  joint: {{kind: prismatic, axis: z{spring}}}
"""

PUSHED = """
name: pushed
water: {density: 1000 kg/m3, gravity: 0 m/s2}
body:
  kind: rigid
  shape: point
  mass: 2 kg
  volume: 0 m3
  joint: {kind: prismatic, axis: x}
  loads:
    push: {kind: force, force: [4 N, 0 N, 0 N], frame: world}
    drag: {kind: lumped_drag, drag_area: [5 cm2, 0 m2, 0 m2]}
limbs:
  hub:
    on: body
    kind: rigid
    shape: point
    mass: 1 kg
    volume: 0 m3
    joint: {kind: revolute, axis: x, motion: {kind: rate, rate: 5 rad/s}}
"""


SERVO = """
name: servo
water: {density: 1000 kg/m3, gravity: 0 m/s2}
body:
  kind: rigid
  shape: point
  mass: 2 kg
  volume: 0 m3
  joint: {kind: prismatic, axis: y, stiffness: 50 N/m, damping: 5 N s/m}
limbs:
  arm:
    on: body
    kind: rigid
    shape: cylinder
    length: 100 mm
    radius: 5 mm
    mass: 0.1 kg
    joint:
      kind: revolute
      axis: z
      motion: {kind: sine, amplitude: 30 deg, frequency: 2 Hz}
      limits: {torque: 5 N m, speed: 60 rpm}
"""


def test_what_falls_is_seen_falling():
    """Half of g t^2 down, g t/2 on the mean; nothing else is told, as it is no cycle."""
    answer = AnswerSolver()(parse_robot(BALL.format(spring="")))
    run, t = answer.run, answer.run["time"].values
    assert t[-1] == 5.0
    np.testing.assert_allclose(run["position"].values[:, 0, 2], -0.5 * G * t**2, rtol=1e-6, atol=1e-9)
    assert answer.kind == "the first 5 s"
    assert answer.numbers == {"speed": pytest.approx(0.5 * G * 5, rel=1e-6)}
    assert answer.warning.startswith("no equilibrium found.")
    assert answer.period == 0


def test_what_hangs_on_a_spring_is_at_rest():
    answer = AnswerSolver()(parse_robot(BALL.format(spring=", stiffness: 20 N/m, damping: 1 N s/m")))
    assert (answer.kind, answer.warning, answer.numbers) == ("at rest", "", {})
    np.testing.assert_allclose(answer.run["position"].values[:, 0, 2], -2 * G / 20, rtol=1e-6)


def test_what_is_pushed_while_something_turns_on_it_is_told_over_one_turn():
    """F = rho A v^2/2; nothing brakes the hub, so that it takes no power."""
    robot = parse_robot(PUSHED)
    speed = np.sqrt(2 * 4.0 / (1000 * 5e-4))  # m/s
    solver = AnswerSolver()
    for answer in (solver(robot), solver(robot)):  # from rest, and from the last answer
        assert (answer.kind, answer.warning) == ("steady motion", "")
        assert answer.period == pytest.approx(2 * np.pi / 5)
        assert answer.numbers["speed"] == pytest.approx(speed, rel=1e-9)
        assert answer.numbers["power"] == pytest.approx(0, abs=1e-9)
        place = answer.run["position"].values[:, 0, 0]
        np.testing.assert_allclose(np.diff(place), speed * answer.period / 64, rtol=1e-9)


def test_speed_counts_along_what_is_forward_where_that_is_said():
    robot = parse_robot(PUSHED)
    along, against, across = (AnswerSolver(forward)(robot).numbers["speed"] for forward in ("x", "-x", "y"))
    assert along == pytest.approx(np.sqrt(2 * 4.0 / (1000 * 5e-4)), rel=1e-9)
    assert (against, across) == (pytest.approx(-along), pytest.approx(0, abs=1e-12))


def test_what_a_servo_cannot_do_is_told_and_numbers_are_those_of_the_command():
    answer, found = AnswerSolver()(parse_robot(SERVO)), periodic(ns.build(parse_robot(SERVO)), 0.5, samples=257)
    assert answer.kind == "periodic motion"
    assert answer.run.sizes["time"] == 65
    assert answer.numbers["power"] == pytest.approx(float(found.means().power), rel=1e-9)
    assert answer.warning == "the servo of arm.angle would exceed its limit of speed."


def test_a_servo_that_is_too_slow_for_its_motion_is_told():
    """30 deg at 2 Hz need 6.6 rad/s; without a load this motor has 3."""
    motor = "rated_voltage: 6 V, stall_torque: 5 N m, no_load_speed: 3 rad/s, inertia: 1e-3 kg m2"
    servo = f"servo: {{{motor}, supply: 6 V, full_voltage_at: 5 deg}}"
    answer = AnswerSolver()(parse_robot(SERVO.replace("limits: {torque: 5 N m, speed: 60 rpm}", servo)))
    assert answer.kind == "periodic motion"
    assert answer.warning.startswith("the servo of arm.angle cannot follow its motion: its tracking error is up to ")


def test_a_cycle_is_looked_for_from_the_last_one_and_is_the_one_from_rest(monkeypatch):
    guesses = []

    def told(*args, guess, **options):
        guesses.append(guess)
        return periodic(*args, guess=guess, **options)

    monkeypatch.setattr(solve, "periodic", told)
    solver, stiffer = AnswerSolver(), parse_robot(SERVO.replace("50 N/m", "51 N/m"))
    first = solver(parse_robot(SERVO))
    continued, alone = solver(stiffer), AnswerSolver()(stiffer)
    assert continued.numbers == pytest.approx(alone.numbers, rel=1e-5, abs=1e-9, nan_ok=True)
    assert guesses[0] is guesses[2] is None
    np.testing.assert_allclose(guesses[1].q, first.run["q"].values[0], atol=1e-12)


def test_a_motor_that_turns_round_is_shown_over_one_turn():
    wheel = parse_robot(WHEEL)
    answer, found = AnswerSolver()(wheel), periodic(wheel)
    assert answer.kind == "periodic motion"
    assert answer.period == pytest.approx(float(found.stats["period"]), rel=1e-6)


def test_what_never_repeats_itself_is_seen_beginning_unless_it_did_before():
    """A push that nothing brakes, over the swings of an arm: (F/m) t/2 on the mean, and what the arm throws it."""
    free = "joint: {kind: prismatic, axis: y}\n  loads: {push: {kind: force, force: [0 N, 21 N, 0 N], frame: world}}"
    runaway = parse_robot(SERVO.replace("joint: {kind: prismatic, axis: y, stiffness: 50 N/m, damping: 5 N s/m}", free))
    solver = AnswerSolver()
    for answer in (solver(runaway), solver(runaway)):
        assert answer.kind == "the first 5 s"
        assert answer.warning.startswith("no periodic motion found.")
        assert answer.numbers == {"speed": pytest.approx(0.5 * 21 / 2.1 * 5, rel=0.01)}
    solver = AnswerSolver()
    assert solver(parse_robot(SERVO)).kind == "periodic motion"
    with pytest.raises(InputError, match="no periodic motion found"):
        solver(runaway)


def test_what_cannot_move_is_refused():
    still = BALL.format(spring="").replace("  joint: {kind: prismatic, axis: z}\n", "")
    with pytest.raises(InputError, match="free to move"):
        AnswerSolver()(parse_robot(still))
