"""What finding a cycle costs, with its multipliers, beside an earlier commit in the same run: processor seconds.

    python -m benchmarks.cycles b48da053 turtle tuna

Cold is the first call of `periodic` in a process with empty caches, its robot built; warm the median of later ones.
"""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from statistics import median

from .compile import earlier

BEFORE = "b48da053"  # the earlier commit
_HERE = Path(__file__).parents[1]
_BELL = Path(__file__).with_name("bell.yaml")
ROBOTS = ("turtle", "manta", str(_BELL), "tuna", "fish", "beetle", "jelly")
_WARM, _TURNS = 3, 3
_PERIODIC = """
import json, sys, time
import jax, numpy as np
import nectosome as ns
from nectosome.solve import periodic, simulate

robot, spent = ns.build(ns.describe(sys.argv[1])), []
for _ in range(1 + int(sys.argv[2])):
    begin = time.process_time()
    found = periodic(robot)
    jax.block_until_ready(found.value.state)
    spent.append(time.process_time() - begin)
largest = float(np.max(np.abs(found.multipliers), initial=0.0))
row = {"status": found.reason, "cycles": int(found.stats["cycles"]), "multiplier": largest, "speed": float(found.speed)}
print(json.dumps({"cold": spent[0], "warm": spent[1:], **row}))
"""


def main(commit: str, robots: list[str]) -> int:
    """Print a row a robot, medians of turns of both trees."""
    with tempfile.TemporaryDirectory() as folder:
        before = earlier(Path(folder) / "before", commit)
        if before is None:
            return 2
        medians = f"medians of {_TURNS} processes, {_WARM} warm runs in each"
        print(f"\n`periodic`, processor seconds, beside {commit}; {medians}")
        print("| robot | cold | before | ratio | warm | before | ratio | multiplier | before | speed | before |")
        print("|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|")
        for robot in robots:
            rows = {tree: [] for tree in (_HERE, before)}
            for _ in range(_TURNS):
                for tree, own in rows.items():
                    own.append(_run(tree, robot))
            cells = []
            for pick in (lambda row: row["cold"], lambda row: median(row["warm"])):
                now, then = (median(map(pick, own)) for own in rows.values())
                cells += [f"{now:.3g} s", f"{then:.3g} s", f"{now / then:.2f}"]
            for name, digits in (("multiplier", "#.4g"), ("speed", "#.6g")):
                cells += [format(own[0][name], digits) for own in rows.values()]
            print(f"| {Path(robot).stem} | {' | '.join(cells)} |", flush=True)
    return 0


def _run(tree: Path, robot: str) -> dict:
    """One process with the package of a tree and an empty cache."""
    with tempfile.TemporaryDirectory() as cache:
        environment = {**os.environ, "PYTHONPATH": str(tree / "src"), "NECTOSOME_CACHE": cache}
        command = [sys.executable, "-c", _PERIODIC, robot, str(_WARM)]
        done = subprocess.run(command, env=environment, cwd=cache, stdout=subprocess.PIPE, text=True, check=True)
    return json.loads(done.stdout.splitlines()[-1])


if __name__ == "__main__":
    sys.exit(main(sys.argv[1] if len(sys.argv) > 1 else BEFORE, sys.argv[2:] or [*ROBOTS]))
