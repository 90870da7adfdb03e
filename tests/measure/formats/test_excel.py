"""Worksheets come back as they look; what is no number is told by its row and column."""

import re
from datetime import date, datetime, time, timedelta
from zipfile import ZipFile

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal
from openpyxl import Workbook

from nectosome.measure.formats.excel import open_excel
from nectosome.units import InputError

from .read import check_refusals, cuts, flipped, flips, read, survived

HEAD = ["t [s]", "force (N)"]
NUMBERS = [[0.125 * i, i * i - 7.5] for i in range(40)]


@pytest.fixture
def sheet(tmp_path):
    """Write a workbook of one worksheet, "Data", and further ones by their titles."""

    def sheet(*rows, merged=(), **further):
        book = Workbook()
        data = book.active
        data.title = "Data"
        for row in rows:
            data.append(row)
        for cells in merged:
            data.merge_cells(cells)
        for title, lines in further.items():
            other = book.create_sheet(title)
            for line in lines:
                other.append(line)
        book.save(tmp_path / "a.xlsx")
        return tmp_path / "a.xlsx"

    return sheet


def test_names_units_and_numbers_come_back(sheet):
    contents = read(open_excel, sheet(HEAD, *NUMBERS))
    assert (contents.names, contents.units) == (["t", "force"], ["s", "N"])
    assert_array_equal(contents.values, NUMBERS)
    assert_array_equal(contents.rows, np.arange(2, 42))
    assert contents.found == ("worksheet: Data", "names in row 1")


@given(st.lists(st.tuples(st.floats(allow_nan=False, allow_infinity=False), st.integers(-(2**60), 2**60)), min_size=1))
def test_any_numbers_come_back_exactly(tmp_path_factory, rows):
    path = tmp_path_factory.mktemp("xlsx") / "a.xlsx"
    book = Workbook()
    for row in rows:
        book.active.append(row)
    book.save(path)
    written = [[float(f"{x:.16g}"), float(f"{n:.16g}")] for x, n in rows]  # as openpyxl writes numbers
    assert_array_equal(read(open_excel, path).values, written)


def test_a_row_of_units_below_the_names_is_known(sheet):
    contents = read(open_excel, sheet(["t", "F", "slip", "x (left)"], ["s", "[mN]", "-", None], [0, 1, 2, 3]))
    assert contents.names == ["t", "F", "slip", "x (left)"]
    assert contents.units == ["s", "mN", "-", ""]
    assert contents.found[1:] == ("names in row 1", "units in row 2")


def test_notes_above_the_table_are_told_and_empty_cells_are_nan(sheet):
    notes = [["Run 5"], ["Rate", 1000, "Hz"], [date(2024, 5, 1)], [], ["Gain", 1.5]]
    path = sheet(
        *notes, [None, *HEAD, "on"], [None, 0, 1, True], [None, 1, None, False], [None, "n/a", 3, True], [], []
    )
    contents = read(open_excel, path)
    assert contents.names == ["t", "force", "on"]
    assert_array_equal(contents.values, [[0, 1, 1], [1, np.nan, 0], [np.nan, 3, 1]])
    assert_array_equal(contents.rows, [7, 8, 9])
    assert contents.found[1:] == ("names in row 6", "left out: notes above the table, rows 1 to 5")
    assert contents.repairs == []


def test_a_table_without_names_numbers_its_columns(sheet):
    assert read(open_excel, sheet([1, 2], [3, 4])).names == ["column 1", "column 2"]
    contents = read(open_excel, sheet([2023, 2024], [1, 2], [3, 4]), header=0)
    assert_array_equal(contents.rows, [1, 2, 3])


def test_the_row_of_names_can_be_said(sheet):
    path = sheet(["t", "F"], ["time", "force at tip"], ["s", "N"], [0, 1])
    assert read(open_excel, path).names == ["time", "force at tip"]
    contents = read(open_excel, path, header=1)
    assert (contents.names, contents.units) == (["t", "F"], ["s", "N"])
    assert read(open_excel, sheet([2023, 2024], [1, 2]), header=1).names == ["2023", "2024"]
    with pytest.raises(InputError, match="no rows of numbers below names in row 9 of Data"):
        read(open_excel, path, header=9)


def test_names_that_occur_twice_are_told_apart(sheet):
    assert read(open_excel, sheet(["F", "F", "F (2)", "F"], [1, 2, 3, 4])).names == ["F", "F (3)", "F (2)", "F (4)"]


