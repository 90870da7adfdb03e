"""What is taken for a robot: names, paths, descriptions, built robots; and what is said of all else."""

import pickle
from pathlib import Path

import equinox as eqx
import jax
import numpy as np
import pytest
import xarray as xr

from nectosome.description import RobotDescription, get_value, save_robot
from nectosome.model import bind, build, description_of, robot_of
from nectosome.robots import describe
from nectosome.units import InputError

NAME = "paddle"


@pytest.fixture(scope="module")
def paddle() -> RobotDescription:
    return describe(NAME)


def test_a_name_a_path_a_description_and_a_built_robot_are_the_same(paddle, tmp_path):
    file = tmp_path / "paddle.yaml"
    save_robot(paddle, file)
    built = build(paddle)
    assert description_of(NAME) == description_of(file) == description_of(str(file)) == paddle
    assert description_of(paddle) is paddle
    assert description_of(built) == paddle
    assert robot_of(built) is built
    for given in (NAME, file, paddle, built):
        assert eqx.tree_equal(robot_of(given), built)
        assert eqx.tree_equal(build(given), built)
        assert bind(given, ("water.density",))[0] == bind(paddle, ("water.density",))[0]


def test_settings_change_a_robot_however_it_is_given(paddle):
    for given in (NAME, paddle, build(paddle)):
        changed = description_of(given, ["water.density=1025kg/m3"])
        assert get_value(changed, "water.density") == 1025.0
        assert float(robot_of(given, ["water.density=1025kg/m3"]).water.density) == 1025.0
    assert get_value(description_of(paddle, "water.density=1025kg/m3"), "water.density") == 1025.0


def test_a_description_neither_compiles_anew_nor_goes_stale(paddle):
    heavier = robot_of(paddle, ["water.density=1025kg/m3"])
    compiled = []

    @jax.jit
    def weigh(robot):
        compiled.append(robot)
        return robot.weight(), robot

    robots = [build(paddle), heavier, heavier.described(None)]
    for robot in robots:
        assert weigh(robot)[1].description is None
    assert len(compiled) == 1
    assert compiled[0].description is None
    denser = eqx.tree_at(lambda r: r.water.density, robots[0], heavier.water.density)
    assert denser.description is None  # its numbers are no longer those of the file
    with pytest.raises(InputError, match="this robot has no description"):
        description_of(denser)


def test_the_description_of_a_robot_made_of_a_vector_has_its_numbers(paddle):
    theta, robot_from = bind(paddle, ("water.density",))
    assert get_value(description_of(robot_from(1.025 * theta)), "water.density") == 1025.0
    assert jax.jit(lambda theta: robot_from(theta))(theta).description is None


def test_a_description_goes_along_into_another_process(paddle):
    assert pickle.loads(pickle.dumps(build(paddle))).description == paddle


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (xr.Dataset(), "a dataset is given where a robot is expected"),
        (np.zeros(3), "an array of numbers is given where a robot is expected"),
        (None, r"nothing \(None\) is given where a robot is expected"),
        (2.5, "the float 2.5 is given where a robot is expected"),
        ({"name": "fish"}, "a dict is given where a robot is expected"),
        ("flagelum", 'there is no robot called "flagelum".* Did you mean "flagellum"'),
        (Path("no_such.yaml"), "no_such.yaml"),
    ],
)
def test_what_is_no_robot_is_said_to_be_none(as_users_run, given, said):
    for take in (robot_of, build, lambda robot: bind(robot, ())):
        with pytest.raises(InputError, match=said):
            take(given)


@pytest.mark.parametrize("settings", [3, [3], {3: "1 m"}, None])
def test_settings_are_text(as_users_run, settings):
    with pytest.raises(InputError, match=r"settings: .* is no setting\. Write text"):
        description_of(NAME, settings)


def test_a_name_or_a_path_is_described(as_users_run, paddle, tmp_path):
    save_robot(paddle, tmp_path / "paddle.yaml")
    assert describe(tmp_path / "paddle.yaml") == describe(str(tmp_path / "paddle.yaml")) == paddle
    for given in (3, None, paddle):
        with pytest.raises(InputError, match="is given where the name of a robot or the path of its file is expected"):
            describe(given)
