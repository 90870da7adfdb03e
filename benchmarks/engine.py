"""The flagellum (13 unknowns, 20 stations): equations of motion in a compiled loop, and 2.5 s from rest."""

import statistics
import time
from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp

from nectosome.core import State
from nectosome.mechanism import Robot
from nectosome.robots import build, describe
from nectosome.solve import simulate

_LOOPS, _REPEATS = 300, 7


def main() -> None:
    robot = build(describe("flagellum"))
    x = robot.initial()
    t = jnp.zeros(())

    def at(w: jax.Array) -> State:
        return State(x.q + 1e-3 * w, x.v + 1e-2 * w, x.z)

    tasks: dict[str, Callable[[Robot, jax.Array], jax.Array]] = {
        "residual": lambda r, w: r.residual(t, at(w), w),
        "forward dynamics": lambda r, w: r.rates(t, at(w)).v,
        "exact Jacobian": lambda r, w: jax.jacfwd(lambda w: r.residual(t, at(w), w))(w),
    }
    print("\nequations of motion, in a compiled loop (median of 7)")
    for name, task in tasks.items():
        compile_s, run_s = _timed(robot, task, x.v)
        print(f"  {name:18s} {run_s * 1e6:8.1f} us   compile {compile_s:.1f} s")

    print("\n2.5 s of full dynamics from rest (median of 5, warm)")
    for rtol in (1e-3, 1e-4, 1e-5):
        times, run = [], None
        for _ in range(6):
            began = time.perf_counter()
            run = simulate(robot, 2.5, rtol=rtol, atol=rtol * 1e-2)
            jax.block_until_ready(run.value.state.v)
            times.append(time.perf_counter() - began)
        speed = -float(run.value.state.v[-1, 0])
        median = statistics.median(times[1:])
        print(f"  rtol {rtol:.0e}: {median:.2f} s, {int(run.stats['steps'])} steps, final speed {speed:.7f} m/s")


def _timed(robot: Robot, task: Callable[[Robot, jax.Array], jax.Array], w: jax.Array) -> tuple[float, float]:
    """Compile time and time of one evaluation [s]."""

    def loop(robot: Robot, w: jax.Array) -> jax.Array:
        def body(w: jax.Array, _: None) -> tuple[jax.Array, None]:
            return w + 1e-9 * jnp.sum(task(robot, w)), None

        return jax.lax.scan(body, w, None, length=_LOOPS)[0]

    began = time.perf_counter()
    compiled = eqx.filter_jit(loop).lower(robot, w).compile()
    compile_s = time.perf_counter() - began
    times = []
    for _ in range(_REPEATS):
        began = time.perf_counter()
        jax.block_until_ready(compiled(robot, w))
        times.append((time.perf_counter() - began) / _LOOPS)
    return compile_s, statistics.median(times)
