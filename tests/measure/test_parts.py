"""Several recordings in one file, apart by a column of numbers or text."""

import json

import numpy as np
import pytest
from openpyxl import Workbook

from nectosome.cli import main
from nectosome.io.schema.validate import validate_as
from nectosome.measure import Sheet, load_campaign, read, read_all
from nectosome.measure.labels import file_of
from nectosome.units import InputError

SIZES = {"left 1": 5, "right": 7, "007": 3}


def rows(labels=tuple(SIZES)):
    """The rows of swims whose clock starts at 0 each time: label, time [s], position [mm]."""
    return [(name, 0.5 * k, 100 * i + k) for i, name in enumerate(labels) for k in range(list(SIZES.values())[i])]


def text(path, table, names="swim,t [s],x [mm]"):
    path.write_text("\n".join([names, *(",".join(map(str, row)) for row in table)]) + "\n")
    return path


def sheet(**data):
    return validate_as(Sheet, data, "sheet")


def check_swims(runs, labels):
    assert [run.attrs["part"] for run in runs] == labels
    for i, (run, n) in enumerate(zip(runs, SIZES.values(), strict=True)):
        np.testing.assert_array_equal(run["time"], 0.5 * np.arange(n))
        np.testing.assert_allclose(run["x"], 1e-3 * (100 * i + np.arange(n)), rtol=1e-14)
        assert list(run.data_vars) == ["x"]


@pytest.mark.parametrize("column", ["swim", 1])
@pytest.mark.parametrize("labels", [list(SIZES), ["1", "2", "3"], ["2024-01-01 10:00:00", "b", "a"]])
def test_each_value_of_a_text_column_is_a_recording(tmp_path, column, labels):
    path = text(tmp_path / "swims.csv", rows(labels))
    runs = read_all(path, sheet(split=column))
    check_swims(runs, labels)
    assert file_of(runs[1]) == f"swims.csv [{labels[1]}]"
    assert runs[1].attrs["title"] == f"swims.csv [{labels[1]}]"
    assert f"split by swim: {labels[1]}, rows 7 to 13" in json.loads(runs[1].attrs["provenance"])["found"]
    one = read(path, sheet(split={"column": column, "value": labels[1]}))
    np.testing.assert_array_equal(one["x"], runs[1]["x"])


def test_a_file_is_split_across_the_pieces_in_which_it_is_read(tmp_path, monkeypatch):
    path = text(tmp_path / "swims.csv", rows())
    for size in (1, 2, 5, 6):
        monkeypatch.setattr("nectosome.measure.recordings._ROWS", size)
        check_swims(read_all(path, sheet(split="swim")), list(SIZES))


def test_worksheets_are_split_by_text_and_by_numbers(tmp_path):
    for labels, shown in ((list(SIZES), list(SIZES)), ([1, 2, 3], ["1", "2", "3"])):
        book = Workbook()
        for row in [("swim", "t [s]", "x [mm]"), *rows(labels)]:
            book.active.append(row)
        book.save(tmp_path / "swims.xlsx")
        check_swims(read_all(tmp_path / "swims.xlsx", sheet(split="swim")), shown)


def test_arrays_are_split_by_numbers(tmp_path):
    table = rows([1, 2.5, 3])
    swim, t, x = map(np.array, zip(*table, strict=True))
    np.savez(tmp_path / "swims.npz", **{"swim": swim, "t": t, "x": 1e-3 * x})
    check_swims(read_all(tmp_path / "swims.npz", sheet(split="swim")), ["1", "2.5", "3"])


def test_each_recording_has_its_own_rate_and_clock_with_a_date(tmp_path):
    table = [(name, 1_650_000_000 + 100 * i + k, k) for i, name in enumerate("ab") for k in range(4)]
    path = text(tmp_path / "a.csv", table, "swim,stamp,x")
    for run in read_all(path, sheet(split="swim", time="stamp")):
        np.testing.assert_array_equal(run["time"], np.arange(4))
    late = read_all(path, sheet(split="swim", time={"column": "stamp", "since": "2022-04-15 05:20:00"}))[1]
    np.testing.assert_array_equal(late["time"], 100 + np.arange(4))
    for run in read_all(path, sheet(split="swim", time={"rate": "2 Hz"}, columns={"x": "x"})):
        np.testing.assert_array_equal(run["time"], 0.5 * np.arange(4))


