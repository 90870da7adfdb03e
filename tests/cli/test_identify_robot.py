"""`identify ROBOT`: the fin of the examples comes out as it was made, and what is wrong is told."""

import json
import shutil
import subprocess
import sys
import time
from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest
from tests.afar import Afar

from nectosome.description import load_robot
from nectosome.io import load_dataset
from nectosome.search.executors.cluster import cluster

from .answers import check_made, check_wrong

EXAMPLE = Path(__file__).parents[2] / "examples" / "fin_recordings"
FIND = {
    "k": "0.05..0.5N m/rad log",
    "c": "0.5 mN m s/rad .. 20 mN m s/rad log",
    "drag": "0.5 .. 4",
    "added": "0.3 .. 2",
}
BARE = ("identify", "lab/fin.yaml", "--campaign", "lab/campaign.yaml")
ONE = (*BARE, "--vary", "drag=0.5 .. 4", "--compare", "angle=fin.angle")
DRIVE = ("--drive", "torque=limbs.fin.joint.torque")


@pytest.fixture
def lab(tmp_path):
    shutil.copytree(EXAMPLE, tmp_path / "lab")
    return tmp_path / "lab"


@pytest.mark.slow
@pytest.mark.usefixtures("lab")
def test_the_example_finds_the_truth_and_predicts_the_other_recording(nectosome, tmp_path):
    find = [word for name, text in FIND.items() for word in ("--vary", f"{name}={text}")]
    compare = ("--compare", "angle=fin.angle", "--compare", "push=force.y")
    files = ("--save", "fin.nc", "--plot", "fin.html", "--write", "tuned.yaml")
    answer = nectosome(*BARE, *find, *compare, *DRIVE, "--test", "fast.csv", *files)
    assert (answer.code, answer.err) == (0, "")
    found = load_dataset(tmp_path / "fin.nc")
    np.testing.assert_allclose(found["value"], [0.16, 3e-3, 1.7, 0.8], rtol=5e-3)
    assert np.all((found["low"] < found["value"]) & (found["value"] < found["high"]) & found["identifiable"])
    np.testing.assert_allclose(found["error"], [np.deg2rad(0.2), 5e-3], rtol=0.05)
    assert found["used"].values.tolist() == ["train", "train", "test"]
    assert np.all(found["e_rmsp"] < 0.7)
    assert json.loads(found.attrs["provenance"])["settings"]["test"] == "['fast.csv']"
    for words in ("2 recordings fitted, 1 held out", "N m s/rad", "held out", "push: standard error 0.005"):
        assert words in answer.out
    assert load_robot(tmp_path / "tuned.yaml").limbs["fin"].joint.stiffness == found["value"][0]
    page = (tmp_path / "fin.html").read_text()
    for words in ("Recording fast", "that was not fitted", "angle (deg)", "push (N)"):
        assert words in page


@pytest.mark.slow
def test_the_recordings_of_the_example_are_what_its_script_makes(tmp_path, monkeypatch):
    check_made(EXAMPLE, tmp_path, monkeypatch, lambda _: 0.01)


@pytest.fixture
def one_recording(lab):
    """The command with one recording, and what it finds."""
    (lab / "campaign.yaml").write_text("recordings: [{file: middle.csv}]\n")
    return (*ONE, *DRIVE, "--starts", "4", "--save")


def same(file: Path, other: Path) -> bool:
    names = ["value", "low", "high", "error", "e_rmsp"]
    return load_dataset(file)[names].drop_attrs().identical(load_dataset(other)[names].drop_attrs())


def interrupted(*_):
    raise KeyboardInterrupt


