# ruff: noqa: E501  (tables: one case a line)
"""Missions: events where closed forms put them, whatever the steps; ramps, orders of modes, reasons; mistakes in files."""

import numpy as np
import pytest
from tests.small_robots import SUB

from nectosome.description import parse_robot
from nectosome.description.mission import load_mission, parse_mission
from nectosome.robots import describe, mission_of
from nectosome.solve import mission_data, run_mission
from nectosome.units import InputError

G = 9.80665
SWIM = "{name: swim, set: {jet: 1 rad/s}, until: high_wall}"
SINK = "{name: sink, set: {jet: 0 rad/s, volume: 1.9 L}, until: position.z < 10 cm}"
RISE = "{name: rise, set: {volume: 2.1 L}, until: [20 s, surface]}"


BEGIN = "{name: begin, set: {jet: 0 rad/s, volume: 2 L}, until: 0 s}"  # so that all set the same: one program


def flown(*modes, robot=SUB, step=5e-3):
    modes = (BEGIN, *modes) if robot is SUB else modes
    return run_mission(parse_mission(f"modes: [{', '.join(modes)}]", robot), step=step)


def test_a_constant_thrust_comes_to_the_wall_after_sqrt_2_m_d_over_f():
    """70 cm with 1 N on 2 kg."""
    assert flown(SWIM).event_time("swim") == pytest.approx(np.sqrt(2 * 2 * 0.7), abs=1e-8)


def test_thrust_goes_with_the_square_of_a_speed_that_is_ramped():
    """F = (t/2 s)^2, so x = t^4/96 of 2 kg; the ramp goes on in the next mode."""
    run = flown("{name: a, set: {jet: 1 rad/s in 2 s}, until: 1.2345 s}", "{name: b, until: position.x > 0.3 m}")
    assert run.event_time("a") == pytest.approx(1.2345, abs=1e-12)
    assert run.event_time("b") == pytest.approx(9.6**0.25, abs=1e-6)
    assert mission_data(run)["quantity_value"].values[-1, 0] == pytest.approx(9.6**0.25 / 2, abs=1e-6)


def test_it_sinks_at_the_speed_where_drag_carries_its_weight():
    """100 mL too little: 0.1 kg g = 100 kg/m V^2, and z = (m/100) ln cosh(100 V t/m) from rest."""
    speed = np.sqrt(0.1 * G / 100)
    run = flown(SINK)
    assert run.measures.velocity[-1, 2] == pytest.approx(-speed, rel=1e-5)
    assert run.event_time("sink") == pytest.approx(np.arccosh(np.exp(0.4 / 0.02)) * 0.02 / speed, abs=1e-6)


def test_modes_may_be_put_in_another_order():
    """What is across does not depend on what is up and down, so that each mode takes as long wherever it stands."""
    one, other = flown(SWIM, SINK, RISE), flown(SINK, SWIM.replace("1 rad/s", "1 rad/s, volume: 2 L"), RISE)
    assert [p[:2] for p in other.passed[1:]] == [
        ("sink", "position.z < 10 cm"),
        ("swim", "high_wall"),
        ("rise", "surface"),
    ]
    swam, sunk = (p.time for p in one.passed[1:3])
    assert [p.time for p in other.passed[1:3]] == pytest.approx([sunk - swam, sunk], abs=1e-6)


def test_a_mission_that_cannot_come_to_its_event_says_so():
    run = flown("{name: wait, until: [surface, position.x > 0.9 m], longest: 2 s}", SWIM)
    awaited = "without coming to surface or position.x > 0.9 m"
    assert run.reason == f"wait took longer than 2 s {awaited}, and stands still"
    pushed = flown("{name: go, set: {jet: 0.1 rad/s}, until: position.x > 0.9 m, longest: 2 s}")
    assert pushed.reason == "go took longer than 2 s without coming to position.x > 0.9 m"
    assert ([p.mode for p in run.passed], run.time[-1]) == (["begin"], 2.0)
    assert mission_data(run).attrs["status"] == "STOPPED"


def test_a_motion_that_breaks_off_is_told():
    run = flown("{name: crash, set: {jet: 1e200 rad/s}, until: 5 s}")
    assert run.reason.startswith("the motion broke off in crash at ")
    assert np.all(np.isfinite(run.measures.position))


def test_a_wall_that_is_too_soft_to_hold_is_told():
    """100 N on 500 N/m are 200 mm, twice the hull's reach; 1 N is 2 mm."""
    push = "{name: push, set: {jet: JET in 2 s}, until: 4 s}"
    hard, soft = (flown(SWIM, push.replace("JET", jet)) for jet in ("1 rad/s", "10 rad/s"))
    assert "soft_contacts" not in mission_data(hard).attrs
    assert soft.measures.depths[-1] == pytest.approx([2.0], rel=1e-4)
    told = mission_data(soft).attrs["soft_contacts"]
    assert told.startswith("hull: body is in a wall by 2 times its reach at ")
    assert told.endswith("The contact is too soft to hold it: raise body.loads.hull.stiffness.")


def test_what_stands_already_ends_its_mode_at_once():
    assert flown("{name: there, until: position.x < 0.3 m}", SWIM).event_time("there") == 0.0


