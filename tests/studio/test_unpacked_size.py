"""Small files that unpack to gigabytes are refused before they are read; others are left to their readers."""

import zipfile

import h5py
import numpy as np
import pytest
import scipy.io

from nectosome.studio import uploads
from nectosome.studio.uploads import check_unpacked, received
from nectosome.units import InputError

LIMIT = 2**25  # bytes; that of the studio is larger


def hdf5(path):
    with h5py.File(path, "w") as file:
        file.create_dataset(
            "a/b", (LIMIT // 8 + 1,), "f8", chunks=(2**20,), compression="gzip"
        )  # nothing of it is written


def excel(path):
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file, file.open("xl/worksheets/sheet1.xml", "w") as sheet:
        for _ in range(LIMIT // 2**24 + 1):
            sheet.write(bytes(2**24))


def matlab(path):
    scipy.io.savemat(path, {f"x{k}": np.zeros((2**21, 1)) for k in range(3)}, do_compression=True)


@pytest.mark.parametrize(("name", "write"), [("run.nc", hdf5), ("table.xlsx", excel), ("values.mat", matlab)])
def test_what_unpacks_to_too_much_is_refused(tmp_path, name, write, monkeypatch):
    assert uploads.UNPACKED_LIMIT == 2**30
    monkeypatch.setattr(uploads, "UNPACKED_LIMIT", LIMIT)
    write(tmp_path / name)
    data = (tmp_path / name).read_bytes()
    assert len(data) < 1e6
    with pytest.raises(InputError, match=f"{name}: holds more than 0 GiB"), received(name, data):
        pass


def test_files_of_a_usual_size_pass_and_damaged_ones_are_left_to_their_readers(tmp_path):
    scipy.io.savemat(tmp_path / "a.mat", {"x": np.arange(1000.0), "y": np.ones(5)}, do_compression=True)
    scipy.io.savemat(tmp_path / "b.mat", {"x": np.arange(1000.0)})
    np.savez_compressed(tmp_path / "c.npz", x=np.arange(1000.0))
    with h5py.File(tmp_path / "d.nc", "w") as file:
        file["x"] = np.arange(1000.0)
        file["empty"] = h5py.Empty("f8")
    for path in sorted(tmp_path.iterdir()):
        check_unpacked(path)
        (tmp_path / f"cut_{path.name}").write_bytes(path.read_bytes()[:-40])
        check_unpacked(tmp_path / f"cut_{path.name}")
    for head in (b"", b"\x89HDF", b"PK", b"MATLAB 5", b"a,b\n1,2\n"):
        (tmp_path / "odd").write_bytes(head)
        check_unpacked(tmp_path / "odd")
