"""The study of the gallery: its rows, and that each robot keeps swimming as it does."""

import numpy as np
import pytest
import xarray as xr

from nectosome.description import parse_robot
from nectosome.mechanism.diagnose import driving
from nectosome.model import build
from nectosome.robots import describe
from nectosome_studies.gallery import study
from nectosome_studies.gallery.entries import ENTRIES

SPEEDS = {  # m/s, of the version that drew the pictures; those of the octopus at a tolerance of 1e-8
    "flagellum": 0.0716241,
    "flagella4": 0.431249,
    "beetle": 0.365225,
    "eel": 0.429118,
    "catshark": 0.161591,
    "kern_eel": 0.288015,
    "fish": 0.110294,
    "tuna": 0.604558,
    "manta": 0.293098,
    "poseidrone": 0.0602446,
    "jelly": 0.0885894,
    "turtle": 0.139954,
    "krill": 0.171389,
    "octopus": 0.0837373,
    "octopus_web": 0.0680863,
    "medusa": 0.0660237,
    "ray": 0.193028,
    "soft_tail": 0.245755,
}


def test_speed_power_and_cost_are_those_of_the_last_period():
    """A point of 2 kg that a force of 3 N drives at 0.5 m/s: 1.5 W, and 1.5/(2 g 0.5) = 0.15296."""
    text = (
        "{name: a, body: {kind: rigid, shape: point, mass: 2 kg, volume: 0 m3, "
        "joint: {kind: prismatic, axis: x, force: {kind: constant, value: 3 N}}}}"
    )
    robot = build(parse_robot(text))
    drives = driving(robot)
    time = np.linspace(0.0, 4.0, 2 * study.A_PERIOD + 1)
    power = np.broadcast_to(np.where(drives, 1.5, -7.0), (time.size, *drives.shape))
    made = xr.Dataset(
        {
            "position": (("time", "station", "axis"), np.stack([0.5 * time, 0 * time, 0 * time], axis=-1)[:, None]),
            "reaction_power": (("time", "prescribed"), np.zeros((time.size, 0))),
            "load_power": (("time", "load", "part"), power),
        },
        coords={"time": time},
    )
    found = study.numbers(robot, made, 2.0)
    assert found["speed"] == pytest.approx(0.5, rel=1e-12)
    assert found["power"] == pytest.approx(1.5, rel=1e-12)
    assert found["cost-of-transport"] == pytest.approx(0.1529574, rel=1e-6)
    assert found["frequency"] == 0.5
    assert found["change"] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("entry", ENTRIES, ids=lambda entry: entry.name)
def test_every_entry_is_a_robot_that_ships_and_swims_on_its_own(entry):
    robot = entry.make()
    command = entry.command.split()
    assert command[:2] == ["nectosome", "simulate"]
    assert describe(command[2]).name == robot.name
    assert robot.body.joint.kind in (("prismatic",) if entry.name == "poseidrone" else ("free", "planar"))
    assert robot.body.joint.motion is None


@pytest.mark.slow
@pytest.mark.parametrize("name", [entry.name for entry in ENTRIES])
def test_it_swims_as_fast_as_ever(name):
    """To 0.1 %: what the time steps' tolerance leaves is less."""
    assert study.swum(name).attrs["speed"] == pytest.approx(SPEEDS[name], rel=1e-3)
