"""`rig check`, `tare`, `calibrate` and `run`: what they print and write, and what is refused before anything moves."""

import io
import json
import re
import sys
from pathlib import Path

import numpy as np
import pytest
from tests.rigs.ni_stand_in import Card

from nectosome.io import load_dataset
from nectosome.rigs.rig_file import load_rig

from .answers import check_wrong

RIGS = Path(__file__).parents[2] / "examples" / "rigs"
PLAN = """
signals:
  tail.pressure: {kind: sine, amplitude: [5 kPa, 10 kPa], frequency: 4 Hz}
periods: 2
ramp: 0.5 s
columns: {pressure: tail.pressure.command, displacement: tail.displacement}
"""
CELL = """\
dt: 5 ms # 200 Hz
devices:
  cell:
    kind: ni
    inputs: # an amplifier
      thrust: {channel: Dev1/ai1, zero: 2.5 V, slope: 8 N/V, low: 0 V, high: 5 V} # 20 N
measurements:
  cell.thrust: {least: -18 N, most: 18 N}
"""
RUN = ("rig", "run", "plan.yaml", "--config", "tail.yaml")
ON_CELL = ("--config", "cell.yaml", "--channel", "cell.thrust", "--time", "0.3s")


class Noisy(dict):
    """Volts with noise of 1 mV, drawn anew at each reading."""

    draw = np.random.default_rng(1)

    def __getitem__(self, channel):
        return super().__getitem__(channel) + 1e-3 * self.draw.standard_normal()


@pytest.fixture
def tail(tmp_path):
    """A simulated rig and a plan for it."""
    (tmp_path / "tail.yaml").write_text((RIGS / "fishtail_simulated.yaml").read_text())
    (tmp_path / "plan.yaml").write_text(PLAN)


@pytest.fixture
def cell(tmp_path, monkeypatch):
    """A load cell on a stand-in for a card."""
    card = Card()
    card.inputs = Noisy({"Dev1/ai1": 2.5})
    monkeypatch.setitem(sys.modules, "nidaqmx", card.module())
    (tmp_path / "cell.yaml").write_text(CELL)
    return card


def test_a_check_tells_noise_gaps_and_rate_of_every_channel_and_moves_nothing(nectosome, tail):
    """0.05 mm of a range of 50 mm; the simulated clock gives 200 samples a second."""
    answer = nectosome("rig", "check", "--config", "tail.yaml", "--json")
    assert (answer.code, answer.err) == (0, "")
    found = json.loads(answer.out)
    assert found["values"]["rate"]["value"] == pytest.approx(200.0)
    row = found["tables"]["channels"]["tail.displacement"]
    assert row["deviation"] == {"value": pytest.approx(5e-5, rel=0.15), "unit": "m"}
    assert row["noise"]["value"] == pytest.approx(1e-3, rel=0.15)
    assert row["missing"]["value"] == 0.0


@pytest.mark.parametrize(
    ("volts", "words"),
    [(5.5, "100 % of the readings are missing"), (4.9, "and -18 to 18 N are allowed"), (None, "to the last bit")],
)
def test_a_check_says_what_looks_wrong(nectosome, cell, volts, words):
    """Out of the sensor's range, out of the limits, and the same to the last bit."""
    cell.inputs = {"Dev1/ai1": 2.5} if volts is None else Noisy({"Dev1/ai1": volts})
    answer = nectosome("rig", "check", "--config", "cell.yaml", "--time", "0.1s")
    assert answer.code == 1
    assert words in " ".join(answer.out.split())
    assert not cell.powered


def test_a_device_that_fails_or_is_not_there_is_told(nectosome, cell):
    cell.unplugged = True
    answer = nectosome("rig", "check", "--config", "cell.yaml")
    assert answer.code == 2 and "Nothing was commanded." in answer.err
    assert len(answer.err.splitlines()) == 1


