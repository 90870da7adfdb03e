"""Attack everything that nectosome reads: `python -m benchmarks.attack [--class NAME] [--seed N]`.

What is attacked how follows from the seed alone. The files of attacks that were not survived stay in `out/attacks`,
with what was wrong, and the exit code is 1.
"""

import argparse
import os
import random
import shutil
import sys
import time
from pathlib import Path

from .attempt import Attack
from .classes import CLASSES

KEPT = Path("out") / "attacks"


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.attack")
    parser.add_argument("--class", dest="name", choices=CLASSES, help="one class of attacks only")
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    lines, failures = ["| attacks on | tried | refused | good all the same | survived |", "|---|---|---|---|---|"], 0
    sums = [0, 0, 0, 0]
    for name in [given.name] if given.name else CLASSES:
        began = time.perf_counter()
        counts = tried(name, given.seed, CLASSES[name].count)
        failures += counts[0] - counts[3]
        sums = [a + b for a, b in zip(sums, counts, strict=True)]
        lines.append(f"| {CLASSES[name].about} | {' | '.join(map(str, counts))} |")
        print(f"{name}: {counts[3]} of {counts[0]} survived, {time.perf_counter() - began:.0f} s", flush=True)
    lines.append(f"| all | {' | '.join(map(str, sums))} |")
    print(f"\nseed {given.seed}\n")
    print("\n".join(lines))
    return int(failures > 0)


def tried(name: str, seed: int, count: int) -> tuple[int, int, int, int]:
    """How many attacks of a class were tried, refused, found good all the same, and survived."""
    results, home = list[tuple[bool, bool]](), Path.cwd()
    shutil.rmtree(KEPT / name, ignore_errors=True)
    for k, attack in enumerate(CLASSES[name].attacks(random.Random(f"{name} {seed}"), count)):
        folder = (home / KEPT / name / f"{k:03d}").resolve()
        folder.mkdir(parents=True)
        os.chdir(folder)
        try:
            outcome = attack.attempt(folder)
        finally:
            os.chdir(home)
        results.append((outcome.accepted, not outcome.faults))
        if k % 100 == 99:
            print(f"  {name}: {k + 1} of {count}", flush=True)
        if outcome.faults:
            report(name, k, attack, outcome.faults, folder)
        else:
            shutil.rmtree(folder)
    accepted, survived = (sum(column) for column in zip(*results, strict=True))
    return len(results), len(results) - accepted, accepted, survived


def report(name: str, k: int, attack: Attack, faults: list[str], folder: Path) -> None:
    """Say what was wrong, and keep it beside the files of the attack."""
    text = f"{name} {k}: {attack.about!r}\n" + "\n".join(faults) + "\n"
    (folder / "what_was_wrong.txt").write_text(text, encoding="utf-8", errors="backslashreplace")
    print(f"  {folder.relative_to(Path.cwd())}: {attack.about[:80]!r}: {'; '.join(faults)[-500:]}", flush=True)


if __name__ == "__main__":
    sys.exit(main())
