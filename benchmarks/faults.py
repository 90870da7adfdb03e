"""Faults of rigs at random times, 200 of each class: `python -m benchmarks.faults [--class NAME] [--count N]`.

A run ends safely where the last call to its device is a vent, and no command left its range or rate before; or, where
no vent reaches the device any more, the log says to take its power out. Of a process that is killed only the log is
judged. The log must give that fault as its reason. Exit code 1 where a run ended otherwise.
"""

import argparse
import random
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from tests.rigs import test_device_faults as devices
from tests.rigs.benches import powered
from tests.rigs.faulty import RIGS
from tests.rigs.injected import Courses, Fault, slept
from tests.rigs.test_faults import SAMPLES, Stuck
from tests.rigs.test_killed_run import Process
from tests.rigs.test_ways_out import ENDS

from nectosome.io import load_dataset
from nectosome.rigs import recovered

_AT_ONCE = 6  # classes: most of their time is spent waiting
_DT = RIGS["simulated"].dt
_SHUT = "its valve is shut"


class Outcome(NamedTuple):
    safe: bool
    told: bool
    lost: float  # of what was measured, not in the log [s]


class Class(NamedTuple):
    about: str
    attempt: Callable[[random.Random, Path, pytest.MonkeyPatch], Outcome]


def during(name: str) -> Class:
    """A fault at a random sample of a simulated rig, in virtual time."""

    def attempt(rng: random.Random, folder: Path, patch: pytest.MonkeyPatch) -> Outcome:
        fault, position = SAMPLES[name], rng.randrange(RIGS["simulated"].reference.size)
        if name == "sensor frozen":
            fault = Fault("measure", Stuck(), fault.ends, fault.words, True)
        hooks = {fault.method: fault.hook(max(2 * position, 1) if fault.method == "now" else position)}
        if fault.method in ("disk", "journal"):
            hooks["wait"] = lambda n, call, *a: slept(call, *a)
        ended, rig, reason = Courses(folder, patch)("simulated", hooks)
        status = ended.status if hasattr(ended, "status") else type(ended)
        words = fault.words, *([_SHUT] if name == "valve stuck" else [])  # whichever guard is first
        told = status == "finished" or (status == fault.ends and any(one in reason for one in words))
        return Outcome(True, told, _lost(rig, folder))

    return Class(f"{name}, during the samples", attempt)


def around(name: str) -> Class:
    """A fault before the first sample, or after the last, on top of one at a random sample."""
    method, then, lasting, expected = ENDS[name]

    def attempt(rng: random.Random, folder: Path, patch: pytest.MonkeyPatch) -> Outcome:
        hooks = {method: Fault(method, then, "", "", lasting).hook(0)}
        if method != "open":
            position = rng.randrange(RIGS["simulated"].reference.size)
            hooks["measure"] = Fault("measure", lambda *_: (float("nan"),), "").hook(position)
        ended, rig, reason = Courses(folder, patch)("simulated", hooks)
        status = ended.status if hasattr(ended, "status") else type(ended)
        known = isinstance(expected, str)
        told = (status == (expected if method == "open" else "aborted")) if known else status is expected
        by_hand = "TAKE ITS POWER OUT BY HAND" in reason
        return Outcome(by_hand == lasting or method != "vent", told and bool(reason), _lost(rig, folder))

    return Class(f"{name}, on the way out", attempt)


def of_device(kind: str, name: str) -> Class:
    """A fault of a device behind its driver, at a random sample, in real time."""
    case = devices.CASES[kind][name]

    def attempt(rng: random.Random, folder: Path, patch: pytest.MonkeyPatch) -> Outcome:
        patch.setattr("dynamixel_sdk.port_handler.LATENCY_TIMER", 250)  # a machine that others use
        sample = rng.randrange(8, 22)  # while the command moves
        with devices.KINDS[kind].device() as device:
            setup = devices.KINDS[kind].setup(device, case.watchdog)
            hooks = {"measure": devices.at(sample, device, case)}
            ended, rig, reason = Courses(folder, patch)(setup, hooks)
            safe = not powered(device) or devices.BY_HAND in reason
        return Outcome(safe, ended.status == case.status and case.words in reason, _lost(rig, folder, devices.DT))

    return Class(f"{kind}: {name}", attempt)


def killed(rng: random.Random, folder: Path, _: pytest.MonkeyPatch) -> Outcome:
    """A process that is killed while it runs, in real time."""
    run = Process(folder)
    time.sleep(rng.uniform(0.0, 1.0))
    run.process.kill()
    run.process.wait()
    left = recovered(folder / "run.csv")
    writes = [event for event in run.events() if event.what == "write"]
    lost = max(len(writes) - left.sizes["time"], 0) * 5e-3
    return Outcome(True, left.attrs["status"] == "killed", lost)


def _lost(rig: Any, folder: Path, dt: float = _DT) -> float:
    log = folder / "run.nc"
    data = load_dataset(log) if log.exists() else recovered(folder / "run.csv")
    return max(rig.calls.get("measure", 0) - 1 - data.sizes["time"], 0) * dt  # one more is being taken


CLASSES = {
    **{f"samples: {name}": during(name) for name in SAMPLES},
    **{f"ends: {name}": around(name) for name in ENDS},
    **{f"{kind}: {name}": of_device(kind, name) for kind, cases in devices.CASES.items() for name in cases},
    "killed": Class("process killed (kill -9)", killed),
}


def tried(name: str, count: int, seed: int) -> list[Outcome]:
    """Each fault of a class; one that breaks a promise is not safe, and its traceback is shown."""
    rng, outcomes = random.Random(f"{name} {seed}"), list[Outcome]()
    for k in range(count):
        with tempfile.TemporaryDirectory() as folder, pytest.MonkeyPatch.context() as patch:
            try:
                outcomes.append(CLASSES[name].attempt(rng, Path(folder), patch))
            except (AssertionError, OSError) as error:
                print(f"{name}, fault {k}: {type(error).__name__} {error}", file=sys.stderr)
                outcomes.append(Outcome(False, False, 0.0))
    return outcomes


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.faults")
    parser.add_argument("--class", dest="name", choices=CLASSES, help="one class of faults only")
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    if given.name:
        outcomes = tried(given.name, given.count, given.seed)
        safe, told = (sum(column) for column in list(zip(*outcomes, strict=True))[:2])
        lost = max(outcome.lost for outcome in outcomes)
        print(f"| {CLASSES[given.name].about} | {given.count} | {safe} | {told} | {1e3 * lost:.0f} |")
        return int(min(safe, told) < given.count)

    def alone(name: str) -> tuple[str, int]:
        options = ["--class", name, "--count", str(given.count), "--seed", str(given.seed)]
        done = subprocess.run([sys.executable, "-m", "benchmarks.faults", *options], capture_output=True, text=True)
        print(done.stderr, end="", file=sys.stderr, flush=True)
        print(done.stdout, end="", flush=True)
        return done.stdout, done.returncode

    with ThreadPoolExecutor(_AT_ONCE) as pool:
        found = [*pool.map(alone, CLASSES)]
    heads = "fault", "runs", "ended safely", "reason in the log", "most that the log lost (ms)"
    print(f"\nseed {given.seed}\n\n| {' | '.join(heads)} |\n|{'---|' * len(heads)}")
    print("".join(line for line, _ in found), end="")
    return int(any(code for _, code in found))


if __name__ == "__main__":
    sys.exit(main())
