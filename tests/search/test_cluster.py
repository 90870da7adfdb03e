"""A real scheduler and real workers as processes: the numbers of one process, bit for bit, whoever is killed."""

import os
import subprocess
import sys
import time
import warnings
from concurrent.futures import Executor, ThreadPoolExecutor

import pytest
from benchmarks.dask_processes import DaskProcesses, kill
from tests.small_robots import DRIVEN

from nectosome.cli import main
from nectosome.description import dump_robot, parse_robot, with_values
from nectosome.designs.sweep import sweep
from nectosome.io import load_dataset
from nectosome.io.file_system import entries
from nectosome.search import Gradient, multistart
from nectosome.search.executors.cluster import cluster
from nectosome.search.executors.spread import LostError, result, spread, submit, versions
from nectosome.units import InputError

from .tasks import Known
from .test_multistart import same

pytest.importorskip("distributed")

ARM = with_values(parse_robot(DRIVEN), {"I": 1e-3, "k": 0.06, "c": 0.01, "M": 0.02, "f": 2.0})
GRID = {"M": [0.01, 0.02, 0.03], "f": [1.0 + 0.05 * k for k in range(21)]}


@pytest.fixture(scope="module")
def dask(tmp_path_factory):
    """A scheduler whose workers come later."""
    with DaskProcesses(tmp_path_factory.mktemp("dask")) as processes:
        yield processes


def test_a_scheduler_without_workers_is_told(dask):
    said = f"no worker has joined {dask.address} within 0.1 s. Start some: "
    with pytest.raises(InputError, match=said), cluster(dask.address, wait=0.1):
        pass


@pytest.mark.parametrize(
    ("address", "said"),
    [
        ("tcp://127.0.0.1:1", "no scheduler answers at tcp://127.0.0.1:1"),
        ("carrier://pigeon", "unknown address scheme 'carrier'"),
        ("nothing.json", '"nothing.json" is no address of a scheduler'),
        (__file__, "is no scheduler file"),
    ],
)
def test_wrong_addresses_are_told(address, said, monkeypatch):
    monkeypatch.setattr(sys.modules[cluster.__module__], "_PATIENCE", 1.0)
    with pytest.raises(InputError, match=said), cluster(address):
        pass


def test_a_cluster_whose_workers_are_gone_is_told_and_goes_on_with_new_ones(dask, monkeypatch):
    monkeypatch.setattr(sys.modules[cluster.__module__], "_ALONE", 0.2)
    dask.add()
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        with cluster(dask.address, wait=60) as executor:
            kill(dask.workers.pop())
            call, until = submit(executor, divmod, 9, 4), time.monotonic() + 60
            while not told and time.monotonic() < until:
                time.sleep(0.05)
            assert f"no worker is left at {dask.address}: waiting for one. Start some: " in str(told[0].message)
            dask.add()
            assert result(call) == (2, 1)
    assert len(told) == 1


def test_workers_compute_the_numbers_of_one_process(dask, tmp_path, monkeypatch, recwarn):
    dask.add(2 - len(dask.workers))
    here = sweep(ARM, GRID, workers=1)
    with cluster(dask.address, wait=60) as executor:
        there = sweep(ARM, GRID, executor=executor, folder=tmp_path / "parts")
    assert there.drop_attrs().identical(here.drop_attrs())
    assert len(entries(tmp_path / "parts", "*.npz")) == 3
    assert [str(one.message) for one in recwarn if "worker" in str(one.message)] == []
    ours, other = versions()["jax"], versions() | {"jax": "0.0.1"}
    monkeypatch.setattr("nectosome.search.executors.spread.versions", lambda: other)
    said = f"the worker tcp://.* has jax {ours}, and 0.0.1 is here"
    with pytest.raises(InputError, match=said), cluster(dask.address):
        pass


def test_workers_evaluate_for_the_starts_of_a_search(dask, tmp_path):
    """A disc with a sharp valley; journals are written here."""
    task, gradient = Known("disc"), Gradient()
    here = multistart(task, gradient, 3, seed=2, executor=ThreadPoolExecutor(1))
    with cluster(dask.address, wait=60) as executor:
        assert same(here, multistart(task, gradient, 3, seed=2, executor=executor, folder=tmp_path))
    assert same(here, multistart(task, gradient, 3, seed=2, executor=Executor(), folder=tmp_path))  # nothing is left


