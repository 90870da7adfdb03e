"""NumPy's files come back as they were saved; objects, and what is damaged, are refused."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from nectosome.measure.formats.numpy_files import open_numpy_files
from nectosome.units import InputError

from .read import check_refusals, cuts, flipped, flips, read, survived

T = np.arange(40) * 0.01
F = np.sin(T)


@pytest.fixture
def save(tmp_path):
    def save(array):
        np.save(tmp_path / "a.npy", array, allow_pickle=True)
        return tmp_path / "a.npy"

    return save


@pytest.fixture
def savez(tmp_path):
    def savez(**arrays):
        np.savez(tmp_path / "a.npz", **arrays)
        return tmp_path / "a.npz"

    return savez


@pytest.mark.parametrize("dtype", ["f8", ">f8", "f4", "f2", "i1", "u1", "<i2", ">u4", "i8", "?"])
@pytest.mark.parametrize("order", ["C", "F"])
def test_a_matrix_of_any_type_comes_back_with_its_columns_numbered(save, dtype, order):
    matrix = np.array([[0, 1, 100], [1, 0, 7], [3, 2, 1], [0, 0, 1]]).astype(dtype, order=order)
    contents = read(open_numpy_files, save(matrix))
    assert contents.names == ["column 1", "column 2", "column 3"]
    assert_array_equal(contents.values, matrix.astype(float))
    assert_array_equal(contents.rows, [1, 2, 3, 4])


@given(values=st.lists(st.floats(), min_size=2, max_size=30))
def test_any_floats_come_back_exactly(tmp_path_factory, values):
    path = tmp_path_factory.mktemp("npy") / "a.npy"
    np.save(path, np.array(values))
    assert_array_equal(read(open_numpy_files, path)["column 1"], values)


def test_records_give_their_fields_and_tell_what_is_no_number(save):
    records = np.zeros(
        5, [("t", "f8"), ("name", "U3"), ("force", "f4", (2,)), ("state", [("on", "?"), ("mode", "i2")])]
    )
    records["t"], records["force"][:, 1], records["state"]["mode"] = np.arange(5), 2.5, 7
    contents = read(open_numpy_files, save(records))
    assert contents.names == ["t", "force[0]", "force[1]", "state.on", "state.mode"]
    assert_array_equal(contents.values, [[t, 0, 2.5, 0, 7] for t in range(5)])
    assert "left out: name (text)" in contents.found


def test_times_become_seconds_since_the_first(save):
    times = np.array(["2024-05-01T12:00:00.5", "2024-05-01T12:00:01.75", "NaT"], "M8[ms]")
    contents = read(open_numpy_files, save(times))
    assert_array_equal(contents["column 1"], [0, 1.25, np.nan])
    assert contents.units == ["s"]
    assert contents.found == ("column 1: seconds since 2024-05-01T12:00:00.500",)


def test_rounded_integers_are_told_with_their_row(save):
    contents = read(open_numpy_files, save(np.array([1, 2**53, 2**53 + 1, -(2**60) - 1])))
    assert_array_equal(contents["column 1"], [1.0, 2.0**53, 2.0**53, -(2.0**60)])
    assert contents.repairs == ["column 1: integers beyond 2^53 are rounded to floats, from row 3 on."]


def test_a_matrix_that_lies_is_turned_and_that_is_told(save):
    contents = read(open_numpy_files, save(np.array([T, F])))
    assert_array_equal(contents.values, np.transpose([T, F]))
    assert contents.found == ("the array: its rows taken as columns",)
    assert read(open_numpy_files, save(np.zeros((2, 20)))).values.shape == (2, 20)


def test_vectors_of_one_length_are_columns_and_the_rest_is_told(savez):
    contents = read(
        open_numpy_files, savez(t=T, F=F, both=np.array([T, F]), fs=1000.0, note="first run", gains=np.eye(3))
    )
    assert contents.names == ["t", "F", "both[0]", "both[1]"]
    assert_array_equal(contents.values, np.transpose([T, F, T, F]))
    assert contents.found == (
        "both: its rows taken as columns",
        "left out: gains (3 rows)",
        "left out: fs = 1000 (scalar)",
        'left out: note = "first run" (text)',
    )


def test_tables_of_similar_length_are_not_chosen_between(savez):
    path = savez(t=T, F=F, slow=np.arange(30.0), picture=np.zeros((4, 5)))
    with pytest.raises(
        InputError, match=r'a\.npz: holds several tables: t, F \(40 rows\); slow \(30 rows\);.*\{table: "t"'
    ):
        read(open_numpy_files, path)
    assert read(open_numpy_files, path, table="F").names == ["t", "F"]
    assert read(open_numpy_files, path, table="slow").names == ["slow"]
    assert read(open_numpy_files, path, table="picture").values.shape == (4, 5)
    with pytest.raises(InputError, match=r'no table called "slwo"\. Did you mean "slow"\?'):
        read(open_numpy_files, path, table="slwo")


def test_objects_are_never_unpickled(save, savez):
    with pytest.raises(InputError, match="holds Python objects, which are not read"):
        read(open_numpy_files, save(np.array([{"a": 1}, None])))
    path = savez(t=T, settings=np.array([{"a": 1}]))
    assert any("settings (Python objects" in phrase for phrase in read(open_numpy_files, path).found)
    with pytest.raises(InputError, match='"settings" is not one of numbers but Python objects'):
        read(open_numpy_files, path, table="settings")


@pytest.mark.parametrize(
    ("array", "what"),
    [
        (np.zeros(5, complex), "complex numbers"),
        (np.array(["a", "b"]), "text"),
        (np.zeros((3, 4, 5)), "3 dimensions"),
        (np.zeros((0, 3)), "empty"),
        (np.float64(3.5), "= 3.5 (scalar)"),
        (np.zeros(4, np.longdouble), "numbers of more than 64 bits"),
        (np.zeros(4, "V3"), "data of an unknown type"),
        (np.zeros(4, [("a", "S2"), ("b", "c8")]), "no numbers"),
    ],
)
def test_what_is_no_table_is_told(save, array, what):
    with pytest.raises(InputError) as error:
        read(open_numpy_files, save(array))
    assert "a.npy: holds no columns of numbers. Inside: the array" in str(error.value)
    assert what in str(error.value)


def test_what_is_no_such_file_is_told(tmp_path):
    files = {
        "empty.npy": (b"", "is empty"),
        "text.npy": (b"t,F\n0,1\n", "this is not a NumPy file but a text file"),
        "other.npz": (b"PK\x03\x04 no zip", "the file is damaged or cut off"),
    }
    check_refusals(open_numpy_files, tmp_path, files)
    with pytest.raises(InputError, match='leave table="a" out'):
        np.save(tmp_path / "a.npy", T)
        read(open_numpy_files, tmp_path / "a.npy", table="a")


def test_a_cut_file_is_refused(save, savez, tmp_path):
    for path in (save(np.transpose([T, F])), savez(t=T, F=F)):
        for raw in cuts(path.read_bytes()):
            assert survived(open_numpy_files, tmp_path / "cut", raw) is None


@given(places=flips)
def test_damage_is_refused_or_leaves_a_table(tmp_path_factory, places):
    folder = tmp_path_factory.mktemp("npy")
    np.save(folder / "a.npy", np.transpose([T, F]))
    np.savez_compressed(folder / "a.npz", t=T, F=F)
    survived(open_numpy_files, folder / "a.npy", flipped((folder / "a.npy").read_bytes(), places))
    contents = survived(open_numpy_files, folder / "a.npz", flipped((folder / "a.npz").read_bytes(), places))
    if contents is not None:  # a zip file has checksums
        assert_array_equal(contents.values[:, : len(contents.names)], np.transpose([T, F])[:, : len(contents.names)])
