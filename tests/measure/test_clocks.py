"""Clocks of every kind become seconds; one that goes back, starts again or has an odd size is told with its rows."""

import json
from datetime import datetime, time

import numpy as np
import pytest
import xarray as xr
from nptdms import ChannelObject, TdmsWriter
from openpyxl import Workbook

from nectosome.io.schema.validate import validate_as
from nectosome.measure import Sheet, load_campaign, read
from nectosome.measure.formats.headings import is_time
from nectosome.units import InputError

UNIX = 1_650_000_000  # 2022-04-15 05:20:00 UTC


def recorded(folder, heading, times, delimiter=",", **sheet):
    """The recording of a file with these cells in its column of times, and its provenance."""
    path = folder / "a.csv"
    rows = "".join(f"{t}{delimiter}{k}\n" for k, t in enumerate(times))
    path.write_text(f"{heading}{delimiter}force [N]\n{rows}")
    run = read(path, validate_as(Sheet, sheet, "sheet"))
    return run, json.loads(run.attrs["provenance"])


@pytest.mark.parametrize(
    ("heading", "step"),
    [
        *(
            (ms, 10)
            for ms in ("time_ms", "t_ms", "timestamp_ms", "time ms", "Time (millisec)", "TIME(MS)", "timeMs", "millis")
        ),
        *((us, 10_000) for us in ("time_us", "t_us", "Time (usec)", "Time (µs)", "micros()", "Time [Microseconds]")),
        *((ns, 10_000_000) for ns in ("timestamp_ns", "time (nanoseconds)", "t/ns")),
        *((s, 0.01) for s in ("t", "Time (Seconds)", "time_s", "Elapsed Time (sec)", "Zeit [s]", "t / s", "seconds")),
    ],
)
def test_the_unit_of_the_time_is_in_its_name(tmp_path, heading, step):
    run, about = recorded(tmp_path, heading, [k * step for k in range(12)])
    np.testing.assert_allclose(run["time"], 0.01 * np.arange(12), rtol=1e-14)
    assert about["warnings"] == []


@pytest.mark.parametrize("name", ["T", "temp", "target", "torque (s)", "timeout", "lifetime", "t1", "T (C)", "system"])
def test_other_names_are_no_time(name):
    assert not is_time(name)


@pytest.mark.parametrize("heading", ["%time", "time", "timestamp", "__time", "t"])
@pytest.mark.parametrize(("per_second", "step"), [(1, 0.25), (10**3, 250), (10**6, 250_000), (10**9, 250_000_000)])
def test_a_unix_clock_is_known_by_its_size_and_counts_from_its_first_sample(tmp_path, heading, per_second, step):
    """Doubles of this size are 0.24 microseconds apart."""
    run, about = recorded(tmp_path, heading, [UNIX * per_second + k * step for k in range(8)])
    np.testing.assert_allclose(run["time"], 0.25 * np.arange(8), atol=5e-7)
    assert run.attrs["since"] == "2022-04-15 05:20:00+00:00"
    assert any("UNIX clock" in phrase for phrase in about["found"])
    assert about["warnings"] == []


def test_whole_seconds_have_their_nanoseconds_beside_them(tmp_path):
    (tmp_path / "a.csv").write_text(
        "header.seq,header.stamp.secs,header.stamp.nsecs,x\n"
        + "".join(f"{k},{UNIX + (980 + 10 * k) // 1000},{(980 + 10 * k) % 1000}000000,{k}\n" for k in range(6))
    )
    run = read(tmp_path / "a.csv")
    np.testing.assert_allclose(run["time"], 0.01 * np.arange(6), atol=1e-12)
    assert list(run.data_vars) == ["header.seq", "x"]
    assert run.attrs["since"] == "2022-04-15 05:20:00.980000+00:00"


