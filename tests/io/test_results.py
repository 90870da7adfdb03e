"""Datasets come back as they were; what is no dataset is told."""

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_array_equal

from nectosome.io import load_dataset, save_dataset
from nectosome.io.results import table_of
from nectosome.units import InputError


@pytest.fixture
def dataset() -> xr.Dataset:
    return xr.Dataset(
        {
            "q": (("time", "coordinate"), np.array([[0.1, np.nan], [np.inf, -0.0], [1e-300, 3.0]]), {"unit": "rad"}),
            "count": ("time", np.array([1, -2, 3], dtype=np.int32)),
            "single": ("time", np.array([1, 2, 3], dtype=np.float32)),
            "whole": ("time", np.array([True, False, True])),
            "station_part": ("station", np.array(["body", "filament", "schön"])),
            "nothing": (("time", "none"), np.zeros((3, 0))),
            "energy": ((), 4.5),
        },
        coords={
            "time": ("time", [0.0, 0.5, 1.0], {"unit": "s", "units": "seconds"}),
            "coordinate": ["shaft", "filament.bending_y.2"],
        },
        attrs={
            "title": "flagellum",
            "robot": "name: a\nbody: {}\n",
            "provenance": '{"a": 1}',
            "x": 1.5,
            "empty": "",
        },
    )


def test_a_dataset_comes_back_identical(dataset, tmp_path):
    save_dataset(dataset, tmp_path / "a.nc")
    again = load_dataset(tmp_path / "a.nc")
    xr.testing.assert_identical(again, dataset)
    for name in dataset.variables:
        assert again[name].dtype == dataset[name].dtype, name
        assert again[name].attrs == dataset[name].attrs
        assert_array_equal(again[name].values, dataset[name].values)
    save_dataset(again, tmp_path / "b.nc")
    xr.testing.assert_identical(load_dataset(tmp_path / "b.nc"), dataset)
    assert sorted(file.name for file in tmp_path.iterdir()) == ["a.nc", "b.nc"]


def test_a_dataset_may_be_written_over_the_one_it_came_from(dataset, tmp_path):
    save_dataset(dataset, tmp_path / "a.nc")
    save_dataset(load_dataset(tmp_path / "a.nc"), tmp_path / "a.nc")
    xr.testing.assert_identical(load_dataset(tmp_path / "a.nc"), dataset)


def test_what_is_no_dataset_is_told(dataset, tmp_path):
    file = tmp_path / "a.nc"
    save_dataset(dataset, file)
    raw = file.read_bytes()
    for end in (0, 4, 100, len(raw) // 2, len(raw) - 10):
        file.write_bytes(raw[:end])
        with pytest.raises(InputError, match=r"a\.nc: cannot be read: this is not a results file, or it is"):
            load_dataset(file)
    file.write_text("time, q\n0, 1\n")
    with pytest.raises(InputError, match="this is not a results file"):
        load_dataset(file)
    with pytest.raises(InputError, match="No such file or directory"):
        load_dataset(tmp_path / "none.nc")
    with pytest.raises(InputError, match="Is a directory"):
        load_dataset(tmp_path)


def test_a_dataset_that_cannot_be_written_is_told(dataset, tmp_path):
    with pytest.raises(InputError, match=r"cannot write .*No such file or directory"):
        save_dataset(dataset, tmp_path / "none" / "a.nc")


def test_a_run_becomes_a_table_with_a_row_for_each_time(tmp_path):
    """Labels and units stand in the heads; what does not depend on time is left out."""
    speed = xr.DataArray(np.arange(12.0).reshape(2, 2, 3), dims=("time", "part", "axis"), attrs={"units": "m/s"})
    run = xr.Dataset(
        {"velocity": speed, "balance": ("time", [0.0, 1e-9], {"units": "1"}), "place": ("station", [1.0])},
        coords={"time": ("time", [0.0, 0.5], {"units": "s"}), "part": ["body", "fin"], "axis": ["x", "y", "z"]},
    )
    save_dataset(run, tmp_path / "run.csv")
    head, first, second = (tmp_path / "run.csv").read_text().splitlines()
    assert head.startswith("time (s),velocity body x (m/s),velocity body y (m/s)") and head.endswith(",balance")
    assert [float(x) for x in first.split(",")] == [0.0, 0, 1, 2, 3, 4, 5, 0.0]
    assert [float(x) for x in second.split(",")] == [0.5, 6, 7, 8, 9, 10, 11, 1e-9]


def test_stations_of_a_part_are_counted_in_a_table():
    run = xr.Dataset(
        {"position": (("time", "station"), [[1.0, 2.0, 3.0]], {"units": "m"})},
        coords={"time": [0.0], "station_part": ("station", ["body", "rod", "rod"])},
    )
    assert list(table_of(run).columns) == ["time", "position body 0 (m)", "position rod 0 (m)", "position rod 1 (m)"]


def test_a_grid_becomes_a_table_with_a_row_for_each_point():
    grid = xr.Dataset(
        {"speed": (("A", "f"), [[1.0, 2.0], [3.0, 4.0]]), "force": (("A", "f", "axis"), np.ones((2, 2, 1)))},
        coords={"A": ("A", [0.5, 1.0], {"units": "rad"}), "f": ("f", [1.0, 2.0], {"units": "Hz"}), "axis": ["x"]},
    )
    table = table_of(grid)
    assert list(table.columns) == ["A (rad)", "f (Hz)", "speed", "force x"]
    assert table["A (rad)"].tolist() == [0.5, 0.5, 1.0, 1.0] and table["speed"].tolist() == [1, 2, 3, 4]


def test_variables_that_share_no_dimension_become_a_long_table():
    found = xr.Dataset(
        {"value": ("parameter", [1.5, 2.5], {"units": "kg"}), "error": ("recording", [0.1])},
        coords={"parameter": ["mass", "drag"], "recording": ["run 1"]},
    )
    table = table_of(found)
    assert table["variable"].tolist() == ["value", "value", "error"] and table["unit"].tolist() == ["kg", "kg", ""]
    assert table["parameter"].tolist()[:2] == ["mass", "drag"] and table["recording"].tolist()[2] == "run 1"
    assert table["value"].tolist() == [1.5, 2.5, 0.1]


def test_what_is_no_dataset_is_said_to_be_none(as_users_run, tmp_path):
    with pytest.raises(InputError, match="a dict is given where a result or its dataset is expected"):
        save_dataset({}, tmp_path / "run.nc")
