"""`control rig`: runs on a simulated rig, logs and pages, and what is refused before anything moves."""

import sys
from pathlib import Path

import numpy as np
import pytest
from tests.rigs.motor_emulator import Microcontroller
from tests.rigs.ni_stand_in import Card
from tests.rigs.tail import save_tail

from nectosome.io import load_dataset

from .answers import check_wrong

RIGS = Path(__file__).parents[2] / "examples" / "rigs"
LINEAR = "gain: 40 mm/bar, frequency: 18.6 rad/s, damping: 1.0"
SIMULATED = (RIGS / "fishtail_simulated.yaml").read_text().replace(LINEAR, "model: tail.nc")
RIG = ("control", "rig", "--config", "tail.yaml")
GAINS = ("--gains", "0.00523,0.866,0.00489")
SINE = (*RIG, "--reference", "sine", "--amplitude", "2mm", "--frequency", "0.5Hz", "--time", "2s", *GAINS)


@pytest.fixture
def tail(tmp_path):
    """A simulated rig of the pneumatic tail."""
    save_tail(tmp_path / "tail.nc")
    (tmp_path / "tail.yaml").write_text(SIMULATED)


def test_a_sine_is_tracked_logged_and_drawn(nectosome, tail, tmp_path):
    answer = nectosome(*SINE, "--save", "run.nc", "--plot", "run.html")
    assert (answer.code, answer.err) == (0, "")
    for words in (
        "sine on simulated rig: finished, 401 samples",
        "measured error",
        "true error",
        "kPa",
        "written: run.nc",
    ):
        assert words in answer.out
    run = load_dataset(tmp_path / "run.nc")
    assert run.attrs["status"] == "finished"
    assert run["tail.displacement.reference"].values.max() == pytest.approx(2e-3, rel=1e-6)
    np.testing.assert_allclose(np.diff(run["time"]), 5e-3, atol=1e-9)
    page = (tmp_path / "run.html").read_text()
    assert "tail.displacement by tail.pressure" in page and "measured (mm)" in page and "command (kPa)" in page


def test_nothing_is_written_unasked_and_nothing_overwritten_without_force(nectosome, tail, tmp_path):
    before = sorted(tmp_path.iterdir())
    assert nectosome(*SINE, "--controller", "pid").code == 0
    assert sorted(tmp_path.iterdir()) == before
    assert nectosome(*SINE, "--save", "run.nc").code == 0
    check_wrong(nectosome, [(*SINE, "--save", "run.nc")], tmp_path)
    first = load_dataset(tmp_path / "run.nc").attrs["controller"]
    assert nectosome(*SINE, "--controller", "pid", "--save", "run.nc", "--force").code == 0
    assert load_dataset(tmp_path / "run.nc").attrs["controller"] != first


def test_the_example_of_a_simulated_rig_runs_as_it_is(nectosome):
    """Its model is linear; gains are found on it."""
    wave = ("--reference", "sine", "--amplitude", "6mm", "--frequency", "0.1Hz")
    answer = nectosome("control", "rig", "--config", str(RIGS / "fishtail_simulated.yaml"), *wave)
    assert (answer.code, answer.err) == (0, "")
    assert "sine on simulated rig: finished, 4001 samples" in answer.out


def test_a_table_is_a_log_too(nectosome, tail, tmp_path):
    assert nectosome(*SINE, "--save", "run.csv").code == 0
    rows = (tmp_path / "run.csv").read_text().splitlines()
    names = "tail.displacement (m),tail.pressure.command (Pa),tail.displacement.reference (m)"
    assert rows[0] == f"time (s),{names},late (s)" and len(rows) == 402
    assert {path.name for path in tmp_path.iterdir()} == {"run.csv", "tail.nc", "tail.yaml"}


def test_gains_are_found_where_none_are_given(nectosome, tail):
    answer = nectosome(*SINE[: -len(GAINS)])
    assert (answer.code, answer.err) == (0, "")
    assert "finished, 401 samples" in answer.out


def test_learning_makes_a_log_a_run(nectosome, tail, tmp_path):
    answer = nectosome(*SINE, "--controller", "ilc", "--rounds", "2", "--save", "ilc.nc", "--plot", "ilc.html")
    assert (answer.code, answer.err) == (0, "")
    assert {file.name for file in tmp_path.glob("ilc*")} == {"ilc_1.nc", "ilc_2.nc", "ilc.html"}
    assert "error of run 2" in (tmp_path / "ilc.html").read_text()


def test_a_recording_is_a_reference(nectosome, tail, tmp_path):
    t = np.arange(0, 1.0, 0.01)
    rows = [f"{x:.3f},{1.5 * np.sin(2 * np.pi * x) ** 2:.6f}" for x in t]
    (tmp_path / "wanted.csv").write_text("\n".join(["time (s),displacement (mm)", *rows]))
    answer = nectosome(*RIG, "--reference", "wanted.csv", "--controller", "pid", *GAINS, "--save", "r.nc")
    assert (answer.code, answer.err) == (0, "")
    reference = load_dataset(tmp_path / "r.nc")["tail.displacement.reference"]
    assert reference.values.max() == pytest.approx(1.5e-3, rel=1e-3)


