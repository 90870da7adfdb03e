"""Tables in text files: what was written is read back, however it was written."""

import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import nectosome_studies
from nectosome.measure.formats import text as text_blocks
from nectosome.measure.formats.source import Column, Options
from nectosome.measure.formats.text import open_text
from nectosome.units import InputError

from .read import growth

PAPERS = Path(nectosome_studies.__file__).parent
NAMES = ["time", "force", "pressure", "Größe", "laser V", "p1", "valve (left)", "x"]
UNITS = ["s", "N", "mm", "bar", "°C", "m/s^2", "1/s", "mV/V", ""]
NOTHING = ["nan", "NaN", "NA", "-"]


def read(path, rows=1000, **options):
    """Columns, rows, values, what was found, what was mended."""
    with open_text(path, Options(**options)) as source:
        pieces = list(source.pieces(rows))
        lines = np.concatenate([piece.rows for piece in pieces])
        return source.columns, lines, np.concatenate([piece.values for piece in pieces]), source.found, source.repairs


def read_text(tmp_path, text, **options):
    path = tmp_path / "bench.txt"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return read(path, **options)


def same(a, b):
    """Whether two arrays agree to the last bit, nan with nan."""
    both_nan = np.isnan(a) & np.isnan(b)
    return a.shape == b.shape and bool(np.all(both_nan | (a.view(np.int64) == b.view(np.int64))))


@st.composite
def files(draw):
    """Text of a table, its encoding, the options that settle it, and what is to be read."""
    delimiter = draw(st.sampled_from(["\t", ";", ",", "|", " "]))
    decimal = "." if delimiter == "," else draw(st.sampled_from([".", ","]))
    width, count = draw(st.integers(1, 5)), draw(st.integers(1, 8))
    number = st.floats(allow_nan=False).map(lambda x: (repr(x).replace(".", decimal), x))
    short = st.integers(-99999, 99999).map(lambda x: (f"{x / 1000:.3f}".replace(".", decimal), x / 1000))
    nothing = st.sampled_from(NOTHING).map(lambda word: (word, np.nan))
    cell = st.one_of(number, short, nothing)
    rows = [[draw(cell) for _ in range(width)] for _ in range(count)]
    rows[0][0] = rows[-1][-1] = draw(short)

    words = [name for name in NAMES if delimiter != " " or " " not in name]
    names = draw(st.lists(st.sampled_from(words), min_size=width, max_size=width, unique=True))
    units = draw(st.lists(st.sampled_from(UNITS), min_size=width, max_size=width))
    head = draw(st.sampled_from(["none", "names", "below", "bracketed below", "beside"]))
    if delimiter == " " or not any(units):
        units = [unit or "V" for unit in units]
    lines = {
        "none": [],
        "names": [names],
        "below": [names, units],
        "bracketed below": [names, [f"[{unit}]" if unit else "" for unit in units]],
        "beside": [[f"{name} [{unit}]" if unit else name for name, unit in zip(names, units, strict=True)]],
    }[head]
    if head == "beside" and delimiter == " ":
        lines = [[cell.replace(" [", "[") for cell in lines[0]]]
    columns = [Column(name, unit) for name, unit in zip(names, units, strict=True)]
    if head == "none":
        columns = [Column(f"column {k + 1}") for k in range(width)]
    if head == "names":
        columns = [Column(name) for name in names]

    behind = delimiter if width > 1 and delimiter != " " and draw(st.booleans()) else ""
    above = draw(st.sampled_from([[], ["# bench"], ["% bench 2", "", "# of 3"]]))
    table = [delimiter.join(line) + behind for line in lines + [[cell for cell, _ in row] for row in rows]]
    end = draw(st.sampled_from(["\n", "\r\n", "\r"]))
    text = "".join(line + end for line in above + table)
    encoding = draw(st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "cp1252"]))

    marked = [cell for row in rows for cell, _ in row if "," in cell]
    first = len(above) + len(lines) + 1
    ambiguous = decimal == "," and (width == 1 or all(len(cell.partition(",")[2]) == 3 for cell in marked))
    options = {}
    if draw(st.booleans()) or ambiguous:
        options = {"delimiter": delimiter, "decimal": decimal, "header": len(above) + 1 if lines else 0}
    return text, encoding, options, columns, np.array([[x for _, x in row] for row in rows]), first


