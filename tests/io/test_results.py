"""Datasets come back as they were; what is no dataset is told."""

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_array_equal

from nectosome.io import load_dataset, save_dataset
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
