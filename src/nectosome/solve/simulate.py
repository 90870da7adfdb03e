"""Simulation of a robot: the public function, with progress and cancelling."""

import math
from collections.abc import Callable, Sequence
from typing import Literal

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from nectosome.core import Mechanical, State, Status
from nectosome.core.remember import remembered
from nectosome.mechanism import reduced

from .integrate import Guard, Integration, Method, Settings, begin, integrate, interpolate
from .results import Run, Trajectory

_CHUNKS, _WIDEST = 20, 20  # number of chunks of a run, most samples of a chunk; it can be cancelled between chunks


@eqx.filter_jit
def _integrate_until(
    system: Mechanical, m: Integration, times: Array, settings: Settings, guard: Guard
) -> tuple[Integration, State]:
    return integrate(system, m, times, settings, guard)


def simulate(
    system: Mechanical,
    time: float,
    *,
    samples: int | Sequence[float] = 201,
    method: Literal["auto", "implicit", "explicit"] = "auto",
    rtol: float = 1e-4,
    atol: float = 1e-6,
    initial: State | None = None,
    until: Guard | None = None,
    progress: Callable[[float], bool | None] | None = None,
    max_steps: int = 200_000,
) -> Run:
    """Integrate from t = 0 to `time` [s] and keep the states at `samples`.

    - samples: number of equally spaced times, or the times themselves, increasing from 0 to `time`; the state at a time
      within a step comes from the step's cubic, as accurate as the steps.
    - method: "implicit" for soft bodies, "explicit" for systems without stiff springs; "auto" is implicit.
    - until(t, x): the run stops at its sign change, with status EVENT; the time of the event is the last one saved.
    - progress(fraction): called about twenty times, for many samples after every twentieth one; the run is cancelled if
      it returns False.

    Returns a Run, a Solution whose value is a Trajectory up to the end of the run; the status says why it ended.
    Raises ValueError for an invalid time, sample count or tolerance.
    """
    times = np.linspace(0.0, time, samples) if isinstance(samples, int) else np.asarray(samples, dtype=float)
    _check(time, times, rtol, atol)
    kind: Method = "implicit" if method == "auto" else method
    settings = Settings(kind, *map(jnp.asarray, (rtol, atol, max_steps)))
    x = system.initial() if initial is None else initial
    equations = reduced(system)
    chunks = _chunks(times[1:])
    m = begin(jnp.asarray(0.0), x, settings, jnp.asarray(min(1e-3, 0.1 * times[1])))
    states, status = [jax.tree.map(lambda x: x[None], x)], Status.SOLVED
    for chunk in chunks:
        if until is None:
            m, xs = remembered(integrate, equations, m, chunk, settings)
        else:
            m, xs = _integrate_until(equations, m, jnp.asarray(chunk), settings, until)
        states.append(xs)
        status = Status(int(m.status))
        if status != Status.SOLVED:
            break
        if progress is not None and progress(float(chunk[-1]) / time) is False:
            status = Status.CANCELLED
            break
    return _solution(system, m, times, states, status)


def _solution(system: Mechanical, m: Integration, times: np.ndarray, states: list[State], status: Status) -> Run:
    state = jax.tree.map(lambda *x: jnp.concatenate(x)[: times.size], *states)
    kept = int(np.sum(times[: state.v.shape[0]] <= min(float(m.end), float(m.t))))
    state = jax.tree.map(lambda x: x[:kept], state)
    times = times[:kept]
    if status == Status.EVENT:
        last = interpolate(m, m.end)
        state = jax.tree.map(lambda x, y: jnp.concatenate([x, y[None]]), state, last)
        times = np.append(times, float(m.end))
    stats = {"steps": m.steps, "rejected": m.rejected}
    if m.memory is not None:
        stats["jacobians"] = m.memory.refreshes
    return Run(Trajectory(system, jnp.asarray(times), state), jnp.asarray(int(status)), stats, jnp.zeros(()))


def _chunks(times: np.ndarray) -> np.ndarray:
    """Times in rows of equal length; the last row is padded with the last time."""
    width = min(-(-times.size // _CHUNKS), _WIDEST)
    rows = -(-times.size // width)
    return np.append(times, np.full(rows * width - times.size, times[-1])).reshape(rows, width)


def _check(time: float, times: np.ndarray, rtol: float, atol: float) -> None:
    if not (math.isfinite(time) and time > 0):
        raise ValueError(f"simulate: time is {time} s; it must be a positive number of seconds.")
    if times.ndim != 1 or times.size < 2:
        raise ValueError(f"simulate: samples has {times.size} times; at least 2 are needed, the start and the end.")
    if times[0] != 0 or times[-1] != time or not np.all(np.diff(times) > 0):
        raise ValueError(f"simulate: the times in samples must increase from 0 to {time} s.")
    if not (0 < rtol < 1 and 0 < atol < 1):
        raise ValueError(f"simulate: tolerances are rtol {rtol}, atol {atol}; they must lie between 0 and 1.")
