"""HDF5 and netCDF files come back as they were written, with their units; damage is told."""

import h5py
import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from numpy.testing import assert_array_equal

from nectosome.io import save_dataset
from nectosome.measure.formats.hdf5 import open_hdf5
from nectosome.units import InputError

from .read import check_refusals, cuts, flipped, flips, growth, read, survived

T = np.arange(40) * 0.01
F = np.sin(T)


@pytest.fixture
def h5(tmp_path):
    def write(**datasets):
        path = tmp_path / "a.h5"
        with h5py.File(path, "w") as file:
            for name, values in datasets.items():
                file[name.replace("__", "/")] = values
        return path

    return write


@pytest.fixture
def measured() -> xr.Dataset:
    return xr.Dataset(
        {
            "force": ("time", np.where(T > 0.2, np.nan, F), {"units": "N"}),
            "position": (("time", "axis"), np.transpose([T, F]), {"units": "mm"}),
            "mass": ((), 4.5),
            "knots": ("knot", np.arange(30.0)),
        },
        coords={"time": ("time", T, {"units": "s"}), "axis": ["x", "y"]},
    )


@pytest.mark.parametrize("dtype", ["f8", ">f4", "f2", "i1", "<u2", ">i8", "?"])
@pytest.mark.parametrize("layout", [{}, {"chunks": (7, 2)}, {"chunks": (7, 2), "compression": "gzip", "shuffle": True}])
def test_datasets_of_any_type_and_layout_come_back(tmp_path, dtype, layout):
    matrix = (np.arange(80).reshape(40, 2) % 5).astype(dtype)
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file.create_dataset("log/t", data=T).attrs["units"] = "s"
        file.create_dataset("log/m", data=matrix, **layout).attrs["Unit"] = np.bytes_("mV")
    got = read(open_hdf5, tmp_path / "a.h5")
    assert (got.names, got.units) == (["m[0]", "m[1]", "t"], ["mV", "mV", "s"])
    assert_array_equal(got.values, np.column_stack([matrix.astype(float), T]))
    assert_array_equal(got.rows, np.arange(1, 41))


def test_what_is_left_out_is_told(h5):
    path = h5(
        t=T, c=np.zeros(40, complex), e=h5py.Empty("f8"), fs=1000.0, gains=np.eye(3), note="first", notes=["a", "b"]
    )
    with h5py.File(path, "a") as file:
        file["gone"], file["elsewhere"] = h5py.SoftLink("/nowhere"), h5py.ExternalLink("other.h5", "/t")
        layout = h5py.VirtualLayout((40,), "f8")
        layout[:] = h5py.VirtualSource("other.h5", "t", (40,))
        file.create_virtual_dataset("virtual", layout)
    got = read(open_hdf5, path)
    assert got.names == ["t"]
    assert got.found == (
        "left out: gains (3 rows)",
        "left out: c (complex numbers)",
        "left out: e (empty)",
        "left out: fs = 1000 (scalar)",
        "left out: note (text)",
        "left out: notes (text)",
        "left out: virtual (its data are in another file)",
    )


def test_a_group_is_chosen_by_its_name(h5):
    path = h5(run1__t=T, run1__F=F, run2__t=T[:9], run2__F=F[:9])
    with pytest.raises(InputError, match=r'run1/F, run1/t \(40 rows\); run2/F, run2/t \(9 rows\).*table: "run1"'):
        read(open_hdf5, path)
    for name in ("run2", "/run2/", "run2/F"):
        got = read(open_hdf5, path, table=name)
        assert got.names == ["F", "t"]
        assert_array_equal(got["F"], F[:9])
        assert got.found == ("left out: run1/F, run1/t (40 rows)",)
    with pytest.raises(InputError, match=r'there is no table called "run3"\. Did you mean "run'):
        read(open_hdf5, path, table="run3")
    with pytest.raises(InputError, match=r'several called "F"\. Choose run1/F or run2/F'):
        read(open_hdf5, path, table="F")


def test_a_compound_dataset_gives_its_fields(h5):
    records = np.zeros(5, [("t", "f8"), ("force", "f4", (2,)), ("label", "S4")])
    records["t"] = np.arange(5)
    got = read(open_hdf5, h5(log=records))
    assert got.names == ["t", "force[0]", "force[1]"]
    assert got.found == ("left out: log.label (text)",)
    assert_array_equal(got["t"], np.arange(5))
    assert read(open_hdf5, h5(log=records, x=F[:5])).names == ["log.t", "log.force[0]", "log.force[1]", "x"]


