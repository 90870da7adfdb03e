"""The flagellum (13 unknowns, 20 stations) on one core: its equations, 2.5 s from rest, and the steady solve.

The steady solve is timed on random designs within the bounds of the shipped problem, with outputs speed and torque;
warm means from the solution of a design that lies 1 % of the box away in each variable, as a search goes on.
"""

import statistics
from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from nectosome.core import State, Status
from nectosome.mechanism import Robot
from nectosome.model import build
from nectosome.robots import describe
from nectosome.solve import simulate

from .designs import draw, swimmers
from .timing import clock, now, once

_LOOPS, _REPEATS = 300, 7
_DESIGNS, _BATCH = 50, 512


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
            began = now()
            run = simulate(robot, 2.5, rtol=rtol, atol=rtol * 1e-2)
            jax.block_until_ready(run.value.state.v)
            times.append(now() - began)
        speed = -float(run.value.state.v[-1, 0])
        median = statistics.median(times[1:])
        print(f"  rtol {rtol:.0e}: {median:.2f} s, {int(run.stats['steps'])} steps, final speed {speed:.7f} m/s")

    _steady()


def _steady() -> None:
    s = swimmers()
    us = jnp.asarray(draw(_DESIGNS))
    cold, warm = jnp.asarray(False), jnp.asarray(True)
    compiled = {
        name: once(lambda f=f: f(us[0], s.rest, cold))[0] for name, f in (("", s.outputs), ("g", s.derivatives))
    }
    print(f"\nsteady solve in ms, {_DESIGNS} designs (compile {compiled['']:.1f} s, derivatives {compiled['g']:.1f} s)")
    print("  task                          median    90 %     max    aim")
    moved = us + 0.01 * jnp.where(us < 0.5, 1.0, -1.0)
    roots = [s.outputs(u, s.rest, cold)[1] for u in us]
    near = [k for k, root in enumerate(roots) if int(root.status) == Status.SOLVED]
    medians = {}
    for start, solve, each, aim in (
        ("cold", lambda f, k: f(us[k], s.rest, cold), range(_DESIGNS), 20.0),
        ("warm", lambda f, k: f(moved[k], roots[k].state, warm), near, 2.0),
    ):
        for what, f in (("solve", s.outputs), ("with 5 derivatives", s.derivatives)):
            times = 1e3 * np.array([clock(lambda f=f, k=k, solve=solve: solve(f, k), 3) for k in each])
            medians[start, what] = middle = float(np.median(times))
            limit = f"{aim:4.0f} ms" if what == "solve" else f"1.5 x, is {middle / medians[start, 'solve']:.2f} x"
            row = f"{middle:8.2f} {np.quantile(times, 0.9):7.2f} {np.max(times):7.2f}"
            print(f"  {start + ', ' + what:26s} {row}   {limit}")
    print(f"  solved: {len(near)} of {_DESIGNS}")
    many = jnp.asarray(draw(_BATCH, seed=2))
    compile_s, _ = once(lambda: s.many(many, s.rest, cold))
    run_s, (_, found) = once(lambda: s.many(many, s.rest, cold))
    solved = int(np.sum(np.asarray(found.status) == Status.SOLVED))
    each = f"{1e3 * run_s / _BATCH:.2f} ms a design"
    print(f"  {_BATCH} designs in one call, cold: {each}, {solved} solved; compile {compile_s:.1f} s")


def _timed(robot: Robot, task: Callable[[Robot, jax.Array], jax.Array], w: jax.Array) -> tuple[float, float]:
    """Compile time and time of one evaluation [s]."""

    def loop(robot: Robot, w: jax.Array) -> jax.Array:
        def body(w: jax.Array, _: None) -> tuple[jax.Array, None]:
            return w + 1e-9 * jnp.sum(task(robot, w)), None

        return jax.lax.scan(body, w, None, length=_LOOPS)[0]

    began = now()
    compiled = eqx.filter_jit(loop).lower(robot, w).compile()
    compile_s = now() - began
    times = []
    for _ in range(_REPEATS):
        began = now()
        jax.block_until_ready(compiled(robot, w))
        times.append((now() - began) / _LOOPS)
    return compile_s, statistics.median(times)


if __name__ == "__main__":
    main()
