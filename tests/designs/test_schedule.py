# ruff: noqa: E501  (tables: one case a line)
"""Schedules of missions: their numbers by name, missions as text, the shortest one where closed forms put it, mistakes."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest
from tests.small_robots import SUB

from nectosome.description.mission import (
    dump_mission,
    get_schedule,
    parse_mission,
    read_schedule_variable,
    with_schedule,
)
from nectosome.designs import Problem, ScheduleDesign, read_constraint
from nectosome.search import CmaEs, multistart
from nectosome.units import InputError

# 2 kg pushed by the square of the speed, then carried on without drag
MISSION = """modes:
- {name: push, set: {jet: 0.8 rad/s}, until: [1 s, position.x > 0.9 m]}
- {name: coast, set: {jet: 0 rad/s, volume: 2 L in 1 s}, until: position.x > 0.9 m, longest: 9 s}
"""
RANGES = {"push.jet": "0.5 rad/s .. 1 rad/s", "push.until": "0.2 s .. 1.2 s"}


@pytest.fixture(scope="module")
def task() -> ScheduleDesign:
    found = Problem(RANGES, mission=MISSION).task(SUB)
    assert isinstance(found, ScheduleDesign)
    return found


def test_a_mission_takes_as_long_as_the_closed_form_says(task):
    """T + (d - v T/2)/v after T of F = w^2, with v = F T/m."""
    evaluate = task.prepare()
    for u in np.random.default_rng(1).uniform(size=(4, 2)):
        w, T = task.box.values(u)
        v = w**2 * T / 2
        assert evaluate(u, False, None).objective == pytest.approx(T + (0.7 - v * T / 2) / v, abs=1e-6)


@pytest.mark.slow  # what it minimises is held to the closed form above
def test_the_shortest_mission_pushes_hardest_for_longest(task):
    result = multistart(task, CmaEs(tolerance=1e-3, evaluations=60), 1, 1, executor=ThreadPoolExecutor(1))
    (start,) = result.best()
    assert start.best is not None
    np.testing.assert_allclose(start.best.u, [1, 1], atol=0.02)
    mission = parse_mission(task.chosen(start.best.u), SUB)
    assert mission.modes == task.mission_at(start.best.u).modes
    values = [get_schedule(mission, name) for name in task.names]
    np.testing.assert_allclose(task.box.places(np.array(values)), start.best.u, atol=1e-12)


def test_what_does_not_come_to_its_end_has_no_time(task):
    slow = with_schedule(task.mission, {"push.jet": 0.0})
    found = ScheduleDesign(slow, (read_schedule_variable("push.until", "0.1 s .. 0.2 s", slow),)).prepare()
    why = "coast took longer than 9 s without coming to position.x > 0.9 m, and stands still"
    assert found(np.zeros(1), False, None).reason == why


def test_a_mission_as_text_reads_back_as_the_same(task):
    assert parse_mission(dump_mission(task.mission), SUB).modes == task.mission.modes


def test_problems_of_missions_are_changed():
    problem = Problem(RANGES, mission=MISSION)
    changed = problem.changed(SUB, fixed=["body.mass"], vary={"push.jet": "0.6..0.7rad/s"})
    assert changed.vary == RANGES | {"push.jet": "0.6..0.7rad/s"}
    assert problem.changed(SUB, mission="modes: []").vary == RANGES
    assert Problem({"body.mass": "1..2kg"}).changed(SUB, mission=MISSION) == Problem(mission=MISSION)


def test_a_mission_s_own_numbers_have_places_in_the_ranges(task):
    np.testing.assert_allclose(task.box.values(np.clip(task.own, 0, 1)), [0.8, 1.0])


@pytest.mark.parametrize(
    ("problem", "message"),
    [
        (Problem({"push.jett": "1 rad/s .. 2 rad/s"}), 'variables: "push.jett" is no number of this mission. Did you mean "push.jet"?'),
        (Problem({"coast.until": "1 s .. 2 s"}), 'variables: "coast.until" is no number of this mission.'),
        (Problem({"push.until": "-1 s .. 2 s"}), 'push.until: "-1 s" is out of range: it must be at least 0 s.'),
        (Problem({"push.jet": "1 s .. 2 s"}), 'push.jet: "1 s" is a time'),
        (Problem({"push.jet": "0 rad/s .. 1 rad/s", "push.body.loads.jet.speed": "0 rad/s .. 1 rad/s"}), "push.body.loads.jet.speed: is named twice: push.jet stands for it too."),
        (Problem(RANGES, keep=(read_constraint("speed <= 1 m/s"),)), "keep: a mission has no limits"),
        (Problem(RANGES, maximise="speed"), 'maximise: "speed": of a mission only the time is minimised.'),
        (Problem(RANGES, forward="x"), 'forward: "x": of a mission only'),
        (Problem(RANGES, minimise="power"), 'minimise: "power": of a mission only the time is minimised.'),
        (Problem(RANGES, forward="z"), 'forward: "z": of a mission only'),
        (Problem(), "variables: there is nothing to choose"),
    ],
)  # fmt: skip
def test_a_mistake_is_told_in_a_sentence(problem, message):
    with pytest.raises(InputError) as caught:
        replace(problem, mission=MISSION).task(SUB)
    assert str(caught.value).startswith(message)


def test_slopes_are_refused(task):
    with pytest.raises(InputError, match="no derivatives"):
        task.prepare()(np.zeros(2), True, None)