@pytest.mark.parametrize("engine", ["h5netcdf", "scipy"])
def test_variables_of_a_netcdf_file_follow_their_coordinate(measured, tmp_path, engine):
    measured.to_netcdf(tmp_path / "a.nc", engine=engine)
    got = read(open_hdf5, tmp_path / "a.nc")
    x, y = ("position[x]", "position[y]") if engine == "h5netcdf" else ("position[0]", "position[1]")
    assert dict(zip(got.names, got.units, strict=True)) == {"time": "s", "force": "N", x: "mm", y: "mm"}
    assert got.names[0] == "time"
    for name, values in (("time", T), ("force", measured.force), (x, T), (y, F)):
        assert_array_equal(got[name], values)
    assert "left out: mass = 4.5 (scalar)" in got.found
    assert "left out: knots (30 rows, knot)" in got.found


@pytest.mark.parametrize("engine", ["h5netcdf", "scipy"])
def test_packed_numbers_are_unpacked_and_moments_keep_their_unit(tmp_path, engine):
    time = np.datetime64("2024-05-01", "ns") + np.arange(4) * np.timedelta64(90, "m")
    dataset = xr.Dataset({"force": ("time", [0.5, np.nan, 1.5, 2.0]), "t": ("time", [1, 2, 3, 4])}, {"time": time})
    packing = {"force": {"dtype": "i2", "scale_factor": 0.25, "add_offset": -1.0, "_FillValue": -99}}
    dataset.to_netcdf(tmp_path / "a.nc", engine=engine, encoding=packing)
    got = read(open_hdf5, tmp_path / "a.nc")
    assert_array_equal(got["force"], dataset.force)
    assert_array_equal(got["time"], np.arange(4) * 90)
    assert got.units == ["minutes", "", ""]
    assert "time: minutes since 2024-05-01 00:00:00" in got.found
    assert "force: unpacked with its scale_factor and add_offset" in got.found


def test_an_unlimited_dimension_of_a_classic_file_is_read(measured, tmp_path):
    measured[["force"]].to_netcdf(tmp_path / "a.nc", engine="scipy", unlimited_dims=["time"])
    assert_array_equal(read(open_hdf5, tmp_path / "a.nc")["force"], measured.force)


def test_channels_before_time_are_turned(tmp_path):
    dataset = xr.Dataset({"force": (("sensor", "time"), np.array([F, T]))}, {"time": T})
    dataset.to_netcdf(tmp_path / "a.nc", engine="h5netcdf")
    got = read(open_hdf5, tmp_path / "a.nc")
    assert got.names == ["time", "force[0]", "force[1]"]
    assert_array_equal(got.values, np.transpose([T, F, T]))
    assert got.found == ("force: its rows taken as columns",)


def test_our_own_results_are_read(measured, tmp_path):
    measured["spin"] = ("time", F, {"unit": "rad/s"})
    save_dataset(measured, tmp_path / "a.nc")
    got = read(open_hdf5, tmp_path / "a.nc")
    assert got.names == ["time", "force", "position[x]", "position[y]", "spin"]
    assert got.units[-1] == "rad/s"
    assert_array_equal(got["spin"], F)


def test_what_is_no_such_file_is_told(h5, tmp_path):
    files = {
        "empty.h5": (b"", "is empty"),
        "text.h5": (b"t,F\n0,1\n", "this is not an HDF5 or netCDF file but a text file"),
        "book.nc": (b"PK\x03\x04", "but a zip file"),
        "large.nc": (b"CDF\x05", "nccopy -k nc4"),
    }
    check_refusals(open_hdf5, tmp_path, files)
    with pytest.raises(InputError, match=r"holds no columns of numbers\. Inside: fs = 7 \(scalar\); note \(text\)"):
        read(open_hdf5, h5(fs=7, note="a"))


@pytest.mark.parametrize("engine", ["h5netcdf", "scipy"])
def test_a_cut_file_is_refused(measured, tmp_path, engine):
    measured.to_netcdf(tmp_path / "a.nc", engine=engine)
    for raw in cuts((tmp_path / "a.nc").read_bytes()):
        assert survived(open_hdf5, tmp_path / "cut.nc", raw) is None


@pytest.mark.parametrize("engine", ["h5netcdf", "scipy"])
@given(places=flips)
def test_damage_is_refused_or_leaves_a_table(tmp_path_factory, engine, places):
    folder = tmp_path_factory.mktemp("nc")
    xr.Dataset({"F": ("time", F)}, {"time": T}).to_netcdf(folder / "a.nc", engine=engine)
    survived(open_hdf5, folder / "a.nc", flipped((folder / "a.nc").read_bytes(), places))


@pytest.mark.slow
@pytest.mark.parametrize("layout", [{}, {"chunks": (20_000,)}])
def test_a_file_of_200_MB_is_read_in_a_fraction_of_it(tmp_path, layout):
    """32 MB of chunks may be kept, and there are a few copies of a piece of 6.4 MB while it is made."""
    values = np.random.default_rng(0).normal(size=3_200_000)
    with h5py.File(tmp_path / "a.h5", "w") as file:
        for i in range(8):
            file.create_dataset(f"c{i}", data=values, **layout)
    assert (tmp_path / "a.h5").stat().st_size > 200e6
    assert growth(open_hdf5, tmp_path / "a.h5") < 100
