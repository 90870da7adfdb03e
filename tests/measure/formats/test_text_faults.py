"""What a user is told when a text file cannot be read: the place, the value and the way out."""

import json
import os
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nectosome.io.schema.validate import validate_as
from nectosome.measure import Sheet, read
from nectosome.measure.formats.source import Options
from nectosome.measure.formats.text import open_text
from nectosome.units import InputError


def fault(path, **options):
    """The error when all of a file is read."""
    with pytest.raises(InputError) as caught, open_text(path, Options(**options)) as source:
        list(source.pieces(1000))
    assert caught.value.file == str(path)
    return caught.value


def text_fault(tmp_path, text, **options):
    path = tmp_path / "bench.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return fault(path, **options)


@st.composite
def faulty(draw):
    """A file with names or none, with one cell of text or one too few, and where that is."""
    delimiter = draw(st.sampled_from([";", "\t", ",", " ", "|"]))
    width, count = draw(st.integers(2, 5)), draw(st.integers(4, 9))
    numbers = st.integers(-99999, 99999).map(lambda x: f"{x / 100:.2f}")
    rows = [[draw(numbers) for _ in range(width)] for _ in range(count)]
    names = [f"p{k}" for k in range(width)] if draw(st.booleans()) else []
    i, j = draw(st.integers(0, count - 2)), draw(st.integers(0, width - 1))
    if draw(st.booleans()):
        rows[i][j] = draw(st.sampled_from(["oops", "1.5.2", "1..5", "12:30:01", "5%"]))
    else:
        del rows[i][j]
    lines = [names, *rows] if names else rows
    return "".join(delimiter.join(line) + "\n" for line in lines), i + 1 + bool(names)


@settings(max_examples=200)
@given(faulty())
def test_no_row_with_a_fault_is_passed_over(tmp_path_factory, file):
    text, line = file
    assert text_fault(tmp_path_factory.mktemp("text"), text).line == line


ROWS = "".join(f"{k}.5,{k},1\n" for k in range(3000))


@pytest.mark.parametrize("above", ["", ROWS])
def test_a_cell_that_is_no_number_is_shown_with_line_and_column(tmp_path, above):
    """Among the first lines, by which the layout is found, and far behind them."""
    error = text_fault(tmp_path, f"time,force,n\n0.5,1,2\n{above}1.5,oops,2\n2.5,3,2\n")
    assert (error.line, error.field) == (3 + above.count("\n"), "force")
    assert error.message == '"oops" is not a number. Correct it, or leave the cell empty where there is no value.'


@pytest.mark.parametrize("cell", ["1_000", "0x10", "True", "1.2e", "1 2", "1d5", "--1", "\u22121", "nan(1)", "1.5N"])
def test_what_only_resembles_a_number_is_none(tmp_path, cell):
    assert f'"{cell}" is not a number.' in text_fault(tmp_path, f"a;b\n1;2\n3;{cell}\n5;6\n").message


def test_a_column_of_true_and_false_does_not_pass_for_numbers(tmp_path):
    """Not even where a block has nothing else."""
    error = text_fault(tmp_path, "a,b\n" + "1.5,2\n" * 400_000 + "1.5,True\n" * 300_000)
    assert (error.line, error.field) == (400_002, "b")


@pytest.mark.parametrize("above", ["", ROWS])
def test_a_row_with_too_many_or_too_few_cells_is_shown_with_the_counts(tmp_path, above):
    error = text_fault(tmp_path, f"time,force,n\n0.5,1,2\n{above}1.5,2\n2.5,3,2\n")
    assert error.line == 3 + above.count("\n")
    remedy = "write repair: {rows: drop} in a sheet to leave such lines out, or put # before it."
    assert error.message == f"2 cells here, 3 expected. Correct this line, or {remedy}"
    assert "4 cells here, 3 expected." in text_fault(tmp_path, f"a,b,c\n0.5,1,2\n{above}1,2,3,4\n2,3,2\n").message
    assert (
        "1 cell here, 3 expected."
        in text_fault(tmp_path, f"a b c\n0.5 1 2\n{above.replace(',', ' ')}1\n2 3 2\n").message
    )


