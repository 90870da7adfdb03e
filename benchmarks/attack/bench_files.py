"""Recordings of the bench: files of every format, damaged, hostile in their cells and names, wide, or bombs."""

import importlib.util
import io
import random
import tempfile
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from openpyxl import Workbook
from scipy.io import savemat
from tests.measure.formats.hostile import BOMBS, WIDE
from tests.measure.formats.test_c3d import write_c3d
from tests.measure.formats.write import FORMATS

from nectosome.measure.formats.file_errors import COLUMNS

from .attempt import Attack, Outcome, commanded, warm_up
from .damage import ESCAPES, LONG, MARKUP, spoilt_files

_TABLE = {"t": 0.1 * np.arange(200), "F": np.sin(np.arange(200.0))}
_CELLS = (
    *("", " ", "nan", "inf", "-inf", "1e999", "-1e308", "1" * 400, "one", "1,5", "1.2.3", "0x10", "1_0", "--1"),
    *("1e", "#REF!"),
    *('"', '"1', "'1'", "=1+1", "=cmd|' /C calc'!A0", "@SUM(1)", "2026-01-01", "12:30:45", "true", "None"),
    *("١٢٣", "½", "∞"),
    *("1;2;3", "1\t2", "1\n2", "\x00", *MARKUP, *ESCAPES, *LONG),
)  # fmt: skip
_CODINGS = ("utf-16", "utf-16-le", "utf-32", "utf-7", "cp1252", "latin-1", "shift_jis", "gb18030", "cp037", "koi8-r")


def damaged_recordings(rng: random.Random, count: int) -> Iterator[Attack]:
    """Files of every format, in turn, with bytes lost, flipped, zeroed, added, or with the ending of another format."""
    good = {name: (file, _written(file, write)) for name, (file, _, write) in FORMATS.items()}
    warm_up(commanded(("measure", file), {file: raw}, ()) for file, raw in good.values())
    if importlib.util.find_spec("ezc3d") is not None:
        good["c3d"] = ("a.c3d", _written("a.c3d", lambda path, _: write_c3d(path)))
    for about, file, raw in spoilt_files(rng, count, good):
        yield Attack(about, commanded(("measure", file), {file: raw}, (file,)))


def _written(file: str, write: Callable[[Path, Any], object]) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        write(Path(folder) / file, _TABLE)
        return (Path(folder) / file).read_bytes()


def hostile_tables(rng: random.Random, count: int) -> Iterator[Attack]:
    """Tables as text with hostile cells, names, widths and encodings."""
    for _ in range(count):
        comma = rng.choice(",;\t ")
        rows = [["t [s]", "F [N]", "note"], *([f"{k / 10}", f"{k % 7}", f"{k}"] for k in range(30))]
        for _ in range(rng.choice((0, 1, 1, 3, 40))):
            row = rng.choice(rows)
            row[rng.randrange(len(row))] = rng.choice(_CELLS)
        how = rng.randrange(6)
        k = rng.randrange(len(rows))
        rows[k] = [rows[k][:1], rows[k], rows[k], rows[k] * 3, [], rows[k] * 2000][how]
        if rng.random() < 0.2:
            rows[0] = [rng.choice(_CELLS)] * len(rows[0])
        text = "".join(comma.join(row) + rng.choice(("\n", "\r\n", "\r") if k == 3 else ("\n",)) for row in rows)
        coding = rng.choice(_CODINGS) if rng.random() < 0.2 else "utf-8"
        file = f"a.{rng.choice(('csv', 'txt', 'tsv', 'dat', 'log', 'lvm', 'asc'))}"
        about = f"row {k + 1} of kind {how}, {coding}"
        yield Attack(about, commanded(("measure", file), {file: text.encode(coding, "replace")}, (file,)))


def hostile_stores(rng: random.Random, count: int) -> Iterator[Attack]:
    """HDF5, MATLAB, numpy and Excel files with what no recording has: bombs, links out, objects, other shapes."""
    known = [*[(name, write) for name, (write, _) in BOMBS.items()], *_stores()]
    known += [(name, lambda path, name=name: WIDE[name](path, COLUMNS + 1)) for name in WIDE]
    for k in range(count):
        if k < len(known):
            file, write = known[k]
            about = f"known case {k}"
        else:
            file, write = _odd_store(rng)
            about = "odd arrays"
        yield Attack(f"{file}: {about}", _made(file, write))


def _made(file: str, write: Callable[[Path], object]) -> Callable[[Path], Outcome]:
    """As `commanded`, with a file that is too large to be kept in memory with the others."""

    def attempt(folder: Path) -> Outcome:
        write(folder / file)
        outcome = commanded(("measure", file), {}, (file,))(folder)
        if "root:" in "".join(outcome.faults):
            outcome.faults.append("reads another file")
        return outcome

    return attempt


def _array(rng: random.Random) -> np.ndarray:
    """An array as no sensor gives it."""
    n = rng.choice((0, 1, 2, 7, 200))
    values = np.random.default_rng(rng.randrange(2**32)).normal(size=n)
    return rng.choice(
        (
            *(values, values * 1e307, values * np.nan, values + 1j, values > 0, values.astype("f2")),
            values.astype("f4"),
            *(values.reshape(1, -1), np.zeros((2, 3, 4)), np.array(3.0), np.zeros((3, 0)), np.zeros((n, 300))),
            *(values.astype(str), values.astype("S8"), np.arange(n, dtype="u8") + 2**63, values.astype(">f8")),
            *(np.full(n, -np.inf), np.arange(n)[::-1].astype(float), np.zeros(n), np.arange(n, dtype="i1")),
        )
    )  # fmt: skip


