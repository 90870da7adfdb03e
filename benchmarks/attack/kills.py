"""Signals while a command writes: its file is there whole, or as it was before, whenever the process ends."""

import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from nectosome.io import save_dataset

from .attempt import Attack, Outcome
from .saved_runs import bare_run

ROOT = Path(__file__).parents[2]
_SIGNALS = (signal.SIGKILL, signal.SIGKILL, signal.SIGTERM, signal.SIGINT)
_SAVES = {
    "run.nc": ("measure", "long.csv", "--save", "run.nc", "--force"),
    "run.csv": ("measure", "long.csv", "--save", "run.csv", "--force"),
    "page.html": ("show", "good.nc", "--plot", "page.html", "--force"),
    "it.yaml": ("new", "manta", "it.yaml", "--force"),
}
_PATIENCE = 120.0  # s


def kills(rng: random.Random, count: int) -> Iterator[Attack]:
    """At a random time, or as soon as a new name shows in the folder; over an old file, or where there is none."""
    for k in range(count):
        target = [*_SAVES][k % len(_SAVES)]
        sent, seed, old = rng.choice(_SIGNALS), rng.randrange(2**32), rng.random() < 0.5
        seen = rng.random() < 0.7
        when = "while it writes" if seen else "at a random time"
        about = f"{signal.Signals(sent).name} {when} {target}{' over an old one' if old else ''}"
        yield Attack(about, _attempt(target, sent, old, seen, random.Random(seed)))


_wholes: dict[str, int] = {}  # size of each file, written without a signal


def _attempt(target: str, sent: int, old: bool, seen: bool, rng: random.Random) -> Callable[[Path], Outcome]:
    def attempt(folder: Path) -> Outcome:
        time_, force = np.arange(40_000) / 100, np.sin(np.arange(40_000.0))
        np.savetxt("long.csv", np.stack([time_, force], axis=-1), delimiter=",", header="t [s],F [N]", comments="")
        save_dataset(bare_run(), folder / "good.nc")
        command = [sys.executable, "-m", "nectosome", *_SAVES[target]]
        environment = {**os.environ, "PYTHONPATH": str(ROOT / "src")}
        if target not in _wholes:
            subprocess.run(command, env=environment, capture_output=True, check=True, timeout=_PATIENCE)
            _wholes[target] = (folder / target).stat().st_size
            for path in {*folder.iterdir()} - {folder / "long.csv", folder / "good.nc"}:
                path.unlink()
        if old:
            (folder / target).write_bytes(b"old")
        before = {path.name for path in folder.iterdir()}
        with subprocess.Popen(
            command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        ) as process:
            if seen:
                while process.poll() is None and {path.name for path in folder.iterdir()} <= before:
                    time.sleep(0.0005)
                time.sleep(rng.choice((0.0, rng.random() * 0.02, rng.random() * 0.2)))
            else:
                time.sleep(rng.random() * 2.5)
            process.send_signal(sent)
            _, err = process.communicate(timeout=_PATIENCE)
        found = _broken(folder / target, old)
        if sent == signal.SIGINT and process.returncode not in (0, 130, -signal.SIGINT):
            found.append(f"exit code {process.returncode}: {err[:300]}")
        if sent == signal.SIGINT and process.returncode == 130:
            left = {path.name for path in folder.iterdir()} - before - {target, "robot.schema.json"}
            found += [f"leaves {sorted(left)}"] if left else []
        if "Traceback" in err and process.returncode != -signal.SIGINT:  # Python's own, while it imports
            found.append(f"a traceback: {err[-300:]}")
        return Outcome(process.returncode == 0, found)

    return attempt


def _broken(file: Path, old: bool) -> list[str]:
    """Whether a file is there by halves."""
    if not file.exists():
        return ["the old file is gone"] if old else []
    raw = file.read_bytes()
    whole = abs(len(raw) - _wholes[file.name]) <= 64  # times and versions are in them
    return [] if whole or (old and raw == b"old") else [f"{file.name} has {len(raw)} bytes of {_wholes[file.name]}"]
