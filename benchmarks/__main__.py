"""Run benchmarks by name, or all, each in a process of its own with an empty compilation cache."""

import os
import platform
import subprocess
import sys
import tempfile
from importlib.metadata import version

# by name: whether it is kept to one core
BENCHMARKS = {
    "engine": True,
    "steady": True,
    "search": False,
    "cantilever": True,
    "paddle": True,
    "batches": False,
    "crawl": True,
    "mission": True,
    "command_line": False,
    "reading": True,
    "crawl_search": False,
    "hysteresis": False,
    "control": False,
    "track": True,
}


def main(names: list[str]) -> None:
    unknown = [name for name in names if name not in BENCHMARKS]
    if unknown:
        sys.exit(f"There is no benchmark {unknown[0]}. There are: {', '.join(BENCHMARKS)}.")
    processor = platform.processor() or platform.machine()
    print(f"{processor}, {os.cpu_count()} cores, Python {platform.python_version()}, ", end="")
    print(f"nectosome {version('nectosome')}, jax {version('jax')}, float64")
    print("times are processor times where it says one core, else wall times", flush=True)
    for name in names or BENCHMARKS:
        with tempfile.TemporaryDirectory() as cache:
            command = [sys.executable, "-m", f"benchmarks.{name}"]
            kept = _keep_to_one_core if BENCHMARKS[name] else None
            subprocess.run(command, env={**os.environ, "NECTOSOME_CACHE": cache}, check=True, preexec_fn=kept)


def _keep_to_one_core() -> None:
    """Linux only; elsewhere timings are those of all cores."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})


if __name__ == "__main__":
    main(sys.argv[1:])
