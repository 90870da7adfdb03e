"""Files that are small on disk and large in memory, or have more columns than any rig has."""

import io
import struct
import zipfile
import zlib

import h5py
import numpy as np
from openpyxl import Workbook
from scipy.io import savemat

HUGE = 400 * 2**20  # numbers of 8 bytes: 3.36 GB
ZEROS = bytes(2**20)


def compressed_mat(path, said=8 * HUGE, there=64 * 2**20):
    """A compressed variable of a MAT-file of version 5 that says this size, and has another."""

    def element(kind, data):
        return struct.pack("<II", kind, len(data)) + data

    head = element(6, struct.pack("<II", 6, 0)) + element(5, struct.pack("<ii", said // 8, 1)) + element(1, b"x" * 8)
    packer = zlib.compressobj(9)
    packed = packer.compress(struct.pack("<II", 14, len(head) + 8 + said) + head + struct.pack("<II", 9, said))
    packed += b"".join(packer.compress(ZEROS) for _ in range(there // len(ZEROS))) + packer.flush()
    path.write_bytes(b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM" + struct.pack("<II", 15, len(packed)) + packed)


def _zipped(path, member, head, megabytes):
    with (
        zipfile.ZipFile(path, "a", zipfile.ZIP_DEFLATED, compresslevel=1) as archive,
        archive.open(member, "w") as file,
    ):
        file.write(head)
        for _ in range(megabytes):
            file.write(ZEROS)


def _npz(path):
    head = io.BytesIO()
    np.lib.format.write_array_header_1_0(head, {"descr": "<f8", "fortran_order": False, "shape": (150 * 2**20,)})
    _zipped(path, "x.npy", head.getvalue(), 1200)


def _xlsx(member, megabytes):
    def write(path):
        book = Workbook()
        book.active.append([1, 2])
        book.save(path)
        _zipped(path, member, b"<a/>", megabytes)

    return write


def _h5(rows, chunk):
    def write(path):
        with h5py.File(path, "w") as file:
            file.create_dataset("x", shape=(rows,), maxshape=(None,), dtype="f8", chunks=(chunk,), compression="gzip")

    return write


BOMBS = {
    "a.mat": (compressed_mat, "3.36 GB are what it holds when it is unpacked, and 1 GB are allowed"),
    "a.npz": (_npz, "1.26 GB are what it holds"),
    "a.xlsx": (_xlsx("xl/worksheets/sheet9.xml", 1000), "1.05 GB are what it holds"),
    "b.xlsx": (_xlsx("xl/sharedStrings9.xml", 200), "210 MB are what its texts hold .* 125 MB are allowed"),
    "a.h5": (_h5(HUGE, 2**17), "3.36 GB are what it holds"),
    "b.h5": (_h5(100, 2**25), "268 MB are what a chunk holds when it is unpacked, and 125 MB are allowed"),
    "b.mat": (_h5(HUGE, 2**17), "3.36 GB are what it holds"),
}


def _csv(path, n):
    path.write_text("".join(",".join([cell] * n) + "\n" for cell in ("c", "1.5", "2.5")))


def _book(path, n):
    book = Workbook(write_only=True)
    sheet = book.create_sheet()
    for row in (["c"] * n, range(n), range(n)):
        sheet.append(list(row))
    book.save(path)


def _hdf5(path, n):
    with h5py.File(path, "w") as file:
        for k in range(n):
            file[f"x{k}"] = np.zeros(3)


WIDE = {
    "a.csv": _csv,
    "a.xlsx": _book,
    "a.npz": lambda path, n: np.savez(path, **{f"x{k}": np.zeros(3) for k in range(n)}),
    "a.h5": _hdf5,
    "a.mat": lambda path, n: savemat(path, {f"x{k}": np.zeros(3) for k in range(n)}),
}
