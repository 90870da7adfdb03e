"""Names that a sheet gives: none twice, none that is taken, and a word where columns may be mixed up."""

import json

import numpy as np
import pytest

from nectosome.io.schema.validate import validate_as
from nectosome.measure import Sheet, load_sheet, read
from nectosome.units import InputError


@pytest.fixture
def log(tmp_path):
    (tmp_path / "log.csv").write_text("t [s],force [N],tip,Load cell\n0,1,10,100\n1,2,20,200\n2,3,30,300\n")
    return tmp_path / "log.csv"


@pytest.mark.parametrize(
    ("text", "line", "said"),
    [
        ("columns:\n  force: 2\n  force: 3", 3, '"force" occurs twice here, first in line 2'),
        (
            "columns:\n  force: 2\n  Force: 3",
            3,
            "columns.Force: differs only by capitals or blanks from columns.force.",
        ),
        (
            "columns:\n  tip x: 2\n  'tip  x ': 3",
            3,
            "differs only by capitals or blanks from columns.tip x. Give another",
        ),
        ("columns:\n  F: 2\n  'F ': 3", 3, "differs only by capitals or blanks from columns.F"),
        ("columns:\n  force: 2\nconditions:\n  force: 3 N", 4, "conditions.force: has the name of columns.force. Give"),
        ("columns:\n  force: 2\nconditions:\n  FORCE: 3 N", 4, "conditions.FORCE: differs only by capitals or blanks"),
        (
            "columns:\n  time: {unit: s}",
            2,
            "columns.time: the time has a field of its own, as in time: {column: time, ",
        ),
        ("columns:\n  Time: 2", 2, "columns.Time: the time has a field of its own"),
        ("columns:\n  ' time': 2", 2, "the time has a field of its own"),
        ("conditions:\n  time: 3 s", 2, "conditions.time: the time has a field of its own"),
        ("columns:\n  row: 2", 2, "columns.row: has the name of a coordinate that recordings have. Give another."),
        ("columns:\n  Repeat: 2", 2, "columns.Repeat: has the name of a coordinate"),
        ("conditions:\n  repeat: 2", 2, "conditions.repeat: has the name of a coordinate"),
        ("columns:\n  ' ': 2", 2, "must be a name without slashes"),
        (
            "clocks:\n  camera: t\n  Camera: t",
            3,
            "clocks.Camera: differs only by capitals or blanks from clocks.camera",
        ),
    ],
)
def test_a_name_that_is_taken_is_refused_with_its_line(tmp_path, text, line, said):
    (tmp_path / "s.yaml").write_text(text + "\n")
    with pytest.raises(InputError) as error:
        load_sheet(tmp_path / "s.yaml")
    assert said in str(error.value)
    assert f"line {line}" in str(error.value)


def test_symbols_in_capitals_are_others_than_small_ones(log):
    data = {"columns": {"F": 2, "f": 3, "Fx": 2, "fx": 3}, "conditions": {"A": "20 deg", "a": "3 mm"}}
    assert list(read(log, validate_as(Sheet, data, "sheet")).data_vars) == ["F", "f", "Fx", "fx"]


@pytest.mark.parametrize(
    ("columns", "said"),
    [
        ({"force": "tip"}, "force: is the column tip; the file's own column force is another"),
        ({"force": 3, "tip": 2}, "tip: is the column force; the file's own column tip is another"),
        ({"a": "force", "b": 2}, "a, b: are one column, force"),
        ({"force": 1}, "force: is the column of the time, t"),
    ],
)
def test_columns_that_may_be_mixed_up_are_warned_of(log, columns, said):
    sheet = validate_as(Sheet, {"time": {"column": "t"}, "columns": columns}, "sheet")
    assert said in json.loads(read(log, sheet).attrs["provenance"])["warnings"]


def test_a_sheet_without_doubts_has_no_warnings(log):
    data = {"time": {"column": "t", "unit": "s"}, "columns": {"force": "Load cell", "tip": {"unit": "mm"}}}
    data["columns"]["pull"] = data["columns"].pop("force")
    run = read(log, validate_as(Sheet, data, "sheet"))
    assert json.loads(run.attrs["provenance"])["warnings"] == []
    np.testing.assert_allclose(run["tip"], [0.01, 0.02, 0.03])


def test_a_name_that_occurs_twice_in_the_file_is_told(tmp_path):
    (tmp_path / "a.csv").write_text("t [s],force [N],force [N]\n0,1,10\n1,2,20\n")
    sheet = validate_as(Sheet, {"columns": {"pull": "force"}}, "sheet")
    run = read(tmp_path / "a.csv", sheet)
    said = "pull: columns 2 and 3 are called force; it is column 2"
    assert said in json.loads(run.attrs["provenance"])["warnings"]
    sheet = validate_as(Sheet, {"columns": {"pull": "force (2)"}}, "sheet")
    run = read(tmp_path / "a.csv", sheet)
    assert json.loads(run.attrs["provenance"])["warnings"] == []
    assert run["pull"].values.tolist() == [10, 20]


def test_what_else_could_be_the_time_is_told(tmp_path):
    (tmp_path / "a.csv").write_text("time [s],timestamp,time [s],x\n0,5,7,1\n1,6,8,2\n2,7,9,3\n")
    run = read(tmp_path / "a.csv")
    found = json.loads(run.attrs["provenance"])["found"]
    assert any(phrase.startswith("time: column 1, time, by its name, and not column 2, timestamp") for phrase in found)
    assert list(run.data_vars) == ["timestamp", "time (2)", "x"]


def test_a_column_called_as_the_coordinate_gets_another_name_and_it_is_told(tmp_path):
    (tmp_path / "a.csv").write_text("time [s],x\n0,5\n1,6\n")
    run = read(tmp_path / "a.csv", validate_as(Sheet, {"time": {"rate": "2 Hz"}}, "sheet"))
    assert list(run.data_vars) == ["time (2)", "x"]
    said = "the column time is a quantity, named time (2), as time is the coordinate"
    assert said in json.loads(run.attrs["provenance"])["found"]
