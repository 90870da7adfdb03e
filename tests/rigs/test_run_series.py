"""A series of runs is a campaign: whole after kills and guards, with every condition and repeat once."""

import json
import os
import signal
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from nectosome.identification import identify_hysteresis
from nectosome.io import load_dataset
from nectosome.measure import load_campaign
from nectosome.rigs import RigError
from nectosome.rigs.devices.simulated_actuator import gain_of
from nectosome.rigs.rig_file import load_rig
from nectosome.rigs.run_plan import load_plan
from nectosome.rigs.run_series import CAMPAIGN, run_series
from nectosome.units import InputError

GAIN, FREQUENCY, DAMPING = 46e-3 / 1e5, 18.6, 0.8  # m/Pa, rad/s, -
RIG = """
dt: 5 ms
devices: {tail: {kind: simulated, gain: 46 mm/bar, frequency: 18.6 rad/s, damping: 0.8, noise: 0.05 mm}}
commands: {tail.pressure: {low: -0.6 bar, high: 0.6 bar, slew: 3.8 bar/s}}
measurements: {tail.displacement: {least: -25 mm, most: 25 mm}}
"""
PLAN = """
about: sines of pressure
signals:
  tail.pressure: {kind: sine, amplitude: [5 kPa, 10 kPa], frequency: [1 Hz, 2 Hz, 4 Hz]}
periods: 4
ramp: 0.5 s
repeats: 2
rest: 3 s
conditions: {depth: 0.3 m}
columns: {pressure: tail.pressure.command, displacement: tail.displacement}
"""
PAIRS = {(a, f) for a in (5e3, 1e4) for f in (1.0, 2.0, 4.0)}


def series_of(folder, plan=PLAN, rig=RIG, tell=None, **options):
    """Take the runs of a plan in `folder`/out."""
    (folder / "plan.yaml").write_text(plan)
    (folder / "rig.yaml").write_text(rig)
    planned = load_plan(folder / "plan.yaml", load_rig(folder / "rig.yaml"))
    return run_series(planned, folder / "out", lambda *_: None, tell or (lambda _: None), **options)


def conditions_of(folder) -> Counter:
    runs = load_campaign(folder / "out" / CAMPAIGN).recordings()
    return Counter((float(run["amplitude"]), float(run["frequency"]), int(run["repeat"])) for run in runs)


def whole() -> Counter:
    return Counter((*pair, repeat) for pair in PAIRS for repeat in (1, 2))


@pytest.fixture(scope="module")
def taken(tmp_path_factory):
    """The folder of a whole series."""
    folder = tmp_path_factory.mktemp("series")
    assert series_of(folder).status == "finished"
    return folder


def test_a_grid_is_a_campaign_with_conditions_repeats_and_units(taken):
    assert conditions_of(taken) == whole()
    for run in load_campaign(taken / "out" / CAMPAIGN).recordings():
        assert {name: of.attrs["units"] for name, of in run.data_vars.items()} == {
            "pressure": "Pa",
            "displacement": "m",
        }
        assert (float(run["depth"]), run["depth"].attrs["units"]) == (0.3, "m")
        assert float(np.abs(run["pressure"]).max()) == pytest.approx(float(run["amplitude"]), rel=3e-3)
        np.testing.assert_allclose(np.diff(run["time"]), 5e-3, atol=1e-9)


def test_a_command_counts_as_held_until_the_next_sample(taken):
    """Lines of a column go through the middles of its steps: at a sample it has the mean of the two that meet there."""
    log = load_dataset(taken / "out" / "run_001.nc")["tail.pressure.command"].values
    run = load_campaign(taken / "out" / CAMPAIGN).recordings()[0]
    np.testing.assert_allclose(run["pressure"].values[1:], 0.5 * (log[:-1] + log[1:]), atol=1e-6)
    assert np.isnan(run["pressure"].values[0])  # what was before is not known
    assert json.loads(run.attrs["window"]) == "1..5 s"  # 0.5 s at rest, 0.5 s of growth, 4 periods of 1 Hz


def test_a_run_tells_its_clock_calibration_conditions_and_window(taken):
    """Within the window the displacement is G A / |1 - (w/w0)^2 + 2i z w/w0|, of its sine at the known frequency."""
    data = load_dataset(taken / "out" / "run_002.nc")
    assert gain_of(json.loads(data.attrs["devices"])["tail"]["gain"]) == (pytest.approx(GAIN), "Pa", "m")
    assert json.loads(data.attrs["conditions"]) == {"depth": "0.3 m", "amplitude": "5 kPa", "frequency": "2 Hz"}
    assert data.attrs["clock"].startswith("of the simulation")
    begin, end = json.loads(data.attrs["window"])
    assert (begin, end) == (1.0, 3.0)
    part = data.isel(time=(data["time"].values >= begin + 0.5) & (data["time"].values < begin + 1.5))
    turn = np.exp(-2j * np.pi * 2.0 * part["time"].values)
    size = 2 * abs(np.mean(part["tail.displacement"].values * turn))
    ratio = 2 * np.pi * 2.0 / FREQUENCY
    # 200 samples of noise of 0.05 mm: 5e-6 m of the amplitude
    assert size == pytest.approx(GAIN * 5e3 / abs(1 - ratio**2 + 2j * DAMPING * ratio), abs=2e-5)