@settings(max_examples=300)
@given(files())
def test_what_is_written_is_read_back_to_the_last_bit(tmp_path_factory, file):
    text, encoding, options, columns, values, first = file
    path = tmp_path_factory.mktemp("text") / "bench.csv"
    path.write_bytes(text.encode(encoding))
    found_columns, lines, found, _, repairs = read(path, **options)
    assert list(found_columns) == columns
    assert list(lines) == list(range(first, first + len(values)))
    assert same(found, values)
    assert repairs == []


def test_a_file_of_an_arduino_is_read_whole():
    """Seven columns without names, as any reader of tab-separated numbers takes them."""
    path = PAPERS / "measure" / "Circle_3bar.csv"
    columns, lines, values, found, repairs = read(path)
    assert [column.name for column in columns] == [f"column {k}" for k in range(1, 8)]
    assert same(values, np.loadtxt(path, delimiter="\t"))
    assert list(lines) == list(range(1, 7835))
    assert {"delimiter: tab", "line ends: CR LF", "decimal sign: point", "no names"} <= set(found)
    assert repairs == []


def test_labels_of_specimens_are_left_out_and_named():
    path = PAPERS / "catshark" / "midline_kinematics.txt"
    columns, _, values, found, _ = read(path)
    names = path.read_text().splitlines()[0].split(",")
    assert [column.name for column in columns] == names[1:]
    assert same(values, np.loadtxt(path, delimiter=",", skiprows=1, usecols=range(1, 14)))
    assert "column specimen is text, left out" in found


LABVIEW = """LabVIEW Measurement\t
Writer_Version\t2
Separator\tTab
Multi_Headings\tNo
Time\t14:33:10.5
***End_of_Header***\t
\t
Channels\t2\t\t
Samples\t3\t3\t
Date\t2013/11/05\t2013/11/05\t
X_Dimension\tTime\tTime\t
X0\t0.0000000000000000E+0\t0.0000000000000000E+0\t
Delta_X\t0.001000\t0.001000\t
***End_of_Header***\t\t\t
X_Value\tForce (N)\tUntitled\tComment
0.000000\t1.500000\t-2.5
0.001000\t1.600000\t-2.6
0.002000\t1.700000\t-2.7
"""


def test_the_heads_of_a_labview_file_say_its_time(tmp_path):
    columns, lines, values, found, _ = read_text(tmp_path, LABVIEW)
    start = "2013-11-05 14:33:10.5"
    assert columns == (Column("Time", "s", start=start), Column("Force", "N"), Column("Untitled"))
    assert list(lines) == [16, 17, 18]
    assert same(values, np.array([[0.0, 1.5, -2.5], [0.001, 1.6, -2.6], [0.002, 1.7, -2.7]]))
    assert {"names: line 15", "units: in the head", "first row: line 16", "X_Value is the time"} <= set(found)


def labview(
    head="", segments=("Time\t14:33:10,5",), rows="0,0\t1,5\t2\n0,1\t1,6\t3\n", names="X_Value\tp\tforce\tComment"
):
    """A file with units, decimal commas, and a head for each segment."""
    text = f"LabVIEW Measurement\t\nSeparator\tTab\nDecimal_Separator\t,\n{head}***End_of_Header***\t\n"
    for about in segments:
        clock = "Date\t2013/11/05\t2013/11/05\nX0\t0,0\t0,0\nDelta_X\t0,1\t0,1\n"
        text += f"\t\nChannels\t2\t\nY_Unit_Label\tVolts\tmN\n{clock}{about}\n***End_of_Header***\t\n{names}\n{rows}"
    return text


def test_labview_names_the_units_of_its_channels(tmp_path):
    columns, _, values, _, _ = read_text(tmp_path, labview())
    assert [(c.name, c.unit) for c in columns] == [("Time", "s"), ("p", "Volts"), ("force", "mN")]
    assert same(values, np.array([[0.0, 1.5, 2.0], [0.1, 1.6, 3.0]]))


