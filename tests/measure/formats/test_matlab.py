"""MAT-files of all versions come back as MATLAB has them; what only MATLAB reads comes with the way out."""

import struct

import h5py
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal
from scipy.io import loadmat, savemat

from nectosome.measure.formats.matlab import open_matlab, read_mat5
from nectosome.units import InputError

from .read import check_refusals, cuts, flipped, flips, read, survived
from .write import mat73

T = np.arange(40) * 0.01
F = np.sin(T)


@pytest.fixture(params=["4", "5", "5 compressed"])
def save(tmp_path, request):
    def save(**variables):
        version, _, compressed = request.param.partition(" ")
        savemat(tmp_path / "a.mat", variables, format=version, do_compression=bool(compressed))
        return tmp_path / "a.mat"

    return save


@pytest.fixture
def save5(tmp_path):
    def save5(**variables):
        savemat(tmp_path / "a.mat", variables)
        return tmp_path / "a.mat"

    return save5


@pytest.fixture
def save73(tmp_path):
    """Write as MATLAB does: dimensions reversed, classes as attributes."""

    def put(file, place, name, value):
        if isinstance(value, dict):
            node = place.create_group(name)
            for field, inner in value.items():
                put(file, node, field, inner)
            kind = "struct"
        elif isinstance(value, list):
            node = place.create_group(name)
            for field in value[0]:
                for i, one in enumerate(value):
                    put(file, file.require_group("#refs#"), f"{name}{field}{i}", one[field])
                references = [file[f"#refs#/{name}{field}{i}"].ref for i in range(len(value))]
                node.create_dataset(field, data=np.array([references], h5py.ref_dtype))
            kind = "struct"
        elif isinstance(value, str):
            node = place.create_dataset(name, data=np.array([[ord(c)] for c in value], "u2"))
            kind = "char"
        else:
            node = place.create_dataset(name, data=np.atleast_2d(value).T)
            kind = {"f8": "double", "b1": "logical"}.get(node.dtype.str[1:], node.dtype.name)
        node.attrs["MATLAB_class"] = np.bytes_(kind)

    def save73(**variables):
        def fill(file):
            for name, value in variables.items():
                put(file, file, name, value)

        mat73(tmp_path / "a.mat", fill)
        return tmp_path / "a.mat"

    return save73


def test_a_matrix_gives_its_columns(save):
    matrix = np.transpose([T, F, T * F])
    contents = read(open_matlab, save(data=matrix))
    assert contents.names == ["data[0]", "data[1]", "data[2]"]
    assert_array_equal(contents.values, matrix)


def test_vectors_of_one_length_are_columns_and_the_rest_is_told(save):
    contents = read(open_matlab, save(t=T, F=F[:, None], fs=1000.0, note="first run", z=np.zeros(40, complex)))
    assert contents.names == ["t", "F"]
    assert_array_equal(contents.values, np.transpose([T, F]))
    assert set(contents.found) == {
        "left out: fs = 1000 (scalar)",
        'left out: note = "first run" (text)',
        "left out: z (complex numbers)",
    }


@pytest.mark.parametrize("dtype", ["f8", "f4", "i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8"])
def test_numbers_of_any_class_come_back(save5, save73, dtype):
    values = np.array([0, 1, 100, 7, 2]).astype(dtype)
    assert_array_equal(read(open_matlab, save5(x=values))["x"], values.astype(float))
    assert_array_equal(read(open_matlab, save73(x=values))["x"], values.astype(float))


def test_a_file_of_version_73_reads_like_one_of_version_5(save5, save73):
    run = {"t": T, "F": F, "xyz": np.transpose([T, F, T]), "on": T > 0.2, "note": "calm", "lab": {"who": "me"}}
    of_5, of_73 = (read(open_matlab, save(run=run, fs=1000.0)) for save in (save5, save73))
    for contents in (of_5, of_73):
        expected = {"t": T, "F": F, "xyz[0]": T, "xyz[1]": F, "xyz[2]": T, "on": T > 0.2}
        assert set(contents.names) == set(expected)
        for name, values in expected.items():
            assert_array_equal(contents[name], values)
        assert set(contents.found) == {
            "left out: fs = 1000 (scalar)",
            'left out: run/note = "calm" (text)',
            'left out: run/lab/who = "me" (text)',
        }