def test_merged_names_stand_for_each_of_their_columns(sheet):
    rows = [["t", "force", None, None], [None, "x", "y", "z"], ["s", "N", "N", "N"], [0, 1, 2, 3]]
    contents = read(open_excel, sheet(*rows, merged=["A1:A2", "B1:D1"]))
    assert contents.names == ["t", "force x", "force y", "force z"]
    assert contents.units == ["s", "N", "N", "N"]
    assert contents.found[1:] == ("names in row 2", "units in row 3")


def test_names_over_two_rows_need_not_be_merged(sheet):
    rows = [[None, "force", None, "torque", None], ["t", "x", "y", "x", "y"], ["s", "N", "N", "N m", "N m"]]
    contents = read(open_excel, sheet(["Run 5"], *rows, [0, 1, 2, 3, 4], [1, 1, 2, 3, 4]))
    assert contents.names == ["t", "force x", "force y", "torque x", "torque y"]


def test_merged_numbers_are_refused(sheet):
    with pytest.raises(InputError, match=r"a\.xlsx, line 4, column B \(force\): the cells are merged.* Unmerge them"):
        read(open_excel, sheet(HEAD, *NUMBERS, merged=["B4:B6"]))


@pytest.mark.parametrize(
    ("cells", "seconds", "since"),
    [
        (
            [datetime(2024, 5, 1, 12, 0, 0, 250_000), datetime(2024, 5, 1, 12, 0, 1, 500_000)],
            [0, 1.25],
            "2024-05-01 12:",
        ),
        ([date(2024, 5, 1), date(2024, 5, 3)], [0, 172_800], "2024-05-01"),
        ([time(23, 59, 58), time(23, 59, 59, 500_000)], [0, 1.5], "23:59:58"),
        ([timedelta(hours=30), timedelta(hours=30, seconds=1)], [108_000, 108_001], ""),
    ],
)
def test_times_become_seconds(sheet, cells, seconds, since):
    contents = read(open_excel, sheet(["time", "F"], *([cell, 1] for cell in cells)))
    assert_array_equal(contents["time"], seconds)
    assert contents.units == ["s", ""]
    assert [f"time: seconds since {since}" in phrase for phrase in contents.found].count(True) == bool(since)


def test_texts_are_left_out_as_a_column_and_refused_among_numbers(sheet):
    remarks = [[0, 1, "start"], [1, 2], [2, 3, "slipped"]]
    contents = read(open_excel, sheet([*HEAD, "remark"], *remarks))
    assert_array_equal(contents.values, [[0, 1], [1, 2], [2, 3]])
    assert "left out: remark (text)" in contents.found
    samples = read(open_excel, sheet(["sample", "force"], ["a", 1], ["b", 2]))
    assert (samples.names, samples.values.tolist()) == (["force"], [[1], [2]])
    for text in ("slipped", "1,5"):
        with pytest.raises(InputError) as error:
            read(open_excel, sheet(HEAD, *NUMBERS[:3], [3, text]))
        assert f'a.xlsx, line 5, column B (force): "{text}" is text, not a number. Correct the cell' in str(error.value)


def test_what_stands_beside_or_below_the_table_is_told(sheet):
    far = [*NUMBERS, *([i, i] for i in range(300))]
    contents = read(open_excel, sheet(HEAD, *far, [1, 2, "slipped here"], [], [1, 3]))
    assert_array_equal(contents.values, [*far, [1, 2], [1, 3]])
    assert contents.repairs == [
        'row 342: "slipped here" beside the table is left out.',
        "row 343: rows that are empty in the columns of the table are left out.",
    ]
    with pytest.raises(InputError, match=r"line 342, column D: 7 is beside the table"):
        read(open_excel, sheet(HEAD, *far, [1, 2, None, 7]))
    with pytest.raises(InputError, match=r'line 343, column A \(t\): "mean" is text'):
        read(open_excel, sheet(HEAD, *far, [], ["mean", 2]))
    with pytest.raises(InputError, match=r"line 342, column C: 5 is beside the table"):
        read(open_excel, sheet([*HEAD, "remark"], [0, 1, "a"], *far[1:], [1, 2, 5]))


def test_a_column_keeps_one_format(sheet):
    with pytest.raises(InputError, match=r"line 3, column A \(time\): 5 is a number in a column of times"):
        read(open_excel, sheet(["time", "F"], [time(1), 1], [5, 1]))
    with pytest.raises(InputError, match=r"line 3, column B \(F\): 01:00:00 is a time in a column of numbers"):
        read(open_excel, sheet(["t", "F"], [0, 1], [1, time(1)]))


_EMPTY = re.compile(r"<v ?/>|<v></v>")  # as it is written without and with lxml