def _odd_store(rng: random.Random) -> tuple[str, Callable[[Path], object]]:
    """A file of a few such arrays with hostile names."""
    names = (
        "t",
        "time",
        "F",
        "x" * 60,
        "a b",
        "a/b",
        "0",
        "time [s]",
        "F (kN)",
        "__class__",
        *MARKUP[:2],
        *ESCAPES[:6],
    )
    arrays = {rng.choice(names).replace("\0", "") or "n": _array(rng) for _ in range(rng.randint(1, 5))}
    kind = rng.choice(("h5", "mat", "npz", "npy", "xlsx"))

    def write(path: Path) -> None:
        if kind == "h5":
            with h5py.File(path, "w") as file:
                for name, value in arrays.items():
                    if name.split("/")[0] not in file:
                        file[name] = value.astype("S8") if value.dtype.kind == "U" else value
        elif kind == "mat":
            savemat(
                path,
                {f"v{k}" if not name.isidentifier() else name[:31]: v for k, (name, v) in enumerate(arrays.items())},
            )
        elif kind == "npz":
            with path.open("wb") as file:
                np.savez(file, **{name.replace("/", "_"): value for name, value in arrays.items()})
        elif kind == "npy":
            np.save(path, next(iter(arrays.values())))
        else:
            book = Workbook()
            for value in arrays.values():
                cells = np.atleast_1d(value).ravel()[:50].tolist()
                book.active.append([cell if isinstance(cell, int | float | bool) else str(cell) for cell in cells])
            book.save(path)

    return f"a.{kind}", write


def _stores() -> list[tuple[str, Callable[[Path], object]]]:
    """Files that ask for other files, run what is in them, or go in circles."""

    def linked(path: Path) -> None:
        with h5py.File(path, "w") as file:
            file["F"] = h5py.ExternalLink("/etc/passwd", "/x")
            file["t"] = np.arange(9.0)

    def outside(path: Path) -> None:
        with h5py.File(path, "w") as file:
            file.create_dataset("F", (64,), "u1", external=[("/etc/passwd", 0, 64)])

    def virtual(path: Path) -> None:
        layout = h5py.VirtualLayout((9,), "f8")
        layout[:] = h5py.VirtualSource("/tmp/none.h5", "x", (9,))
        with h5py.File(path, "w") as file:
            file.create_virtual_dataset("F", layout)

    def circle(path: Path) -> None:
        with h5py.File(path, "w") as file:
            group = file.create_group("g")
            group["g"] = file["g"]
            group["soft"] = h5py.SoftLink("/g/soft")
            file["t"] = np.arange(9.0)

    def deep(path: Path) -> None:
        with h5py.File(path, "w") as file:
            file["/".join("a" * 2000)] = np.arange(9.0)

    def pickled(path: Path) -> None:
        np.save(path, np.array([print, {}], dtype=object), allow_pickle=True)

    def pickled_inside(path: Path) -> None:
        np.savez(path, t=np.array([print, {}], dtype=object))

    def zipped(member: str, content: bytes) -> Callable[[Path], None]:
        def write(path: Path) -> None:
            with zipfile.ZipFile(path, "w") as file:
                file.writestr(member, content)

        return write

    def entities(path: Path) -> None:
        book = Workbook()
        book.active.append([1, 2])
        book.save(path)
        head = b'<?xml version="1.0"?><!DOCTYPE a [<!ENTITY x SYSTEM "file:///etc/passwd"><!ENTITY b0 "bb">'
        head += b"".join(b'<!ENTITY b%d "%s">' % (k + 1, b"&b%d;" % k * 10) for k in range(9))
        body = head + b"]><worksheet><sheetData><row><c><v>&x;&b9;</v></c></row></sheetData></worksheet>"
        with zipfile.ZipFile(path) as file:
            members = {name: file.read(name) for name in file.namelist()}
        members["xl/worksheets/sheet1.xml"] = body
        with zipfile.ZipFile(path, "w") as file:
            for name, content in members.items():
                file.writestr(name, content)

    def headed(shape: str) -> Callable[[Path], None]:
        def write(path: Path) -> None:
            head = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}".ljust(117).encode() + b"\n"
            path.write_bytes(b"\x93NUMPY\x01\x00" + len(head).to_bytes(2, "little") + head + bytes(800))

        return write

    plain = io.BytesIO()
    np.save(plain, np.arange(9.0))
    shapes = (
        "(10**18,)",
        "(-1,)",
        "(1000000000000000000,)",
        "(2, 0, 9000000000000000000)",
        "(True,)",
        "__import__('os')",
    )
    return [
        *(("a.h5", write) for write in (linked, outside, virtual, circle, deep)),
        *(("a.nc", write) for write in (linked, outside, virtual, circle)),
        *(("a.npy", write) for write in (pickled, *map(headed, shapes))),
        *(
            ("a.npz", write)
            for write in (pickled_inside, zipped("../../x.npy", plain.getvalue()), zipped("x.txt", b"x"))
        ),
        *(
            ("a.xlsx", write)
            for write in (entities, zipped("x.npy", plain.getvalue()), zipped("xl/workbook.xml", b"<a"))
        ),
        *(
            ("a.mat", write)
            for write in (lambda path: savemat(path, {"c": np.array([1, "x", print.__name__], dtype=object)}), linked)
        ),
    ]