@pytest.mark.slow  # `identification/test_robot_fit.py` has starts of an executor and those that are kept
def test_a_cluster_that_is_lost_leaves_the_fits_that_came_in(nectosome, one_recording, tmp_path, monkeypatch):
    """And so does Ctrl-C."""
    assert nectosome(*one_recording, "here.nc").code == 0
    goes_on = "The same command goes on from what is in there.parts.\n"
    with monkeypatch.context() as patch:
        patch.setattr("nectosome.identification.robot.fit._started", interrupted)
        stopped = nectosome(*one_recording, "there.nc")
    assert (stopped.code, stopped.err) == (130, f"cancelled. {goes_on}")
    monkeypatch.setattr(sys.modules[cluster.__module__], "cluster", lambda _: nullcontext(executor))
    asked = (*one_recording, "there.nc", "--cluster", "tcp://far:1")
    with Afar(most=3) as executor:
        lost = nectosome(*asked)
    assert (lost.code, lost.err) == (1, f"the connection to the scheduler was lost. {goes_on}")
    with Afar() as executor:
        assert nectosome(*asked).code == 0
    assert executor.calls == 1
    assert same(tmp_path / "there.nc", tmp_path / "here.nc")
    assert sorted(tmp_path.iterdir()) == [tmp_path / name for name in ("here.nc", "lab", "there.nc")]


@pytest.mark.slow
def test_a_command_that_is_killed_goes_on(nectosome, one_recording, tmp_path):
    assert nectosome(*one_recording, "whole.nc").code == 0
    process = subprocess.Popen([sys.executable, "-m", "nectosome", *one_recording, "fin.nc"], stdout=subprocess.DEVNULL)
    kept, until = tmp_path / "fin.parts" / "starts.jsonl", time.monotonic() + 120
    while not (kept.exists() and kept.read_bytes().count(b"\n") > 1) and time.monotonic() < until:
        time.sleep(0.002)
    process.kill()
    process.wait()
    assert kept.exists()
    assert nectosome(*one_recording, "fin.nc").code == 0
    assert same(tmp_path / "fin.nc", tmp_path / "whole.nc")
    assert not kept.parent.exists()


@pytest.mark.usefixtures("lab")
def test_wrong_input_is_told_in_one_sentence(nectosome, tmp_path):
    cases = [
        ONE[1:],
        ("identify", "nobody", *ONE[2:]),
        (*BARE, "--vary", "drag=0.5 .. 4"),
        (*BARE, "--compare", "angle=fin.angle"),
        (*ONE, "--vary", "drag=1 .. 2"),
        (*ONE, "--vary", "k=0.1..0.2:0.01N m/rad"),
        (*ONE, "--compare", "angle=fin.angle"),
        (*ONE, "--vary", "dragg=1 .. 2"),
        (*ONE, "--vary", "k=2 .. 3"),
        (*ONE, "--vary", "k=3 N m/rad .. 2 N m/rad"),
        (*ONE, "--vary", "k"),
        (*ONE, "--compare", "push=forse.y"),
        (*ONE, "--compare", "push"),
        (*ONE, "--compare", "nothing=force.y"),
        (*ONE, "--compare", "push=position.fin.x"),
        (*ONE, "--shift", "-0.1..0.1 m"),
        (*ONE, "--shift", "soon"),
        (*ONE, "--start", "k=0.1..0.2N m/rad"),
        (*ONE, "--start", "limbs.fin.joint.position"),
        (*ONE, "--drive", "torque"),
        (*ONE, "--drive", "torque=limbs.fin.joint.torqe"),
        (*ONE, "--drive", "push=limbs.fin.joint.torque"),
        (*ONE, "--error", "push=1 N"),
        (*ONE, "--error", "angle=1 N"),
        (*ONE, "--error", "angle=0 deg"),
        (*ONE, "--skip", "9 s"),
        (*ONE, "--skip", "-1 s"),
        (*ONE, "--starts", "0"),
        (*ONE, "--starts", "many"),
        (*ONE, "--test", "other.csv"),
        (*ONE, "--test", "slow.csv", "middle.csv", "fast.csv"),
        (*ONE, "--save", "fin.txt"),
        (*ONE, "--plot", "nowhere/fin.html"),
        (*ONE, "--write", "fin.nc"),
        (*ONE[:3], "missing.yaml", *ONE[4:]),
        (*ONE, "--set", "k=-1 N m/rad"),
    ]
    check_wrong(nectosome, cases, tmp_path)
