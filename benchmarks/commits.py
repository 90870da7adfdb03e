"""This tree beside an earlier commit, in one run: the same numbers, and processor seconds.

    python -m benchmarks.commits 6eaa0876

Each robot that ships, and each robot file of the examples, has its residual evaluated at a random state, compiled in
both trees. Then commands, the import and residuals are timed by turns.
"""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from statistics import median

from .compile import earlier, run

_HERE = Path(__file__).parents[1]
_SAME = 1e-9  # largest difference, relative to the largest number of a residual
_COMMANDS = {
    "simulate flagellum": ("simulate", "flagellum", "--time", "2.5s"),
    "periodic turtle": ("periodic", "turtle"),
}
_TURNS = 5
_IMPORT = "import time; t = time.process_time(); import nectosome; print(time.process_time() - t)"
_RESIDUALS = """
import json, sys, time
import jax, numpy as np
import nectosome as ns
from nectosome.core import State

found = {}
for name in [*ns.names(), *sys.argv[1:]]:
    begin = time.process_time()
    robot = ns.build(ns.describe(name))
    rng, x = np.random.default_rng(1), robot.initial()
    q = robot.advance(x.q, 0.1 * rng.normal(size=x.v.shape), 1.0)
    v, a = rng.normal(size=(2, *x.v.shape))
    residual = jax.jit(lambda robot, q, v, z, a: robot.residual(np.float64(0.3), State(q, v, z), a))
    values = np.asarray(residual(robot, q, v, x.z, a))
    first = time.process_time() - begin
    many = jax.jit(lambda robot, q, v, z, a: jax.lax.fori_loop(
        0, 300, lambda _, a: residual(robot, q, v, z, a) * 1e-9 + a, a))
    jax.block_until_ready(many(robot, q, v, x.z, a))
    times = []
    for _ in range(7):
        begin = time.process_time()
        jax.block_until_ready(many(robot, q, v, x.z, a))
        times.append((time.process_time() - begin) / 300)
    found[name] = {"values": values.tolist(), "first": first, "each": float(np.median(times))}
    jax.clear_caches()
print(json.dumps(found))
"""


def main(commit: str) -> int:
    """Print what differs, then the ratios of processor seconds; 1 where numbers differ."""
    robots = [str(path) for path in sorted((_HERE / "examples").rglob("*.yaml")) if _is_robot(path)]
    with tempfile.TemporaryDirectory() as folder:
        before = earlier(Path(folder) / "before", commit)
        if before is None:
            return 2
        now, then = (json.loads(_python(tree, _RESIDUALS, robots)) for tree in (_HERE, before))
        wrong = 0
        print(f"\nresiduals of {len(now)} robots at a random state, beside {commit}")
        for name, ours in now.items():
            theirs = then.get(name)
            if theirs is None:
                print(f"  {name}: new")
                continue
            scale = max(map(abs, theirs["values"]), default=1.0) or 1.0
            same = len(ours["values"]) == len(theirs["values"])
            off = max((abs(x - y) for x, y in zip(ours["values"], theirs["values"], strict=False)), default=0.0) / scale
            if not same or off > _SAME:
                wrong += 1
                print(f"  {name}: {f'differs by {off:.1e}' if same else 'has another number of freedoms'}")
        wrong += len(lost := sorted(then.keys() - now.keys()))
        print("\n".join(f"  {name}: is gone" for name in lost) or f"  {wrong} differ by more than {_SAME:g}")
        both = [name for name in now if name in then]
        for key, what in (("first", "build and first residual"), ("each", "one residual")):
            ratios = [now[name][key] / then[name][key] for name in both]
            sums = sum(now[name][key] for name in both) / sum(then[name][key] for name in both)
            print(f"  processor seconds, {what}: median ratio {median(ratios):.3f}, of the sums {sums:.3f}")
        imports = {tree: [] for tree in (_HERE, before)}
        for _ in range(4 * _TURNS):
            for tree, seconds in imports.items():
                seconds.append(float(_python(tree, _IMPORT)))
        _ratio("import nectosome", imports[_HERE], imports[before])
        for name, words in _COMMANDS.items():
            costs = {tree: ([], []) for tree in (_HERE, before)}
            for _ in range(_TURNS):
                for tree, (cold, warm) in costs.items():
                    with tempfile.TemporaryDirectory() as cache:
                        cold.append(run(tree, [*words], Path(cache)).seconds)
                        warm.append(run(tree, [*words], Path(cache)).seconds)
            for k, state in enumerate(("empty", "full")):
                _ratio(f"{name}, {state} cache", costs[_HERE][k], costs[before][k])
    return int(wrong > 0)


def _ratio(what: str, now: list[float], then: list[float]) -> None:
    ratios = median(x / y for x, y in zip(now, then, strict=True))
    print(f"  {what}: {median(now):.3g} s, {ratios:.3f} of {median(then):.3g} s", flush=True)


def _is_robot(path: Path) -> bool:
    return "robot.schema.json" in path.read_text(encoding="utf-8").partition("\n")[0]


def _python(tree: Path, code: str, arguments: list[str] | None = None) -> str:
    """What a script prints last, run with the package of a tree."""
    environment = {**os.environ, "PYTHONPATH": str(tree / "src"), "NECTOSOME_CACHE": ""}
    command = [sys.executable, "-c", code, *(arguments or [])]
    done = subprocess.run(command, env=environment, cwd=_HERE, stdout=subprocess.PIPE, text=True, check=True)
    return done.stdout.splitlines()[-1]


if __name__ == "__main__":
    sys.exit(main(sys.argv[1] if len(sys.argv) > 1 else "HEAD~1"))
