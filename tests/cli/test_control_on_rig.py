"""`control ROBOT --rig FILE`: gains and rehearsal on the model, then the rig; and what is refused before it moves."""

import json

import numpy as np
import pytest
from tests.rigs.controlled import SHAKEN
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


def test_a_controller_that_learns_is_logged_round_by_round(nectosome, slide, tmp_path):
    answer = nectosome(*ASKED, GAINS, "--controller", "ilc", "--rounds", "2", "--save", "run.nc", "--json")
    assert (answer.code, answer.err) == (0, "")
    tables = json.loads(answer.out)["tables"]
    for k in (1, 2):
        x = load_dataset(tmp_path / f"run_{k}.nc")["tank.x"].values[1:]
        found = tables["rounds"][str(k)]["rig"]["value"]
        assert found == pytest.approx(np.sqrt(np.mean((x - 0.1) ** 2)), rel=1e-9)
    assert tables["tracking"]["rms_error"]["rig"]["value"] == found
    again = nectosome(*ASKED, GAINS, "--controller", "ilc", "--rounds", "2", "--save", "run.nc")
    assert again.code == 2 and "run_1.nc" in again.err


def test_a_predictive_controller_tells_its_model(nectosome, slide):
    answer = nectosome(*ASKED, GAINS, "--controller", "mpc")
    assert (answer.code, answer.err) == (0, "")
    assert "linear model: 2 poles; it explains 100 % of what the command does" in " ".join(answer.out.split())


@pytest.mark.parametrize(("given", "why"), [
    (("--controller", "ilc", "--rounds", "0"), '--rounds: "0" must be a whole number from 1 to 100'),
    (("--rounds", "2"), "--rounds: are those of ilc"),
    (("--controller", "scheduled", GAINS), "--gains: a scheduled PID has gains by frequency"),
    (("--controller", "predictive"), '--controller: "predictive" is not known: pid, scheduled, ff-pid, ilc, mpc'),
])  # fmt: skip
def test_a_controller_that_is_none_is_refused(nectosome, slide, given, why):
    answer = nectosome(*ASKED, *given)
    assert answer.code == 2 and why in answer.err


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


def test_a_rig_that_is_the_robot_itself_needs_no_file(nectosome, slide, tmp_path):
    """Its run is that of `control` without a rig, a sample later, to 1e-6 m: the time steps differ."""
    own = ("control", "slide.yaml", *LOOP, GAINS, "--rate", "10 Hz")
    answer = nectosome(*own, "--rig", "simulated", "--save", "rig.nc")
    assert (answer.code, answer.err) == (0, "")
    assert "body.position by push on simulated slide: finished, 21 samples" in answer.out
    assert "the rig is the robot itself, simulated" in answer.out
    assert nectosome(*own, "--save", "run.nc").code == 0
    rig, run = load_dataset("rig.nc"), load_dataset("run.nc")
    np.testing.assert_allclose(rig["body.position"].values[1:], run["output"].values[:-1], atol=1e-6)


def test_with_a_mean_over_the_beat_errors_are_those_of_the_mean(nectosome, tmp_path):
    """Ten samples a beat; before the first one the slide was at rest. The oscillation itself is twice as large."""
    (tmp_path / "shaken.yaml").write_text(SHAKEN)
    loop = ("--command", "push=-2..2N", "--measure", "body.position", "--reference", "5cm", "--mean", "--rate", "20Hz")
    given = (*loop, "--gains=10,20,4", "--time", "6s", "--rig", "simulated", "--save", "run.nc", "--json")
    answer = nectosome("control", "shaken.yaml", *given)
    assert answer.code == 0
    x = load_dataset("run.nc")["body.position"].values
    weights = np.array([0.5, *[1.0] * 9, 0.5]) / 10
    mean = np.convolve(np.concatenate([np.full(10, x[0]), x]), weights, "valid")
    told = json.loads(answer.out)["tables"]["tracking"]["rms_error"]["rig"]["value"]
    assert told == pytest.approx(np.sqrt(np.mean((mean[1:] - 0.05) ** 2)), rel=1e-9)
    assert np.ptp(x[-10:]) > 2 * np.ptp(mean[-10:])


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
            ("control", "slide.yaml", *LOOP, "--rig", "simulated", "--rig-command", "push"),
            ("control", "slide.yaml", *LOOP, "--rig", "simulated", "--rig-measure", "body.position"),
        ],
        tmp_path,
    )
