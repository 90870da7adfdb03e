"""A Dask scheduler and workers as processes of this machine: kills, scaling, overhead, and who compiles.

Needs two processors of its own. A sweep of 504 paddles (18 parts of 28) measures the scaling; one of 500 flagella, each
a call of its own, the overhead; Monte Carlo runs are those of 256 fishtails under a PID and a predictive controller.
"""

import os
import random
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import jax
import numpy as np

from nectosome.controllers import run_batch
from nectosome.designs.sweep import sweep
from nectosome.io import load_dataset
from nectosome.io.file_system import entries
from nectosome.search.executors.cluster import cluster
from nectosome_studies.fishtail import control_study

from .dask_processes import DaskProcesses, kill

_KILLS, _AGAIN = 10, 3
_RTOL = 1e-6  # of the sweep that scales
_LEAST, _MOST = 1.8, 5e-3  # aims: from 1 to 2 workers; s a point
_PADDLES = {"f": np.linspace(0.5, 2.0, 18).tolist(), "A": np.linspace(0.5, 0.9, 28).tolist()}
_FLAGELLA = {"omega": np.linspace(8.0, 20.0, 50).tolist(), "E": np.linspace(3e6, 4e6, 10).tolist()}
_GRID = ("--over", "f=0.5..2:0.025Hz", "--over", "A=30..57:1deg")  # of the command: 1708 points, 61 parts


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        _compiling(Path(folder))
        _scaling(Path(folder))
        _overhead(Path(folder))
        _monte_carlo(Path(folder))
        _kills(Path(folder))


def _compiling(folder: Path) -> None:
    """Two workers with an empty cache: the second one loads what the first one compiled."""
    with DaskProcesses(folder) as dask:
        dask.add(2)
        dask.wait()
        with cluster(dask.address) as executor:
            found = _timed(dask, lambda: sweep("paddle", _PADDLES, executor=executor))
    print(f"\n  504 paddles, two workers, empty cache: {found}", flush=True)


