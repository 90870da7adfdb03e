"""An experiment whose process is killed, or told to end."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from nectosome.io import load_dataset
from nectosome.rigs import recovered

CODE = """
from pathlib import Path
from nectosome.rigs import Experiment
from rigs.faulty import LIMITS, Faulty, changed, pi, simulated, sine, tracked
limits = changed(LIMITS, overruns_in_row=1000, overruns_share=1.0, error=0.02)
rig = Faulty(simulated(pace="real"), file=Path({seen!r}))
run = Experiment(*tracked(rig, pi(), sine(4000, 5e-3), 5e-3), limits, 5e-3).run({log!r})
print(run.status, run.reason, flush=True)
"""


class Line(NamedTuple):
    what: str
    value: float
    time: float


class Process:
    """An experiment of 20 s in a process of its own; its device writes what it sees to a file."""

    def __init__(self, folder: Path):
        self.seen, self.log = folder / "seen", folder / "run.nc"
        code = CODE.format(seen=str(self.seen), log=str(self.log))
        paths = os.pathsep.join([str(Path(__file__).parents[1]), os.environ.get("PYTHONPATH", "")])
        self.process = subprocess.Popen(
            [sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, env={**os.environ, "PYTHONPATH": paths}
        )
        until = time.monotonic() + 60
        while len(self.events()) < 250 and self.process.poll() is None and time.monotonic() < until:
            time.sleep(0.02)

    def events(self) -> list[Line]:
        lines = self.seen.read_text().splitlines() if self.seen.exists() else []
        words = [line.split() for line in lines if line.count(" ") == 2]
        return [Line(what, float(value), float(when)) for what, value, when in words]


@pytest.mark.skipif(os.name != "posix", reason="processes are killed the POSIX way")
def test_a_run_that_is_killed_loses_less_than_a_second(tmp_path):
    """SIGKILL cannot be caught: the device keeps its last command. What was measured is in the journal."""
    run = Process(tmp_path)
    run.process.kill()
    run.process.wait()
    events = run.events()
    assert events[-1].what == "write"
    assert not run.log.exists()
    left = recovered(tmp_path / "run.csv")
    writes = [event for event in events if event.what == "write"]
    lost = len(writes) - left.sizes["time"]
    print(f"{lost} of {len(writes)} samples lost")
    assert lost <= 200
    assert np.allclose(
        left["pressure.command"], [event.value for event in writes[: left.sizes["time"]]], rtol=0, atol=0
    )
    assert left.attrs["status"] == "killed"


@pytest.mark.skipif(os.name != "posix", reason="processes are ended the POSIX way")
def test_a_run_that_is_told_to_end_vents_and_says_so(tmp_path):
    """By another process, at any moment; it does not die before it is safe."""
    run = Process(tmp_path)
    run.process.send_signal(signal.SIGTERM)
    told, _ = run.process.communicate(timeout=30)
    assert run.process.returncode == 0
    assert told == "interrupted it was interrupted by SIGTERM.\n"
    events = run.events()
    assert [event.what for event in events[-3:]] == ["write", "vent", "close"]
    assert events[-3].value == 0.0
    logged = load_dataset(run.log)
    assert logged.attrs["status"] == "interrupted"
    assert "SIGTERM" in logged.attrs["status_reason"]
    writes = sum(event.what == "write" for event in events)
    assert logged.sizes["time"] <= writes <= logged.sizes["time"] + 0.15 / 5e-3 + 2  # and the ramp
