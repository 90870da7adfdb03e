"""`control fishtail`: runs on a simulated rig, logs and pages, and what is refused before anything moves."""

import sys
from pathlib import Path

import numpy as np
import pytest
from tests.rigs.ni_stand_in import Card

from nectosome.io import load_dataset

from .answers import check_wrong

RIGS = Path(__file__).parents[2] / "examples" / "rigs"
ASKED = ("control", "fishtail", "--reference", "sine", "--amplitude", "2mm", "--frequency", "0.5Hz", "--time", "2s")


def test_a_sine_is_followed_logged_and_drawn(nectosome, tmp_path):
    answer = nectosome(*ASKED, "--save", "run.nc", "--plot", "run.html")
    assert (answer.code, answer.err) == (0, "")
    for words in ("finished, 401 samples", "error, measured", "error, true", "bar", "written: run.nc"):
        assert words in answer.out
    run = load_dataset(tmp_path / "run.nc")
    assert run.attrs["status"] == "finished"
    assert run["reference"].values.max() == pytest.approx(2e-3, rel=1e-6)
    np.testing.assert_allclose(np.diff(run["time"]), 5e-3, atol=1e-9)
    assert "What the rig did" in (tmp_path / "run.html").read_text()


def test_runs_are_numbered_and_never_overwritten(nectosome, tmp_path):
    for k in (1, 2):
        assert nectosome(*ASKED, "--controller", "pid").code == 0
        assert (tmp_path / f"fishtail_{k}.nc").is_file()
    check_wrong(nectosome, [(*ASKED, "--save", "fishtail_1.nc")], tmp_path)


def test_learning_makes_a_log_a_run(nectosome, tmp_path):
    answer = nectosome(*ASKED, "--controller", "ilc", "--rounds", "2", "--save", "ilc.nc", "--plot", "ilc.html")
    assert (answer.code, answer.err) == (0, "")
    assert {file.name for file in tmp_path.glob("ilc*")} == {"ilc_1.nc", "ilc_2.nc", "ilc.html"}
    assert "error of run 2" in (tmp_path / "ilc.html").read_text()


def test_a_recording_is_a_reference(nectosome, tmp_path):
    t = np.arange(0, 1.0, 0.01)
    rows = [f"{x:.3f},{1.5 * np.sin(2 * np.pi * x) ** 2:.6f}" for x in t]
    (tmp_path / "wanted.csv").write_text("\n".join(["time (s),displacement (mm)", *rows]))
    answer = nectosome("control", "fishtail", "--reference", "wanted.csv", "--controller", "mpc", "--save", "r.nc")
    assert (answer.code, answer.err) == (0, "")
    assert load_dataset(tmp_path / "r.nc")["reference"].values.max() == pytest.approx(1.5e-3, rel=1e-3)


def test_a_card_is_driven_by_the_same_command(nectosome, tmp_path, monkeypatch):
    """A stand-in for a card, whose laser sees 25 mm/bar after 20 ms: less than the model says, and sooner."""
    card = Card()
    monkeypatch.setitem(sys.modules, "nidaqmx", card.module())
    text = (RIGS / "fishtail_ni.yaml").read_text().rstrip()
    (tmp_path / "rig.yaml").write_text(f"{text}\n  overruns_share: 0.9\n  overruns_in_row: 500\n")
    answer = nectosome(*ASKED, "--rig", "ni", "--config", "rig.yaml", "--save", "run.nc")
    assert (answer.code, answer.err) == (0, "")
    assert "sine on National Instruments: finished, 401 samples" in answer.out
    assert "true" not in answer.out
    run = load_dataset(tmp_path / "run.nc")
    assert np.std(run["measured"].values[100:] - run["reference"].values[100:]) < 0.5e-3
    assert card.volts["Dev1/ao0"] == card.volts["Dev1/ao1"] == 5.0
    card.unplugged = True
    answer = nectosome(*ASKED, "--rig", "ni", "--config", "rig.yaml", "--save", "gone.nc")
    assert answer.code == 1
    assert "Dev1" in answer.err and len(answer.err.splitlines()) == 1


def test_mistakes_are_told_and_nothing_moves(nectosome, tmp_path):
    (tmp_path / "no.csv").write_text("time (s),pressure (bar)\n0,0\n1,1\n")
    (tmp_path / "junk.nc").write_text("junk")
    plain = ("control", "fishtail", "--reference")
    sine = (*plain, "sine", "--amplitude", "6mm", "--frequency")
    check_wrong(
        nectosome,
        [
            ("control", "fishtail"),
            (*plain, "sinus"),
            (*plain, "sine"),
            (*plain, "sine", "--amplitude", "6mm"),
            (*plain, "sine", "--amplitude", "6", "--frequency", "1Hz"),
            (*plain, "sine", "--amplitude", "-6mm", "--frequency", "1Hz"),
            (*plain, "chirp", "--amplitude", "6mm", "--frequency", "1Hz"),
            (*plain, "variable", "--amplitude", "6mm"),
            (*plain, "gone.csv"),
            (*plain, "no.csv"),
            (*sine, "0Hz"),
            (*sine, "nanHz"),
            (*sine, "1Hz", "--time", "0s"),
            (*sine, "1Hz", "--controller", "pip"),
            (*sine, "1Hz", "--gains", "1,2"),
            (*sine, "1Hz", "--gains", "1,2,-3"),
            (*sine, "1Hz", "--gains", "a,b,c"),
            (*sine, "1Hz", "--rig", "usb"),
            (*sine, "1Hz", "--rig", "ni"),
            (*sine, "1Hz", "--rig", "ni", "--config", "gone.yaml"),
            (*sine, "1Hz", "--rig", "ni", "--config", str(RIGS / "servo_dynamixel.yaml")),
            (*sine, "1Hz", "--config", "gone.yaml"),
            (*sine, "1Hz", "--rig", "ni", "--config", "gone.yaml", "--real-time"),
            (*sine, "1Hz", "--model", "gone.nc"),
            (*sine, "1Hz", "--model", "junk.nc"),
            (*sine, "1Hz", "--controller", "ilc", "--rounds", "0"),
            (*sine, "1Hz", "--save", "run.txt"),
            (*sine, "1Hz", "--save", "gone/run.nc"),
            (*sine, "1Hz", "--plot", "run.pdf"),
            (*sine, "4Hz"),
            (*plain, "sine", "--amplitude", "30mm", "--frequency", "0.04Hz"),
            (*sine, "0.5Hz", "--controller", "pid", "--gains", "0.05,5,0.001"),
            (*sine, "0.5Hz", "--controller", "pid", "--gains", "0,0.01,0"),
        ],
        tmp_path,
    )
