"""`control loops ROBOT FILE`: several loops at once, on the robot itself or on a rig; what it prints and refuses."""

import json

import numpy as np
import pytest
from tests.rigs.controlled import ALONG, ASIDE, CROSS, RIG

from nectosome.io import load_dataset

from .answers import check_wrong

LOOPS = f"time: 2 s\nloops:\n  along: {ALONG}\n  aside: {ASIDE}\n"
ASKED = ("control", "loops", "cross.yaml", "loops.yaml")


@pytest.fixture
def cross(tmp_path):
    """A robot with a loop along and one aside, and a rig of one that is heavier."""
    on_rig = [
        loop[:-1] + f", rig_command: tank.{command}, rig_measure: tank.{measurement}}}"
        for loop, command, measurement in ((ALONG, "a", "x"), (ASIDE, "b", "y"))
    ]
    (tmp_path / "cross.yaml").write_text(CROSS)
    (tmp_path / "heavy.yaml").write_text(CROSS.replace("mass: 2 kg", "mass: 3 kg"))
    (tmp_path / "loops.yaml").write_text(LOOPS)
    (tmp_path / "loops_on_rig.yaml").write_text(f"time: 2 s\nloops:\n  along: {on_rig[0]}\n  aside: {on_rig[1]}\n")
    (tmp_path / "rig.yaml").write_text(RIG.replace("cross.yaml", "heavy.yaml"))


def test_without_a_rig_loops_run_on_the_robot_itself(nectosome, cross, tmp_path):
    answer = nectosome(*ASKED, "--save", "run.nc", "--plot", "run.html")
    assert (answer.code, answer.err) == (0, "")
    for words in (
        "slide: 2 loops on simulated slide: finished, 41 samples",
        "body.position by push",
        "side.position by swing",
        "along, gains: 20,30,10 (N/cm, N/(cm s), N s/cm)",
        "aside, gains: 0.3,0.4,0.1",
        "sampled at 20 Hz",
        "the rig is the robot itself, simulated",
    ):
        assert words in answer.out
    run = load_dataset(tmp_path / "run.nc")
    assert json.loads(run.attrs["loops"]) == {"push": "body.position", "swing": "side.position"}
    page = (tmp_path / "run.html").read_text()
    assert "body.position by push" in page and "side.position by swing" in page


@pytest.mark.slow
def test_each_loop_has_a_controller_of_its_own(nectosome, cross, tmp_path):
    """One learns in two rounds; the other one, with a model, has two runs too."""
    along, aside = ALONG[:-1] + ", controller: mpc}", ASIDE[:-1] + ", controller: ilc, rounds: 2}"
    (tmp_path / "loops.yaml").write_text(f"time: 4 s\nloops:\n  along: {along}\n  aside: {aside}\n")
    answer = nectosome(*ASKED, "--save", "run.nc", "--json")
    assert answer.code == 0
    tables = json.loads(answer.out)["tables"]
    assert set(tables["rounds aside"]) == {"1", "2"} and "rounds along" not in tables
    for name, of in (("along", "body.position"), ("aside", "side.position")):
        run = load_dataset(tmp_path / "run_2.nc")
        error = run[of].values[1:] - run[f"{of}.reference"].values[1:]
        assert tables[name]["rms_error"]["rig"]["value"] == pytest.approx(np.sqrt(np.mean(error**2)), rel=1e-9)


def test_a_command_that_stays_at_an_end_of_its_range_is_told(nectosome, cross, tmp_path):
    """8 cm against 5 N/m need 0.4 N, and 0.3 N are the most: all samples but the first are there, which is at 0."""
    far = ALONG.replace("-2..2 N", "-0.3..0.3 N").replace("5 cm", "8 cm")
    (tmp_path / "loops.yaml").write_text(f"time: 10 s\nloops:\n  far: {far}\n")
    answer = nectosome(*ASKED)
    assert (answer.code, answer.err) == (0, "")
    assert "far, command: 0 N to 0.3 N, mean of the last tenth 0.3 N; saturated in 100 % of the samples" in " ".join(
        answer.out.split()
    )


def test_each_loop_has_its_errors_on_the_model_and_on_the_rig(nectosome, cross, tmp_path):
    """The rig is heavier along its slide, and not across."""
    answer = nectosome(*ASKED[:3], "loops_on_rig.yaml", "--rig", "rig.yaml", "--save", "run.nc", "--json")
    assert answer.code == 0
    tables, run = json.loads(answer.out)["tables"], load_dataset(tmp_path / "run.nc")
    assert [*tables] == ["along", "aside"]
    for name, measurement in (("along", "tank.x"), ("aside", "tank.y")):
        error = (run[measurement] - run[f"{measurement}.reference"]).values[1:]
        assert tables[name]["rms_error"]["rig"]["value"] == pytest.approx(np.sqrt(np.mean(error**2)), rel=1e-9)
    along, aside = (tables[name]["rms_error"] for name in ("along", "aside"))
    assert along["rig"]["value"] > 1.01 * along["model"]["value"]
    assert aside["rig"]["value"] == pytest.approx(aside["model"]["value"], rel=1e-6)


def test_gains_that_are_not_given_are_found_loop_by_loop(nectosome, cross, tmp_path):
    """As `control ROBOT` finds them, for the loop that has none."""
    text = LOOPS.replace("2 s", "4 s").replace("gains: '20, 30, 10'", "noise: 0 m")
    (tmp_path / "loops.yaml").write_text(text)
    answer = nectosome(*ASKED)
    alone = nectosome("control", "cross.yaml", "--command", "push=-2..2 N", "--measure", "body.position",
                      "--reference", "5 cm", "--time", "4s")  # fmt: skip
    assert (answer.code, alone.code) == (0, 0)
    gains = alone.out.partition("gains: ")[2].partition(" ")[0]
    assert f"along, gains: {gains} " in answer.out and "from a relay" in answer.out
    assert "aside, gains: 0.3,0.4,0.1" in answer.out


def test_what_is_wrong_is_told_before_anything_moves(nectosome, cross, tmp_path):
    (tmp_path / "wide.yaml").write_text((tmp_path / "loops_on_rig.yaml").read_text().replace("-2..2 N", "-5..5 N", 1))
    (tmp_path / "other.yaml").write_text(LOOPS.replace("swing=", "push="))
    (tmp_path / "far.yaml").write_text(
        (tmp_path / "loops_on_rig.yaml").read_text().replace("reference: 5 cm", "reference: 60 cm")
    )
    check_wrong(
        nectosome,
        [
            ASKED[:3],
            (*ASKED[:3], "gone.yaml"),
            (*ASKED[:3], "rig.yaml"),
            (*ASKED[:3], "other.yaml"),
            (*ASKED[:3], "wide.yaml", "--rig", "rig.yaml"),
            (*ASKED[:3], "far.yaml", "--rig", "rig.yaml", "--save", "run.nc"),
            (*ASKED, "--rig", "rig.yaml"),
            (*ASKED, "--rig", "gone.yaml"),
            (*ASKED, "--set", "mass=1kg"),
            (*ASKED, "--save", "run.png"),
            ("control", "loops", "nobody", "loops.yaml"),
        ],
        tmp_path,
    )
    answer = nectosome(*ASKED[:3], "wide.yaml", "--rig", "rig.yaml")
    assert answer.err.startswith("wide.yaml, line 3, loops.along.command: -5 N to 5 N is beyond the limits of the rig")