def test_a_struct_is_chosen_by_its_name(save5, save73):
    for save in (save5, save73):
        path = save(calm={"t": T, "F": F}, rough={"t": T[:9], "F": F[:9]})
        with pytest.raises(InputError, match=r'holds several tables: calm/.*rough/.*table: "calm"'):
            read(open_matlab, path)
        for name in ("rough", "rough.F", "rough/F"):
            assert_array_equal(read(open_matlab, path, table=name)["F"], F[:9])
        with pytest.raises(InputError, match=r'no table called "ruogh"\. Did you mean "rough"'):
            read(open_matlab, path, table="ruogh")


def test_what_simulink_logs_is_understood(save5, save73):
    one = {"values": np.transpose([F, T]), "label": "force", "blockName": "rig/Scope"}
    two = {"values": T, "label": " ", "blockName": "rig/motor/angle"}
    kinds = [("values", object), ("label", object), ("blockName", object)]
    signals = np.array([tuple(one.values()), tuple(two.values())], kinds)
    of_5 = read(open_matlab, save5(out={"time": T[:, None], "signals": signals}))
    of_73 = read(open_matlab, save73(out={"time": T[:, None], "signals": [one, two]}))
    for contents in (of_5, of_73):
        assert contents.names == ["time", "force[0]", "force[1]", "angle"]
        assert_array_equal(contents.values, np.transpose([T, F, T, T]))
    alone = read(open_matlab, save73(out={"time": T, "signals": {"values": F, "label": "", "blockName": ""}}))
    assert alone.names == ["time", "signals(1)"]


def test_a_timeseries_as_a_struct_gives_its_units(save5, save73):
    series = {"Name": "F", "Time": T, "Data": F, "TimeInfo": {"Units": "seconds"}, "DataInfo": {"Units": "N"}}
    for save in (save5, save73):
        contents = read(open_matlab, save(force=series))
        assert dict(zip(contents.names, contents.units, strict=True)) == {"Time": "seconds", "force": "N"}
        assert_array_equal(contents["force"], F)
        assert contents.found == ('left out: force/Name = "F" (text)',)


def test_simulinks_rows_are_turned(save5):
    contents = read(open_matlab, save5(ans=np.array([T, F])))
    assert_array_equal(contents.values, np.transpose([T, F]))
    assert contents.found == ("ans: its rows taken as columns",)


def test_cells_sparse_and_struct_arrays_are_told(save5):
    from scipy.sparse import eye_array

    path = save5(
        c=np.array([T, "a"], object), s=eye_array(3).tocsc(), a=np.zeros(2, [("x", object)]), q=np.zeros((2, 2, 2))
    )
    with pytest.raises(InputError) as error:
        read(open_matlab, path)
    for what in ("c (cells)", "s (a sparse matrix", "a (an array of 2 structs)", "q (3 dimensions)"):
        assert what in str(error.value)


def _element(kind: int, data: bytes) -> bytes:
    return struct.pack("<II", kind, len(data)) + data + bytes(-len(data) % 8)


def _object(name: bytes, kind: bytes) -> bytes:
    """An object of a class of MATLAB's own: flags, its name, the system of types, its class, and what it refers to."""
    inner = _element(6, struct.pack("<II", 13, 0)) + _element(5, struct.pack("<ii", 1, 1)) + _element(1, b"")
    reference = _element(14, inner + _element(6, struct.pack("<I", 0xDD000000)))
    names = b"".join(_element(1, text) for text in (name, b"MCOS", kind))
    return _element(14, _element(6, struct.pack("<II", 17, 0)) + names + reference)


