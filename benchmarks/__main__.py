"""Run benchmarks by name, or all, each in a process of its own with an empty compilation cache.

What each prints is kept in out/benchmarks.
"""

import os
import platform
import subprocess
import sys
import tempfile
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

PRINTED = Path("out") / "benchmarks"

# by name: whether it is kept to one core
BENCHMARKS = {
    "engine": True,
    "steady": True,
    "search": False,
    "cantilever": True,
    "paddle": True,
    "servo": True,
    "batches": False,
    "crawl": True,
    "mission": True,
    "command_line": False,
    "compile": False,
    "cycles": True,
    "coverage": False,
    "evaluations": True,
    "environments": True,
    "identify": False,
    "reading": True,
    "meshes": True,
    "crawl_search": False,
    "hysteresis": False,
    "control": False,
    "controllers": False,
    "track": True,
    "studio": False,
    "tabs": False,
    "edges": False,
    "flapping": True,
    "attack": False,
    "faults": False,
    "panels": True,
    "devices": False,
    "cluster": False,
}


def main(names: list[str]) -> None:
    unknown = [name for name in names if name not in BENCHMARKS]
    if unknown:
        sys.exit(f"There is no benchmark {unknown[0]}. There are: {', '.join(BENCHMARKS)}.")
    processor = platform.processor() or platform.machine()
    versions = f"Python {platform.python_version()}, nectosome {version('nectosome')}, jax {version('jax')}, float64"
    machine = f"{processor}, {os.cpu_count()} cores, {versions}"
    print(machine)
    print("times are processor times where it says one core, else wall times", flush=True)
    for name in names or BENCHMARKS:
        text = f"{datetime.now(UTC):%Y-%m-%d}, {machine}\n{_run(name)}"
        PRINTED.mkdir(parents=True, exist_ok=True)
        (PRINTED / f"{name}.txt").write_text(text, encoding="utf-8")


def _run(name: str) -> str:
    """What a benchmark prints, shown as it comes."""
    lines = []
    with tempfile.TemporaryDirectory() as cache:
        command = [sys.executable, "-um", f"benchmarks.{name}"]
        kept = _keep_to_one_core if BENCHMARKS[name] else None
        environment = {**os.environ, "NECTOSOME_CACHE": cache}
        with subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True, preexec_fn=kept) as process:
            for line in process.stdout or ():
                print(line, end="", flush=True)
                lines.append(line)
        if process.returncode:
            sys.exit(f"The benchmark {name} ended with {process.returncode}.")
    return "".join(lines)


def _keep_to_one_core() -> None:
    """Linux only; elsewhere timings are those of all cores."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})


if __name__ == "__main__":
    main(sys.argv[1:])
