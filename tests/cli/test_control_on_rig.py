"""`control ROBOT --rig FILE`: gains and rehearsal on the model, then the rig; and what is refused before it moves."""

import json

import numpy as np
import pytest
from tests.small_robots import SLIDE

from nectosome.io import load_dataset

from .answers import check_wrong

RIG = """
dt: 50 ms
devices:
  tank:
    kind: robot
    robot: heavy.yaml
    commands: {push: push}
    measurements:
      x: {reading: body.position, noise: 0.1 mm, resolution: 0.1 mm}
      v: {reading: velocity.x}
commands: {tank.push: {low: -3 N, high: 3 N, slew: 200 N/s}}
measurements: {tank.x: {least: -50 cm, most: 50 cm, error: 20 cm}}
"""
LOOP = ("--command", "push=-2..2N", "--measure", "body.position", "--reference", "10cm", "--time", "2s")
ASKED = ("control", "slide.yaml", *LOOP, "--rig", "rig.yaml", "--rig-measure", "tank.x")
GAINS = "--gains=20,30,10"


@pytest.fixture
def slide(tmp_path):
    """A slide, and a rig of one that is heavier by a half."""
    (tmp_path / "slide.yaml").write_text(SLIDE)
    (tmp_path / "heavy.yaml").write_text(SLIDE.replace("mass: 2 kg", "mass: 3 kg"))
    (tmp_path / "rig.yaml").write_text(RIG)


def test_gains_of_the_model_run_on_the_rig(nectosome, slide, tmp_path):
    """Errors of both stand side by side: the rig is heavier than its model."""
    answer = nectosome(*ASKED, "--save", "run.nc", "--plot", "run.html")
    assert (answer.code, answer.err) == (0, "")
    for words in ("body.position by push on simulated slide: finished, 41 samples", "model", "rig", "relay experiment"):
        assert words in answer.out
    run = load_dataset(tmp_path / "run.nc")
    assert run.attrs["status"] == "finished" and json.loads(run.attrs["loops"]) == {"tank.push": "tank.x"}
    assert {"tank.x", "tank.v", "tank.push.command", "tank.x.reference", "late"} <= set(run.data_vars)
    np.testing.assert_array_equal(run["tank.x.reference"].values, np.where(np.arange(41) > 0, 0.1, 0.0))
    assert "error of run 1" in (tmp_path / "run.html").read_text()


def test_its_numbers_are_those_of_the_logged_run(nectosome, slide, tmp_path):
    answer = nectosome(*ASKED, GAINS, "--save", "run.nc", "--json")
    table = json.loads(answer.out)["tables"]["tracking"]
    x = load_dataset(tmp_path / "run.nc")["tank.x"].values[1:]
    assert table["rms_error"]["rig"]["value"] == pytest.approx(np.sqrt(np.mean((x - 0.1) ** 2)), rel=1e-9)
    assert table["overshoot"]["rig"]["value"] == pytest.approx(x.max() / 0.1 - 1, rel=1e-6)
    assert table["overshoot"]["rig"]["value"] > table["overshoot"]["model"]["value"] + 0.02


def test_nothing_moves_where_the_guards_would_end_it_on_the_model(nectosome, slide, tmp_path):
    (tmp_path / "rig.yaml").write_text(RIG.replace("most: 50 cm", "most: 10.5 cm"))
    answer = nectosome(*ASKED, GAINS, "--save", "run.nc")
    assert answer.code == 2
    assert "on the model it would end, nothing was moved: at " in answer.err
    assert not (tmp_path / "run.nc").exists()


def test_a_run_that_a_guard_ends_on_the_rig_is_kept_with_its_reason(nectosome, slide, tmp_path):
    (tmp_path / "rig.yaml").write_text(RIG.replace("resolution: 0.1 mm", "range: -5..5 cm"))
    answer = nectosome(*ASKED, GAINS, "--save", "run.nc")
    assert answer.code == 1
    assert "aborted: at " in answer.err and "tank.x is nan m" in answer.err
    assert load_dataset(tmp_path / "run.nc").attrs["status"] == "aborted"


def test_what_does_not_fit_is_refused_before_gains_are_sought(nectosome, slide, tmp_path):
    check_wrong(
        nectosome,
        [
            (*ASKED, "--rate", "10 Hz"),
            (*ASKED, "--mean"),  # it has no beat
            ASKED[:-2],
            (*ASKED[:-1], "tank.v"),
            (*ASKED, "--rig-command", "tank.pull"),
            ("control", "slide.yaml", "--command", "push=-5..5N", *LOOP[2:], *ASKED[-4:]),
            ("control", "slide.yaml", *LOOP, "--rig", "none.yaml"),
        ],
        tmp_path,
    )