def test_lines_that_were_cut_are_left_out_and_counted_by_a_sheet(tmp_path):
    """As a serial log has them: cut, two in one, and the words of a board that starts again; both ways of reading."""
    for label in ("", ",a"):
        path = tmp_path / f"log{len(label)}.txt"
        rows = [f"{k},{2 * k},0{label}" for k in range(1, 1001)]
        rows[499:501] = ["500,", "Logger v1.3", f"501,10x2,0{label}"]
        rows[800] = f"801,1602,0802,1604,0{label}"
        path.write_text(f"Logger v1.3\nms,raw,sync{label}\n" + "\n".join(rows) + "\n")
        with pytest.raises(InputError, match=r"cells? here, \d expected\. .* repair: \{rows: drop\} in a sheet"):
            read(path)
        run = read(path, validate_as(Sheet, {"repair": {"rows": "drop"}}, "sheet"))
        about = json.loads(run.attrs["provenance"])
        assert run.sizes["time"] == 997
        np.testing.assert_allclose(run["raw"], 2000 * run["time"].values, rtol=1e-14)
        cells = 4 if label else 3
        assert about["repairs"] == [f"4 lines left out: not {cells} cells of numbers; the first is line 502"]


PAIRS = ["1,2,3,4\n1,2\n", "1,2\n1,2,3,4\n", "1,2,3,4,5\n\n"]
PAIRS_WITH_EMPTY = ["1,2,3,\n1,2\n", "1,2,,4\n,2\n"]  # between blanks no cell is empty


@pytest.mark.parametrize(("delimiter", "pair"), [*product(",;\t ", PAIRS), *product(",;\t", PAIRS_WITH_EMPTY)])
@pytest.mark.parametrize("label", ["", "rig,"])
def test_too_many_and_too_few_cells_do_not_make_up_for_each_other(tmp_path, pair, label, delimiter):
    """Also beside a column that is left out as text, where rows are read in another way."""
    lines = ("1,2,3\n" * 10 + pair + "1,2,3\n" * 10).splitlines()
    text = "".join(f"{label}{line}\n" if line else "\n" for line in lines)
    error = text_fault(tmp_path, text.replace(",", delimiter))
    assert (error.line, f"{4 if label else 3} expected" in error.message) == (11, True)


def test_a_fault_in_the_first_row_does_not_make_it_part_of_the_head(tmp_path):
    error = text_fault(tmp_path, "a,b,c\n0.5,x1,2\n1.5,2,3\n2.5,3,4\n")
    assert error.line == 2
    assert '"x1" is not a number.' in error.message
    error = text_fault(tmp_path, "a,b,c\n0.5,1\n1.5,2,3\n2.5,3,4\n")
    assert (error.line, error.message) == (
        2,
        "2 cells here, and the rows below have 3. Put # before it if it is not a row.",
    )
    assert text_fault(tmp_path, "a,b,c\n0.5,1,2,oops\n1.5,2,3\n2.5,3,4\n").line == 2


def test_names_that_are_numbers_must_be_told(tmp_path):
    error = text_fault(tmp_path, "time,1,2\n0.5,2,3\n")
    assert error.message.endswith("If this line has the names, set header to 1.")


def test_names_and_cells_that_differ_in_number_are_refused(tmp_path):
    error = text_fault(tmp_path, "a,b\n1,2,3\n4,5,6\n")
    assert error.line == 1
    assert error.message == "2 names here, and the rows have 3 cells. Name each column, or set header to 0."
    error = text_fault(tmp_path, "a,b\n1,2,3\n4,5,6\n", header=1)
    assert (error.line, error.message) == (1, "there are not 3 names in this line. Give the line that has them, or 0.")


def test_a_decimal_comma_and_two_numbers_are_not_confused(tmp_path):
    error = text_fault(tmp_path, "10,512\n20,513\n")
    assert error.message == '"20,513" is one number with a decimal comma, or two. Set decimal to "comma" or "point".'


def test_a_decimal_comma_and_thousands_are_not_confused(tmp_path):
    error = text_fault(tmp_path, "1;1,234\n2;5,678\n")
    assert error.message == (
        '"1,234" has a decimal comma, or a separator between thousands. '
        'Set decimal to "comma", or write the file without separators between thousands.'
    )


@pytest.mark.parametrize("cell", ["1,234.5", "1.234,5", "1,234,567", "1.234.567"])
def test_separators_between_thousands_are_refused(tmp_path, cell):
    for text in (f"a;b\n{cell};1.5\n{cell};2.5\n", f"a;b\n1.5;1.5\n{cell};2.5\n2.5;3.5\n"):
        error = text_fault(tmp_path, text)
        assert error.message.startswith(f'"{cell}" has separators between thousands. Write the file without them.')


