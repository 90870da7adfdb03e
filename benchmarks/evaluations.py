"""One evaluation of the equations of each shipped robot, beside an earlier commit: running time and equations.

Residuals are those of the equations that a simulation would take, planar ones where the robot moves in a plane; rates
are those of an explicit step. Both commits take turns, each in processes of its own; the median of their ratios counts.
"""

import json
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from .compile import BEFORE, earlier

_HERE = Path(__file__).parents[1]
_ROUNDS = 5
_EVALUATIONS = 300  # in one call


def main(names: list[str]) -> None:
    """Run all shipped robots, or those named."""
    from nectosome.robots import names as shipped

    with tempfile.TemporaryDirectory() as folder:
        before = earlier(Path(folder) / "before")
        print(f"\none evaluation, us, beside {BEFORE}" if before else "\none evaluation, us")
        print(f"  {'robot':16s} {'residual':>9s} {'ratio':>6s} {'rates':>9s} {'ratio':>6s} {'equations':>10s}")
        for name in names or shipped():
            found: list[list[dict[str, float]]] = [[], []]
            for _ in range(_ROUNDS):
                for rows, tree in zip(found, (_HERE, before), strict=True):
                    if tree:
                        rows.append(_measured(tree, name, Path(folder) / "compiled"))
            line = f"  {name:16s}"
            for what in ("residual", "rates"):
                own = statistics.median(row[what] for row in found[0])
                ratio = statistics.median(a[what] / b[what] for a, b in zip(*found, strict=True)) if before else 0.0
                line += f" {own:9.1f} {ratio:6.2f}"
            counts = " / ".join(f"{rows[0]['equations']:.0f}" for rows in found if rows)
            print(f"{line} {counts:>13s}", flush=True)


def _measured(tree: Path, name: str, compiled: Path) -> dict[str, float]:
    """What a process of its own finds; programs that an earlier one compiled are kept in a folder."""
    kept = {"JAX_COMPILATION_CACHE_DIR": str(compiled), "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": "0"}
    environment = {**os.environ, **kept, "PYTHONPATH": f"{tree / 'src'}:{_HERE}", "NECTOSOME_CACHE": ""}
    command = [sys.executable, "-m", "benchmarks.evaluations", "--measure", name]
    return json.loads(subprocess.run(command, env=environment, cwd=_HERE, capture_output=True, check=True).stdout)


def measure(name: str) -> dict[str, float]:
    """Microseconds of one residual and of one rate, and the equations of the residual in space."""
    import jax
    import jax.numpy as jnp

    from nectosome.core import State
    from nectosome.mechanism import reduced
    from nectosome.robots import describe

    try:
        from nectosome.model import build
    except ImportError:
        from nectosome.robots import build  # pyright: ignore[reportAttributeAccessIssue]  the earlier commit

    from .timing import now

    robot = build(describe(name))
    system, x = reduced(robot), robot.initial()
    push = jnp.linspace(0.1, 0.2, max(x.v.size, 1))[: x.v.size]

    def chained(of: Any) -> Any:
        """The mean of many evaluations, each at a state that depends on the one before."""

        def one(system: Any, a: Any) -> Any:
            def step(carry: tuple[Any, Any], _: None) -> tuple[tuple[Any, Any], None]:
                t, a = carry
                moved = 1e-3 * jnp.tanh(a)
                state = State(x.q + jnp.sum(moved), x.v + moved, x.z)
                return (t + 1e-4, of(system, t, state, push)), None

            return jax.lax.scan(step, (jnp.zeros(()), a), None, length=_EVALUATIONS)[0][1]

        return jax.jit(one)

    found = {}
    for what, of in (
        ("residual", lambda s, t, y, a: s.residual(t, y, a + 1e-3 * jnp.tanh(y.v))),
        ("rates", lambda s, t, y, a: s.rates(t, y).v),
    ):
        run = chained(of)
        jax.block_until_ready(run(system, push))
        times = []
        for _ in range(9):
            began = now()
            jax.block_until_ready(run(system, push))
            times.append(now() - began)
        found[what] = 1e6 * statistics.median(times) / _EVALUATIONS
    residual = jax.make_jaxpr(lambda y, a: robot.residual(jnp.zeros(()), y, a))(x, push)
    return found | {"equations": equations(residual.jaxpr)}


def equations(jaxpr: Any) -> int:
    """Number of equations, those of inner programs included."""
    import jax

    def is_program(x: Any) -> bool:
        return hasattr(x, "eqns") or hasattr(x, "jaxpr")

    inner = [p for e in jaxpr.eqns for p in jax.tree.leaves(list(e.params.values()), is_leaf=is_program)]
    return len(jaxpr.eqns) + sum(equations(getattr(p, "jaxpr", p)) for p in inner if is_program(p))


if __name__ == "__main__":
    if sys.argv[1:2] == ["--measure"]:
        print(json.dumps(measure(sys.argv[2])))
    else:
        main(sys.argv[1:])
