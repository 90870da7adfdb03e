"""Devices with a clock of their own in one file: late by a known time, or with a column of times of their own."""

import json

import numpy as np
import pytest

from nectosome.io.schema.validate import validate_as
from nectosome.measure import Sheet, load_campaign, read, recordings
from nectosome.units import InputError

UNIX = 1_650_000_000


def write(path, **columns):
    """A file with these columns, empty where a shorter one has ended."""
    rows = max(map(len, columns.values()))
    cells = [[*map(repr, map(float, column)), *[""] * (rows - len(column))] for column in columns.values()]
    lines = [",".join(columns), *(",".join(row) for row in zip(*cells, strict=True))]
    path.write_text("\n".join(lines) + "\n")
    return path


def recorded(path, **sheet):
    run = read(path, validate_as(Sheet, sheet, "sheet"))
    return run, json.loads(run.attrs["provenance"])


def test_a_late_logger_is_moved_to_where_it_belongs(tmp_path):
    """Its clock reads 0.12 s less than it should: a straight line is found again, and its ends are missing."""
    t = 0.01 * np.arange(101)
    path = write(tmp_path / "a.csv", t=t, force=3 * t, tip=5 * t)
    run, about = recorded(
        path,
        time={"column": "t", "unit": "s"},
        clocks={"camera": {"column": "t", "unit": "s", "offset": "120 ms"}},
        columns={"force": {"unit": "N"}, "tip": {"column": "tip", "unit": "mm", "clock": "camera"}},
    )
    np.testing.assert_array_equal(run["force"], 3 * t)
    known = t >= 0.12 - 1e-9
    np.testing.assert_allclose(run["tip"][known], 5e-3 * (t[known] - 0.12), atol=1e-15)
    assert np.isnan(run["tip"][~known]).all()
    assert list(run.data_vars) == ["force", "tip"]
    assert run["tip"].attrs["clock"] == "clocks.camera"
    assert run["tip"].attrs["missing"] == 12
    assert "clocks.camera: 0.12 s added, by the sheet" in about["found"]
    every = "(101 samples, every 0.01 s)"
    assert f"tip: by clocks.camera {every}, resampled at the times of the recording" in about["conversions"]
    assert about["warnings"] == ["tip: 12 times of the recording without a reading"]


def test_each_device_has_its_own_column_of_times_and_its_own_number_of_samples(tmp_path):
    fast, slow = 0.01 * np.arange(101), 0.005 + 0.05 * np.arange(20)
    path = write(tmp_path / "a.csv", t=fast, force=fast**2, stamp=1000 * slow, tip=7 * slow)
    sheet = {
        "time": {"column": "t", "unit": "s"},
        "clocks": {"camera": {"column": "stamp", "unit": "ms"}},
        "columns": {"force": {"unit": "N"}, "tip": {"unit": "m", "clock": "camera"}},
    }
    run, about = recorded(path, **sheet)
    inside = (fast >= slow[0]) & (fast <= slow[-1])
    np.testing.assert_allclose(run["tip"][inside], 7 * fast[inside], atol=1e-14)
    assert np.isnan(run["tip"][~inside]).all()
    assert "tip: sampled every 0.05 s, and the recording every 0.01 s: most values are interpolated, " in str(about)
    # the other way round: the slow clock is that of the recording
    sheet |= {
        "time": {"column": "stamp", "unit": "ms"},
        "clocks": {"cell": {"column": "t", "unit": "s"}},
        "columns": {"force": {"unit": "N", "clock": "cell"}, "tip": {"unit": "m"}},
    }
    run, about = recorded(path, **sheet)
    assert run.sizes["time"] == slow.size
    np.testing.assert_allclose(run["tip"], 7 * slow, rtol=1e-12)
    assert any("after a low-pass of 8 Hz" in phrase for phrase in about["conversions"])
    middle = (run["time"] > 0.4) & (run["time"] < 0.6)  # far from the ends of the low-pass
    np.testing.assert_allclose(run["force"][middle], run["time"][middle] ** 2, atol=2e-3)