def test_two_decimal_signs_are_refused(tmp_path):
    error = text_fault(tmp_path, "a;b\n0,5;1.5\n0,7;1.7\n")
    assert (error.line, error.field) == (2, "a")
    assert '"0,5" has a decimal comma in a file with points. Set decimal to "comma"' in error.message
    error = text_fault(tmp_path, "a;b\n0,5;1,5\n0,7;1.7\n0,8;1,8\n")
    assert '"1.7" has a decimal point in a file with commas.' in error.message


def test_a_cell_behind_the_last_column_is_refused(tmp_path):
    error = text_fault(tmp_path, "a;b;\n" + "1;2;\n" * 3000 + "3;4;5\n6;7;\n")
    assert (error.line, error.message) == (3002, '"5" stands behind the last column. Name its column, or delete it.')


def test_a_date_that_is_none_is_refused(tmp_path):
    for wrong in ("2024-13-01 10:00:00", "yesterday", "2024"):
        error = text_fault(tmp_path, f"at,b\n2024-01-01 10:00:00,1\n{wrong},2\n2024-01-01 10:00:02,3\n")
        assert (error.line, error.field) == (3, "at")
        assert error.message.startswith(f'"{wrong}" is not a date and time.')
    assert text_fault(tmp_path, "at,b\n2024-13-01 10:00:00,1\n").field == "at"


def test_an_open_quotation_is_refused(tmp_path):
    error = text_fault(tmp_path, 'a,b\n1,2\n"3,4\n5,6\n')
    assert (error.line, error.message) == (3, "the quotation marks do not pair. Close them, or put # before the line.")


@pytest.mark.parametrize("text", ["", "\n\n \n", b"\xef\xbb\xbf"])
def test_an_empty_file_is_refused(tmp_path, text):
    assert text_fault(tmp_path, text).message == "is empty."


def test_a_file_without_rows_is_refused(tmp_path):
    assert (
        text_fault(tmp_path, "time,force\n").message == 'there is no row of numbers. Its last line reads "time,force".'
    )
    assert text_fault(tmp_path, "# only this\n").message == "there is no row of numbers."


def test_nul_bytes_are_refused_with_their_line(tmp_path):
    error = text_fault(tmp_path, b"a,b\n1,2\n3,4\n\0\0\0\0")
    assert error.line == 4
    assert error.message.startswith(
        "contains NUL bytes: it is not text, its writing was interrupted, or it has another encoding"
    )
    assert text_fault(tmp_path, "a,b\n1,2\n".encode("utf-16-le")).line == 1
    assert text_fault(tmp_path, b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR").line == 3


def test_a_wrong_encoding_is_told(tmp_path):
    error = text_fault(tmp_path, b"a;b\n1;2\n" + b"# 20 \xb0C\n3;4\n", encoding="utf-8")
    assert (error.line, error.message) == (3, "this is not utf-8. Set encoding, for instance to cp1252.")
    assert text_fault(tmp_path, b"1;2\n3;4\n5", encoding="utf-16").message.startswith("this is not utf-16.")
    error = text_fault(tmp_path, "1;2\n", encoding="utf-99")
    assert error.message == '"utf-99" is not a known encoding; common ones are utf-8, utf-16, cp1252 and latin-1.'
    assert "not a known encoding" in text_fault(tmp_path, "1;2\n", encoding="base64").message


def test_a_line_without_end_is_refused(tmp_path):
    assert "does not end" in text_fault(tmp_path, "1;2\n" + "1" * 20_000_000).message


def test_options_that_do_not_fit_are_refused(tmp_path):
    error = text_fault(tmp_path, "1;2\n", delimiter="slash")
    assert error.message == 'there is no delimiter "slash"; give tab, semicolon, comma, bar, blanks.'
    assert text_fault(tmp_path, "1;2\n", decimal="dot").message == 'there is no decimal sign "dot"; give point, comma.'
    assert text_fault(tmp_path, "1;2\n", header=7).message == "header is set to line 7, which is empty."
    assert "no row of numbers after" in text_fault(tmp_path, "1;2\n3;4\n", header=2).message
    assert text_fault(tmp_path, "1;2\n", table="Sheet1").message == "a text file has one table; leave table out."
    assert "no row of numbers" in text_fault(tmp_path, "1\t2\n3\t4\n", delimiter=";").message


def test_a_path_that_is_no_readable_file_is_refused(tmp_path):
    assert fault(tmp_path).message == "cannot be read: Is a directory."
    assert fault(tmp_path / "none.csv").message == "cannot be read: No such file or directory."
    closed = tmp_path / "closed.csv"
    closed.write_text("1;2\n")
    closed.chmod(0)
    if not os.access(closed, os.R_OK):  # root may read anything
        assert fault(closed).message == "cannot be read: Permission denied."