def test_a_tare_finds_the_zero_and_writes_it_only_when_it_is_told_to(nectosome, cell, tmp_path):
    """2.6 V at rest: the zero in the file, 2.5 V, is 0.1 V off; its comments stay."""
    cell.inputs = Noisy({"Dev1/ai1": 2.6})
    answer = nectosome("rig", "tare", *ON_CELL)
    assert (answer.code, answer.err) == (0, "")
    said = re.search(r"devices\.cell\.inputs\.thrust: zero: (\S+) V", " ".join(answer.out.split()))
    assert said is not None and float(said[1]) == pytest.approx(2.6, abs=5e-4)
    assert (tmp_path / "cell.yaml").read_text() == CELL
    answer = nectosome("rig", "tare", *ON_CELL, "--apply")
    assert (answer.code, answer.out.splitlines()[-1]) == (0, "written: cell.yaml")
    text = (tmp_path / "cell.yaml").read_text()
    zero = load_rig(tmp_path / "cell.yaml").rig.devices["cell"].wiring.inputs["thrust"].zero
    assert zero == pytest.approx(2.6, abs=5e-4)
    assert text == CELL.replace("zero: 2.5 V", f"zero: {zero:g} V")


def test_a_calibration_asks_for_each_load_and_finds_slope_and_zero(nectosome, cell, tmp_path, monkeypatch):
    """The cell gives 2.4 V at rest and 0.1 V/N: 10 N/V."""

    class Hanging(io.StringIO):
        loads = iter((0.0, 5.0, 10.0, 0.0))

        def readline(self, *_):
            cell.inputs = Noisy({"Dev1/ai1": 2.4 + 0.1 * next(self.loads)})
            return "\n"

    monkeypatch.setattr(sys, "stdin", Hanging())
    answer = nectosome("rig", "calibrate", *ON_CELL, "--known", "0 N, 5 N, 10 N, 0 N", "--apply")
    assert answer.code == 0
    assert answer.err.splitlines()[1] == "load 2 of 4: put on 5 N, wait until it hangs still, then press Enter."
    sensor = load_rig(tmp_path / "cell.yaml").rig.devices["cell"].wiring.inputs["thrust"]
    assert (sensor.slope, sensor.zero) == (pytest.approx(10.0, rel=1e-3), pytest.approx(2.4, abs=1e-3))
    assert "# an amplifier" in (tmp_path / "cell.yaml").read_text()


def test_a_calibration_takes_readings_of_a_file(nectosome, cell, tmp_path):
    """By hand: x = 1, 2, 3 V, y = 0, 9, 21 N: slope 10.5 N/V, zero 2 - 10/10.5 V, residuals 0.5, -1, 0.5 N."""
    (tmp_path / "loads.csv").write_text("reading (V),load (N)\n1,0\n2,9\n3,21\n")
    argv = ("rig", "calibrate", *ON_CELL, "--readings", "loads.csv", "--json")
    found = json.loads(nectosome(*argv).out)
    rows = found["tables"]["calibration"]
    assert rows["slope"]["value"] == {"value": pytest.approx(10.5), "unit": "N/V"}
    assert rows["zero"]["value"]["value"] == pytest.approx(2 - 10 / 10.5)
    assert rows["slope"]["error"]["value"] == pytest.approx(np.sqrt(1.5 / 1 / 2))
    assert [row["residual"]["value"] for row in found["tables"]["readings"]] == pytest.approx([0.5, -1.0, 0.5])
    assert (tmp_path / "cell.yaml").read_text() == CELL


def test_many_readings_of_a_load_are_one_row(nectosome, cell, tmp_path):
    rows = [f"{x + e:g},{y}" for x, y in ((1, 0), (2, 10), (3, 20)) for e in (-0.01, 0.0, 0.01)]
    (tmp_path / "loads.csv").write_text("\n".join(["reading (V),load (N)", *rows]) + "\n")
    told = nectosome("rig", "calibrate", *ON_CELL, "--readings", "loads.csv").out
    assert "9 readings of 3 loads" in told
    row = next(line for line in told.splitlines() if line.startswith("10 N"))
    assert row.split()[:4] == ["10", "N", "3", "2"]
    assert sum(" N " in line for line in told.splitlines()) == 3