@pytest.mark.parametrize(
    ("table", "split", "message"),
    [
        (
            [("a", 0, 0), ("b", 0, 0), ("a", 1, 0)],
            "swim",
            r'line 4, swim: rows with "a" are not together: they go on he',
        ),
        ([("a", 0, 0), ("", 1, 0), ("a", 2, 0)], "swim", r"line 3, swim: has no value in this row"),
        ([("a", 0, 0), ("a", 2, 0), ("a", 1, 0)], "swim", r"a\.csv \[a\], line 4, t: the time 1 s comes after 2 s"),
        ([("a", 0, 0), ("b", 2, 0)], "swum", r'split: there is no column called "swum"\. Did you mean "swim"'),
        ([("a", 0, 0), ("b", 2, 0)], 4, r"split: there is no column 4: the file has 3"),
        ([("a", k, k) for k in range(1001)], "x", r"x: has more than 1000 values\. Is it the column that says which"),
        ([("a", 0, 0), ("b", 2, 0)], {"column": 1, "value": "c"}, r'swim: there is no "c"\. 2 values: a, b\.'),
    ],
)
def test_what_cannot_be_split_is_refused_with_its_row(tmp_path, table, split, message):
    with pytest.raises(InputError, match=message):
        read_all(text(tmp_path / "a.csv", table), sheet(split=split))


def test_the_column_of_a_split_is_no_quantity_and_one_recording_may_be_needed(tmp_path):
    path = text(tmp_path / "a.csv", rows())
    with pytest.raises(InputError, match="swim: column 1, swim, is what the file is split by, not numbers"):
        read_all(path, sheet(split="swim", columns={"swim": 1}))
    with pytest.raises(InputError, match=r'split: splits the file into 3 recordings, .* value: "left 1"'):
        read(path, sheet(split="swim"))


def test_recordings_of_a_campaign_are_repeats_whatever_file_they_are_in(tmp_path):
    text(tmp_path / "a.csv", rows())
    text(tmp_path / "b.csv", rows(["u", "v", "w"]))
    (tmp_path / "c.yaml").write_text(
        "split: swim\nrecordings: [{file: a.csv, conditions: {f: 1 Hz}}, {file: b.csv, conditions: {f: 1 Hz}},"
        ' {file: c.csv, split: {column: swim, value: "007"}}, {file: c.csv, split: {column: swim, value: right}}]\n'
    )
    text(tmp_path / "c.csv", rows())
    runs = load_campaign(tmp_path / "c.yaml").recordings()
    assert [int(run["repeat"]) for run in runs] == [1, 2, 3, 4, 5, 6, 1, 2]
    assert [run.attrs["part"] for run in runs] == [*SIZES, "u", "v", "w", "007", "right"]
    (tmp_path / "c.yaml").write_text("recordings: [{file: c.csv, split: {column: swim, value: a}}, {file: c.csv}]\n")
    with pytest.raises(InputError, match=r"c\.csv is listed twice"):
        load_campaign(tmp_path / "c.yaml")


def test_the_command_shows_each_recording(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    text(tmp_path / "a.csv", rows())
    (tmp_path / "s.yaml").write_text("split: swim\n")
    assert main(["measure", "a.csv", "--config", "s.yaml"]) == 0
    shown = capsys.readouterr().out
    for label, n in SIZES.items():
        assert f"a.csv [{label}]: text, {n} rows" in shown
    assert main(["measure", "a.csv", "--config", "s.yaml", "--save", "a.nc"]) == 2
    assert "only one recording can be saved, not 3" in capsys.readouterr().err