def test_segments_of_labview_go_on_at_their_instants(tmp_path):
    """The second begins 1.25 s after the first. One of the same instant as the first keeps its times."""
    segments = ["Time\t14:33:10,5", "Time\t14:33:11,75"]
    _, lines, values, found, _ = read_text(tmp_path, labview(segments=segments))
    assert same(values[:, 0], np.array([0.0, 0.1, 1.25, 1.35]))
    assert list(lines) == [14, 15, 25, 26]
    assert "2 segments" in found
    later = labview(segments=segments[:1]) + labview(segments=segments[:1], rows="0,2\t1\t2\n").split("***\t\n", 1)[1]
    assert same(read_text(tmp_path, later)[2][:, 0], np.array([0.0, 0.1, 0.2]))
    other = labview() + labview().split("***\t\n", 1)[1].replace("mN", "N")
    with pytest.raises(InputError, match=r"line \d+: segment 2 has other channels, units or intervals than the first"):
        read_text(tmp_path, other)


def test_instants_with_all_their_digits_are_those_of_segments(tmp_path):
    """LabVIEW writes some twenty digits of a second."""
    rows = "\t1,5\t2\n\t1,6\t3\n"
    times = ["Time\t14:33:10,9093303680419921875", "Time\t14:33:12,1593303680419921875"]
    columns, _, values, _, _ = read_text(tmp_path, labview("X_Columns\tNo\n", times, rows))
    assert columns[0].start == "2013-11-05 14:33:10.909330368+00:00"
    np.testing.assert_allclose(values[:, 0], [0.0, 0.1, 1.25, 1.35], atol=1e-9)


def test_absolute_times_of_labview_count_from_the_first(tmp_path):
    """Seconds since 1904, in UTC: 3468148390.5 s is 2013-11-24 01:33:10.5."""
    zero = (np.datetime64("2013-11-24T01:33:10.5") - np.datetime64("1904-01-01")) / np.timedelta64(1, "s")
    rows = [f"{zero + x:.6f}\t1\t2\n".replace(".", ",") for x in (0.0, 0.1, 2.0, 2.1)]
    head = "Time_Pref\tAbsolute\n"
    text = labview(head, rows="".join(rows[:2])) + labview(rows="".join(rows[2:])).split("***\t\n", 1)[1]
    columns, _, values, _, _ = read_text(tmp_path, text)
    assert columns[0].start == "2013-11-24 01:33:10.500000+00:00"
    np.testing.assert_allclose(values[:, 0], [0.0, 0.1, 2.0, 2.1], atol=1e-6)


@pytest.mark.parametrize("between", ["\t", "\t\t"], ids=["without room for the times", "with room"])
def test_channels_with_times_of_their_own_have_their_units(tmp_path, between):
    rows = "0,0\t1,5\t0,0\t2\n0,1\t1,6\t0,3\t3\n"
    text = labview("X_Columns\tMulti\n", rows=rows, names="X_Value\tp\tX_Value\tforce\tComment")
    text = re.sub(r"(?m)^(Y_Unit_Label|X0|Delta_X|Date)\t(\S+)\t(\S+)$", rf"\1\t\2{between}\3", text)
    columns, _, values, _, _ = read_text(tmp_path, text)
    assert [column.unit for column in columns] == ["s", "Volts", "s", "mN"]
    assert same(values, np.array([[0.0, 1.5, 0.0, 2.0], [0.1, 1.6, 0.3, 3.0]]))


def test_times_of_labview_without_values_of_x_are_those_of_its_heads(tmp_path):
    """X0 + k Delta_X in each segment; what lies between the dates of two that begin alike is added."""
    rows, zeros = "\t1,5\t2\n\t1,6\t3\n", "X0\t3,5\t3,5\nDelta_X\t0,02\t0,02"
    text = labview("X_Columns\tNo\n", ["Time\t14:33:10,5", "Time\t14:33:11,75"], rows)
    columns, _, values, found, _ = read_text(tmp_path, text)
    assert [(c.name, c.unit) for c in columns] == [("Time", "s"), ("p", "Volts"), ("force", "mN")]
    assert same(values[:, 0], np.array([0.0, 0.1, 1.25, 1.35]))
    assert "time from Delta_X, 0.1 s" in found
    text = labview("X_Columns\tNo\n", [""], rows) + labview("", [zeros], rows).split("***\t\n", 1)[1]
    assert same(read_text(tmp_path, text)[2][:, 0], np.array([0.0, 0.1, 3.5, 3.52]))
    for word in ("X0", "Delta_X"):
        other = re.sub(f"{word}\t0,.\t", f"{word}\t0,7\t", labview("X_Columns\tNo\n", rows=rows))
        with pytest.raises(InputError, match=f"its channels have different {word} and one time"):
            read_text(tmp_path, other)