def test_the_gain_of_the_actuator_is_identified_within_its_interval(tmp_path):
    """Slow sines, so that the delay of one sample, which is not asked for, counts as damping: 46 mm/bar, no hysteresis.

    The slopes of all nine plays are that gain within half a percent; it is in the 95 % interval of the first and of
    seven or more (99 % of all cases).
    """
    plan = PLAN.replace("[5 kPa, 10 kPa]", "[10 kPa, 20 kPa, 30 kPa]").replace("[1 Hz, 2 Hz, 4 Hz]", "[0.1 Hz, 0.2 Hz]")
    plan = plan.replace("periods: 4", "periods: 1").replace("repeats: 2", "repeats: 1")
    series_of(tmp_path, plan, RIG.replace("dt: 5 ms", "dt: 2 ms"))
    result = identify_hysteresis(tmp_path / "out" / CAMPAIGN)
    found = result.to_dataset()
    slopes = found.sel(parameter=[name for name in map(str, found["parameter"].values) if name.startswith("slope")])
    holds = (slopes["low"].values <= GAIN) & (slopes["high"].values >= GAIN)
    assert holds[0] and holds.sum() >= 7 and len(holds) == 9
    np.testing.assert_allclose(slopes["value"], GAIN, rtol=5e-3)
    assert result.found.noise == pytest.approx(5e-5, rel=0.05)


@pytest.mark.slow
def test_frequency_damping_and_dead_time_of_the_simulated_valve_are_identified_within_their_intervals(tmp_path):
    """The rig of the examples, whose valve acts a sample later at up to 3.8 bar/s: 18.6 rad/s, 1.0, 5 ms.

    Commands of up to 2.5 bar/s are reached within two thirds of a sample. The steps of the simulation, a fifth of the
    sample, make the dead time longer by up to half of that.
    """
    plan = PLAN.replace("[5 kPa, 10 kPa]", "[5 kPa, 20 kPa]").replace("[1 Hz, 2 Hz, 4 Hz]", "[1 Hz, 2 Hz]")
    plan = plan.replace("repeats: 2", "repeats: 1")
    rig = Path(__file__).parents[2] / "examples" / "rigs" / "fishtail_simulated.yaml"
    series_of(tmp_path, plan, rig.read_text())
    campaign = tmp_path / "out" / CAMPAIGN
    found = identify_hysteresis(campaign, slew=True, dead_time=True).found
    for name, value in (("frequency", 18.6), ("damping", 1.0), ("dead_time", 5e-3), ("slew", 3.8e5)):
        assert found.intervals[name].low < value < found.intervals[name].high
    assert found.intervals["frequency"].high - found.intervals["frequency"].low < 1.0
    assert found.intervals["damping"].high - found.intervals["damping"].low < 0.05
    assert found.intervals["dead_time"].high - found.intervals["dead_time"].low < 2.5e-3
    assert found.noise == pytest.approx(5e-5, rel=0.05) and not found.warnings
    without = identify_hysteresis(campaign).found
    assert without.theta["frequency"] < 17.5
    assert any("a dead time of" in text for text in without.warnings)


def test_repeats_have_noise_of_their_own(taken):
    """5e-5 m each, so the difference of two has sqrt(2) of that."""
    first, second = (load_dataset(taken / "out" / f"run_{k:03d}.nc")["tail.displacement"].values for k in (1, 7))
    assert np.std(first - second) == pytest.approx(5e-5 * np.sqrt(2), rel=0.1)


def test_the_same_again_takes_nothing_anew(taken):
    before = {path.name: path.stat().st_mtime_ns for path in (taken / "out").glob("run_*.nc")}
    told = []
    series = series_of(taken, tell=told.append)
    assert len(series.finished) == 12
    assert {path.name: path.stat().st_mtime_ns for path in (taken / "out").glob("run_*.nc")} == before
    assert told == ["12 runs of 12 there already; it goes on."]