def test_a_card_is_driven_by_the_same_command(nectosome, tail, tmp_path, monkeypatch):
    """A stand-in for a card, whose laser sees 25 mm/bar after 20 ms: less than the model says, and sooner."""
    card = Card()
    monkeypatch.setitem(sys.modules, "nidaqmx", card.module())
    text = (RIGS / "fishtail_ni.yaml").read_text().rstrip()
    (tmp_path / "tail.yaml").write_text(f"{text}\nguards: {{overruns_share: 0.9, overruns_in_row: 500}}\n")
    answer = nectosome(*SINE, "--model", "tail.nc", "--save", "run.nc")
    assert (answer.code, answer.err) == (0, "")
    assert "sine on National Instruments: finished, 401 samples" in answer.out
    assert "true" not in answer.out
    run = load_dataset(tmp_path / "run.nc")
    assert np.std(run["tail.displacement"].values[100:] - run["tail.displacement.reference"].values[100:]) < 0.5e-3
    assert card.volts["Dev1/ao0"] == card.volts["Dev1/ao1"] == 5.0
    free = nectosome(*SINE, "--save", "free.nc")
    assert free.code in (0, 1) and "not rehearsed: there is no --model" in free.out
    card.unplugged = True
    answer = nectosome(*SINE, "--model", "tail.nc", "--save", "gone.nc")
    assert answer.code == 2
    assert "Dev1" in answer.err and len(answer.err.splitlines()) == 1


def test_a_motor_turns_at_speeds_in_its_own_units_and_time(nectosome, tmp_path):
    """50 samples a second, rad/s and rpm; its speed loop runs on a stand-in for its microcontroller."""
    with Microcontroller() as motor:
        text = (RIGS / "motor_serial.yaml").read_text().replace("/dev/ttyACM0", motor.path).rstrip()
        text = text.replace("timeout: 20 ms, watchdog: 0.2 s", "timeout: 0.2 s, start: 0.2 s, watchdog: 1 s")
        (tmp_path / "motor.yaml").write_text(f"{text}\nguards: {{overruns_share: 0.9, overruns_in_row: 500}}\n")
        argv = ("control", "rig", "--config", "motor.yaml", "--reference", "60rpm", "--time", "2s", "--save", "m.nc")
        answer = nectosome(*argv, "--gains", "0.2,4,0")
    assert (answer.code, answer.err) == (0, "")
    run = load_dataset(tmp_path / "m.nc")
    assert run.sizes["time"] == 101 and run["motor.speed"].attrs["units"] == "rad/s"
    assert run["motor.speed"].values[-20:].mean() == pytest.approx(2 * np.pi, rel=0.05)


def test_mistakes_are_told_and_nothing_moves(nectosome, tail, tmp_path):
    (tmp_path / "no.csv").write_text("time (s),pressure (bar)\n0,0\n1,1\n")
    (tmp_path / "junk.nc").write_text("junk")
    plain = (*RIG, "--reference")
    sine = (*plain, "sine", "--amplitude", "6mm", "--frequency")
    servo = ("control", "rig", "--config", str(RIGS / "servo_dynamixel.yaml"), "--reference", "10deg")
    check_wrong(
        nectosome,
        [
            ("control", "rig"),
            ("control", "rig", "--reference", "1mm"),
            (*plain, "sinus"),
            (*plain, "sine"),
            (*plain, "sine", "--amplitude", "6mm"),
            (*plain, "sine", "--amplitude", "6", "--frequency", "1Hz"),
            (*plain, "sine", "--amplitude", "-6mm", "--frequency", "1Hz"),
            (*plain, "chirp", "--amplitude", "6mm", "--frequency", "1Hz"),
            (*plain, "chirp", "--amplitude", "6mm", "--frequency", "1Hz", "--to", "2Hz"),
            (*plain, "varying", "--amplitude", "4mm,6mm", "--frequency", "0.1Hz"),
            (*plain, "6deg"),
            (*plain, "gone.csv"),
            (*plain, "no.csv"),
            (*sine, "0Hz"),
            (*sine, "nanHz"),
            (*sine, "1Hz", "--time", "0s"),
            (*sine, "1Hz", "--controller", "pip"),
            (*sine, "1Hz", "--gains", "1,2"),
            (*sine, "1Hz", "--gains", "1,2,-3"),
            (*sine, "1Hz", "--gains", "a,b,c"),
            ("control", "rig", "--config", "gone.yaml", "--reference", "1mm"),
            servo,
            (*servo, "--controller", "mpc", "--gains", "1,0,0"),
            (*servo, "--gains", "1,0,0", "--model", "tail.nc"),
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


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("6deg",), '--reference: "6deg" is an angle. Length expected'),
        (("sine", "--amplitude", "6mm"), "--frequency: is missing. Frequency expected"),
        (("1mm", "--gains", "1,-2,0"), '--gains: "1,-2,0": gains must share one sign; use negative gains'),
    ],
)
def test_a_mistake_is_told_with_its_way_out(nectosome, tail, options, message):
    answer = nectosome(*RIG, "--reference", *options)
    assert answer.code == 2
    assert answer.err.startswith(message)