def test_what_numpy_saves_with_a_header_has_names(tmp_path):
    path, values = tmp_path / "x.txt", np.random.default_rng(1).normal(size=(20, 3))
    np.savetxt(path, values, header="time force pressure\ns N bar")
    columns, _, found, _, _ = read(path)
    assert columns == (Column("time", "s"), Column("force", "N"), Column("pressure", "bar"))
    assert same(found, np.loadtxt(path))


def test_what_pandas_saves_without_names_has_no_row_of_names(tmp_path):
    columns, lines, values, _, _ = read_text(tmp_path, ",0,1\n0,0.5,1.5\n1,0.6,1.6\n")
    assert [column.name for column in columns] == ["column 1", "column 2", "column 3"]
    assert list(lines) == [2, 3]
    assert values[0, 1] == 0.5


def test_quoted_names_units_and_numbers_are_read(tmp_path):
    """As testing machines export them."""
    text = '"Specimen ""A"", wet"\n\n"Time","Force, left"\n"(s)","(kN)"\n"0.0","-1.5"\n"0.1","nan"\n'
    columns, lines, values, _, _ = read_text(tmp_path, text)
    assert columns == (Column("Time", "s"), Column("Force, left", "kN"))
    assert list(lines) == [5, 6]
    assert same(values, np.array([[0.0, -1.5], [0.1, np.nan]]))


def test_names_between_blanks_may_hold_blanks(tmp_path):
    assert read_text(tmp_path, "time [s] force [N]\n  0.0    1.0\n  1.0 -2.0\n")[0][1] == Column("force", "N")
    assert read_text(tmp_path, "laser V   valve 1\n0.0 1.0\n1.0 -2.0\n")[0][0] == Column("laser V")


def test_date_times_become_seconds_since_the_first(tmp_path):
    text = "at,force\n2024-03-01 23:59:59.25,1\n2024-03-02 00:00:00.5,2\n,3\n2024-03-02T00:01:00+00:00,4\n"
    columns, _, values, found, _ = read_text(tmp_path, text)
    assert columns[0] == Column("at", "s")
    assert same(values[:, 0], np.array([0.0, 1.25, np.nan, 60.75]))
    assert "column at: date-times, now seconds since 2024-03-01 23:59:59.25" in found


def test_columns_of_the_same_name_are_numbered(tmp_path):
    columns, _, _, found, _ = read_text(tmp_path, "force,force,force (2),\n1,2,3,4\n")
    assert [column.name for column in columns] == ["force", "force (3)", "force (2)", "column 4"]
    assert "column 2 is another force, named force (3)" in found


def test_rows_are_counted_as_an_editor_counts_lines(tmp_path):
    text = "# rig 3\n\ntime;force\n\n0;1.5\n   \n# pump on\n1;2.5\n  % pump off; noon\n\n2;3.5\n\n"
    _, lines, values, found, _ = read_text(tmp_path, text.replace("\n", "\r\n"))
    assert list(lines) == [5, 8, 11]
    assert same(values[:, 1], np.array([1.5, 2.5, 3.5]))
    assert "lines that begin with # or % are comments" in found


@pytest.mark.parametrize("delimiter", ["\t", ",", " ", "  "])
@pytest.mark.parametrize("block", [1 << 20, *range(2000, 2012)])
def test_it_does_not_matter_where_blocks_are_cut(tmp_path, monkeypatch, delimiter, block):
    """Blocks of a few rows, cut within numbers, line ends, comments and the last row."""
    rows = [[k / 8, -k / 3, k * 1e9] for k in range(400)]
    lines = [delimiter.join(map(repr, row)) for row in rows]
    lines[250:250] = ["", "# pause", '"1.0"' + delimiter + '"2.0"' + delimiter + '"3.0"']
    path = tmp_path / "x.csv"
    path.write_bytes("\r\n".join([*lines, "50.0" + delimiter + "1", "", ""]).encode())
    monkeypatch.setattr(text_blocks, "BLOCK", block)
    _, found_lines, values, _, repairs = read(path)
    assert same(values, np.array([*rows[:250], [1.0, 2.0, 3.0], *rows[250:]]))
    assert list(found_lines) == [*range(1, 251), *range(253, 404)]
    assert repairs == [f'Line 404, the last one, is incomplete and left out: "50.0{delimiter}1".'.replace("\t", " ")]