def test_another_plan_or_rig_is_refused_with_what_differs(taken):
    """Only what it is about may change, and what its campaign calls things."""
    for plan, rig, words in (
        (PLAN.replace("10 kPa", "12 kPa"), RIG, r"plan\.signals\.tail\.pressure\.amplitude is .*12 kPa.* was .*10 kPa"),
        (PLAN, RIG.replace("0.8", "0.7"), r"rig\.devices\.tail\.damping is 0.7 and was 0.8"),
    ):
        with pytest.raises(InputError, match=words):
            series_of(taken, plan, rig)
    renamed = PLAN.replace("sines of", "more sines of").replace("{pressure:", "{p:") + "names: {f: frequency}\n"
    assert len(series_of(taken, renamed).finished) == 12
    run = load_campaign(taken / "out" / CAMPAIGN).recordings()[0]
    assert "p" in run.data_vars and "f" in run.coords
    assert len(series_of(taken).finished) == 12


def test_a_new_series_sets_the_old_one_aside(tmp_path):
    plan = PLAN.replace("repeats: 2", "repeats: 1").replace("[1 Hz, 2 Hz, 4 Hz]", "4 Hz")
    series_of(tmp_path, plan)
    series_of(tmp_path, plan.replace("10 kPa", "12 kPa"), anew=True)
    assert {path.name for path in (tmp_path / "out" / "set_aside").iterdir()} == {"run_001_1.nc", "run_002_1.nc"}
    runs = load_campaign(tmp_path / "out" / CAMPAIGN).recordings()
    assert sorted(float(run["amplitude"]) for run in runs) == [5e3, 12e3]


KILLED = """
import os, signal, sys
from pathlib import Path
import nectosome.rigs.simulated_rig as simulated
from nectosome.rigs.rig_file import load_rig
from nectosome.rigs.run_plan import load_plan
from nectosome.rigs.run_series import run_series

left = [int(sys.argv[1])]
measure = simulated.SimulatedRig.measure

def killing(rig):
    left[0] -= 1
    if left[0] == 0:
        import time
        time.sleep(0.5)  # what waits for the journal is written: all but the last milliseconds
        os.kill(os.getpid(), signal.SIGKILL)
    return measure(rig)

simulated.SimulatedRig.measure = killing
plan = load_plan("plan.yaml", load_rig("rig.yaml"))
run_series(plan, Path("out"), lambda *_: None, print)
"""


def test_a_series_that_is_killed_twice_goes_on_and_nothing_is_lost_or_doubled(tmp_path):
    """Killed within its third run and, later, within its sixth: what both had measured is set aside."""
    (tmp_path / "plan.yaml").write_text(PLAN)
    (tmp_path / "rig.yaml").write_text(RIG)
    lengths = [round((0.5 + 1.0 + 4 / f) / 5e-3) + 1 for f in (1.0, 2.0, 4.0)] * 2
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    for samples in (lengths[0] + lengths[1] + 300, sum(lengths[2:5]) + 200):
        done = subprocess.run(
            [sys.executable, "-c", KILLED, str(samples)], cwd=tmp_path, env=environment, timeout=120, check=False
        )
        assert done.returncode == -signal.SIGKILL
    told = []
    series = series_of(tmp_path, tell=told.append)
    assert series.status == "finished"
    assert conditions_of(tmp_path) == whole()
    aside = sorted((tmp_path / "out" / "set_aside").iterdir())
    assert [path.name for path in aside] == ["run_003_1.nc", "run_006_1.nc"]
    assert [load_dataset(path).sizes["time"] for path in aside] == [299, 199]
    assert all(load_dataset(path).attrs["status"] == "killed" for path in aside)
    assert not list((tmp_path / "out").glob("*.csv"))
    assert "run_006 was broken off" in told[0]


def test_a_run_that_was_killed_when_all_was_measured_is_kept(tmp_path):
    """Its journal says that it has finished, and its file is not there yet."""
    plan = PLAN.replace("repeats: 2", "repeats: 1").replace("[1 Hz, 2 Hz, 4 Hz]", "4 Hz")
    series_of(tmp_path, plan)
    path = tmp_path / "out" / "run_002.nc"
    whole = load_dataset(path)
    head = "".join(f"# {name}: {json.dumps(value)}\n" for name, value in whole.attrs.items() if isinstance(value, str))
    names = ["time", *map(str, whole.data_vars)]
    columns = ",".join(f"{name} [{whole[name].attrs.get('units', 's')}]" for name in names)
    rows = "".join(",".join(map(repr, map(float, row))) + "\n" for row in np.column_stack([whole[n] for n in names]))
    lines = [line for line in head.splitlines(keepends=True) if not line.startswith("# status")]
    path.with_suffix(".csv").write_text(
        "".join(lines) + columns + "\n" + rows + '# status: "finished"\n# status_reason: "all samples were taken."\n'
    )
    path.unlink()
    before = (tmp_path / "out" / "run_001.nc").stat().st_mtime_ns
    assert series_of(tmp_path, plan).finished == ["run_001", "run_002"]
    assert (tmp_path / "out" / "run_001.nc").stat().st_mtime_ns == before
    np.testing.assert_array_equal(load_dataset(path)["tail.displacement"], whole["tail.displacement"])
    assert not (tmp_path / "out" / "set_aside").exists()


