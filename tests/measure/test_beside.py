"""Devices with files of their own: put on one clock by a pulse, joined at the times of the first."""

import json

import numpy as np
import pytest

from nectosome.measure import load_campaign
from nectosome.units import InputError

RATES = {"cell": 80.0, "servo": 100.0, "camera": 60.0}
STARTED = {"cell": 2.391, "servo": 3427.5, "camera": 0.0}  # what each clock says as all begin
LATE = {"cell": 0.0, "servo": 0.0, "camera": 0.02}
PULSE, F = (1.003, 1.203), 0.7


def write(folder, device, repeat, seed=0):
    """A pulse, and a sine of the one time of all; each device has a phase of its own between samples."""
    t = np.arange(0, 6, 1 / RATES[device]) + np.random.default_rng(seed).uniform(0, 1 / RATES[device])
    seen = np.sin(2 * np.pi * F * (t - LATE[device]))
    pulse = (t >= PULSE[0]) & (t < PULSE[1])
    rows = [f"{STARTED[device] + x:.6f},{y:.9f},{int(p)}" for x, y, p in zip(t, seen, pulse, strict=True)]
    (folder / f"{device}_{repeat}.csv").write_text("\n".join(["clock (s),seen,sync", *rows]) + "\n")


CAMPAIGN = """
time: {column: clock, trigger: sync}
columns: {force: {column: seen, unit: N}, sync: sync}
recordings:
  - file: cell_*.csv
    conditions: {f: 0.7 Hz}
    beside:
      servo:
        file: servo_*.csv
        time: {column: clock, trigger: pulse}
        columns: {angle: {column: seen, unit: rad}, pulse: sync}
      camera:
        file: camera_*.csv
        LATE
        time: {column: clock, trigger: led}
        columns: {tip: {column: seen, unit: m}, led: sync}
"""


@pytest.fixture
def lab(tmp_path):
    for repeat in (1, 2):
        for k, device in enumerate(RATES):
            write(tmp_path, device, repeat, seed=10 * repeat + k)
    return tmp_path


def joined(lab, late="", text=CAMPAIGN):
    (lab / "campaign.yaml").write_text(text.replace("LATE", late))
    return load_campaign(lab / "campaign.yaml").recordings()


def lag(time, values):
    """By how much a sine of the one time is late [s], by least squares."""
    good = np.isfinite(values)
    turn = 2 * np.pi * F * time[good]
    (sine, cosine), *_ = np.linalg.lstsq(np.stack([np.sin(turn), np.cos(turn)], axis=1), values[good], rcond=None)
    return -np.arctan2(cosine, sine) / (2 * np.pi * F)


def test_all_devices_are_on_one_clock_up_to_their_samples(lab):
    """The pulse rises between two samples of each: clocks agree within half a step of both, the camera 20 ms late."""
    for k, run in enumerate(joined(lab), start=1):
        assert list(run.data_vars) == ["force", "sync", "angle", "tip"]
        assert run.attrs["trigger_error"] == pytest.approx(1 / RATES["cell"] / np.sqrt(12), rel=1e-3)
        time = run["time"].values
        assert time[run["sync"].values > 0][0] == pytest.approx(0.5 / RATES["cell"], abs=1e-5)
        for name, device in (("force", "cell"), ("angle", "servo"), ("tip", "camera")):
            most = 0.5 / RATES["cell"] + (0.5 / RATES[device] if device != "cell" else 0.0)
            assert lag(time + PULSE[0], run[name].values) == pytest.approx(LATE[device], abs=most)
        assert int(run["repeat"]) == k
        about = json.loads(run.attrs["provenance"])
        assert {*about["beside"]} == {"servo", "camera"}
        assert about["beside"]["camera"]["file"].endswith(f"camera_{k}.csv")
        assert any("time: 0 where sync rises" in note for note in about["conversions"])


def test_a_known_lateness_comes_off_and_a_range_is_left_to_a_fit(lab):
    plain, known, free = (joined(lab, late)[0] for late in ("", "shift: 20 ms", "shift: -30..30 ms"))
    time = plain["time"].values
    inside = (time > 0) & (time < 4)
    early = np.interp(time[inside] + 0.02, time, plain["tip"].values)
    assert known["tip"].values[inside] == pytest.approx(early, abs=4e-3)  # of straight lines between samples
    assert free["tip"].values == pytest.approx(plain["tip"].values, nan_ok=True)
    clocks = json.loads(free.attrs["clocks"])
    assert clocks["camera"]["columns"] == ["tip"] and clocks["camera"]["shift"] == [-0.03, 0.03]
    assert "shift" not in clocks["servo"]


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (("trigger: led", "trigger: let"), '"let" is no quantity. Did you mean "led"?'),
        (("tip: {column", "force: {column"), "has force as well as cell_1.csv"),
        (("camera_*.csv", "camera_*_*.csv"), 'needs as many signs * as "cell_*.csv", 1'),
        (("camera_*.csv", "kamera_*.csv"), "there is no file"),
        (("LATE", "conditions: {A: 1 deg}"), "conditions"),
    ],
)
def test_what_cannot_be_joined_is_told(lab, change, why):
    with pytest.raises(InputError) as error:
        joined(lab, text=CAMPAIGN.replace(*change))
    assert why in str(error.value)


def test_a_device_that_saw_no_pulse_is_named(lab):
    (lab / "camera_2.csv").write_text("clock (s),seen,sync\n" + "".join(f"{0.1 * k},1,0\n" for k in range(9)))
    with pytest.raises(InputError, match=r"camera_2.csv, time.trigger: led does not rise through 0"):
        joined(lab)
