"""Means of a run in its summary: over whole beats, and of what lies between the samples."""

import numpy as np
import pytest

from nectosome.io import load_dataset
from nectosome.solve.summaries.run_summary import powers, reaction_unit

ARM = """
name: arm
water: {gravity: 0 m/s2}
body:
  kind: rigid
  shape: box
  length: 100 mm
  width: 20 mm
  height: 20 mm
  mass: 1 kg
  volume: 0 m3
  joint: {kind: prismatic, axis: x, motion: {kind: sine, amplitude: 20 mm, frequency: 2 Hz}}
"""
TURN = "motion: {kind: sine, amplitude: 20 mm, frequency: 2 Hz}"

STROKE = "motion: {kind: stroke, amplitude: 20 deg, frequency: 2 Hz, ramp: 0.5 s}"


def told(answer) -> str:
    return next(line for line in answer.out.splitlines() if line.startswith("means: "))


def test_means_are_over_the_last_whole_beats(nectosome, tmp_path):
    """After 1.37 beats a tenth of the run would give half of the largest speed; over a beat it is 0."""
    (tmp_path / "arm.yaml").write_text(ARM)
    answer = nectosome("simulate", "arm.yaml", "--time", "0.685s", "--samples", "1001", "--save", "run.nc")
    assert answer.code == 0, answer.err
    assert told(answer) == "means: over the last beat, 500 ms"
    row = next(line for line in answer.out.splitlines() if line.startswith("mean velocity"))
    assert abs(float(row.split()[2])) < 1e-5
    v = load_dataset(tmp_path / "run.nc")["velocity"].values[-100:, 0, 0]
    assert abs(v.mean()) > 0.05


@pytest.mark.parametrize(
    ("drive", "time", "words"),
    [
        (TURN, "20s", "the last 4 beats, 2 s"),
        (STROKE, "1.7s", "the last beat, 500 ms"),
        (TURN, "0.3s", "the last 30 ms"),  # no beat is over
        ("force: {kind: constant, value: 1 N}", "2s", "the last 200 ms"),
    ],
)
def test_it_is_told_what_means_are_over(nectosome, tmp_path, drive, time, words):
    robot = ARM.replace("prismatic", "revolute") if drive == STROKE else ARM
    (tmp_path / "arm.yaml").write_text(robot.replace(TURN, drive))
    answer = nectosome("simulate", "arm.yaml", "--time", time)
    assert answer.code == 0, answer.err
    assert told(answer) == f"means: over {words}"


def test_a_reaction_times_the_rate_of_its_coordinate_is_a_power():
    """Displacements are in m of a slide, in rad of a hinge and a bending, plain of an extension (`coordinate_unit`)."""
    units = {"arm.angle": "N m", "slide.position": "N", "body.vx": "N", "body.wx": "N m"}
    units |= {"tail.bending_z.0": "N m", "tail.extension.1": "N m"}
    assert {name: reaction_unit(name) for name in units} == units


def test_a_strain_of_several_coordinates_has_a_mean_power_and_no_largest():
    """Their largest powers come at different times: the sum of them is that of no time."""
    names = np.array(["body.bending_z.0", "body.bending_z.1", "shaft.angle"])
    arrays = {"prescribed": names, "load": np.array(["drag"]), "load_force": np.zeros(1)}
    peaks = np.array([9.0]), np.array([4.0, 4.0, 2.0]), 0.1
    table = powers(arrays, np.array([-3.0]), np.array([1.5, 0.5, 1.0]), peaks)
    rows = {row[0]: row[1:] for row in table.texts()[1:]}
    assert rows["body.bending z"] == ("2 W", "")
    assert rows["shaft.angle"] == ("1 W", "2 W")
