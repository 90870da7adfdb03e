"""Every fault of a measurement in a file of every format: refused with its row, or told; never silent, never lost."""

import json

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from nectosome.io.schema.validate import validate_as
from nectosome.measure import Sheet, read
from nectosome.units import InputError

from .formats.write import FORMATS

N = 60
SHEET = {"time": {"column": "t", "unit": "s"}, "columns": {"F": {"unit": "N"}}}
DROP = SHEET | {"time": SHEET["time"] | {"repair": "drop"}}
RANGE = SHEET | {"columns": {"F": {"unit": "N", "range": ["-50 N", "50 N"]}}}


def sheet(data):
    return validate_as(Sheet, data, "sheet")


@st.composite
def tables(draw):
    """Times that go on and forces within +-40, and a row that is neither first nor last."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    t = draw(st.integers(-100, 100)) + 0.125 * np.arange(N)
    return {"t": t, "F": rng.uniform(-40, 40, N)}, draw(st.integers(2, N - 2))


@pytest.fixture(scope="module", params=FORMATS)
def bench(request, tmp_path_factory):
    """Write a table as a file, and give its path and the row of its first sample."""
    name, first, write = FORMATS[request.param]
    folder = tmp_path_factory.mktemp("bench")

    def bench(table):
        write(folder / name, table)
        return folder / name, first

    bench.infinite = request.param != "excel"  # a worksheet has no such numbers
    return bench


few = settings(max_examples=8)


@few
@given(tables())
def test_a_good_file_comes_back_and_nothing_is_odd(bench, drawn):
    table, _ = drawn
    path, _ = bench(table)
    run = read(path, sheet(SHEET))
    np.testing.assert_allclose(run["time"], table["t"], rtol=1e-15)
    np.testing.assert_allclose(run["F"], table["F"], rtol=1e-15)
    about = json.loads(run.attrs["provenance"])
    assert (about["repairs"], about["warnings"], run.attrs["gaps"]) == ([], [], "[]")


@few
@given(tables(), st.sampled_from(["back", "twice", "missing"]))
def test_a_time_that_does_not_go_on_is_refused_or_left_out(bench, drawn, fault):
    table, k = drawn
    t = table["t"].copy()
    t[k] = {"back": t[k - 2], "twice": t[k - 1], "missing": np.nan}[fault]
    path, first = bench({"t": t, "F": table["F"]})
    with pytest.raises(InputError) as caught:
        read(path, sheet(SHEET))
    assert (caught.value.file, caught.value.line, caught.value.field) == (str(path), first + k, "t")
    said = {"back": "comes after", "twice": "occurs twice", "missing": "is missing"}[fault]
    assert said in caught.value.message
    run = read(path, sheet(DROP))
    np.testing.assert_allclose(run["F"], np.delete(table["F"], k), rtol=1e-15)
    assert json.loads(run.attrs["provenance"])["repairs"] == [
        f"1 row left out: time does not increase; the first is row {first + k}"
    ]


@few
@given(tables(), st.integers(6, 1000))
def test_a_gap_is_told_with_its_ends(bench, drawn, steps):
    table, k = drawn
    t = table["t"].copy()
    t[k:] += 0.125 * steps
    path, first = bench({"t": t, "F": table["F"]})
    run = read(path, sheet(SHEET))
    assert json.loads(run.attrs["gaps"]) == [[t[k - 1], t[k], first + k]]
    odd = json.loads(run.attrs["provenance"])["warnings"]
    assert odd == [f"time: a gap of {0.125 * (steps + 1):.3g} s before row {first + k}"]


@few
@given(tables(), st.sampled_from([np.nan, np.inf, -np.inf]))
def test_values_that_are_none_are_counted_and_told(bench, drawn, value):
    table, k = drawn
    assume(bench.infinite or np.isnan(value))
    F = table["F"].copy()
    F[k] = value
    path, first = bench({"t": table["t"], "F": F})
    run = read(path, sheet(SHEET))
    assert np.flatnonzero(np.isnan(run["F"])).tolist() == [k]
    assert run["F"].attrs["missing"] == 1
    about = json.loads(run.attrs["provenance"])
    told = about["warnings"] if np.isnan(value) else about["repairs"]
    what = "missing, the first is row {}" if np.isnan(value) else "saturated or infinite, from row {}: now missing"
    assert told == ["F: 1 row " + what.format(first + k)]


@few
@given(tables(), st.integers(10, 20))
def test_a_sensor_at_its_end_is_told_and_by_its_range_missing(bench, drawn, length):
    table, k = drawn
    k = min(k, N - length)
    F = table["F"].copy()
    F[k : k + length] = 50.0
    path, first = bench({"t": table["t"], "F": F})
    odd = json.loads(read(path, sheet(SHEET)).attrs["provenance"])["warnings"]
    assert odd == [f"F: stays at its extreme 50 N for {length} rows from row {first + k}: saturated?"]
    run = read(path, sheet(RANGE))
    assert np.isnan(run["F"][k : k + length]).all()
    assert run["F"].attrs["missing"] == length
    repairs = json.loads(run.attrs["provenance"])["repairs"]
    assert repairs == [f"F: {length} rows saturated or infinite, from row {first + k}: now missing"]


@few
@given(tables())
def test_columns_that_are_not_there_are_refused_and_a_sheet_overrules_units(bench, drawn):
    path, _ = bench(drawn[0])
    with pytest.raises(InputError, match=r'F2: there is no column called "F2"\. Did you mean "F"\?') as caught:
        read(path, sheet(SHEET | {"columns": {"F2": {"unit": "N"}}}))
    assert caught.value.file == str(path)
    named = {"t [s]": drawn[0]["t"], "F [mN]": drawn[0]["F"]}
    if path.suffix not in (".mat", ".npy"):  # their names hold no brackets
        path, _ = bench(named)
        run = read(path, sheet(SHEET))
        np.testing.assert_allclose(run["F"], drawn[0]["F"], rtol=1e-15)
        odd = json.loads(run.attrs["provenance"])["warnings"]
        assert odd == ["F: is in mN in the file and in N in the sheet, which holds"]
        np.testing.assert_allclose(read(path)["F"], 1e-3 * drawn[0]["F"], rtol=1e-15)


@few
@given(tables(), st.integers(1, 40))
def test_a_file_that_breaks_off_is_refused_or_said(bench, drawn, lost):
    """Whatever is kept is as it was, and a row that is lost is told, unless a text ends with a whole row."""
    table, _ = drawn
    path, _ = bench(table)
    path.write_bytes(path.read_bytes()[:-lost])
    try:
        run = read(path, sheet(SHEET))
    except InputError as error:
        assert error.file == str(path)
        return
    n = run.sizes["time"]
    np.testing.assert_allclose(run["F"][: n - 1], table["F"][: n - 1], rtol=1e-15)
    about = json.loads(run.attrs["provenance"])
    assert about["repairs"] or n == N or path.read_bytes().endswith(b"\n")