def test_many_quick_calls_bring_their_own_results_errors_and_an_early_end(dask):
    with cluster(dask.address, wait=60) as executor:
        found = dict(spread(executor, ((k, divmod, (k, 7)) for k in range(500)), lambda: True))
        assert found == {k: divmod(k, 7) for k in range(500)}
        with pytest.raises(ZeroDivisionError):
            list(spread(executor, ((k, divmod, (1, k)) for k in range(200, -1, -1)), lambda: True))
        seen = []
        for key, _ in spread(executor, ((k, time.sleep, (0.05,)) for k in range(500)), lambda: not seen):
            seen.append(key)
        assert len(seen) < 100
        assert result(submit(executor, divmod, 9, 4)) == (2, 1)  # and nothing stands before a later call
    with pytest.raises(LostError, match="executor ended"):
        submit(executor, divmod, 9, 4)


def test_what_a_worker_cannot_load_is_told(dask, tmp_path, monkeypatch):
    """As one of another version, that joined after the versions were compared."""
    (tmp_path / "newer.py").write_text("def f(): pass\n")
    monkeypatch.syspath_prepend(tmp_path)
    dask.add(1 - len(dask.workers))
    with cluster(dask.address, wait=60) as executor:
        call = submit(executor, __import__("newer").f)
        with pytest.raises(InputError, match=r"the worker on .* has nectosome .* cannot load .*'newer'\. Install"):
            result(call)


@pytest.mark.slow
def test_workers_with_many_threads_are_warned_of(tmp_path):
    with DaskProcesses(tmp_path, pinned=False) as dask:
        dask.add(1, threads=3)
        with pytest.warns(UserWarning) as told, cluster(dask.address, wait=60):
            pass
    words = [str(one.message) for one in told]
    assert any("1 of 1 worker compute with 3 threads each" in one for one in words)
    assert any("1 of 1 worker run without NPROC=1" in one for one in words)


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="processes are killed the POSIX way")
@pytest.mark.parametrize("victim", ["worker", "scheduler", "client"])
def test_whoever_is_killed_the_numbers_stay(tmp_path, monkeypatch, victim):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "arm.yaml").write_text(dump_robot(ARM))
    argv = ["sweep", "arm.yaml", "--over", "M=10..30:0.5mN m", "--over", "f=1..3:0.05Hz"]
    assert main([*argv, "--save", "whole.nc"]) == 0
    with DaskProcesses(tmp_path) as dask:
        dask.add(2)
        there = [*argv, "--save", "grid.nc", "--cluster", dask.address]
        client = begin(there)
        kept = wait_for_parts(tmp_path / "grid.parts", client)
        kill({"worker": dask.workers[0], "scheduler": dask.scheduler, "client": client}[victim])
        if victim == "worker":
            dask.add()
        if victim == "scheduler":
            assert client.wait(60) == 1
            said = "connection to the scheduler was lost. The same command goes on from what is in grid.parts"
            told = client.stderr.read().decode().splitlines()
            assert said in told[-1]
            assert [line for line in told if "sweep of arm.yaml" not in line] == told[-1:]  # but for progress
            dask.begin()
            dask.add(2)  # those before end with their scheduler
        if victim != "worker":
            assert len(entries(tmp_path / "grid.parts", "*.npz")) >= kept
            client = begin(there)
        assert client.wait(120) == 0, client.stderr.read().decode()
    whole, found = load_dataset("whole.nc"), load_dataset("grid.nc")
    assert found.drop_attrs().identical(whole.drop_attrs())


def begin(argv: list[str]) -> subprocess.Popen:
    command = [sys.executable, "-m", "nectosome", *argv]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)


def wait_for_parts(folder, process) -> int:
    """How many parts lie in the folder, some by then."""
    until = time.monotonic() + 120
    while len(entries(folder, "*.npz")) < 3 and time.monotonic() < until:
        assert process.poll() is None, process.stderr.read().decode()
        time.sleep(0.005)
    return len(entries(folder, "*.npz"))