@pytest.mark.parametrize(
    ("kind", "way_out"),
    [
        ("timetable", "t = seconds(log.Properties.RowTimes - log.Properties.RowTimes(1)); data = log.Variables; save("),
        ("table", "s = table2struct(log, 'ToScalar', true); save('new.mat', '-struct', 's')"),
        ("timeseries", "t = log.Time; data = log.Data; save('new.mat', 't', 'data')"),
        ("datetime", "t = seconds(log - log(1)); save("),
        ("my.Class", "save its numbers as arrays"),
    ],
)
def test_objects_that_only_matlab_reads_come_with_the_way_out(save5, save73, kind, way_out):
    path = save5(fs=1000.0)
    path.write_bytes(path.read_bytes() + _object(b"log", kind.encode()))
    with pytest.raises(InputError) as of_5:
        read(open_matlab, path)
    path = save73(log=np.zeros(6, "u4"))
    with h5py.File(path, "a") as file:
        file["log"].attrs.update({"MATLAB_class": np.bytes_(kind), "MATLAB_object_decode": np.int32(3)})
    with pytest.raises(InputError) as of_73:
        read(open_matlab, path)
    for error in (of_5, of_73):
        assert f"log (an object of the class {kind}, which only MATLAB reads" in str(error.value)
        assert way_out in str(error.value)


@given(
    st.recursive(
        st.one_of(
            st.text(st.characters(codec="utf-8", exclude_characters="\0\n", max_codepoint=0xFFFF), max_size=5),
            st.lists(st.floats(), min_size=1, max_size=4).map(np.array),
            st.lists(st.integers(-5, 5), min_size=1, max_size=4).map(np.array),
        ),
        lambda inner: st.dictionaries(st.sampled_from("abcd"), inner, min_size=1, max_size=3),
        max_leaves=6,
    ),
    st.booleans(),
)
def test_any_structs_read_as_scipy_reads_them(tmp_path_factory, value, compressed):
    path = tmp_path_factory.mktemp("mat") / "a.mat"
    savemat(path, {"v": value}, do_compression=compressed)
    _same(read_mat5(path.read_bytes(), 10**9)["v"], loadmat(path)["v"])


def _same(ours, theirs):
    if isinstance(ours, dict):
        assert list(ours) == list(theirs.dtype.names)
        for field in ours:
            _same(ours[field], theirs[0, 0][field])
    elif isinstance(ours, str):
        assert ours == "".join(theirs.ravel())
    else:
        assert_array_equal(ours, theirs)


def test_big_endian_files_are_read(save5, tmp_path):
    """The same file, written by hand."""
    values = _big(5, struct.pack(">ii", 3, 1)) + _big(1, b"x") + _big(9, struct.pack(">3d", 1, 2.5, -3))
    variable = _big(14, _big(6, struct.pack(">II", 6, 0)) + values)
    (tmp_path / "b.mat").write_bytes(b"MATLAB 5.0 MAT-file".ljust(124) + b"\x01\x00MI" + variable)
    assert_array_equal(read(open_matlab, tmp_path / "b.mat")["x"], [1, 2.5, -3])


def _big(kind: int, data: bytes) -> bytes:
    return struct.pack(">II", kind, len(data)) + data + bytes(-len(data) % 8)


def test_what_is_no_such_file_is_told(tmp_path, save5):
    files = {
        "empty.mat": (b"", "is empty"),
        "text.mat": (b"t,F\n0,1\n", "this is not a MAT-file but a text file"),
        "book.mat": (b"PK\x03\x04", "but a zip file"),
        "noise.mat": (bytes(range(1, 200)), "the file is damaged or cut off"),
    }
    check_refusals(open_matlab, tmp_path, files)
    with pytest.raises(InputError, match=r'Inside: fs = 7 \(scalar\); note = "a" \(text\)'):
        read(open_matlab, save5(fs=7, note="a"))


def test_a_cut_file_gives_whole_variables_or_none(save, save73, tmp_path):
    for path in (save(t=T, F=F), save73(t=T, F=F)):
        for raw in cuts(path.read_bytes()):
            contents = survived(open_matlab, tmp_path / "cut.mat", raw)
            if contents is not None:  # it ends with a whole variable
                assert_array_equal(contents.values, T[:, None])


@given(places=flips, version=st.sampled_from(["4", "5", "5 compressed"]))
def test_damage_is_refused_or_leaves_a_table(tmp_path_factory, places, version):
    path = tmp_path_factory.mktemp("mat") / "a.mat"
    version, _, compressed = version.partition(" ")
    values = {"t": T, "log": {"F": F, "note": "hi"}} if version == "5" else {"t": T, "F": F}
    savemat(path, values, format=version, do_compression=bool(compressed))
    contents = survived(open_matlab, path, flipped(path.read_bytes(), places))
    if contents is not None and compressed:  # each variable has a checksum
        assert_array_equal(contents.values[:, 0], T)
