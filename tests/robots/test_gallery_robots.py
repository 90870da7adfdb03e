"""The robots made for the gallery: neutral, symmetric, driven as their files say, the same as ever."""

import math
from functools import cache

import equinox as eqx
import jax
import numpy as np
import pytest

from nectosome.description import get_value
from nectosome.mechanism import Robot
from nectosome.model import build
from nectosome.robots import describe
from nectosome.solve import simulate

TIME = 0.1  # s
STORED = {  # of the version that drew the gallery: a change here is one of a model or of a robot, and should be meant
    "jelly": {
        "body.vx": 0.002982163493210092,
        "tentacle1.bending_y.0": 0.034074066763811084,
        "tentacle1.bending_y.1": 0.1124388378575946,
    },
    "octopus": {"body.vx": -0.02515666258297662, "arm1.bending_y.0": -0.4223736012867098},
    "turtle": {
        "body.vx": 0.004263235664565194,
        "body.wy": 0.10590120366644577,
        "front_edge1.angle": -1.7483227217209973,
        "front_flipper1.bending_y.0": 5.251143174948301,
        "hind_edge1.angle": 2.332188778375874,
        "hind_flipper1.bending_y.0": 1.888493153568006,
    },
    "manta": {
        "body.vx": 0.001183408673312893,
        "body.wy": 0.09480966254268527,
        "fin1.angle": 1.2275202766094122,
        "fin1.bending_y.0": 2.609278587726497,
    },
    "krill": {
        "body.vx": 0.046782202075946626,
        "body.vz": -0.01179908729656952,
        "body.wy": -0.4394072485068652,
        "blade1_1.angle": 15.385426499806647,
        "blade3_1.angle": 3.5359507360309745,
        "blade5_1.angle": 0.9830267983683644,
    },
}
# compiling the equations of these takes long
MADE = [
    "jelly",
    "octopus",
    pytest.param("turtle", marks=pytest.mark.slow),
    pytest.param("manta", marks=pytest.mark.slow),
    pytest.param("krill", marks=pytest.mark.slow),
]


@cache
def made(name: str, *settings: str) -> Robot:
    return build(describe(name, settings))


@cache
def swum(name: str, *settings: str) -> dict[str, float]:
    """Velocities of all free coordinates after a short swim; settings of a robot share its compiled equations."""
    robot = made(name, *settings)
    run = simulate(robot, TIME, samples=2, method="explicit", rtol=1e-8, atol=1e-10)
    return dict(zip(robot.coordinate_names, map(float, run.value.state.v[-1]), strict=True))


@pytest.mark.parametrize("name", MADE)
def test_it_is_neutral(name):
    robot = made(name)
    volume = float(np.sum(robot.tree.stations.volume))
    assert float(robot.water.density) * volume == pytest.approx(float(robot.weight().sum()), rel=1e-9)


@pytest.mark.parametrize("name", MADE)
def test_a_gait_that_is_symmetric_swims_straight(name):
    """No way to the side, no roll, no yaw; what is symmetric about its axis does not pitch either."""
    v = swum(name)
    sideways = ["vy", "wx", "wz"] + (["vz", "wy"] if name in ("octopus", "jelly") else [])
    assert max(abs(v[f"body.{name}"]) for name in sideways) < 1e-9
    assert abs(v["body.vx"]) > 1e-4


@pytest.mark.slow
def test_a_turtle_turns_to_the_side_of_the_weaker_flipper_and_its_image_the_other_way():
    left, right = swum("turtle", "A_left=20deg"), swum("turtle", "A_right=20deg")
    assert abs(left["body.wz"]) > 1e-3
    for name, sign in {"vx": 1, "vy": -1, "vz": 1, "wx": -1, "wy": 1, "wz": -1}.items():
        assert left[f"body.{name}"] == pytest.approx(sign * right[f"body.{name}"], rel=1e-6, abs=1e-12)


@pytest.mark.slow
def test_the_tail_of_the_manta_holds_its_course():
    """A yaw rate of 0.05 rad/s at full speed: six beats later less than a thousandth is left."""
    robot = made("manta")
    yaw = robot.coordinate_names.index("body.wz")
    state = jax.tree.map(lambda x: x[-1], simulate(robot, 10.0, samples=2).value.state)
    disturbed = eqx.tree_at(lambda s: s.v, state, state.v.at[yaw].add(0.05))
    after = simulate(robot, 6.0, samples=2, initial=disturbed)
    assert abs(float(after.value.state.v[-1, yaw])) < 5e-5


def test_the_legs_of_the_krill_beat_a_fifth_of_a_period_before_those_ahead():
    krill = describe("krill")
    places = [krill.limbs[f"segment{k}"].offset[0] for k in range(1, 6)]
    assert places == sorted(places, reverse=True)  # the first is ahead
    for side in (1, 2):
        phases = [get_value(krill, f"limbs.leg{k}_{side}.joint.motion.phase") for k in range(1, 6)]
        assert np.diff(phases) == pytest.approx(2 * math.pi * 0.2, rel=1e-12)


@pytest.mark.parametrize("name", MADE)
def test_it_stays_as_it_is(name):
    found = swum(name)
    assert {key: found[key] for key in STORED[name]} == pytest.approx(STORED[name], rel=1e-6)