def test_runs_out_of_range_are_repeated_told_and_left_out(tmp_path):
    """At 1 Hz 10 kPa move by 4.2 mm or so, and 3 mm are allowed: both runs of it lack, each tried twice."""
    rig = RIG.replace("least: -25 mm, most: 25 mm", "least: -3 mm, most: 3 mm")
    plan = PLAN.replace("frequency: [1 Hz, 2 Hz, 4 Hz]", "frequency: 1 Hz") + "attempts: 2\n"
    told = []
    series = series_of(tmp_path, plan, rig, told.append)
    assert (series.status, series.finished) == ("finished", ["run_001", "run_003"])
    assert series.reason == "2 of 4 runs left out."
    assert series.repeated == {"run_002": 2, "run_004": 2}
    assert all("3" in why and "allowed" in why for why in series.left_out.values())
    assert [text.partition(":")[0] for text in told] == [
        f"{name} (amplitude 10 kPa), attempt {attempt} of 2"
        for name in ("run_002", "run_004") for attempt in (1, 2)
    ]  # fmt: skip
    assert len(list((tmp_path / "out" / "set_aside").iterdir())) == 4
    runs = load_campaign(tmp_path / "out" / CAMPAIGN).recordings()
    assert [(float(run["pressure"].max()) < 6e3, int(run["repeat"])) for run in runs] == [(True, 1), (True, 2)]


def test_the_example_of_a_tail_rig_takes_its_whole_pressure(tmp_path):
    """0.6 bar both ways, as on the paper's rig: 24 mm, within the 25 mm of the guard; no sample is clamped."""
    rig = (Path(__file__).parents[2] / "examples" / "rigs" / "fishtail_simulated.yaml").read_text()
    plan = """
signals: {tail.pressure: {kind: sine, amplitude: 0.6 bar, frequency: 0.25 Hz}}
periods: 1
ramp: 1 s
"""
    told = []
    series = series_of(tmp_path, plan, rig, told.append)
    assert (series.finished, series.reason, told) == (["run_001"], "all runs are there.", [])


def test_a_device_that_fails_ends_the_series_which_goes_on_later(tmp_path, monkeypatch):
    from nectosome.rigs.simulated_rig import SimulatedRig

    measure, left = SimulatedRig.measure, [600]

    def failing(rig):
        left[0] -= 1
        if left[0] == 0:
            raise RigError("tail: the cable is out.")
        return measure(rig)

    monkeypatch.setattr(SimulatedRig, "measure", failing)
    plan = PLAN.replace("frequency: [1 Hz, 2 Hz, 4 Hz]", "frequency: 4 Hz")
    series = series_of(tmp_path, plan)
    assert series.status == "failed" and "run_002: " in series.reason and "the cable is out" in series.reason
    assert series_of(tmp_path, plan).finished == ["run_001", "run_002", "run_003", "run_004"]


def test_a_rig_rests_between_runs_and_not_before_the_first(tmp_path, monkeypatch):
    """By the rig's clock: three pauses of 3 s between four runs of 2.5 s, 500 steps of the ramp to 0 at most apart."""
    from nectosome.rigs.simulated_rig import SimulatedRig

    opened, closed = [], []
    begin, end = SimulatedRig.open, SimulatedRig.close
    monkeypatch.setattr(SimulatedRig, "open", lambda rig: (opened.append(rig.now()), begin(rig))[1])
    monkeypatch.setattr(SimulatedRig, "close", lambda rig: (closed.append(rig.now()), end(rig))[1])
    series_of(tmp_path, PLAN.replace("frequency: [1 Hz, 2 Hz, 4 Hz]", "frequency: 4 Hz"))
    assert opened[0] == 0.0
    pauses = [start - stop for start, stop in zip(opened[1:], closed, strict=False)]
    assert pauses == pytest.approx([3.0] * 3, abs=2e-3)


def test_one_process_works_in_a_folder(tmp_path):
    """A second one must not take the journal of the first for that of a kill."""
    plan = PLAN.replace("repeats: 2", "repeats: 1")
    holder = "import fcntl, time, pathlib; pathlib.Path('out').mkdir(); f = open('out/lock', 'ab'); "
    holder += "fcntl.flock(f, fcntl.LOCK_EX); print('held', flush=True); time.sleep(30)"
    with subprocess.Popen([sys.executable, "-c", holder], cwd=tmp_path, stdout=subprocess.PIPE) as process:
        assert process.stdout is not None and process.stdout.readline()
        began = time.monotonic()
        try:
            with pytest.raises(InputError, match="another process"):
                series_of(tmp_path, plan)
        finally:
            process.kill()
    assert time.monotonic() - began < 20
    assert not (Path(tmp_path) / "out" / CAMPAIGN).exists()