@pytest.mark.parametrize(
    ("first", "second"),
    [
        ("2024-03-14 23:59:59.5", "2024-03-15 00:00:00.25"),
        ("2024-03-14T23:59:59.500+02:00", "2024-03-14T22:00:00.250Z"),
        ("2024/03/14 23:59:59.5", "2024/03/15 00:00:00.25"),
        ("14.03.2024 23:59:59.5", "15.03.2024 00:00:00.25"),
        ("3/14/2024 11:59:59.5 PM", "3/15/2024 12:00:00.25 AM"),
        ("14/03/24 23:59:59.5", "15/03/24 00:00:00.25"),
        ("14-Mar-2024 23:59:59.5", "15-Mar-2024 00:00:00.25"),
        ("23:59:59.500", "00:00:00.250"),
        ("11:59:59.5 PM", "12:00:00.25 AM"),
    ],
)
@pytest.mark.parametrize("heading", ["time", "stamp"])
def test_wall_clocks_become_seconds_and_pass_midnight(tmp_path, heading, first, second):
    run, about = recorded(tmp_path, heading, [first, second])
    np.testing.assert_allclose(np.diff(run["time"]), [0.75], atol=1e-9)
    dated = len(first) > 14
    assert float(run["time"][0]) == (0.0 if dated else 86399.5)
    assert about["repairs"] == ([] if dated else ["time: midnight passes before row 3: counted on from there"])


def test_noon_and_midnight_of_twelve_hours_are_where_they_should_be(tmp_path):
    run, _ = recorded(tmp_path, "time", ["12:00:00 AM", "11:59:59 AM", "12:00:00 PM", "1:00:00 PM"])
    np.testing.assert_array_equal(run["time"], [0, 43199, 43200, 46800])


def test_a_decimal_comma_may_stand_in_a_time(tmp_path):
    run, _ = recorded(tmp_path, "time", ["2024-03-14 10:00:00,5", "2024-03-14 10:00:01,25"], delimiter=";")
    np.testing.assert_allclose(run["time"], [0, 0.75], atol=1e-12)


def test_the_order_of_day_and_month_is_asked_for_where_it_matters(tmp_path):
    one_day = ["03/04/2024 10:00:00", "03/04/2024 10:00:01"]
    np.testing.assert_array_equal(recorded(tmp_path, "time", one_day)[0]["time"], [0, 1])
    for times in ([*one_day, "04/04/2024 10:00:01"], [one_day[0]] * 2500 + ["04/04/2024 10:00:01"]):
        with pytest.raises(InputError, match=r"03/04/2024 may have the day or the month first\. Write file"):
            recorded(tmp_path, "time", times)
    times = ["03/04/2024 10:00:00", "04/04/2024 10:00:00"]
    for order, days in (("day first", 1), ("month first", 31)):
        run, _ = recorded(tmp_path, "time", times, file={"dates": order})
        np.testing.assert_array_equal(run["time"], [0, days * 86400])


def test_halves_of_the_day_in_another_column_are_refused(tmp_path):
    (tmp_path / "a.txt").write_text("time half force\n11:59:59 AM 1\n01:00:00 PM 2\n")
    with pytest.raises(InputError, match="AM and PM are in another column than their times"):
        read(tmp_path / "a.txt")


@pytest.mark.parametrize("heading", ["time_ms", "time (ms)"])
def test_a_clock_since_midnight_passes_it(tmp_path, heading):
    run, about = recorded(tmp_path, heading, [86_399_980, 86_399_990, 0, 10, 20])
    np.testing.assert_allclose(run["time"], 86399.98 + 0.01 * np.arange(5), rtol=1e-14)
    assert about["repairs"] == ["time: midnight passes before row 4: counted on from there"]


@pytest.mark.parametrize(("heading", "bits", "interval"), [("micros", 32, 10_000), ("millis", 16, 10)])
def test_a_counter_starts_again(tmp_path, heading, bits, interval):
    """After 71.6 minutes of micros(), 2^32 us = 4294.967296 s; after 65.5 s of milliseconds in 16 bits."""
    ticks = [2**bits + int(interval * (k - 2.5)) for k in range(6)]
    run, about = recorded(tmp_path, heading, [tick % 2**bits for tick in ticks])
    np.testing.assert_allclose(run["time"], (1e-6 if bits == 32 else 1e-3) * np.array(ticks), rtol=1e-14)
    assert about["repairs"] == [f"time: the counter of {bits} bits starts again before row 5: counted on from there"]


