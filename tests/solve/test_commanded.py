"""Robots whose command is held from sample to sample: what goes on, what is read, what is refused."""

import numpy as np
import pytest

from nectosome.core import Status
from nectosome.description import parse_robot, with_values
from nectosome.description.robot_file import Samples, with_recordings
from nectosome.description.variables import read_variable
from nectosome.model import build
from nectosome.robots import describe
from nectosome.solve import PlantBatch, SampledPlant, simulate
from nectosome.solve.readings import reading, reading_of
from nectosome.units import InputError

MASS, WEIGHT, FORCE, SWING, ARM, DT = 2.0, 0.5, 3.0, 0.5, 0.1, 0.37
# a slide that a force shakes, and a weight on it that is made to turn to and fro; `f` is the frequency of both
WAGGING = parse_robot(f"""
name: wagging
water: {{gravity: 0 m/s2}}
body:
  kind: rigid
  shape: point
  mass: {MASS} kg
  volume: 0 m3
  inertia: [1 kg m2, 1 kg m2, 1 kg m2]
  joint:
    kind: prismatic
    axis: x
    force: {{kind: sine, amplitude: {FORCE} N, frequency: 1.3 Hz, phase: 0.4 rad}}
limbs:
  arm:
    on: body
    kind: rigid
    shape: point
    mass: {WEIGHT} kg
    volume: 0 m3
    joint: {{kind: revolute, axis: z, motion: {{kind: sine, amplitude: {SWING} rad, frequency: 1.3 Hz}}}}
  tip: {{on: arm, offset: [{ARM} m, 0 m, 0 m], kind: rigid, shape: point, mass: 0 kg, volume: 0 m3}}
aliases:
  f: [body.joint.force.frequency, limbs.arm.joint.motion.frequency]
""")


@pytest.fixture(scope="module")
def wagged():
    """Frequencies, and what was seen under them."""
    robot = SampledPlant(WAGGING, "f", "body.position.rate", DT, instants=40, rtol=1e-9, atol=1e-10)
    state, first = robot.start()
    held, commands = [first], (1.3, 2.1, 0.7, 0.7)
    for command in commands:
        state, one, status = robot.hold(state, command)
        assert status == Status.SOLVED and one is not None
        held.append(one)
    return robot, commands, held


def turned(commands) -> np.ndarray:
    """Turns that have passed at each moment."""
    rates = np.repeat(commands, 40)
    return np.append(0.0, np.cumsum(rates * DT / 40))


def test_a_drive_goes_on_where_it_is_when_its_frequency_changes(wagged):
    """(m + w) dv/dt = F sin(phi + 2 pi turns): within a sample v goes with the cosine."""
    _, commands, held = wagged
    angle = 0.4 + 2 * np.pi * turned(commands)
    rates = 2 * np.pi * np.repeat(commands, 40)
    exact = np.append(0.0, np.cumsum(FORCE / (MASS + WEIGHT) * (np.cos(angle[:-1]) - np.cos(angle[1:])) / rates))
    np.testing.assert_allclose(np.concatenate([one.reading for one in held]), exact, atol=1e-7)


def test_a_motion_goes_over_within_a_sample(wagged):
    """At the end of each sample it is where the turns so far say; no acceleration jumps where samples meet.

    Left to itself the velocity would jump there by 2.5 rad/s, and the acceleration, by moments, by its largest value.
    """
    robot, commands, held = wagged
    position = np.concatenate([one.position for one in held])
    hand = position[:, robot.parts.index("tip")] - position[:, robot.parts.index("arm")]
    angle = np.arctan2(hand[:, 1], hand[:, 0])
    ends = SWING * np.sin(2 * np.pi * turned(commands)[::40])
    np.testing.assert_allclose(angle[::40], ends, atol=1e-9)
    acceleration = np.diff(angle, 2)
    jumps = [abs(acceleration[40 * k] - acceleration[40 * k - 1]) for k in (1, 2, 3)]
    assert max(jumps) < 0.3 * np.abs(acceleration).max()


def test_the_program_does_not_know_the_command(wagged, monkeypatch):
    """Whatever is commanded, and whenever, nothing is compiled anew."""
    from nectosome.core.programs import remember

    monkeypatch.setattr(remember, "_program", lambda *_: pytest.fail("compiled anew"))
    state, _ = wagged[0].start()
    for command in (0.5, 3.0):
        state, *_ = wagged[0].hold(state, command)
    assert state.sample == 2


@pytest.mark.parametrize(
    ("command", "reading", "message"),
    [
        ("freq", "velocity.x", 'there is no quantity called "freq" in wagging'),
        ("body.joint.position", "velocity.x", "body.joint.position: says how the robot starts"),
        ("f", "heeding", '"heeding" is nothing that can be measured. Did you mean "heading"?'),
        ("f", "depth", '"depth" needs a surface of the water, and there is none. Measure position.z.'),
    ],
)
def test_what_makes_no_sense_is_refused(command, reading, message):
    with pytest.raises(InputError) as told:
        SampledPlant(WAGGING, command, reading, DT)
    assert str(told.value).startswith(message)