def test_clocks_with_a_date_need_no_offset_and_others_do(tmp_path):
    t = 0.01 * np.arange(50)
    path = write(tmp_path / "a.csv", t=t, ros=UNIX + t, ros2=1e3 * (UNIX + 0.1 + t), a=t, b=t + 0.1)
    camera = {"clocks": {"camera": {"column": "ros2"}}, "columns": {"a": 4, "b": {"column": 5, "clock": "camera"}}}
    run, _ = recorded(path, time={"column": "ros"}, **camera)
    np.testing.assert_allclose(run["b"][12:], t[12:], atol=1e-6)
    assert np.isnan(run["b"][:10]).all()
    with pytest.raises(
        InputError, match=r"clocks\.camera: this clock counts from an instant, and the time from the zer"
    ):
        recorded(path, time={"column": "t"}, **camera)
    camera["clocks"]["camera"] |= {"offset": "0.1 s"}
    np.testing.assert_allclose(recorded(path, time={"column": "t"}, **camera)[0]["b"][12:], t[12:], atol=1e-6)
    camera["clocks"]["camera"] |= {"since": "2022-04-15 05:20:01"}
    with pytest.raises(InputError, match="since is not that of the time, which counts from 2022-04-15 05:20:00"):
        recorded(path, time={"column": "ros"}, **camera)


def test_a_device_may_have_a_rate(tmp_path):
    path = write(tmp_path / "a.csv", force=np.arange(100), tip=np.arange(50))
    run, _ = recorded(
        path,
        time={"rate": "100 Hz"},
        clocks={"camera": {"rate": "50 Hz", "offset": "0.01 s"}},
        columns={"force": 1, "tip": {"column": 2, "clock": "camera"}},
    )
    np.testing.assert_allclose(run["tip"][1:100:2], np.arange(50), atol=1e-12)


def test_a_device_that_stopped_for_a_while_has_no_readings_there(tmp_path):
    t = 0.01 * np.arange(100)
    late = np.concatenate([t[:40], t[60:]])
    path = write(tmp_path / "a.csv", t=t, force=t, stamp=late, tip=late)
    run, about = recorded(
        path,
        time="t",
        clocks={"camera": "stamp"},
        columns={"force": 2, "tip": {"column": 4, "clock": "camera"}},
    )
    there = (t <= 0.39 + 1e-9) | (t >= 0.6 - 1e-9)
    np.testing.assert_array_equal(np.isfinite(run["tip"]), there)
    assert any(phrase.startswith("clocks.camera: a gap of 0.21 s") for phrase in about["warnings"])


@pytest.mark.parametrize(
    ("sheet", "message"),
    [
        ({"clocks": {"cam": {"column": "t"}}}, r"clocks\.cam: no column has this clock\. Write clock: cam beside"),
        ({"columns": {"a": {"clock": "cam"}}}, r'columns\.a\.clock: there is no clock "cam"\. Write it under clocks'),
        ({"clocks": {"cam": "none"}}, "needs either a column or a rate"),
        ({"clocks": {"cam": {"unit": "s"}}}, "needs either a column or a rate"),
        ({"clocks": {"cam": "u"}, "columns": {"a": {"clock": "cam"}}}, r'clocks\.cam: there is no column called "u"'),
        (
            {"time": "none", "clocks": {"cam": "t"}, "columns": {"a": {"clock": "cam"}}},
            "resampled at the times of the recording, which has none",
        ),
        (
            {"clocks": {"cam": "back"}, "columns": {"a": {"clock": "cam"}, "b": 2}},
            r"line 3, back: the time 1 s comes after 2 s\. .* write under clocks\.cam in a sheet repair: drop",
        ),
    ],
)
def test_what_is_wrong_with_a_clock_is_said(tmp_path, sheet, message):
    path = write(tmp_path / "a.csv", t=[0, 1, 2], a=[0, 1, 2], b=[0, 1, 2], back=[2, 1, 0])
    with pytest.raises(InputError, match=message):
        recorded(path, **sheet)


