"""From a file to quantities in SI units: sheets, conversions, what is refused, mended or reported."""

import hashlib
import json
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nectosome.io import load_dataset, save_dataset
from nectosome.io.schema.validate import validate_as
from nectosome.measure import Sheet, load_campaign, load_sheet, read
from nectosome.units import InputError

LOG = "time (ms);force [V];note\n" + "".join(f"{10 * k};{0.5 + 0.1 * k};{k}\n" for k in range(20))
SHEET = """
about: a test
time: {column: time, unit: ms}
columns:
  force: {column: 2, unit: V, zero: 0.5 V, gain: 20 N/V, sign: -1, about: load cell}
conditions: {f: 1.1 Hz, A: 20 deg}
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "log.csv").write_text(LOG)
    (tmp_path / "sheet.yaml").write_text(SHEET)
    return tmp_path


def about(recording):
    return json.loads(recording.attrs["provenance"])


def test_a_file_with_names_and_units_needs_no_sheet(folder):
    recording = read("log.csv")
    np.testing.assert_allclose(recording["time"], 0.01 * np.arange(20), rtol=1e-15)
    np.testing.assert_allclose(recording["force"], 0.5 + 0.1 * np.arange(20), rtol=1e-15)
    assert recording["force"].attrs["units"] == "V"
    assert "time: ms to s" in about(recording)["conversions"]
    assert about(recording)["sha256"] == hashlib.sha256(LOG.encode()).hexdigest()


def test_a_sheet_makes_quantities_of_readings(folder):
    recording = read("log.csv", "sheet.yaml")
    np.testing.assert_allclose(recording["force"], -20 * 0.1 * np.arange(20), atol=1e-14)
    assert recording["force"].attrs["units"] == "N"
    assert recording["force"].attrs["maximum"] == pytest.approx(0.0, abs=1e-14)
    assert recording["force"].attrs["minimum"] == pytest.approx(-38.0)
    assert float(recording["A"]) == pytest.approx(np.pi / 9)
    assert recording["f"].attrs["units"] == "Hz"
    assert list(recording.data_vars) == ["force"]


def test_a_recording_survives_netcdf(folder):
    recording = read("log.csv", "sheet.yaml")
    save_dataset(recording, "log.nc")
    assert load_dataset("log.nc").identical(recording)


@given(
    st.floats(-5, 5),
    st.floats(0.1, 100),
    st.sampled_from([1, -1]),
    st.sampled_from([("mm", 1e-3, "m"), ("V", 1.0, "V"), ("bar", 1e5, "Pa"), ("deg", np.pi / 180, "rad")]),
)
def test_zero_gain_and_sign_work_in_any_unit(tmp_path_factory, zero, gain, sign, unit):
    text, factor, si = unit
    folder = tmp_path_factory.mktemp("any")
    (folder / "a.csv").write_text("t,x\n0,1.5\n1,2.5\n2,-3.5\n")
    (folder / "s.yaml").write_text(
        f"time: {{column: t, unit: s}}\ncolumns:\n  x: {{unit: {text}, zero: {zero!r}, gain: {gain!r}, sign: {sign}}}\n"
    )
    x = read(folder / "a.csv", folder / "s.yaml")["x"]
    np.testing.assert_allclose(x, sign * gain * factor * (np.array([1.5, 2.5, -3.5]) - zero), rtol=1e-12, atol=1e-12)
    assert x.attrs["units"] == si


@pytest.mark.parametrize(
    ("row", "said"),
    [
        ("0.02,5", "line 5, t: the time 0.02 s comes after 0.03 s"),
        ("0.03,5", "line 5, t: the time 0.03 s occurs twice"),
        (",5", "line 5, t: the time is missing"),
    ],
)
def test_times_that_do_not_go_on_are_refused_or_left_out(folder, row, said):
    (folder / "bad.csv").write_text(f"t,x\n0.01,1\n0.02,2\n0.03,3\n{row}\n0.04,4\n")
    with pytest.raises(InputError, match=said):
        read("bad.csv")
    (folder / "drop.yaml").write_text("time: {column: t, unit: s, repair: drop}\n")
    recording = read("bad.csv", "drop.yaml")
    assert recording["x"].values.tolist() == [1, 2, 3, 4]
    assert about(recording)["repairs"] == ["1 row left out: time does not increase; the first is row 5"]


def test_gaps_missing_and_saturated_values_are_told(folder):
    t = np.r_[np.arange(50) * 0.1, 10 + np.arange(50) * 0.1]
    x = np.sin(t)
    x[[7, 9]] = np.nan
    x[60:80] = 5.0
    rows = "".join(f"{a!r},{'' if np.isnan(b) else repr(float(b))}\n" for a, b in zip(t.tolist(), x, strict=True))
    (folder / "odd.csv").write_text("t,x\n" + rows)
    recording = read("odd.csv")
    assert json.loads(recording.attrs["gaps"]) == [[pytest.approx(4.9), 10.0, 52]]
    odd = about(recording)["warnings"]
    assert odd[0] == "time: a gap of 5.1 s before row 52"
    assert odd[1] == "x: 2 rows missing, the first is row 9"
    assert odd[2] == "x: stays at its extreme 5 for 20 rows from row 62: saturated?"
    (folder / "range.yaml").write_text("time: {column: t, unit: s}\ncolumns:\n  x: {unit: V, range: [-5 V, 5 V]}\n")
    mended = read("odd.csv", "range.yaml")
    assert np.isnan(mended["x"].values[60:80]).all()
    assert about(mended)["repairs"] == ["x: 20 rows saturated or infinite, from row 62: now missing"]
    assert mended["x"].attrs["missing"] == 22


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("colums: {}", 'sheet.yaml, line 1, colums: there is no field "colums" here. Did you mean "columns"?'),
        ("columns:\n  force: {column: 9}", "there is no column 9: the file has 3"),
        ("columns:\n  force: {column: Force}", 'there is no column called "Force"'),
        ("columns:\n  time: {unit: s}", "columns.time: the time has a field of its own, as in time: {column: time"),
        ("conditions: {time: 3 s}", "conditions.time: the time has a field of its own"),
        ("columns:\n  row: {column: 2}", "has the name of a coordinate"),
        ("columns:\n  a/b: {column: 2}", "must be a name without slashes"),
        ("conditions: {note: 3 N}", "note: is a column of the file, too"),
        ("columns:\n  force: {column: 2, unit: Vv}", 'line 2, columns.force.unit: "Vv" has no unit called Vv'),
        ("columns:\n  note: {column: 3, zero: 0.3 V}", "needs the unit of the reading beside it, as in unit: V"),
        ("columns:\n  note: {column: 3, gain: 3 N/V}", "needs the unit of the reading beside it, as in unit: V"),
        ("columns:\n  force: {column: 2, zero: 3 mm}", "0.003 m has not the dimension of the reading, V"),
        ("columns:\n  force: {column: 2, unit: V, zero: 3 mm}", "has not the dimension of the reading, V"),
        ("columns:\n  force: {column: 2, unit: V, gain: 0 N/V}", "is 0; it must differ from 0"),
        ("columns:\n  force: {column: 2, unit: V, sign: 2}", '"2" must be 1 or -1'),
        ("columns:\n  force: {column: 2, unit: V, range: [3 V, 1 V]}", "is empty"),
        ("columns:\n  force: {column: true}", '"true" is not a column'),
        ("time: {column: 1, unit: mm}", '"mm" is not a unit of time'),
        ("time: {rate: 3 m}", '"3 m" is not a rate'),
        ("time: {column: 1, offset: 3 mm}", '"3 mm" is not a time, as in "0.12 s"'),
        ("time: {column: 1, since: noon}", '"noon" is not a date and time'),
        ("time: {column: 1, since: 2024-03-01 12:00:00}", "since needs a clock with a date, and"),
        ("time: {unit: s}", "needs either a column or a rate"),
        ("conditions: {f: fast}", '"fast" is not a number with a unit'),
        ("- 1", "this has no named fields. A sheet says which column is which quantity."),
    ],
)
def test_mistakes_in_a_sheet_are_told_with_their_place(folder, text, said):
    (folder / "sheet.yaml").write_text(text + "\n")
    with pytest.raises(InputError) as error:
        read("log.csv", load_sheet("sheet.yaml"))
    assert said in str(error.value)


def test_a_rate_gives_the_time(folder):
    (folder / "rate.yaml").write_text("time: {rate: 1 kHz}\ncolumns: {force: 2}\n")
    recording = read("log.csv", "rate.yaml")
    np.testing.assert_allclose(recording["time"], np.arange(20) / 1000)


def test_repeats_of_a_campaign_stay_apart(folder):
    for name, f in (("a_1", 1.0), ("a_2", 2.0), ("b", 3.0)):
        (folder / f"{name}.csv").write_text(f"0,{f}\n1,{f}\n2,{f}\n")
    text = """