@pytest.mark.parametrize("rows", [2, 3, 100])
def test_it_does_not_matter_where_pieces_are_cut(tmp_path, monkeypatch, rows):
    monkeypatch.setattr("nectosome.measure.recordings._ROWS", rows)
    run, about = recorded(tmp_path, "time", ["23:59:58", "23:59:59", "00:00:00", "00:00:01"])
    np.testing.assert_array_equal(run["time"], 86398 + np.arange(4))
    assert about["repairs"] == ["time: midnight passes before row 4: counted on from there"]
    run, about = recorded(tmp_path, "t", [0, 1, 2, 0, 1, 2, 3], time={"column": 1, "unit": "s"} | on(1))
    np.testing.assert_array_equal(run["time"], np.arange(7))
    text = "".join(f"{k % 50},{k + 3 * (k >= 50)},{k}\n" for k in range(100))
    (tmp_path / "b.csv").write_text(f"t [s],pc [s],force [N]\n{text}")
    run = read(tmp_path / "b.csv", validate_as(Sheet, {"time": {"column": "t", "repair": "shift", "host": "pc"}}, "x"))
    np.testing.assert_array_equal(run["time"], run["pc"])


def on(gap):
    """What a sheet says of a clock that was set back."""
    return {"repair": "shift", "gap": f"{gap} s"}


def test_a_clock_that_was_set_back_is_refused_and_carried_on_by_a_sheet(tmp_path):
    times = [0.0, 0.1, 0.2, 0.1, 0.2, 0.3, 0.0, 0.1]
    with pytest.raises(InputError, match=r"line 5, t: the time 0\.1 s comes after 0\.2 s.* repair: shift"):
        recorded(tmp_path, "t [s]", times)
    with pytest.raises(
        InputError, match=r"line 5, t: the time goes from 0\.2 s back to 0\.1 s, and how long .* host: CO"
    ):
        recorded(tmp_path, "t [s]", times, time={"column": "t", "repair": "shift"})
    run, about = recorded(tmp_path, "t [s]", times, time={"column": "t"} | on(0.28))
    np.testing.assert_allclose(np.diff(run["time"]), [0.1, 0.1, 0.28, 0.1, 0.1, 0.28, 0.1], atol=1e-14)
    stood = "it stood 0.28, 0.28 s by the sheet"
    assert about["repairs"] == [f"time: goes back by up to 0.3 s before rows 5, 8: {stood}"]
    with pytest.raises(InputError, match="the time is missing"):
        recorded(tmp_path, "t [s]", [0.0, 0.1, "nan", 0.3], time={"column": "t"} | on(0.1))
    with pytest.raises(InputError, match=r"the time 0\.1 s occurs twice"):
        recorded(tmp_path, "t [s]", [0.0, 0.1, 0.1, 0.3], time={"column": "t"} | on(0.1))


def test_how_long_a_board_stood_is_told_by_the_clock_of_the_computer(tmp_path):
    """It stood 0.3 s and 1.7 s; lines arrive up to 8 ms late, of which the median over 20 samples is taken."""
    random = np.random.default_rng(0)
    true = 0.01 * np.arange(300) + np.where(np.arange(300) >= 100, 0.29, 0) + np.where(np.arange(300) >= 110, 1.69, 0)
    board = np.concatenate([5 + true[:100], true[100:110] - true[100], true[110:] - true[110]])
    host = UNIX + true + random.uniform(0, 8e-3, 300)
    path = tmp_path / "a.csv"
    rows = "".join(f"{a:.3f},{b:.6f},{k}\n" for k, (a, b) in enumerate(zip(board, host, strict=True)))
    path.write_text(f"t [s],arrived,force [N]\n{rows}")

    def found(**time):
        return read(path, validate_as(Sheet, {"time": {"column": "t"} | time}, "sheet"))

    run = found(repair="shift", host="arrived")
    np.testing.assert_allclose(run["time"], 5 + true, atol=4e-3)
    said = json.loads(run.attrs["provenance"])["repairs"]
    stood = "it stood 0.298, 1.7 s by the clock of arrived"
    assert said == [f"time: goes back by up to 5.99 s before rows 102, 112: {stood}"]
    with pytest.raises(InputError, match=r"the clock of time\.host does not go on there"):
        found(repair="shift", host="t")
    with pytest.raises(InputError, match=r'time\.host: there is no column called "arived"'):
        found(repair="shift", host="arived")
    for given, why in (
        ({"host": "arrived"}, r"time\.host: is for a clock that was set back"),
        ({"gap": "1 s"}, r"time\.gap: is for a clock that was set back"),
        ({"repair": "shift", "gap": "1 s", "host": "arrived"}, r"time\.gap: is what the column of host tells"),
        ({"repair": "shift", "gap": "0 s"}, r"time\.gap.*must be more than 0 s"),
    ):
        with pytest.raises(InputError, match=why):
            found(**given)