def test_recordings_of_a_campaign_share_its_clocks(tmp_path):
    t = 0.1 * np.arange(20)
    write(tmp_path / "a.csv", t=t, force=t, tip=t)
    (tmp_path / "c.yaml").write_text(
        "time: t\nclocks: {camera: {column: t, offset: -0.1 s}}\n"
        "columns: {force: force, tip: {column: tip, clock: camera}}\nrecordings: [{file: a.csv}]\n"
    )
    (run,) = load_campaign(tmp_path / "c.yaml").recordings()
    np.testing.assert_allclose(run["tip"][:-1], t[:-1] + 0.1, atol=1e-12)


FAST = 0.05 * np.arange(200)


@pytest.mark.parametrize("sheet", [{}, {"columns": {"force": 2, "p": 4}}, {"time": {"column": 1}}])
def test_tables_side_by_side_have_a_clock_each(tmp_path, sheet):
    """Force over one time, pressure over another of half the interval: both are the lines that made them."""
    t = 0.1 * np.arange(100)
    rows = [f"{t[k]:.2f},{5 * t[k]:.3f},{1e3 * x:.1f},{100 + 20 * x:.3f}" for k, x in enumerate(FAST[:100])]
    (path := tmp_path / "a.csv").write_text("\n".join(["Time (s),force (N),Time (ms),p (kPa)", *rows]) + "\n")
    run, about = recorded(path, **sheet)
    np.testing.assert_allclose(run["time"], t, rtol=1e-14)
    assert list(run.data_vars) == ["force", "p"]
    np.testing.assert_allclose(run["force"], 5 * t, atol=1e-12)
    inside = (t > 1.5) & (t < 3.4)  # beyond the reach of the low-pass
    np.testing.assert_allclose(run["p"][inside], 1e5 + 2e4 * t[inside], rtol=1e-6)
    assert np.isnan(run["p"][t > FAST[99]]).all()
    assert any(
        "p: by clocks.Time (100 samples, every 0.05 s)" in x or "p: by clocks.Time (2)" in x
        for x in about["conversions"]
    )


def test_a_table_too_short_for_a_low_pass_is_read_with_a_warning(tmp_path):
    t = 0.1 * np.arange(20)
    path = write(tmp_path / "a.csv", time=t, force=5 * t, t=0.5 * t, p=10 * t)
    run, about = recorded(path)
    np.testing.assert_allclose(run["p"][:10], 20 * t[:10], atol=1e-12)
    assert "p: too short for a low-pass: what is faster than the recording may alias" in about["warnings"]


def test_another_column_of_the_same_times_is_no_other_clock(tmp_path):
    path = write(tmp_path / "a.csv", t=FAST, force=5 * FAST, time_ms=1e3 * (FAST + UNIX), p=10 * FAST)
    run, _ = recorded(path)
    assert list(run.data_vars) == ["force", "time_ms", "p"]
    np.testing.assert_array_equal(run["p"], 10 * FAST)


def test_tables_whose_clocks_have_unrelated_zeros_are_asked_for(tmp_path):
    path = write(tmp_path / "a.csv", t=FAST, force=5 * FAST, timestamp=UNIX + 2 * FAST, p=10 * FAST)
    with pytest.raises(InputError, match=r"clocks\.timestamp: this clock counts from an instant, and the time from"):
        recorded(path)


@pytest.mark.parametrize("own", [False, True], ids=["times of the recording", "times of its own"])
def test_a_clock_that_is_late_and_fast_is_put_right(tmp_path, own):
    """It reads (1 + 0.001) T + 0.03 s: a straight line of what it stamps is the line again."""
    t = 0.02 * np.arange(1001)
    path = write(tmp_path / "a.csv", t=t, force=3 * t, stamp=1000 * t, tip=5 * (t - 0.03) / 1.001)
    camera = {"shift": "30 ms", "drift": "0.1 %"} | ({"column": "stamp", "unit": "ms"} if own else {})
    columns = {"force": {"unit": "N"}, "tip": {"column": "tip", "unit": "mm", "clock": "camera"}}
    run, about = recorded(path, time={"column": "t", "unit": "s"}, clocks={"camera": camera}, columns=columns)
    known = np.isfinite(run["tip"].values)
    np.testing.assert_allclose(run["tip"][known], 5e-3 * t[known], atol=1e-12)
    assert known[:997].all() and not known[999]
    assert "clocks.camera: late by 0.03 s and fast by 0.1 %: taken off" in about["found"]
    assert json.loads(run.attrs["clocks"]) == {"camera": {"columns": ["tip"]}}


