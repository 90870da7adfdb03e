"""Reading measurements on one core, in megabytes of the file a second: nectosome beside what others read with.

The recordings are like a logger's: 7 channels with three decimals. `measure.read` takes the hash of the file, watches
over times, gaps and saturation and converts to SI; the readers beside it hand over all rows as arrays and look at
nothing. They take turns, so that other work on the machine meets all of them.
"""

import statistics
import tempfile
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
from nptdms import ChannelObject, TdmsFile, TdmsWriter

from nectosome.io.schema.validate import validate_as
from nectosome.measure import read
from nectosome.measure.formats.source import Options, open_source
from nectosome.measure.sheet import Sheet

from .timing import once

_MEGABYTES, _PIECE, _REPEATS, _CHANNELS = 100, 100_000, 5, 7
_SHEET = validate_as(Sheet, {"time": {"rate": "1000 Hz"}}, "sheet", file="", lines={})


def main() -> None:
    """Compare readers of text, TDMS and HDF5."""
    rng = np.random.default_rng(0)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        text, tdms, hdf5 = folder / "logger.tsv", folder / "logger.tdms", folder / "logger.h5"
        values = rng.normal(scale=30.0, size=(_PIECE, _CHANNELS)).round(3)
        _write_text(text, values)
        _write_tdms(tdms, values)
        _write_hdf5(hdf5, values)
        _compare(
            "text",
            text,
            {
                "pandas, in pieces": lambda: _pandas_in_pieces(text),
                "pandas, at once": lambda: pd.read_csv(text, sep="\t", header=None).to_numpy(),
            },
        )
        _compare("TDMS", tdms, {"npTDMS and pandas": lambda: TdmsFile.read(tdms).as_dataframe().to_numpy()})
        _compare("HDF5", hdf5, {"h5py and pandas": lambda: _h5py(hdf5)})


def _compare(kind: str, path: Path, others: dict[str, Callable[[], object]]) -> None:
    """Print how fast each reader is, and how fast `measure.read` is beside the others."""
    readers = {
        "nectosome, read": lambda: read(path, _SHEET),
        "nectosome, in pieces": lambda: _in_pieces(path),
        **others,
    }
    times = {name: [] for name in readers}
    for _ in range(_REPEATS + 1):
        for name, reader in readers.items():
            times[name].append(once(reader)[0])
    size = path.stat().st_size / 1e6
    speeds = {name: size / statistics.median(each[1:]) for name, each in times.items()}  # the first one warms up
    print(f"\n{kind} of {size:.0f} MB, in pieces of {_PIECE} rows (median of {_REPEATS})")
    for name, speed in speeds.items():
        print(f"  {name:24s} {speed:6.0f} MB/s   {next(iter(speeds.values())) / speed:5.2f} x")


def _write_text(path: Path, values: np.ndarray) -> None:
    block = "".join("\t".join(f"{value:.3f}" for value in row) + "\n" for row in values.tolist())
    path.write_text(block * (_MEGABYTES * 1_000_000 // len(block) + 1))


def _write_tdms(path: Path, values: np.ndarray) -> None:
    with TdmsWriter(path) as file:
        for _ in range(_MEGABYTES * 1_000_000 // values.nbytes):
            file.write_segment([ChannelObject("log", f"c{k}", values[:, k]) for k in range(_CHANNELS)])


def _write_hdf5(path: Path, values: np.ndarray) -> None:
    times = _MEGABYTES * 1_000_000 // values.nbytes
    with h5py.File(path, "w") as file:
        for k in range(_CHANNELS):
            file.create_dataset(f"c{k}", data=np.tile(values[:, k], times), chunks=(_PIECE,))


def _in_pieces(path: Path) -> None:
    with open_source(path, Options()) as source:
        for _ in source.pieces(_PIECE):
            pass


def _pandas_in_pieces(path: Path) -> None:
    for frame in pd.read_csv(path, sep="\t", header=None, chunksize=_PIECE):
        frame.to_numpy()


def _h5py(path: Path) -> np.ndarray:
    with h5py.File(path) as file:
        return pd.DataFrame({name: data[:] for name, data in file.items() if isinstance(data, h5py.Dataset)}).to_numpy()


if __name__ == "__main__":
    main()
