"""Random flagella within the bounds of the shipped design problem, and checks of the steady solve on each of them.

Used by the benchmarks and by `tests/solve/test_steady_designs.py`.
"""

from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from nectosome.core import State, Status
from nectosome.designs import MotionDesign, shipped_problem
from nectosome.designs.plans import MotionQuantities, judge, judge_with_derivatives
from nectosome.mechanism import Robot
from nectosome.model import build
from nectosome.robots import describe
from nectosome.solve import simulate

_PIECE, _LONGEST = 4.0, 300.0  # s, of the dynamics from rest; next to a standstill the canister coasts for minutes
_STEP = 2e-3  # of a variable, relative, and at most of its unit box


def task() -> MotionDesign:
    problem = shipped_problem("flagellum")
    assert problem is not None
    return problem.task(describe("flagellum"))


def draw(count: int, seed: int = 1) -> np.ndarray:
    """Designs in the unit box, Young's modulus on its logarithmic scale [count, 5]."""
    return np.random.default_rng(seed).uniform(size=(count, 5))


class Swimmers(NamedTuple):
    """The robot as a function of u in the unit box, and functions of it compiled at their first call."""

    robot: Callable[[np.ndarray], Robot]
    rest: State
    # (u, guess, warm) -> speed [m/s] and torque [N m], solution
    outputs: Callable[..., tuple[jax.Array, MotionQuantities]]
    derivatives: Callable[..., tuple[jax.Array, MotionQuantities]]  # of these two by u [2, 5]
    many: Callable[..., tuple[jax.Array, MotionQuantities]]  # outputs of designs [n, 5], one after another


@cache
def swimmers() -> Swimmers:
    t = task()
    plan, numbers = t.plan()
    assert plan.used[:2] == ("speed", "torque")

    def outputs(u: jax.Array, guess: State, warm: jax.Array) -> tuple[jax.Array, MotionQuantities]:
        found, _ = judge(plan, numbers, u, guess, warm)
        return found.quantities[:2], found

    def derivatives(u: jax.Array, guess: State, warm: jax.Array) -> tuple[jax.Array, MotionQuantities]:
        found, derivatives = judge_with_derivatives(plan, numbers, u, guess, warm)
        return derivatives[:2], found

    return Swimmers(
        lambda u: build(t.robot_at(u)),
        build(t.description).initial(),
        jax.jit(outputs),
        jax.jit(derivatives),
        jax.jit(lambda us, guess, warm: jax.lax.map(lambda u: outputs(u, guess, warm), us)),
    )


class DesignCheck(NamedTuple):
    """A design, its solution from rest, and errors of that."""

    u: np.ndarray
    reason: str  # why it is unsolved; empty if it is solved
    speed: float  # [m/s]
    residual: float
    derivative_error: tuple[float, float]  # of the derivatives of speed and torque, relative to the gradient
    settled_speed: float  # of the dynamics from rest [m/s]; NaN where they were not run
    settled_time: float  # [s]

    @property
    def agrees(self) -> bool:
        """Whether the dynamics settle at the same speed: within 0.1 %, or 1e-5 m/s."""
        return abs(self.settled_speed - self.speed) <= max(1e-3 * abs(self.speed), 1e-5)


def check(u: np.ndarray, dynamics: bool) -> DesignCheck:
    """Solve one design from rest; compare it with central differences and, with `dynamics`, with its own transient."""
    s = swimmers()
    at = jnp.asarray(u)
    values, found = s.outputs(at, s.rest, jnp.asarray(False))
    status = Status(int(found.status))
    none = float("nan")
    if status != Status.SOLVED:
        return DesignCheck(u, status.reason, none, float(found.residual), (none, none), none, none)
    error = derivative_error(u, found.state)
    speed, time = settle(s.robot(u)) if dynamics else (none, none)
    return DesignCheck(u, "", float(values[0]), float(found.residual), error, speed, time)


def derivative_error(u: np.ndarray, state: State) -> tuple[float, float]:
    """Errors of the derivatives of speed and torque against central differences of fourth order.

    By each variable the differences are taken with three steps, and those count that the next step changes least: near
    a standstill, where the speed goes with the root of the thrust, long steps are off; short ones have more rounding.
    """
    s = swimmers()
    warm = jnp.asarray(True)
    exact = np.asarray(s.derivatives(jnp.asarray(u), state, warm)[0])
    expected = np.zeros_like(exact)
    for k, h in enumerate(_steps(u)):
        tries = np.array([_differences(u, k, h * share, state) for share in _SHARES])
        change = np.abs(np.diff(tries, axis=0))
        expected[:, k] = np.take_along_axis(tries[1:], np.argmin(change, axis=0)[None], axis=0)[0]
    error = np.linalg.norm(expected - exact, axis=1) / np.linalg.norm(exact, axis=1)
    return float(error[0]), float(error[1])


_SHARES = (1.0, 0.2, 0.04)
_WEIGHTS = {-2: 1, -1: -8, 1: 8, 2: -1}


def _differences(u: np.ndarray, k: int, h: float, state: State) -> np.ndarray:
    """Derivatives of speed and torque by variable k."""
    shifted = {m: jnp.asarray(u + m * h * np.eye(u.size)[k]) for m in _WEIGHTS}
    outputs = swimmers().outputs
    return sum(w * np.asarray(outputs(shifted[m], state, jnp.asarray(True))[0]) for m, w in _WEIGHTS.items()) / (12 * h)


def _steps(u: np.ndarray) -> np.ndarray:
    """Longest steps, of the unit box: so much of the variable's value, since solutions change most near its zero."""
    ends = task().box.ends
    width = ends[:, 1] - ends[:, 0]
    value = np.where([v.log for v in task().variables], 1.0, ends[:, 0] + u * width)
    return np.clip(_STEP * value / width, 1e-5, _STEP)


def settle(robot: Robot) -> tuple[float, float]:
    """Speed [m/s] that the dynamics come to from rest, and the time [s] by which the last 0.5 s are even."""
    x, time = None, 0.0
    while time < _LONGEST:
        run = simulate(robot, _PIECE, samples=41, rtol=1e-6, atol=1e-8, initial=x)
        if int(run.status) != Status.SOLVED:
            break
        time += _PIECE
        speed = -np.asarray(run.value.state.v[:, 0])
        if np.ptp(speed[-6:]) <= 1e-5 * abs(speed[-1]) + 1e-7:
            return float(speed[-1]), time
        x = jax.tree.map(lambda x: x[-1], run.value.state)
    return float("nan"), time