@pytest.mark.parametrize("rows", [1, 3, 10, 11, 1000])
def test_pieces_have_the_rows_that_were_asked_for_and_may_be_read_again(tmp_path, monkeypatch, rows):
    monkeypatch.setattr(text_blocks, "BLOCK", 1000)
    path = tmp_path / "x.csv"
    path.write_text("a,b\n" + "".join(f"{k}.5,{k}\n" for k in range(400)) + "400.5,40")
    with open_text(path, Options()) as source:
        for _ in range(2):
            pieces = list(source.pieces(rows))
            assert {len(piece.rows) for piece in pieces[:-1]} <= {rows}
            assert same(np.concatenate([piece.values for piece in pieces])[:, 0], np.arange(401) + 0.5)
            assert len(source.repairs) == 1


def test_cells_that_pandas_does_not_take_are_read_one_by_one(tmp_path):
    text = "".join(f"{k / 3!r}, nan , {k} ,2024-01-01 00:00:{k:02d} \n" for k in range(60))
    values = read_text(tmp_path, text)[2]
    k = np.arange(60.0)
    assert same(values, np.stack([k / 3, np.full(60, np.nan), k, k], axis=1))


@pytest.mark.parametrize("cell", ["", "nan", "NaN", "NAN", "-nan", "NA", "N/A", "#N/A", "null", "-", "1.#QNAN"])
def test_cells_without_a_value_are_nan(tmp_path, cell):
    assert same(read_text(tmp_path, f"1;2;3\n4;{cell};6\n")[2], np.array([[1.0, 2, 3], [4, np.nan, 6]]))


def test_first_rows_without_values_are_rows(tmp_path):
    _, lines, values, found, _ = read_text(tmp_path, "nan,nan\nNA,-\n0.5,1.5\n")
    assert list(lines) == [1, 2, 3]
    assert np.isnan(values[:2]).all()
    assert "no names" in found


@pytest.mark.parametrize("cell", ["inf", "-inf", "Infinity", "+INF"])
def test_infinity_stays_infinite(tmp_path, cell):
    assert np.isinf(read_text(tmp_path, f"1;2\n4;{cell}\n")[2][1, 1])


def test_a_delimiter_at_every_line_end_makes_no_column(tmp_path):
    columns, _, values, found, _ = read_text(tmp_path, "a;b;;\n1;2;;\n3;4;;\n")
    assert [column.name for column in columns] == ["a", "b"]
    assert same(values, np.array([[1.0, 2], [3, 4]]))
    assert "empty cells behind the last column, left out: 2" in found


def test_an_empty_column_with_a_name_is_one_of_nan(tmp_path):
    columns, _, values, _, _ = read_text(tmp_path, "a;b;c\n1;2;\n3;4;\n")
    assert [column.name for column in columns] == ["a", "b", "c"]
    assert np.isnan(values[:, 2]).all()


def test_only_brackets_make_a_unit(tmp_path):
    columns = read_text(tmp_path, "Force_N,force / N,time (ms),flap (left),x[mm],ai[0]\n1,2,3,4,5,6\n")[0]
    assert columns == (
        Column("Force_N"),
        Column("force / N"),
        Column("time", "ms"),
        Column("flap (left)"),
        Column("x", "mm"),
        Column("ai[0]"),
    )