def _with_values(path, values):
    """Give the formulas of a worksheet the values that Excel would have kept."""
    with ZipFile(path) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    for cell, value in values.items():
        sheet = members["xl/worksheets/sheet1.xml"].decode()
        before, found, after = sheet.partition(f'<c r="{cell}"')
        kind = ' t="str"' if value == "" else ""
        members["xl/worksheets/sheet1.xml"] = (
            f"{before}{found}{kind}{_EMPTY.sub(f'<v>{value}</v>', after, count=1)}".encode()
        )
    with ZipFile(path, "w") as archive:
        for name, content in members.items():
            archive.writestr(name, content)


def test_formulas_count_by_the_values_that_excel_kept(sheet):
    path = sheet(HEAD, [0, "=A2*2"], [1, "=A3*2"], [2, '=IF(A4>1,"",1)'])
    with pytest.raises(
        InputError, match=r"line 2, column B \(force\): has a formula without a value. Open the workbook"
    ):
        read(open_excel, path)
    _with_values(path, {"B2": 0.5, "B3": 2, "B4": ""})
    assert_array_equal(read(open_excel, path)["force"], [0.5, 2, np.nan])


@pytest.mark.parametrize("wrong", ["#DIV/0!", "#VALUE!", "#REF!"])
def test_errors_of_formulas_are_refused_but_not_available_is_missing(sheet, wrong):
    with pytest.raises(InputError, match=rf'line 3, column B \(force\): "{wrong}" is'):
        read(open_excel, sheet(HEAD, [0, 1], [1, wrong]))
    assert_array_equal(read(open_excel, sheet(HEAD, [0, 1], [1, "#N/A"]))["force"], [1, np.nan])


def test_a_worksheet_is_chosen_by_its_title(sheet):
    path = sheet(HEAD, [0, 1], calm=[HEAD, [2, 3]], about=[["who", "me"], ["Rate", 1000]])
    with pytest.raises(InputError, match=r'several worksheets with numbers: Data, calm.*table: "Data"'):
        read(open_excel, path)
    assert_array_equal(read(open_excel, path, table="calm").values, [[2, 3]])
    with pytest.raises(InputError, match=r'no worksheet called "clam"\. Did you mean "calm"\?'):
        read(open_excel, path, table="clam")
    with pytest.raises(InputError, match="no rows of numbers in the first 200 rows of about"):
        read(open_excel, path, table="about")


def test_a_wrong_size_in_the_file_hides_no_rows(sheet):
    """Some programs write that the sheet is A1:A1."""
    path = sheet(HEAD, *NUMBERS)
    with ZipFile(path) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    name = "xl/worksheets/sheet1.xml"
    members[name] = members[name].replace(b'<dimension ref="A1:B41"', b'<dimension ref="A1:A1"')
    with ZipFile(path, "w") as archive:
        for member, content in members.items():
            archive.writestr(member, content)
    assert_array_equal(read(open_excel, path).values, NUMBERS)


def test_what_is_no_workbook_is_told(sheet, tmp_path):
    np.savez(tmp_path / "other.npz", a=NUMBERS)
    files = {
        "empty.xlsx": (b"", "is empty"),
        "text.xlsx": (b"t,F\n0,1\n", r"this is not an Excel workbook \(.xlsx\) but a text file"),
        "old.xlsx": (
            b"\xd0\xcf\x11\xe0" + bytes(600),
            "but an old .xls workbook, or one with a password. Save it as .xlsx",
        ),
        "array.xlsx": ((tmp_path / "other.npz").read_bytes(), "not an Excel workbook .* but a zip file"),
        "noise.xlsx": (b"PK\x03\x04" + bytes(range(200)), "damaged or cut off"),
    }
    check_refusals(open_excel, tmp_path, files)
    for empty in ([], [["a", "b"]], [["1,5", "2,5"]]):
        with pytest.raises(InputError, match=r"no rows of numbers in the first 200 rows of Data\. Numbers stored"):
            read(open_excel, sheet(*empty))


def test_a_cut_workbook_is_refused(sheet, tmp_path):
    for raw in cuts(sheet(HEAD, *NUMBERS).read_bytes()):
        assert survived(open_excel, tmp_path / "cut.xlsx", raw) is None


@given(places=flips)
def test_damage_is_refused_or_does_no_harm(tmp_path_factory, places):
    path = tmp_path_factory.mktemp("xlsx") / "a.xlsx"
    book = Workbook()
    for row in [HEAD, *NUMBERS]:
        book.active.append(row)
    book.save(path)
    contents = survived(open_excel, path, flipped(path.read_bytes(), places))
    if contents is not None:  # a zip file has checksums
        assert_array_equal(contents.values, NUMBERS)