file: {header: none}
time: {column: 1, unit: s}
columns: {force: {column: 2, unit: N}}
conditions: {density: 1000 kg/m3}
recordings:
  - {file: "a_*.csv", conditions: {f: 1.1 Hz}}
  - {file: b.csv, conditions: {f: 1.3 Hz}}
"""
    (folder / "campaign.yaml").write_text(text)
    found = load_campaign("campaign.yaml").recordings()
    told = [(float(r["f"]), int(r["repeat"]), float(r["density"]), float(r["force"][0])) for r in found]
    assert told == [(1.1, 1, 1000, 1), (1.1, 2, 1000, 2), (1.3, 1, 1000, 3)]
    (folder / "campaign.yaml").write_text(text.replace("b.csv", "../b.csv"))
    with pytest.raises(InputError, match=r"line 8, recordings\.1\.file: .* is outside the folder"):
        load_campaign("campaign.yaml")
    (folder / "campaign.yaml").write_text(text.replace("b.csv", "c.csv"))
    with pytest.raises(InputError, match=r'there is no file "c\.csv"'):
        load_campaign("campaign.yaml")
    (folder / "campaign.yaml").write_text(text.replace("b.csv", "a_1.csv"))
    with pytest.raises(InputError, match=r"a_1\.csv is listed twice"):
        load_campaign("campaign.yaml")


def test_what_is_too_large_for_memory_is_read_from_a_file_of_its_own(folder, monkeypatch):
    small = read("log.csv")
    monkeypatch.setattr("nectosome.measure.recordings.IN_MEMORY", 200)
    monkeypatch.setattr("nectosome.measure.recordings._ROWS", 3)
    large = read("log.csv")
    assert large["force"].chunks is None
    np.testing.assert_array_equal(large["force"].values, small["force"].values)
    np.testing.assert_array_equal(large["time"].values, small["time"].values)


def test_a_trigger_is_not_saturated_and_lost_samples_are_counted(tmp_path):
    """Of 1000 samples, every 10 ms and 1 ms of jitter, three are lost, two of them side by side."""
    t = np.delete(0.01 * np.arange(1000) + 5e-4 * np.random.default_rng(0).uniform(-1, 1, 1000), [400, 700, 701])
    sync = np.where((t > 1) & (t < 1.2), 1, 0)
    path = tmp_path / "a.csv"
    path.write_text("time,force,sync\n" + "".join(f"{x:.6f},{x:.6f},{y}\n" for x, y in zip(t, sync, strict=True)))
    about = json.loads(read(path).attrs["provenance"])
    (warning,) = about["warnings"]
    assert re.fullmatch(r"time: 3 samples lost of one every 0\.0\d+ s, the first before row 402", warning)


def test_the_zero_of_a_sensor_that_drifts_comes_from_stretches_at_rest(tmp_path):
    """2.5 V and 0.01 V/s of drift below a pulse of 3 V between the second and the eighth second."""
    t = 0.01 * np.arange(1001)
    pulse = np.where((t > 2) & (t < 8), 3 * np.sin(np.pi * (t - 2) / 6), 0.0)
    path = tmp_path / "a.csv"
    rows = zip(5 + t, 2.5 + 0.01 * t + pulse, strict=True)
    path.write_text("time (s),x (V)\n" + "".join(f"{a:.2f},{b:.9f}\n" for a, b in rows))

    def sheet(at_rest):
        return validate_as(Sheet, {"columns": {"x": {"gain": "2 N/V", "at_rest": at_rest}}}, "sheet")

    run = read(path, sheet(["0..1.5 s", "-1.5..0 s"]))
    np.testing.assert_allclose(run["x"][75:-75], 2 * pulse[75:-75], atol=1e-8)
    assert run["x"].attrs["maximum"] == pytest.approx(6, abs=0.02)
    said = json.loads(run.attrs["provenance"])["conversions"]
    assert said[-1] == "x: minus what it reads at rest, 5.015 N, 5.185 N"
    assert float(read(path, sheet(["0..1 s"]))["x"][-1]) == pytest.approx(0.19, abs=1e-6)
    with pytest.raises(InputError, match=r"columns\.x\.at_rest: has no reading from 25 to 30 s; it is from 5 to 15 s"):
        read(path, sheet(["20..25 s"]))
    with pytest.raises(InputError, match=r'"3 s" is no stretch of time\. Write LOW\.\.HIGH'):
        sheet(["3 s"])


def test_hum_is_taken_off_before_the_zero_and_told(tmp_path):
    """50 Hz of 0.2 V over 2.5 V at rest: at 80 samples/s they look like 30 Hz."""
    t = np.arange(0, 8, 1 / 80)
    pulse = np.where((t > 2) & (t < 6), np.sin(np.pi * (t - 2) / 4) ** 2, 0.0)
    path = tmp_path / "a.csv"
    rows = zip(t, 2.5 + pulse + 0.2 * np.sin(100 * np.pi * t), strict=True)
    path.write_text("time (s),x (V),y (V)\n" + "".join(f"{a:.4f},{b:.9f},1\n" for a, b in rows))

    def sheet(**entry):
        at_rest = {"gain": "2 N/V", "at_rest": ["0..1.203 s"]}
        return validate_as(Sheet, {"columns": {"x": at_rest | entry, "y": {}}}, "sheet")

    run = read(path, sheet(notch="50 Hz"))
    np.testing.assert_allclose(run["x"], 2 * pulse, atol=2e-3)
    said = json.loads(run.attrs["provenance"])["conversions"]
    assert said[-2] == "x: minus hum of 50 Hz, 0.4 N of amplitude, which looks like 30 Hz at this sampling rate"
    assert run.attrs == read(path, sheet(notch=["50 Hz"])).attrs
    np.testing.assert_allclose(read(path, sheet(notch=["50 Hz", "30.5 Hz"]))["x"], 2 * pulse, atol=2e-2)
    with pytest.raises(InputError, match=r'columns\.x\.notch.*"50 N" is not a rate'):
        sheet(notch="50 N")
    with pytest.raises(InputError, match=r"columns\.x\.notch: 80 Hz look like 0 Hz in samples taken at 80 Hz"):
        read(path, sheet(notch="80 Hz"))
