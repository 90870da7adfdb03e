"""What is read off a robot is what its results say."""

import numpy as np
import pytest

from nectosome.description import parse_robot
from nectosome.model import build, read
from nectosome.model.readings import reading_of
from nectosome.solve import simulate
from nectosome.units import InputError

# a body that is held, with a driven arm, and a fin that follows on a spring
ROWER = """
name: rower
body: {kind: rigid, shape: point, mass: 1 kg, joint: {kind: planar, axis: z, motion: {}}}
limbs:
  arm:
    kind: rigid
    shape: cylinder
    length: 100 mm
    radius: 5 mm
    density: 1200 kg/m3
    joint: {kind: revolute, axis: z, motion: {kind: sine, amplitude: 40 deg, frequency: 1 Hz}}
    loads: &wet {drag: {kind: drag, normal: 1.2}, water: {kind: added_mass, normal: 1}}
  fin:
    on: arm
    kind: rigid
    shape: cylinder
    length: 80 mm
    radius: 4 mm
    density: 1200 kg/m3
    joint: {kind: revolute, axis: z, stiffness: 0.02 N m/rad, damping: 1 mN m s/rad}
    loads: *wet
"""


NAMES = {
    "force.x": "N",
    "force.y": "N",
    "reaction.body.x": "N",
    "reaction.body.y": "N",
    "reaction.arm.angle": "N m",
    "fin.tip.y": "m",
    "fin.x": "m",
    "fin.surge": "m/s",
    "fin.heading": "rad",
    "fin.angle": "rad",
    "fin.angle.rate": "rad/s",
}


@pytest.fixture(scope="module")
def robot():
    return build(parse_robot(ROWER))


@pytest.fixture(scope="module")
def rowed(robot):
    """What is read, by name, and the results."""
    run = simulate(robot, 0.5, samples=6)
    return {name: read(run, name) for name in NAMES}, run.to_dataset()


def test_a_load_cell_feels_what_holds_the_body(rowed):
    """The robot gives to it what its reactions give to the robot, with the other sign."""
    for axis in "xy":
        assert np.abs(rowed[0][f"force.{axis}"]).max() > 0.01
        np.testing.assert_allclose(rowed[0][f"force.{axis}"], -rowed[0][f"reaction.body.{axis}"], atol=1e-10)


def test_readings_are_those_of_the_results(rowed):
    found, data = rowed
    stations = np.flatnonzero(data["station_part"].values == "fin")
    expected = {
        "fin.tip.y": data["position"].values[:, stations[-1], 1],
        "fin.x": data["position"].values[:, stations[0], 0],
        "fin.surge": data["velocity"].sel(part="fin", axis="x").values,
        "fin.heading": np.arctan2(*data["rotation"].values[:, stations[0], [1, 0], 0].T),
        "fin.angle": data["q"].sel(coordinate="fin.angle").values,
        "fin.angle.rate": data["v"].sel(coordinate="fin.angle").values,
        "reaction.arm.angle": data["reaction"].sel(prescribed="arm.angle").values,
    }
    for name, values in expected.items():
        np.testing.assert_allclose(found[name], values, atol=1e-12, err_msg=name)


def test_a_heading_goes_on_beyond_half_a_turn():
    spinner = ROWER.replace("sine, amplitude: 40 deg, frequency: 1 Hz", "rate, rate: 10 rad/s")
    run = simulate(build(parse_robot(spinner)), 2.0, samples=21)
    np.testing.assert_allclose(read(run, "arm.heading"), 10.0 * run.value.time, rtol=1e-9, atol=1e-9)


def test_readings_tell_their_units(robot):
    assert {name: reading_of(robot, name).unit for name in NAMES} == NAMES


@pytest.mark.parametrize("name", ["arm.anlge", "force.w", "reaction.fin.angle", "depth", "tip.x", ""])
def test_what_cannot_be_read_is_told(robot, name):
    with pytest.raises(InputError):
        reading_of(robot, name)