@pytest.mark.parametrize(
    ("text", "delimiter", "decimal"),
    [
        ("0,5;1,25\n", "semicolon", "comma"),
        ("0.5;1.25\n", "semicolon", "point"),
        ("0,5 1,25\n", "blanks", "comma"),
        ("0,5\t1,25\n", "tab", "comma"),
        ("1, 2\n", "comma", "point"),
        ("1,2,3\n", "comma", "point"),
        ("time,force\n1,2\n", "comma", "point"),
        ("1,05\n2,10\n", "none, one column", "comma"),
        ("0.5\n", "none, one column", "point"),
        ('"0,5","1,25"\n', "comma", "comma"),
        ("12:30:01;0,5;1,5\n", "semicolon", "comma"),
        ("2024-01-01 12:30:01,0.5\n", "comma", "point"),
        ("time of day|force in N\n1|2\n", "bar", "point"),
        ("1,234;0,5\n", "semicolon", "comma"),
        ("1.234;0.561\n", "semicolon", "point"),
    ],
)
def test_delimiter_and_decimal_sign_are_found(tmp_path, text, delimiter, decimal):
    found = read_text(tmp_path, text)[3]
    assert {f"delimiter: {delimiter}", f"decimal sign: {decimal}"} <= set(found)


@pytest.mark.parametrize(
    ("raw", "name"),
    [
        ("Größe;b\n1;2\n".encode(), "utf-8"),
        ("Größe;b\n1;2\n".encode("utf-8-sig"), "utf-8-sig"),
        ("Größe;b\n1;2\n".encode("utf-16"), "utf-16"),
        (b"\xfe\xff" + "Größe;b\n1;2\n".encode("utf-16-be"), "utf-16"),
        ("Größe;b\n1;2\n".encode("cp1252"), "cp1252, as it is not UTF-8"),
        (b"Gr\xf6\xdfe;\x81\n1;2\n", "latin-1, as it is not UTF-8"),
    ],
)
def test_the_encoding_is_found(tmp_path, raw, name):
    columns, _, _, found, _ = read_text(tmp_path, raw)
    assert columns[0].name == "Größe"
    assert f"encoding: {name}" in found


def test_what_is_told_is_taken_for_granted(tmp_path):
    text = "time,1,2\n\xe4,x\n1,5;2,5;3\n".encode("latin-1")
    options = {"encoding": "latin-1", "delimiter": "semicolon", "decimal": "comma", "header": 0}
    columns, lines, values, found, _ = read_text(tmp_path, text, **options)
    assert same(values, np.array([[1.5, 2.5, 3.0]]))
    assert list(lines) == [3]
    assert {"encoding: latin-1, as given", "delimiter: semicolon, as given", "decimal sign: comma, as given"} <= set(
        found
    )
    columns = read_text(tmp_path, "1,2\n0.5,0.6\n", header=1)[0]
    assert [column.name for column in columns] == ["1", "2"]
    assert read_text(tmp_path, "1,5\n2,5\n", decimal=".")[2].shape == (2, 2)
    assert read_text(tmp_path, "1,5\n2,5\n", decimal=",")[2].shape == (2, 1)


def test_a_last_row_that_breaks_off_is_left_out_and_said(tmp_path):
    for end in ("0.2,1", "0.2,1\n", "0.2,1,", "0.2,1,-", "0.2,1,1.2e", "0.2,1,1.2e+", '0.2,1,"3'):
        _, lines, _, _, repairs = read_text(tmp_path, f"a,b,c\n0.0,1.0,2.0\n0.1,1.0,2.0\n{end}")
        assert list(lines) == [2, 3]
        assert repairs == [f'Line 4, the last one, is incomplete and left out: "{end.strip()}".']


def test_a_last_row_without_line_end_is_kept_and_said(tmp_path):
    for text in ("a,b\n0.0,1.0\n0.1,1.5", "a,b\n0.0,1.0,\n0.1,1.5", "a,b\n0.0,1.0,\n0.1,1.5,"):
        _, lines, values, _, repairs = read_text(tmp_path, text)
        assert list(lines) == [2, 3]
        assert values[1, 1] == 1.5
        assert repairs == ["Line 3, the last one, has no line end: its last cell may be incomplete."]


@pytest.mark.slow
def test_a_long_file_is_read_in_little_memory(tmp_path):
    """A piece of 100 000 rows of 7 numbers has 5.6 MB and a block 1 MB; a few copies of each are allowed, 60 MB."""
    block = "".join("\t".join(f"{k + j / 1000:.3f}" for j in range(7)) + "\n" for k in range(20_000)).encode()
    path = tmp_path / "long.csv"
    with path.open("wb") as stream:
        for _ in range(200_000_000 // len(block)):
            stream.write(block)
    assert growth(open_text, path) < 60