def test_a_clock_whose_lateness_a_fit_shall_find_is_left_as_it_is_and_said(tmp_path):
    """Rows of two devices one below the other: cells that another device leaves empty are no gaps."""
    t, nan = 0.02 * np.arange(100), np.full(100, np.nan)
    force, tip = nan.copy(), nan.copy()
    force[::2], tip[1::2] = 3 * t[::2], 5 * t[1::2]
    path = write(tmp_path / "a.csv", t=t, force=force, tip=tip)
    late, columns = {"shift": "-30..30 ms"}, {"force": {"unit": "N"}, "tip": {"unit": "mm", "clock": "camera"}}
    run, about = recorded(path, time={"column": "t", "unit": "s"}, clocks={"camera": late}, columns=columns)
    np.testing.assert_array_equal(run["tip"], 1e-3 * tip)
    told = {"camera": {"columns": ["tip"], "shift": [-0.03, 0.03], "drift": 0.0}}
    assert json.loads(run.attrs["clocks"]) == told
    assert "clocks.camera: a fit finds its shift and drift; they are not taken off here" in about["found"]
    late = {"shift": "20 ms"}
    run, _ = recorded(path, time={"column": "t", "unit": "s"}, clocks={"camera": late}, columns=columns)
    np.testing.assert_allclose(run["tip"][1:-2], 5e-3 * (t[1:-2] + 0.02), atol=1e-12)


def test_a_clock_without_times_has_those_to_the_left_of_its_columns(tmp_path):
    path = write(
        tmp_path / "a.csv", time=np.arange(10.0), force=np.arange(10.0), time_2=0.5 * np.arange(10), tip=np.arange(10.0)
    )
    path.write_text(path.read_text().replace("time_2", "time"))
    columns = {"force": {"column": 2}, "tip": {"column": 4, "clock": "camera"}}
    run, _ = recorded(path, clocks={"camera": {"shift": "0 s"}}, columns=columns)
    np.testing.assert_allclose(run["tip"][:5], 2 * np.arange(5.0))


def test_a_time_that_is_named_after_its_quantity_is_the_clock_of_what_is_behind_it(tmp_path):
    """A sheet that names the first of two times does not make it that of the other table."""
    t = 0.1 * np.arange(100)
    path = write(tmp_path / "a.csv", t_force=t, force=3 * t, t_pressure=0.5 * t, p=7 * t)
    path.write_text(path.read_text().replace("t_force", "t_force (s)").replace("t_pressure", "t_pressure (s)"))
    run, _ = recorded(path, time="t_force")
    np.testing.assert_allclose(run["p"][20:40], 14 * t[20:40], rtol=1e-6)


LATE = 0.65 * np.arange(100)  # times of the second table, over those of the first