def _scaling(folder: Path) -> None:
    walls = list[float]()
    for number in (1, 2):
        with DaskProcesses(folder) as dask:
            dask.add(number)
            dask.wait()
            with cluster(dask.address) as executor:
                run = partial(sweep, "paddle", _PADDLES, rtol=_RTOL, executor=executor)
                run()  # loads programs
                found = sorted((_timed(dask, run) for _ in range(_AGAIN)), key=lambda times: times.wall)[_AGAIN // 2]
        walls.append(found.wall)
        print(f"  504 paddles, {number} worker(s): {found}", flush=True)
    print(f"    from 1 to 2 workers {walls[0] / walls[1]:.2f} times as fast (aim {_LEAST})", flush=True)


def _overhead(folder: Path) -> None:
    """What a call of its own costs a point, beside the same in this process."""
    sweep("flagellum", {**_FLAGELLA, "E": _FLAGELLA["E"][:1]}, workers=1)
    began = time.perf_counter()
    here = sweep("flagellum", _FLAGELLA, workers=1)
    alone = time.perf_counter() - began
    with DaskProcesses(folder) as dask:
        dask.add()
        dask.wait()
        with cluster(dask.address) as executor:
            sweep("flagellum", {**_FLAGELLA, "E": _FLAGELLA["E"][:1]}, executor=executor)
            there = []
            found = _timed(dask, lambda: there.append(sweep("flagellum", _FLAGELLA, executor=executor)))
    same = there[0].drop_attrs().identical(here.drop_attrs())
    points = here["status"].size
    print(f"  {points} flagella, a call each: here {alone:.2f} s, one worker {found}")
    each = 1e3 * (found.wall - alone) / points
    asked = 1e3 * (found.spent["scheduler"] + found.spent["client"]) / points
    print(
        f"    {each:.2f} ms a point longer (aim {1e3 * _MOST:.0f} ms), of scheduler and client {asked:.2f} ms",
        flush=True,
    )
    print(f"    the numbers of one process, bit for bit: {'yes' if same else 'NO'}", flush=True)


def _monte_carlo(folder: Path) -> None:
    """Perturbed fishtails, 10 000 samples each, in this process and by two workers."""
    loops, reference = control_study.plants(256), next(iter(control_study.REFERENCES.values()))
    laws = control_study.controllers(control_study.kept(), control_study.known_model())
    with DaskProcesses(folder) as dask:
        dask.add(2)
        dask.wait()
        with cluster(dask.address) as executor:
            for name in ("pid", "mpc"):
                run = partial(run_batch, loops, laws[name].planned(reference, control_study.DT), reference)
                here, alone = _median(run)
                there, spread = _median(partial(run, executor=executor))
                same = all(np.array_equal(*both) for both in zip(here, there, strict=True))
                print(
                    f"  256 loops, {name}: here {alone:.2f} s, two workers {spread:.2f} s, "
                    f"bit for bit: {'yes' if same else 'NO'}",
                    flush=True,
                )


def _median(run: Callable[[], Any]) -> tuple[Any, float]:
    """What a run gives, and its median wall time [s] after a first one that loads programs."""
    found, walls = run(), list[float]()
    for _ in range(_AGAIN):
        began = time.perf_counter()
        jax.block_until_ready(run())
        walls.append(time.perf_counter() - began)
    return found, sorted(walls)[_AGAIN // 2]


class _Times(NamedTuple):
    """Wall time [s], and processor time of each process [s]."""

    wall: float
    spent: dict[str, float]

    def __str__(self) -> str:
        return f"{self.wall:.2f} s, processor {', '.join(f'{name} {x:.1f} s' for name, x in self.spent.items())}"


def _timed(dask: DaskProcesses, run: Callable[[], object]) -> _Times:
    assert dask.scheduler is not None
    processes = {f"worker {k}": one.pid for k, one in enumerate(dask.workers, start=1)}
    processes |= {"scheduler": dask.scheduler.pid, "client": os.getpid()}
    before, began = {name: _spent(pid) for name, pid in processes.items()}, time.perf_counter()
    run()
    wall = time.perf_counter() - began
    return _Times(wall, {name: _spent(pid) - before[name] for name, pid in processes.items()})


def _spent(pid: int) -> float:
    """Processor time of a process [s]; Linux only."""
    words = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")


def _kills(folder: Path) -> None:
    """Workers are killed ten times, the scheduler and the client once; the same command goes on."""
    argv = [sys.executable, "-m", "nectosome", "sweep", "paddle", *_GRID]
    subprocess.run([*argv, "--save", str(folder / "whole.nc")], check=True, stdout=subprocess.DEVNULL)
    rng, began = random.Random(1), time.perf_counter()
    save, parts = folder / "grid.nc", folder / "grid.parts"
    victims = ["worker"] * _KILLS
    victims.insert(rng.randrange(2, 6), "scheduler")
    victims.insert(rng.randrange(6, 10), "client")
    with DaskProcesses(folder) as dask:
        argv += ["--save", str(save), "--cluster", dask.address]
        dask.add(2)
        client = subprocess.Popen(argv, stdout=subprocess.DEVNULL)
        for victim in victims:
            before = len(entries(parts))
            while len(entries(parts)) <= before:  # it computes
                if client.poll() is not None:
                    sys.exit(f"the command ended with {client.returncode} before all were killed")
                time.sleep(0.01)
            time.sleep(rng.uniform(0.0, 0.5))
            if victim == "worker":
                kill(dask.workers.pop(rng.randrange(len(dask.workers))))
                dask.add()
                continue
            if victim == "client":
                kill(client)
            else:
                dask.restart()
            print(f"  {victim} killed: exit code {client.wait(120)}, {len(entries(parts))} parts are kept", flush=True)
            if victim == "scheduler":
                dask.add(2)
            client = subprocess.Popen(argv, stdout=subprocess.DEVNULL)
        code = client.wait(300)
    same = load_dataset(save).drop_attrs().identical(load_dataset(folder / "whole.nc").drop_attrs())
    print(f"  after {_KILLS} workers, scheduler and client: exit code {code}, {time.perf_counter() - began:.0f} s")
    print(f"    the numbers of one process, bit for bit: {'yes' if same else 'NO'}", flush=True)


if __name__ == "__main__":
    main()
