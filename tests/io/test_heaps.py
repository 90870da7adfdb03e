"""Global heaps of HDF5 files: the damage over which the library would never end."""

import h5py
import numpy as np
import pytest
import xarray as xr

from nectosome.io import load_dataset, save_dataset
from nectosome.io.heaps import check_heaps
from nectosome.measure import read
from nectosome.units import InputError


def emptied(file):
    """Write a free space of no bytes where the one of the first heap was."""
    raw = bytearray(file.read_bytes())
    start = raw.index(b"GCOL")
    end, at = start + int.from_bytes(raw[start + 8 : start + 16], "little"), start + 16
    while int.from_bytes(raw[at : at + 2], "little"):
        at += 16 + (int.from_bytes(raw[at + 8 : at + 16], "little") + 7) // 8 * 8
    assert int.from_bytes(raw[at + 8 : at + 16], "little") == end - at
    raw[at + 8 : at + 16] = bytes(8)
    file.write_bytes(raw)


def test_a_results_file_that_would_be_read_for_ever_is_refused(tmp_path):
    file = tmp_path / "a.nc"
    save_dataset(xr.Dataset({"x": ("t", [1.0, 2.0])}, coords={"t": [0.0, 1.0]}, attrs={"title": "a"}), file)
    check_heaps(file)
    emptied(file)
    with pytest.raises(InputError, match="damaged") as caught:
        load_dataset(file)
    assert caught.value.file == str(file)


def test_a_recording_that_would_be_read_for_ever_is_refused(tmp_path):
    file = tmp_path / "a.h5"
    with h5py.File(file, "w") as stored:
        stored["time"], stored["force"] = np.arange(3.0), np.arange(3.0)
        stored["names"] = ["a", "b"]
    emptied(file)
    with pytest.raises(InputError, match="damaged") as caught:
        read(file)
    assert str(caught.value).count("a.h5") == 1


def test_an_empty_file_has_no_heaps(tmp_path):
    (tmp_path / "a").touch()
    check_heaps(tmp_path / "a")


@pytest.mark.parametrize("before", [0, 2**24 - 4, 2**24 + 20, 2**25])
def test_a_heap_is_seen_at_any_place_of_a_file(tmp_path, before):
    """A file is searched by windows of 2^24 bytes; a heap may lie across two."""
    heap = b"GCOL\x01\0\0\0" + (4096).to_bytes(8, "little") + bytes(4080)  # its free space has no bytes
    (tmp_path / "a").write_bytes(bytes(before) + heap)
    with pytest.raises(InputError, match="damaged"):
        check_heaps(tmp_path / "a")