@pytest.mark.parametrize(
    "order",
    [
        {"t_force (s)": 1, "force": 3, "t_p (s)": LATE, "p": 7},
        {"time": 1, "force": 3, "time_p": LATE, "p": 7},
        {"time (s)": 1, "force": 3, "p time (ms)": 1e3 * LATE, "p": 7},
        {"time": 1, "force": 3, "p": 7, "p_time": LATE},
        {"time_force (s)": 1, "time_p (s)": LATE, "force": 3, "p": 7},
        {"time": 1, "force": 3, "time2": LATE, "p": 7},
        {"t1 (s)": 1, "force": 3, "t2 (s)": LATE, "p": 7},
        {"force": 3, "t": 1, "p": 7, "t2": LATE},
        {"time (s)": 1, "force": 3, "time (s) ": np.arange(100) + 5.0, "p": 7},
        {"time": 1, "force": 3, "time 2": LATE, "u": 2, "time 3": 1, "p": 7},
    ],
    ids=lambda order: ", ".join(order),
)
def test_each_quantity_has_the_times_that_are_named_after_it_or_stand_beside_it(tmp_path, order):
    """Quantities are lines of their own times; a second table is slower, or begins five samples later."""
    first, second = 0.1 * np.arange(100), LATE
    columns = {}
    rates = {"force": (3, first), "p": (7, first if "time 3" in order else second), "u": (2, second)}
    if "time (s) " in order:
        rates["p"] = 7, np.arange(100) + 5.0
    for name, x in order.items():
        columns[name] = np.multiply(*rates[name]) if name in rates else first if np.ndim(x) == 0 else x
    run, _ = recorded(write(tmp_path / "a.csv", **columns))
    assert {*run.data_vars} - {"time 3"} == rates.keys() & order.keys()
    for name in rates.keys() & order.keys():
        there = np.isfinite(run[name].values)
        assert there.sum() > 10
        np.testing.assert_allclose(run[name][there], rates[name][0] * run["time"][there], rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(
    "columns",
    [
        {"time": FAST, "force": FAST, "cycle time (s)": 0.5 + 0 * FAST, "p": FAST},
        {"time": FAST, "force": FAST, "rise time (s)": np.cos(FAST), "p": FAST},
        {"time": FAST, "force": FAST, "t_water": 20 + np.cos(FAST), "p": FAST},
    ],
    ids=lambda columns: [*columns][2],
)
def test_a_quantity_that_is_called_a_time_and_does_not_go_on_is_no_clock(tmp_path, columns):
    run, about = recorded(write(tmp_path / "a.csv", **columns))
    assert len(run.data_vars) == 3 and not about["warnings"]
    np.testing.assert_array_equal(run["p"], FAST)


def test_times_of_starts_and_ends_are_quantities(tmp_path):
    run, _ = recorded(write(tmp_path / "a.csv", **{"t_start (s)": FAST, "t_end (s)": 2 * FAST + 1, "force": FAST}))
    assert list(run.data_vars) == ["t_start", "t_end", "force"] and run.sizes == {"row": 200}


def test_a_time_beside_no_quantity_is_warned_of(tmp_path):
    t = 0.1 * np.arange(100)
    path = write(tmp_path / "a.csv", time=t, force=3 * t, p=7 * t, stamp=0.5 * t)
    path.write_text(path.read_text().replace("stamp", "time"))
    _, about = recorded(path)
    assert (
        "time (2): other times than time. If columns have these, write clocks: {other: {column: 4}}"
        in about["warnings"][0]
    )
    sheet = {"time": 1, "clocks": {"other": 4}, "columns": {"force": 2, "p": {"column": 3, "clock": "other"}}}
    run, about = recorded(path, **sheet)
    np.testing.assert_allclose(run["p"][20:40], 14 * t[20:40], rtol=1e-6)
    assert not any("other times" in words for words in about["warnings"])


@pytest.mark.parametrize("rows", [2, 3, 5, 1000])
def test_rows_of_two_devices_at_one_time_are_one_row(tmp_path, monkeypatch, rows):
    """However the file is cut into pieces; a row that is there twice, or a second reading of a column, is refused."""
    monkeypatch.setattr(recordings, "_ROWS", rows)
    (path := tmp_path / "a.csv").write_text("time (s),F,x\n0,1,\n0,,7\n0.1,2,\n0.2,,8\n0.2,3,\n0.2,,\n0.3,4,9\n")
    run = read(path)
    np.testing.assert_array_equal(run["time"], [0, 0.1, 0.2, 0.3])
    np.testing.assert_array_equal(run["F"], [1, 2, 3, 4])
    np.testing.assert_array_equal(run["x"], [7, np.nan, 8, 9])
    assert any(note.startswith("3 rows joined with") for note in json.loads(run.attrs["provenance"])["repairs"])
    for wrong in ("0,1,\n0,1,\n", "0,1,\n0,,7\n0,2,\n"):
        path.write_text("time (s),F,x\n" + wrong)
        with pytest.raises(InputError, match="the time 0 s occurs twice"):
            read(path)
