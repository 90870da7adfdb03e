"""First answers of the command line: with an empty compilation cache, and again."""

import os
import statistics
import subprocess
import sys
import tempfile
import time

_FLAGELLUM = ["simulate", "flagellum", "--set", "omega=14.4rad/s", "--set", "E=7.4MPa", "--time", "2.5s"]
_COMMANDS = {
    "simulate": _FLAGELLUM,
    "simulate --save": [*_FLAGELLUM, "--save", "run.nc"],
    "show": ["show", "flagellum"],
    "--help": ["--help"],
}
_REPEATS = 7


def main() -> None:
    """Time from the start of the process to its first line of results, and to its end."""
    print(f"\ncommand line, first answer and whole process (warm: medians of {_REPEATS})")
    for name, words in _COMMANDS.items():
        with tempfile.TemporaryDirectory() as folder:
            cold = _run(words, folder)
            warm = [
                statistics.median(each) for each in zip(*(_run(words, folder) for _ in range(_REPEATS)), strict=True)
            ]
        times = [f"{label} {first:5.2f} s, {end:5.2f} s" for label, (first, end) in (("cold", cold), ("warm", warm))]
        print(f"  nectosome {name:16s} {'   '.join(times)}")


def _run(words: list[str], folder: str) -> tuple[float, float]:
    began = time.perf_counter()
    environment = {**os.environ, "NECTOSOME_CACHE": folder}
    command = [sys.executable, "-m", "nectosome", *words]
    with subprocess.Popen(
        command, env=environment, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
    ) as process:
        assert process.stdout is not None
        process.stdout.readline()
        first = time.perf_counter() - began
        process.stdout.read()
    if process.returncode:
        raise SystemExit(f"nectosome {' '.join(words)} ended with exit code {process.returncode}.")
    return first, time.perf_counter() - began


if __name__ == "__main__":
    main()
