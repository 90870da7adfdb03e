"""A column's number counts the columns of the file, those of text as well, in every format."""

import h5py
import numpy as np
import pytest
from nptdms import ChannelObject, TdmsWriter
from openpyxl import Workbook
from scipy.io import savemat

from nectosome.io.schema.validate import validate_as
from nectosome.measure import Sheet, read
from nectosome.units import InputError

N = 8
TIME, FORCE, TEMPERATURE = 0.1 * np.arange(N), 100.0 + np.arange(N), 20.0 + np.arange(N)
NUMBERS = {"a": TIME, "b": FORCE, "c": TEMPERATURE}


def _delimited(delimiter):
    def write(path, table):
        rows = zip(*(column.tolist() for column in table.values()), strict=True)
        path.write_text("".join(delimiter.join(map(str, row)) + "\n" for row in rows))

    return write


def _excel(path, table):
    book = Workbook()
    for row in zip(*(column.tolist() for column in table.values()), strict=True):
        book.active.append(row)
    book.save(path)


def _tdms(path, table):
    with TdmsWriter(path) as file:
        channels = [ChannelObject("log", k, v.tolist() if v.dtype.kind == "U" else v) for k, v in table.items()]
        file.write_segment(channels)


def _hdf5(path, table):
    with h5py.File(path, "w", track_order=True) as file:
        for k, v in table.items():
            file[k] = v.tolist() if v.dtype.kind == "U" else v


def _records(path, table):
    np.save(path, np.rec.fromarrays(list(table.values()), names=",".join(table)))


def _cells(path, table):
    savemat(path, {k: v.astype(object)[:, None] if v.dtype.kind == "U" else v for k, v in table.items()})


FORMATS = {
    "csv": _delimited(","),
    "tsv": _delimited("\t"),
    "txt": _delimited(" "),
    "xlsx": _excel,
    "tdms": _tdms,
    "h5": _hdf5,
    "npy": _records,
    "npz": lambda path, table: np.savez(path, **table),
    "mat": _cells,
}


def with_text(at):
    """The three columns with one of text at this index."""
    columns = [*NUMBERS.items()]
    columns.insert(at, ("note", np.array(["up", "down"] * (N // 2))))
    return dict(columns)


def sheet(time, force):
    data = {"time": {"column": time, "unit": "s"}, "columns": {"force": {"column": force, "unit": "N"}}}
    return validate_as(Sheet, data, "sheet")


@pytest.mark.parametrize("at", range(4))
@pytest.mark.parametrize("ending", FORMATS)
def test_columns_of_text_count(tmp_path, ending, at):
    path, table = tmp_path / f"a.{ending}", with_text(at)
    FORMATS[ending](path, table)
    names = sorted(table) if ending == "h5" else list(table)  # that file keeps its columns by name
    place = {name: k for k, name in enumerate(names, 1)}
    run = read(path, sheet(place["a"], place["b"]))
    np.testing.assert_allclose(run["time"], TIME, rtol=1e-15)
    np.testing.assert_array_equal(run["force"], FORCE)
    with pytest.raises(InputError, match=rf"force: column {place['note']}, .* is (text|cells|Python objects)"):
        read(path, sheet(place["a"], place["note"]))
    with pytest.raises(InputError, match="there is no column 5: the file has 4"):
        read(path, sheet(place["a"], 5))


def test_empty_columns_of_a_worksheet_count_as_its_letters_do(tmp_path):
    book = Workbook()
    for a, b in zip(TIME.tolist(), FORCE.tolist(), strict=True):
        book.active.append([None, a, None, b])
    book.save(tmp_path / "a.xlsx")
    run = read(tmp_path / "a.xlsx", sheet(2, 4))
    np.testing.assert_array_equal(run["force"], FORCE)


def test_a_time_that_is_computed_is_no_column_of_the_file(tmp_path):
    wave = {"wf_increment": 0.1, "wf_start_offset": 0.0, "wf_samples": N}
    with TdmsWriter(tmp_path / "a.tdms") as file:
        file.write_segment([ChannelObject("log", name, x, wave) for name, x in (("F", FORCE), ("T", TEMPERATURE))])
    columns = {"force": {"column": 1, "unit": "N"}}
    run = read(tmp_path / "a.tdms", validate_as(Sheet, {"columns": columns}, "sheet"))
    np.testing.assert_allclose(run["time"], TIME, rtol=1e-14)
    np.testing.assert_array_equal(run["force"], FORCE)


def test_columns_of_a_matrix_count_each(tmp_path):
    np.savez(tmp_path / "a.npz", note=np.array(["x"] * N), m=np.stack([FORCE, TEMPERATURE], axis=1), t=TIME)
    run = read(tmp_path / "a.npz", sheet(4, 2))
    np.testing.assert_allclose(run["time"], TIME, rtol=1e-15)
    np.testing.assert_array_equal(run["force"], FORCE)