def test_a_plan_is_listed_and_nothing_is_written(nectosome, tail, tmp_path):
    before = sorted(tmp_path.iterdir())
    answer = nectosome(*RUN, "--dry-run")
    assert (answer.code, answer.err) == (0, "")
    assert "2 runs, 0:04 in all" in answer.out
    assert "run_002  10 kPa" in answer.out and "frequency: 4 Hz" in answer.out
    assert sorted(tmp_path.iterdir()) == before


def test_runs_are_a_campaign_that_the_next_command_reads(nectosome, tail, tmp_path):
    answer = nectosome(*RUN, "--out", "runs")
    assert answer.code == 0 and "2 of 2 runs finished" in answer.out
    assert answer.out.splitlines()[-1] == "written: runs/campaign.yaml"
    answer = nectosome("measure", "--campaign", "runs/campaign.yaml")
    assert (answer.code, answer.err) == (0, "")
    assert "amplitude: 5000 Pa" in answer.out and "tail.pressure.command" in answer.out
    assert load_dataset(tmp_path / "runs" / "run_001.nc").attrs["status"] == "finished"
    again = nectosome(*RUN, "--out", "runs")
    assert again.code == 0 and "2 runs of 2 there already" in again.err
    (tmp_path / "plan.yaml").write_text(PLAN.replace("10 kPa", "12 kPa"))
    check_wrong(nectosome, [(*RUN, "--out", "runs")], tmp_path)
    answer = nectosome(*RUN, "--out", "runs", "--force")
    assert answer.code == 0
    assert len(list((tmp_path / "runs" / "set_aside").iterdir())) == 2


def test_runs_that_are_left_out_are_told_with_exit_code_1(nectosome, tail, tmp_path):
    text = (tmp_path / "tail.yaml").read_text()
    (tmp_path / "tail.yaml").write_text(text.replace("least: -25 mm, most: 25 mm", "least: -1 mm, most: 1 mm"))
    answer = nectosome(*RUN, "--out", "runs")
    assert answer.code == 1
    assert "left out: run_002: at " in answer.err and "attempt 3 of 3" in answer.err


def test_wrong_input_is_refused_before_anything_moves(nectosome, tail, cell, tmp_path):
    (tmp_path / "steep.yaml").write_text(PLAN.replace("4 Hz", "40 Hz"))
    (tmp_path / "few.csv").write_text("reading (V),load (N)\n1,0\n2,9\n")
    (tmp_path / "other.csv").write_text("reading (V),load (kg)\n1,0\n2,9\n3,4\n")
    on_cell = ("rig", "calibrate", *ON_CELL)
    check_wrong(
        nectosome,
        [
            RUN,
            (*RUN, "--out", "runs", "--dry-run"),
            ("rig", "run", "steep.yaml", "--config", "tail.yaml", "--dry-run"),
            ("rig", "run", "tail.yaml", "--config", "tail.yaml", "--dry-run"),
            ("rig", "run", "gone.yaml", "--config", "tail.yaml", "--dry-run"),
            ("rig", "check", "--config", "plan.yaml"),
            ("rig", "check", "--config", "tail.yaml", "--time", "0s"),
            ("rig", "tare", "--config", "tail.yaml", "--channel", "tail.displacement"),
            ("rig", "tare", "--config", "cell.yaml", "--channel", "cell.force"),
            on_cell,
            (*on_cell, "--known", "0 N, 1 N"),
            (*on_cell, "--known", "0 mm, 1 mm, 2 mm"),
            (*on_cell, "--readings", "few.csv"),
            (*on_cell, "--readings", "other.csv"),
            (*on_cell, "--known", "0 N, 1 N, 2 N", "--readings", "few.csv"),
        ],
        tmp_path,
    )
