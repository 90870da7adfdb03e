"""What first answers cost: whole commands with empty and with full caches, beside an earlier commit in the same run.

Processor seconds are those of the command and of all its processes, memory that of its largest process. The programs
that it compiles are listed with their operations (StableHLO) and the seconds that tracing, lowering, compiling and
loading take; a program is loaded where the cache has it.
"""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

BEFORE = "ba2af50"  # the earlier commit
_HERE = Path(__file__).parents[1]
_MANTA = str(Path(__file__).with_name("manta.yaml"))
_COMMANDS = {
    "simulate flagellum": ["simulate", "flagellum", "--time", "2.5s"],
    "steady flagellum": ["steady", "flagellum"],
    "simulate turtle": ["simulate", "turtle", "--time", "2s"],
    "periodic turtle": ["periodic", "turtle"],
    "periodic krill": ["periodic", "krill"],
    # a free robot in space with two soft fins; the range is so narrow that it takes a few evaluations
    "design manta": ["design", _MANTA, "--vary", "f=0.7999Hz..0.8Hz", "--forward", "x", "--starts", "1"],
}
_LONGEST = 12  # programs of a command that are listed


class Cost(NamedTuple):
    """What one run of a command took."""

    seconds: float  # of processors
    memory: float  # [GB]
    stray: int  # lines on stderr
    programs: list[dict[str, float | str]]


def main(names: list[str]) -> None:
    """Run all commands, or those named."""
    if unknown := [name for name in names if name not in _COMMANDS]:
        sys.exit(f"There is no command {unknown[0]}. There are: {', '.join(_COMMANDS)}.")
    with tempfile.TemporaryDirectory() as folder:
        before = earlier(Path(folder) / "before")
        print(f"\nfirst answers, processor seconds beside those of {BEFORE}" if before else "\nfirst answers")
        for name in names or _COMMANDS:
            rows = {}
            for tree, label in ((_HERE, "now"), *([(before, BEFORE)] if before else [])):
                with tempfile.TemporaryDirectory() as cache:
                    rows[label] = [run(tree, _COMMANDS[name], Path(cache)) for _ in range(2)]
            print(f"\n{name}", flush=True)
            for k, state in enumerate(("cold", "warm")):
                now = rows["now"][k]
                line = f"{state}: {now.seconds:.1f} s"
                if before:
                    line += f", {now.seconds / rows[BEFORE][k].seconds:.2f} of {rows[BEFORE][k].seconds:.1f} s"
                print(f"  {line}; {now.memory:.2f} GB; stderr {now.stray} lines; {len(now.programs)} programs")
            _list(*(cost.programs for cost in rows["now"]))


def earlier(folder: Path, commit: str = BEFORE) -> Path | None:
    """An earlier commit as a tree of its own; None where this checkout does not have it."""
    folder.mkdir()
    archive = subprocess.run(["git", "archive", commit, "src"], cwd=_HERE, capture_output=True, check=False)
    if archive.returncode:
        print(f"commit {commit} is not in this checkout: nothing to compare with")
        return None
    subprocess.run(["tar", "-x"], cwd=folder, input=archive.stdout, check=True)
    return folder


def run(tree: Path, words: list[str], cache: Path) -> Cost:
    """Run a command of the package in `tree`, with this cache, in an empty folder."""
    with tempfile.TemporaryDirectory() as folder:
        listed, errors = Path(folder) / "programs.json", Path(folder) / "stderr"
        environment = {**os.environ, "NECTOSOME_CACHE": str(cache), "PYTHONPATH": str(tree / "src")}
        command = [sys.executable, str(_HERE / "benchmarks" / "watched.py"), str(listed), *words]
        with errors.open("w") as stream:
            process = subprocess.Popen(command, env=environment, cwd=folder, stdout=subprocess.DEVNULL, stderr=stream)
            _, code, spent = os.wait4(process.pid, 0)
        if os.waitstatus_to_exitcode(code) not in (0, 1):  # 1: no solution, and why
            sys.exit(f"nectosome {' '.join(words)} ended with {code}:\n{errors.read_text()}")
        stray = len(errors.read_text().splitlines())
        return Cost(spent.ru_utime + spent.ru_stime, spent.ru_maxrss / 1e6, stray, json.loads(listed.read_text()))


def _list(cold: list[dict[str, float | str]], warm: list[dict[str, float | str]]) -> None:
    """The programs that took longest with empty caches, then what they and the others take with full ones."""

    def seconds(row: dict[str, float | str]) -> float:
        return sum(float(row[key]) for key in ("trace", "lower", "compile", "load"))

    print(f"    {'program':28s} {'operations':>10s} {'trace':>7s} {'lower':>7s} {'compile':>8s} {'load':>7s}")
    for state, rows in (("cold", cold), ("warm", warm)):
        longest = sorted(rows, key=seconds, reverse=True)
        for row in longest[:_LONGEST]:
            times = f"{row['trace']:7.2f} {row['lower']:7.2f} {row['compile']:8.2f} {row['load']:7.2f}"
            print(f"    {str(row['program'])[:28]:28s} {row['operations']:10d} {times}  {state}")
        if others := longest[_LONGEST:]:
            print(f"    {len(others)} others take {sum(map(seconds, others)):.2f} s  {state}")


if __name__ == "__main__":
    main(sys.argv[1:])
