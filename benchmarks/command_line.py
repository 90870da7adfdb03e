"""First answers of the command line: with an empty compilation cache, and again."""

import os
import statistics
import subprocess
import sys
import tempfile
import time

_COMMANDS = {
    "simulate": ["simulate", "flagellum", "--set", "omega=14.4rad/s", "--set", "E=7.4MPa", "--time", "2.5s"],
    "show": ["show", "flagellum"],
    "--help": ["--help"],
}


def main() -> None:
    print("\ncommand line, whole process (warm: median of 5)")
    for name, words in _COMMANDS.items():
        with tempfile.TemporaryDirectory() as cache:
            cold = _run(words, cache)
            warm = statistics.median(_run(words, cache) for _ in range(5))
        print(f"  nectosome {name:10s} cold {cold:5.1f} s   warm {warm:5.2f} s")


def _run(words: list[str], cache: str) -> float:
    began = time.perf_counter()
    environment = {**os.environ, "NECTOSOME_CACHE": cache}
    subprocess.run([sys.executable, "-m", "nectosome", *words], env=environment, check=True, capture_output=True)
    return time.perf_counter() - began


if __name__ == "__main__":
    main()