@pytest.fixture(scope="module")
def dives():
    """PoseiDRONE let down near the floor, five steps, up again: with steps of 2 ms and of half as much."""
    robot = describe("poseidrone", ["body.joint.start.position.2=0.2 m", "volume=0.65 L"])
    modes = (
        "{name: dive, set: {volume: 0.609855 L in 1 s}, until: touchdown}",
        "{name: crawl, set: {legs: 12.4602 rad/s in 0.5 s}, until: 2.5 s}",
        "{name: inflate, set: {legs: 0 rad/s in 0.5 s, volume: 0.9 L in 0.5 s}, until: [position.z > 0.2 m]}",
        "{name: rise, until: surface}",
    )
    return [flown(*modes, robot=robot, step=step) for step in (2e-3, 1e-3)]


def test_events_of_a_walk_do_not_depend_on_the_steps(dives):
    coarse, fine = (np.array([p.time for p in run.passed]) for run in dives)
    assert coarse.size == 4
    np.testing.assert_allclose(coarse, fine, atol=2e-3)


def test_feet_touch_the_floor_as_the_first_mode_ends(dives):
    for run in dives:
        last = np.flatnonzero(run.mode == 0)[-1]
        assert run.measures.feet[last] == pytest.approx(0.0, abs=1e-8)
        assert run.time[last + 1] == run.time[last]
        assert np.all(run.measures.feet[:last] < 0)
        assert run.measures.feet[run.mode == 1].max() > 1e-3


def test_a_body_that_turns_heads_where_its_rate_takes_it():
    """60 deg at 2 rad/s about z; it tilts by what it turns about x."""
    top = parse_robot("""
name: top
water: {gravity: 0 m/s2}
body: {kind: rigid, shape: point, mass: 1 kg, inertia: [1 kg m2, 1 kg m2, 1 kg m2], volume: 0 m3,
       joint: {kind: free, start: {angular_velocity: [0 rad/s, 0 rad/s, 2 rad/s]}}}
""")
    run = flown("{name: turn, until: heading > 60 deg}", robot=top)
    assert run.event_time("turn") == pytest.approx(np.pi / 6, abs=1e-8)
    assert run.measures.tilt.max() < 1e-9


@pytest.mark.slow
def test_a_crawler_turns_round_at_the_wall_and_comes_back():
    """It goes straight again where the cranks of both sides are in phase after the turn."""
    path = mission_of("poseidrone_turning")
    run = run_mission(load_mission(path, describe("poseidrone_turning")))
    assert [p.event for p in run.passed] == ["high_wall", "8.57243 s", "low_wall"]
    back = run.mode == 2
    straight = np.unwrap(run.measures.heading[back])[1000:]
    assert np.ptp(straight) < np.radians(5)
    assert np.abs(np.cos(straight) + 1).max() < 0.02
    assert np.abs(run.measures.position[:, 1]).max() < 0.2


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "mission: this is empty. A mission has at least one mode."),
        ("modes: []", "mission, line 1, modes: at least 1 value expected, 0 given."),
        ("modes: [{name: a}]", "mission, line 1, modes.0.until: is missing. A list expected."),
        ("modes: [{name: a, until: tuesday}]", 'mission, line 1, modes.0.until: "tuesday" is nothing that a mode can end with. Known: touchdown, liftoff, surface, low_wall, high_wall, position.x > value, position.y > value, position.z > value, pitch > value, heading > value, a time.'),
        ("modes: [{name: a, until: touch down}]", 'mission, line 1, modes.0.until: "touch down" is nothing that a mode can end with. Did you mean "touchdown"?'),
        ("modes: [{name: a, until: 20}]", 'mission, line 1, modes.0.until: "20" has no unit.'),
        ("modes: [{name: a, until: touchdown}]", "mission, line 1, modes.0.until: sub has no touchdown: it lacks legs."),
        ("modes: [{name: a, until: position.x > 3 kg}]", 'mission, line 1, modes.0.until: "3 kg" is a mass'),
        ("modes:\n- {name: a, until: 1 s}\n- {name: a, until: 1 s}", "mission, line 3, modes.1.name: there is a mode of this name before, number 1."),
        ("modes:\n- name: a\n  until: 1 s\n  set: {jett: 1 rad/s}", 'mission, line 4, modes.0.set.jett: there is no quantity called "jett" in sub. Did you mean "jet"?'),
        ("modes: [{name: a, until: 1 s, set: {jet: 1 rad/s in 3 m}}]", 'mission, line 1, modes.0.set.jet: "3 m" is a length'),
        ("modes: [{name: a, until: 1 s, set: {volume: -1 L}}]", 'mission, line 1, modes.0.set.volume: "-1 L" is out of range'),
        ("modes: [{name: a, until: 1 s, set: {jet: 1 rad/s, body.loads.jet.speed: 2 rad/s}}]", "mission, line 1, modes.0.set.body.loads.jet.speed: body.loads.jet.speed is set twice in this mode."),
    ],
)  # fmt: skip
def test_a_mistake_in_a_mission_file_is_told_in_a_sentence(text, message):
    with pytest.raises(InputError) as caught:
        parse_mission(text, SUB)
    assert str(caught.value).startswith(message)