def test_a_clock_that_jumps_is_told_with_its_row(tmp_path):
    _, about = recorded(tmp_path, "t [s]", [*np.arange(10) / 10, *(3600 + np.arange(10) / 10)])
    assert about["warnings"] == ["time: a gap of 3.6e+03 s before row 12"]


def test_every_device_has_its_offset_and_a_common_date(tmp_path):
    (tmp_path / "cell.csv").write_text("time,force [N]\n" + "".join(f"{UNIX + k / 4},{k}\n" for k in range(8)))
    (tmp_path / "camera.csv").write_text(
        "at,x [mm]\n" + "".join(f"2022-04-15 05:20:0{k // 4}.{25 * (k % 4):02d},{k}\n" for k in range(2, 8))
    )
    (tmp_path / "campaign.yaml").write_text("""
recordings:
  - {file: cell.csv, time: {column: time, since: "2022-04-15 05:20:00", offset: -120 ms}, columns: {force: force}}
  - {file: camera.csv, time: {column: at, since: "2022-04-15 05:20:00"}, columns: {x: x}}
""")
    cell, camera = load_campaign(tmp_path / "campaign.yaml").recordings()
    np.testing.assert_allclose(cell["time"], np.arange(8) / 4 - 0.12, atol=1e-12)
    np.testing.assert_allclose(camera["time"], np.arange(2, 8) / 4, atol=1e-12)
    run, _ = recorded(tmp_path, "t", [0, 1, 2], time={"rate": "100 Hz", "offset": "0.5 s"})
    np.testing.assert_allclose(run["time"], 0.5 + 0.01 * np.arange(3), rtol=1e-14)


@pytest.mark.parametrize(
    ("heading", "times", "said"),
    [
        ("time", [0, 10, 20], "time: time is taken in s: a sample every 10 s. If that is wrong, write time:"),
        ("time_s", [0, 1e7, 2e7], "time: a sample every 1e+07 s."),
        ("Time (s)", [1.65e18, 1.65e18 + 1e9], "time: 1.65e+18 s is more than 100 years."),
        ("time (ns)", [0, 1, 2], "time: a sample every 1e-09 s."),
        ("time", ["Fri 10h", "Fri 11h"], "column 1, time, is text that is no known clock: there is no time"),
    ],
)
def test_odd_sizes_are_told(tmp_path, heading, times, said):
    _, about = recorded(tmp_path, heading, times)
    assert [odd.startswith(said) for odd in about["warnings"]] == [True]


def test_an_unknown_unit_of_time_is_asked_for_and_the_answer_holds(tmp_path):
    with pytest.raises(
        InputError, match=r'"foo" has no unit called foo.* Write time: \{column: "time \(foo\)", unit: ms\}'
    ):
        recorded(tmp_path, "time (foo)", [0, 10, 20])
    run, _ = recorded(tmp_path, "time (foo)", [0, 10, 20], time={"column": "time (foo)", "unit": "ms"})
    np.testing.assert_allclose(run["time"], [0, 0.01, 0.02], rtol=1e-14)
    run, _ = recorded(tmp_path, "time_us", [0, 10, 20], time={"column": "time_us", "unit": "ms"})
    np.testing.assert_allclose(run["time"], [0, 0.01, 0.02], rtol=1e-14)


