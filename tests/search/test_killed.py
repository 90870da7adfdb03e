"""A run that is killed again and again ends as if nothing had happened."""

import os
import random
import shutil
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from nectosome.search import Pattern, multistart

from .tasks import Known
from .test_multistart import same

STARTS, SEED, WORKERS = 8, 11, 2
OPTIMISER = Pattern(evaluations=1000)
CODE = """
from nectosome.search import Pattern, multistart
from search.tasks import Known
multistart(Known("hs43", pause={pause}, log={log!r}), Pattern(evaluations=1000), {starts}, {seed}, folder={folder!r},
           workers={workers}, executor=executor)
"""


def begin(folder: Path, log: Path, pause: float, ready: str = "executor = None") -> subprocess.Popen:
    """Begin the run; what its processes write to stderr goes into a file beside the log."""
    code = CODE.format(pause=pause, log=str(log), starts=STARTS, seed=SEED, folder=str(folder), workers=WORKERS)
    paths = os.pathsep.join([str(Path(__file__).parents[1]), os.environ.get("PYTHONPATH", "")])
    with log.with_name("stderr").open("ab") as stderr:
        argv = [sys.executable, "-c", ready + code]
        return subprocess.Popen(argv, start_new_session=True, env={**os.environ, "PYTHONPATH": paths}, stderr=stderr)


@pytest.fixture(scope="module")
def whole():
    return multistart(Known("hs43"), OPTIMISER, STARTS, SEED, executor=ThreadPoolExecutor(1))


def computed(log: Path) -> int:
    return sum(file.stat().st_size for file in log.iterdir())


def nobody_left(group: int, patience: float) -> bool:
    """Whether no process of the group is alive; dead ones that nobody has asked after (Z) do not count."""
    until = time.monotonic() + patience
    while time.monotonic() < until:
        table = subprocess.run(["ps", "-eo", "pgid=,stat="], capture_output=True, text=True, check=True).stdout
        lines = [line.split() for line in table.splitlines()]
        if not any(int(pgid) == group and not state.startswith("Z") for pgid, state in lines):
            return True
        time.sleep(0.02)
    return False


@pytest.mark.skipif(shutil.which("ps") is None, reason="ps tells who is alive")
@pytest.mark.skipif(os.name != "posix", reason="processes are killed the POSIX way")
@pytest.mark.parametrize("kills", [2, pytest.param(20, marks=pytest.mark.slow)])
def test_nothing_is_lost_when_the_process_is_killed(tmp_path, whole, kills):
    log, folder = tmp_path / "log", tmp_path / "run"
    log.mkdir()
    rng = random.Random(kills)
    for kill in range(kills):
        before = computed(log)
        process = begin(folder, log, pause=2e-3)
        while kill % 4 and computed(log) == before and process.poll() is None:
            time.sleep(0.01)
        time.sleep(rng.uniform(0.0, 0.4 if kill % 4 else 1.0))  # every fourth strikes while the workers start
        assert process.poll() is None
        process.send_signal(signal.SIGKILL)
        process.wait()
        assert nobody_left(process.pid, 5.0)  # killing the one ends its workers
    assert 50 < computed(log) < whole.evaluations
    assert "resource_tracker" not in log.with_name("stderr").read_text()
    last = begin(folder, log, pause=0.0)
    assert last.wait(300) == 0
    assert nobody_left(last.pid, 5.0)
    again = multistart(Known("hs43"), OPTIMISER, STARTS, SEED, folder=folder, executor=ThreadPoolExecutor(1))
    assert same(whole, again)
    print(f"{whole.evaluations} evaluations, {computed(log) - whole.evaluations} of them twice, {kills} kills")
    assert whole.evaluations <= computed(log) <= whole.evaluations + WORKERS * kills


@pytest.mark.skipif(os.name != "posix", reason="processes are interrupted the POSIX way")
@pytest.mark.parametrize("executor", ["None", pytest.param("ThreadPoolExecutor(1)", marks=pytest.mark.slow)])
def test_ctrl_c_ends_the_run_and_keeps_all(tmp_path, whole, executor):
    """It reaches workers too, and pattern search has a handler of its own: neither may end a start early."""
    log, folder = tmp_path / "log", tmp_path / "run"
    log.mkdir()
    ready = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
    ready += f"from concurrent.futures import ThreadPoolExecutor\nexecutor = {executor}\n"
    process = begin(folder, log, 2e-3, ready)
    while computed(log) < 40 and process.poll() is None:
        time.sleep(0.01)
    os.killpg(process.pid, signal.SIGINT)
    assert process.wait(10) != 0
    assert nobody_left(process.pid, 5.0)
    again = multistart(Known("hs43"), OPTIMISER, STARTS, SEED, folder=folder, executor=ThreadPoolExecutor(1))
    assert same(whole, again)
