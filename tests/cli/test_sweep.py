"""`sweep` on a small robot: what it prints, saves and refuses."""

import json

import numpy as np
import pytest
from tests.small_robots import DRIVEN

from nectosome.cli import options
from nectosome.description import dump_robot, parse_robot, with_values
from nectosome.designs.design import SEED, STARTS
from nectosome.io import load_dataset

from .answers import check_wrong

# off resonance at 2 Hz, and damped well: it settles within a few cycles
ARM = dump_robot(with_values(parse_robot(DRIVEN), {"I": 1e-3, "k": 0.06, "c": 0.01, "M": 0.02, "f": 2.0}))


@pytest.fixture
def arm(tmp_path):
    (tmp_path / "arm.yaml").write_text(ARM)
    return "arm.yaml"


def test_a_sweep_is_printed_and_saved(nectosome, arm, tmp_path):
    answer = nectosome(
        "sweep", arm, "--over", "M=10..30:10mN m", "--over", "f=1,2Hz", "--save", "grid.nc", "--plot", "a.html"
    )
    assert answer.code == 0, answer.err
    page = (tmp_path / "a.html").read_text()
    assert "<h3>Power</h3>" in page
    assert "<h3>Speed</h3>" not in page  # an arm goes nowhere
    assert "driven: sweep over M, f" in answer.out
    assert "6 points: " in answer.out
    assert "M=10 mN m, f=2 Hz" in answer.out  # where the power is lowest: beyond resonance
    found = load_dataset(tmp_path / "grid.nc")
    M, w = found["M"].to_numpy()[:, None], 2 * np.pi * found["f"].to_numpy()
    speed = w * M / abs(0.06 - 1e-3 * w**2 + 0.01j * w)
    np.testing.assert_allclose(found["power"], 0.01 * speed**2 / 2, rtol=1e-3)
    assert found["M"].attrs["units"] == "N m"
    assert sorted(file.name for file in tmp_path.iterdir()) == ["a.html", "arm.yaml", "grid.nc"]


def test_a_sweep_without_any_motion_ends_with_code_1(nectosome, tmp_path):
    """A force without drag: no speed stays."""
    (tmp_path / "sled.yaml").write_text("""
name: sled
water: {gravity: 0 m/s2}
body:
  {kind: rigid, shape: point, mass: 1 kg, volume: 0 m3,
   joint: {kind: prismatic, axis: x, force: {kind: constant, value: 1 N}}}
""")
    answer = nectosome("sweep", "sled.yaml", "--over", "body.mass=1,2kg")
    assert (answer.code, answer.err) == (1, "no point has a motion that was found\n")
    assert "2 points: 2 NO_EQUILIBRIUM" in answer.out


def test_long_paths_leave_room_for_the_numbers(nectosome, arm):
    argv = ("sweep", arm, "--over", "body.joint.torque.amplitude=10,20mN m", "--over", "f=1,2Hz")
    answer = nectosome(*argv)
    assert answer.code == 0, answer.err
    assert max(map(len, answer.out.splitlines())) <= 80
    power = next(line for line in answer.out.splitlines() if line.startswith("power "))
    assert [word for word in power.split() if word.startswith("amplitude=")] == ["amplitude=10", "amplitude=20"]
    found = json.loads(nectosome(*argv, "--json").out)["tables"]["means"]
    assert found["power"]["lowest_at"] == "amplitude=10 mN m, f=2 Hz"
    assert "force.y" not in found  # what holds the arm is pushed to and fro, by as much


def test_wrong_sweeps_are_answered_in_a_sentence(nectosome, arm, tmp_path):
    (tmp_path / "taken.parts").write_text("")
    cases = [
        ("sweep",),
        ("sweep", arm),
        ("sweep", arm, "--over"),
        ("sweep", arm, "--over", "M"),
        ("sweep", arm, "--over", "M=10..30mN m"),
        ("sweep", arm, "--over", "M=10:30:10mN m"),
        ("sweep", arm, "--over", "M=10,20"),
        ("sweep", arm, "--over", "B=10,20"),
        ("sweep", arm, "--over", "M=10,20mN m", "--over", "M=30,40mN m"),
        ("sweep", arm, "--over", "N=1,2"),
        ("sweep", arm, "--over", "f=0,1Hz", "--set", "M=1kg"),
        ("sweep", arm, "--over", "M=10mN m", "--samples", "3"),
        ("sweep", arm, "--over", "M=10mN m", "--save", "grid.txt"),
        ("sweep", arm, "--over", "M=10mN m", "--save", "taken.nc"),
        ("sweep", arm, "--over", "M=10mN m", "--plot", "grid.png"),
        ("sweep", arm, "--over", "M=9mN m", "--over", "f=1Hz", "--over", "body.mass=1kg", "--plot", "grid.html"),
        ("sweep", "nothing.yaml", "--over", "M=10mN m"),
    ]
    check_wrong(nectosome, cases, tmp_path)
    for over in ("N=one", "N=-1,2"):  # its hinges are as printed, which comes first
        answer = nectosome("sweep", "paddle", "--over", over)
        assert (answer.code, answer.out) == (2, "")
        warned, said = answer.err.splitlines()
        assert "as_printed" in warned and said.startswith("N: ")


@pytest.mark.parametrize("ending", ["png", "svg"])
def test_where_a_picture_is_wanted_the_way_to_one_is_told(nectosome, arm, ending):
    answer = nectosome("sweep", arm, "--over", "M=10mN m", "--plot", f"grid.{ending}")
    assert answer.code == 2
    assert answer.err == (
        f'--plot: "grid.{ending}" does not end in .html. A page is written: a camera button above each of its plots '
        "saves that as a picture (.png).\n"
    )


def test_seeds_and_starts_are_the_same_by_command_and_in_python():
    assert (int(options.STARTS), int(options.SEED)) == (STARTS, SEED)