@pytest.mark.parametrize(
    "cells",
    [
        [time(23, 59, 59), time(23, 59, 59, 500_000), time(0, 0, 0), time(0, 0, 0, 500_000)],
        [datetime(2024, 3, 14, 23, 59, 59 + k // 2, 500_000 * (k % 2)) for k in range(2)]
        + [datetime(2024, 3, 15, 0, 0, 0, 500_000 * k) for k in range(2)],
    ],
)
def test_clocks_of_a_worksheet_pass_midnight(tmp_path, cells):
    book = Workbook()
    for row in [("time", "force (N)"), *((cell, k) for k, cell in enumerate(cells))]:
        book.active.append(row)
    book.save(tmp_path / "a.xlsx")
    np.testing.assert_allclose(read(tmp_path / "a.xlsx")["time"], 0.5 * np.arange(4), atol=1e-9)


START = np.datetime64("2024-03-14T10:00:00.5", "ns")


def _worksheet(path):
    book = Workbook()
    for row in [("time", "x"), *((datetime(2024, 3, 14, 10, 0, 0, 500_000 + 250_000 * k), k) for k in range(2))]:
        book.active.append(row)
    book.save(path)


def _waveform(path):
    wave = {"wf_increment": 0.25, "wf_start_time": START.astype("M8[us]")}
    with TdmsWriter(path) as file:
        file.write_segment([ChannelObject("log", "x", np.arange(2.0), wave)])


def _stamped(path):
    stamps = START.astype("M8[us]") + np.arange(2) * np.timedelta64(250, "ms")
    with TdmsWriter(path) as file:
        file.write_segment([ChannelObject("log", "time", stamps), ChannelObject("log", "x", np.arange(2.0))])


def _netcdf(path):
    seconds = ("time", [0.0, 0.25], {"units": "seconds since 2024-03-14 10:00:00.5"})
    xr.Dataset({"x": ("time", [0.0, 1.0])}, coords={"time": seconds}).to_netcdf(path, engine="h5netcdf")


@pytest.mark.parametrize(
    ("name", "write"),
    [
        ("a.xlsx", _worksheet),
        ("a.tdms", _waveform),
        ("a.tdms", _stamped),
        ("a.nc", _netcdf),
        ("a.npz", lambda path: np.savez(path, time=START + np.arange(2) * np.timedelta64(250, "ms"), x=np.arange(2.0))),
    ],
)
def test_dates_of_other_formats_count_from_a_common_one_as_well(tmp_path, name, write):
    write(tmp_path / name)
    assert read(tmp_path / name)["time"].values.tolist() == [0, 0.25]
    data = {"time": {"column": "time", "since": "2024-03-14 09:59:59"}}
    run = read(tmp_path / name, validate_as(Sheet, data, "sheet"))
    np.testing.assert_allclose(run["time"], [1.5, 1.75], atol=1e-9)


def _book(path, *rows):
    book = Workbook()
    for row in rows:
        book.active.append(row)
    book.save(path)
    return path


@pytest.mark.parametrize(
    ("first", "second", "start"),
    [
        ("2024-05-03 12:00:01.25", "2024-05-03 12:00:02", "2024-05-03 12:00:01.250000+00:00"),
        ("2024-05-03T12:00:01.25Z", "2024-05-03T14:00:02+02:00", "2024-05-03 12:00:01.250000+00:00"),
        ("13.05.2024 12:00:01,25 ", " 13.05.2024 12:00:02", "2024-05-13 12:00:01.250000+00:00"),
        ("5/13/2024 12:00:01.25 PM", "5/13/2024 12:00:02 PM", "2024-05-13 12:00:01.250000+00:00"),
        ("12:00:01.25", "12:00:02", ""),
    ],
)
@pytest.mark.parametrize("heading", ["time", "logged at"])
def test_dates_as_text_in_worksheets_are_clocks(tmp_path, heading, first, second, start):
    path = _book(tmp_path / "a.xlsx", (heading, "force [N]"), (first, 1.5), (second, 2.5))
    run = read(path)
    np.testing.assert_allclose(np.diff(run["time"]), [0.75], atol=1e-9)
    assert (run.attrs["since"], list(run.data_vars)) == (start, ["force"])
    assert float(run["time"][0]) == (0.0 if start else 43201.25)
    assert any(phrase.startswith(f"{heading}: text, ") for phrase in json.loads(run.attrs["provenance"])["found"])


def test_other_texts_of_a_worksheet_are_no_clock(tmp_path):
    dates = [("2024-05-03 12:00:01", 1.0), ("2024-05-03 12:00:02", 2.0)]
    assert "time" not in read(_book(tmp_path / "a.xlsx", ("note", "x"), ("up", 1.0), ("12:00:01 up", 2.0))).dims
    late = [*dates * 150, ("later", 3.0)]
    with pytest.raises(InputError, match=r'line 302, column A \(time\): "later" is not a date and time'):
        read(_book(tmp_path / "b.xlsx", ("time", "x"), *late))
    with pytest.raises(InputError, match=r"03/04/2024 may have the day or the month first\. Write file: {dates"):
        read(_book(tmp_path / "c.xlsx", ("time", "x"), ("03/04/2024 10:00:00", 1.0), ("04/04/2024 10:00:00", 2.0)))
    mixed = _book(tmp_path / "d.xlsx", ("time", "x"), dates[0], *[dates[1]] * 250, (datetime(2024, 5, 3, 12, 1), 3.0))
    with pytest.raises(InputError, match="is no text in a column of dates as text"):
        read(mixed, validate_as(Sheet, {"time": {"column": 1, "repair": "drop"}}, "sheet"))