def test_all_that_can_be_read_is_named_once():
    """Of the eel: places of its body, its joint's angle, and its strains, with their kinds."""
    eel = build(describe("eel"))
    expected = {
        "heading": "angle",
        "body.position.z": "length",
        "body.angle": "angle",
        "body.angle.rate": "angular_speed",
    }
    assert {name: reading_of(eel, name).dimension for name in expected} == expected
    assert reading_of(eel, "body.bending_z.2").dimension == "angle"  # curvature times length
    assert reading_of(eel, "heading").turns and not reading_of(eel, "body.angle").turns


PULLED = parse_robot("""
name: pulled
water: {gravity: 0 m/s2}
body:
  kind: rigid
  shape: point
  mass: 2 kg
  volume: 0 m3
  joint: {kind: prismatic, axis: x, stiffness: 5 N/m, damping: 1 N s/m, force: {kind: constant, value: 0 N}}
limbs:
  arm:
    on: body
    kind: rigid
    shape: point
    mass: 0.5 kg
    inertia: [0.01 kg m2, 0.01 kg m2, 0.01 kg m2]
    centre_of_mass: [0 m, 0.2 m, 0 m]
    volume: 0 m3
    joint:
      kind: revolute
      axis: z
      stiffness: 0.3 N m/rad
      damping: 0.02 N m s/rad
      torque: {kind: constant, value: 0 N m}
""")


def test_two_commands_and_readings_are_those_of_one_simulation_with_both_recorded():
    """Each held for 0.1 s; recorded as stairs whose steps take 1 ns. The arm swings, and shakes its slide."""
    dt, rng = 0.1, np.random.default_rng(3)
    commands = np.stack([rng.uniform(-3, 3, 20), rng.uniform(-0.3, 0.3, 20)], axis=1)
    names = "body.joint.force.value", "limbs.arm.joint.torque.value"
    plant = SampledPlant(PULLED, names, ("arm.angle", "body.position", "arm.heading"), dt, 1, 1e-9, 1e-11)
    state, first = plant.start()
    seen = [first.readings[0]]
    for row in commands:
        state, interval, status = plant.hold(state, *row)
        assert status == Status.SOLVED and interval is not None and interval.readings.shape == (1, 3)
        seen.append(state.readings)
    stairs = np.repeat(dt * np.arange(21), 2)[1:-1] - np.tile([0.0, 1e-9], 20)
    drives = zip(("body.joint.force", "limbs.arm.joint.torque"), commands.T, ("N", "N m"), strict=True)
    played = with_recordings(PULLED, {path: Samples(stairs, np.repeat(u, 2), unit) for path, u, unit in drives})
    run = simulate(played, 20 * dt, samples=21, method="implicit", rtol=1e-9, atol=1e-11)
    expected = np.stack([reading(run, name) for name in ("arm.angle", "body.position", "arm.heading")], axis=1)
    assert np.ptp(expected[:, 0]) > 0.5
    np.testing.assert_allclose(seen, expected, atol=1e-6)
    with pytest.raises(ValueError, match="zip"):
        plant.hold(state, 1.0)


def test_what_two_commands_would_both_set_is_refused():
    """The phase takes up the jumps of its frequency."""
    for commands, message in (
        (("f", "body.joint.force.frequency"), "body.joint.force.frequency: is set by two commands"),
        (("f", "body.joint.force.phase"), "body.joint.force.phase takes up its jumps"),
    ):
        with pytest.raises(InputError, match=message):
            SampledPlant(WAGGING, commands, "heading", DT)


@pytest.mark.parametrize("together", [False, True])
def test_copies_that_draw_masses_move_as_plants_of_their_own(together):
    """The motion commanded is prescribed; what stays of each copy's robot is worked out once, when it starts."""
    mass = read_variable("body.mass", "1..4 kg", WAGGING)
    batch = PlantBatch(SampledPlant(WAGGING, "f", "body.position.rate", DT, drawn=[mass], rtol=1e-9), together)
    some = batch.start(np.array([[MASS], [3.1]]))
    assert some.parts.shape[1] > 20
    robots = [with_values(WAGGING, {"body.mass": m}) for m in (MASS, 3.1)]
    plants = [SampledPlant(robot, "f", "body.position.rate", DT, rtol=1e-9) for robot in robots]
    alone = [plant.start()[0] for plant in plants]
    for f in (1.3, 2.1, 0.7):
        some, _ = batch.hold(some, np.full((2, 1), f))
        alone = [plant.hold(state, f)[0] for plant, state in zip(plants, alone, strict=True)]
        found = np.asarray(some.moving.readings)[:, 0]
        np.testing.assert_allclose(found, [state.reading for state in alone], atol=1e-12)
        np.testing.assert_allclose(some.moving.speed, np.abs(found), atol=1e-12)
    assert abs(found[0] - found[1]) > 0.01
