"""Reading measurements on one core, in megabytes of the file a second: nectosome beside what it is built upon.

The text is like a logger's: 7 columns with three decimals between tabs. Every reader hands over all rows as arrays;
they take turns, so that other work on the machine meets all of them.
"""

import statistics
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd

from nectosome.measure.formats.source import Options
from nectosome.measure.formats.text import open_text

from .timing import once

_MEGABYTES, _PIECE, _REPEATS = 100, 100_000, 5


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        text = _write_text(Path(folder) / "logger.tsv")
        _compare(
            "text",
            text,
            {
                "nectosome, in pieces": lambda: _in_pieces(text),
                "pandas, in pieces": lambda: _pandas_in_pieces(text),
                "pandas, at once": lambda: pd.read_csv(text, sep="\t", header=None).to_numpy(),
            },
        )


def _compare(kind: str, path: Path, readers: dict[str, Callable[[], object]]) -> None:
    """Print how fast each reader is, and how fast the first one is beside the others."""
    times = {name: [] for name in readers}
    for _ in range(_REPEATS + 1):
        for name, read in readers.items():
            times[name].append(once(read)[0])
    size = path.stat().st_size / 1e6
    speeds = {name: size / statistics.median(each[1:]) for name, each in times.items()}  # the first one warms up
    print(f"\n{kind} of {size:.0f} MB, in pieces of {_PIECE} rows (median of {_REPEATS})")
    for name, speed in speeds.items():
        print(f"  {name:24s} {speed:6.0f} MB/s   {next(iter(speeds.values())) / speed:5.2f} x")


def _write_text(path: Path) -> Path:
    values = np.random.default_rng(0).normal(scale=30.0, size=(_PIECE, 7)).tolist()
    block = "".join("\t".join(f"{value:.3f}" for value in row) + "\n" for row in values)
    path.write_text(block * (_MEGABYTES * 1_000_000 // len(block) + 1))
    return path


def _in_pieces(path: Path) -> None:
    with open_text(path, Options()) as source:
        for _ in source.pieces(_PIECE):
            pass


def _pandas_in_pieces(path: Path) -> None:
    for frame in pd.read_csv(path, sep="\t", header=None, chunksize=_PIECE):
        frame.to_numpy()


if __name__ == "__main__":
    main()
