"""The studio's simulated rig, whose first device fails when it is told to, and writes down what it sees."""

import os
import signal
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from tests.rigs.faulty import Faulty, Hook

from nectosome.rigs import Devices, RigError
from nectosome.rigs.rig_file import RigFile, load_rig
from nectosome.studio.tasks.rig_request import SIMULATED_FILE

FAILS = "the cable was pulled"


def pulled(n: int, call: Callable[..., Any]) -> Any:
    """From its 20th measurement on there is no answer."""
    if n >= 20:
        raise RigError(f"tail: {FAILS}.")
    return call()


def killed(n: int, call: Callable[..., Any]) -> Any:
    """Its driver takes the whole process along."""
    if n >= 20:
        time.sleep(0.5)  # the log's thread writes what there is
        os.kill(os.getpid(), signal.SIGKILL)
    return call()


def absent(*_: Any) -> None:
    raise RigError("tail: there is no such device.")


FAULTS: dict[str, dict[str, Hook]] = {
    "": {},
    "pulled": {"measure": pulled},
    "killed": {"measure": killed},
    "absent": {"open": absent},
}


def watched_rig(seen: Path, fault: str, path: Path = SIMULATED_FILE) -> RigFile:
    """As `load_rig`, with the first device watched: what it sees goes to a file."""
    file = load_rig(path)
    devices = dict(file.rig.devices)
    first = next(iter(devices))
    devices[first] = Faulty(devices[first], FAULTS[fault], seen)
    devices[first].commanded = fault != "absent"
    patient = replace(file.limits, overruns_in_row=1_000_000, overruns_share=1.0)  # tests share their machine
    return replace(file, rig=Devices(devices), limits=patient)


def events(seen: Path) -> list[str]:
    """What the device has seen so far, without the process that it was in."""
    return [line.split()[0] for line in seen.read_text().splitlines()] if seen.exists() else []


def commands(seen: Path) -> list[float]:
    """Commands that the device has seen."""
    return [float(line.split()[1]) for line in seen.read_text().splitlines() if line.startswith("write")]
