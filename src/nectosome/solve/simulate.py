"""Simulation of a robot: the public function, with progress and cancelling."""

from collections.abc import Callable, Iterable, Sequence
from functools import partial
from time import monotonic
from typing import Any, Literal

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from nectosome.core import Mechanical, State, Status
from nectosome.core.programs.remember import remembered, runs_long
from nectosome.core.rows import all_on_device, on_device
from nectosome.core.tracers import traced
from nectosome.mechanism import ImpulsiveStart, Robot, check_inertia, from_rest, reduced
from nectosome.model import RobotLike, robot_of
from nectosome.units import InputError, check_choice, check_share, check_whole, read_numbers, read_positive

from .beat_means import beat_means
from .integrate import Guard, Integration, Method, Settings, begin, integrate, interpolate
from .results import Results, Run, Trajectory, results_of

_METHODS = ("auto", "implicit", "explicit")
_TIGHTER = 0.1  # tolerance of explicit steps that are chosen here: errors of free motion add up
_ROWS, _WIDEST = 20, 20  # rows of samples in a call, at most, and samples of a row
_LONGEST_CALL = 0.3  # [s] about, without `progress`: Ctrl-C is heard between calls


class SimulationRun(Run):
    """A Run from t = 0 on."""

    # None of a run from a given state, and of a robot without prescribed joints
    start: ImpulsiveStart | None = eqx.field(kw_only=True)

    def results(self, settings: dict[str, Any] | None = None) -> Results:
        """Results as of any run, with the impulse at the start [N m s, N s], its energy [J], and means of beats."""
        d = self.diagnosis()
        found = results_of(self, d, settings)
        means = beat_means(self.value.system, np.asarray(self.value.time), d, found.attributes)
        found = found._replace(data=found.data | means)
        if self.start is None:
            return found
        impulse, energy = map(np.asarray, (self.start.impulse, self.start.energy))
        start = {"impulse": (("prescribed",), impulse, "N m s or N s"), "impulse_energy": ((), energy, "J")}
        return found._replace(data=found.data | start)


def simulate(
    robot: RobotLike | Mechanical,
    time: float | str,
    *,
    settings: Iterable[str] = (),
    samples: int | Sequence[float] = 201,
    method: Literal["auto", "implicit", "explicit"] = "auto",
    rtol: float = 1e-4,
    atol: float = 1e-6,
    initial: State | None = None,
    until: Guard | None = None,
    progress: Callable[[float], bool | None] | None = None,
    max_steps: int = 200_000,
) -> SimulationRun:
    """Motion of a robot from t = 0 to `time`, seconds or text such as "2.5s", with the states at `samples`.

    - robot: a name, the path of a robot file, a description or a built robot, with `settings` such as "E=3MPa"; or any
      other mechanical system.
    - initial: the state at t = 0, of a run that goes on; without one the robot starts from rest, by an impulse where
      its drives are at speed at once (`from_rest`).
    - samples: how many evenly spaced times, or the times themselves, increasing from 0 to `time`; the state at a time
      within a step is that of the step's cubic, as accurate as the steps.
    - method: "implicit" for soft bodies, "explicit" for systems without stiff springs; "auto" takes the explicit one
      where nothing is stiff (`Robot.mild`), with a tenth of the tolerances: it is cheap, and keeps energy and phase of
      a motion that nothing damps.
    - until(t, x): the run stops where it changes sign; status EVENT, and that time is the last one kept.
    - progress(share): called about twenty times with the share done, of many samples after every twentieth; the run is
      cancelled where it returns False.

    Returns a SimulationRun, a Solution whose value is a Trajectory up to where the run came; its status says why it
    ended there. Of a traced robot or state it runs in one piece, without `progress`, has all times, with NaN after an
    early end, and forward derivatives: those of the steps taken. Raises InputError for what is no robot, and for a
    time, sample count or tolerance that makes no sense.
    """
    time = read_positive(time, "time", "time")
    check_choice(method, _METHODS, "method")
    if np.ndim(samples) == 0:
        check_whole(samples, "samples", 2)
        times = np.linspace(0.0, time, int(samples))  # pyright: ignore[reportArgumentType]
    else:
        times = read_numbers(samples, "samples")
    _check(time, times, rtol, atol)
    system = robot if isinstance(robot, Mechanical) else robot_of(robot, settings)
    pure = traced(system, initial)
    if isinstance(system, Robot) and not pure:
        check_inertia(system)
    kind: Method = "implicit" if method == "auto" else method
    if method == "auto" and isinstance(system, Robot) and system.mild:
        kind, rtol, atol = "explicit", _TIGHTER * rtol, _TIGHTER * atol
    zero, step, *limits = all_on_device(0.0, min(1e-3, 0.1 * times[1]), rtol, atol, max_steps)
    stepping = Settings(kind, *limits)
    x, start = system.initial(), None
    if initial is not None:
        _check_state(initial, x)
        x = initial
    elif isinstance(system, Robot) and system.prescribed_names:
        start = remembered(from_rest, system, zero, x)
        x = start.state
    equations = reduced(system)
    m = begin(zero, x, stepping, step)
    if pure:
        m, later = _integrate(equations, m, jnp.asarray(times[1:]), stepping, until)
        whole = jax.tree.map(lambda a, b: jnp.concatenate([a[None], b]), x, later)
        return SimulationRun(Trajectory(system, jnp.asarray(times), whole), m.status, _counts(m), zero, start=start)
    states = [jax.tree.map(lambda x: np.asarray(x)[None], x)]
    # a guard is a Python function, which `remembered` does not take
    run = partial(remembered, _integrate_rows) if until is None else partial(_integrate_until, guard=until)
    for rows in _blocks(times[1:]):
        done, count = 0, 1
        while done < len(rows) and (int(m.status) == Status.SOLVED or rows[done, 0] <= _reached(m)):
            began, last = monotonic(), min(done + count, len(rows))
            m, xs = run(equations, m, *all_on_device(rows, done, last), stepping)
            states.append(jax.tree.map(partial(_samples, done, last), xs))
            if progress is None:
                count = max(int(_LONGEST_CALL / (monotonic() - began) * (last - done)), 1)
            elif int(m.status) == Status.SOLVED and progress(float(rows[last - 1, -1]) / time) is False:
                return _solution(system, m, times, states, Status.CANCELLED, start)
            done = last
    return _solution(system, m, times, states, Status(int(m.status)), start)


@runs_long
def _integrate_rows(
    system: Mechanical,
    state: Integration,
    rows: Float[Array, "n k"],
    first: Int[Array, ""],
    last: Int[Array, ""],
    settings: Settings,
    guard: Guard | None = None,
) -> tuple[Integration, State]:
    """Integrate over the times of the rows from `first` to before `last`; states [n, k, ...], NaN in other rows.

    After an early end, rows that the last step came to have their states too.
    """

    def going(carry: tuple[Array, Integration, State]) -> Array:
        i, m, _ = carry
        return (i < last) & ((m.status == int(Status.SOLVED)) | (rows[i, 0] <= jnp.minimum(m.t, m.end)))

    def row(carry: tuple[Array, Integration, State]) -> tuple[Array, Integration, State]:
        i, m, found = carry
        m, new = integrate(system, m, rows[i], settings, guard)
        return i + 1, m, jax.tree.map(lambda all, one: all.at[i].set(one), found, new)

    blank = jax.tree.map(lambda x: jnp.full((*rows.shape, *x.shape), jnp.nan), state.x)
    _, state, found = jax.lax.while_loop(going, row, (first, state, blank))
    return state, found


_integrate_until, _integrate = eqx.filter_jit(_integrate_rows), eqx.filter_jit(integrate)


def _counts(m: Integration) -> dict[str, Array]:
    memory = {} if m.memory is None else {"jacobians": m.memory.refreshes}
    return {"steps": m.steps, "rejected": m.rejected, **memory}


def _solution(
    system: Mechanical,
    m: Integration,
    times: np.ndarray,
    states: list[State],
    status: Status,
    start: ImpulsiveStart | None,
) -> SimulationRun:
    whole = jax.tree.map(lambda *x: np.concatenate([*map(np.asarray, x)])[: times.size], *states)
    kept = int(np.sum(times[: whole.v.shape[0]] <= _reached(m)))
    state = jax.tree.map(lambda x: on_device(x[:kept]), whole)
    times = times[:kept]
    if status == Status.EVENT:
        last = interpolate(m, m.end)
        state = jax.tree.map(lambda x, y: jnp.concatenate([x, y[None]]), state, last)
        times = np.append(times, float(m.end))
    trajectory = Trajectory(system, on_device(times), state)
    return SimulationRun(trajectory, on_device(int(status)), _counts(m), on_device(0.0), start=start)


def _samples(first: int, last: int, x: Array) -> np.ndarray:
    """One after the other, those of the rows from `first` to before `last`."""
    rows = np.asarray(x)[first:last]
    return rows.reshape((last - first) * rows.shape[1], *rows.shape[2:])


def _reached(m: Integration) -> float:
    return min(float(m.end), float(m.t))


def _blocks(times: np.ndarray) -> np.ndarray:
    """Times in blocks of rows, of equal lengths; the last ones are padded with the last time."""
    width = min(-(-times.size // _ROWS), _WIDEST)
    rows = -(-times.size // width)
    blocks = -(-rows // _ROWS)
    height = -(-rows // blocks)
    return np.append(times, np.full(blocks * height * width - times.size, times[-1])).reshape(blocks, height, width)


def _check_state(given: State, own: State) -> None:
    """Raise InputError where a state is not one of this robot: it has other coordinates, or other states of loads."""
    shapes, expected = ([np.shape(leaf) for leaf in jax.tree.leaves(x)] for x in (given, own))
    if jax.tree.structure(given) != jax.tree.structure(own) or shapes != expected:
        has = f"{np.size(given.q)} coordinates and {len(shapes) - 2} states of loads"
        needs = f"{np.size(own.q)} and {len(expected) - 2}"
        words = f"it is of a robot of another structure: it has {has}, where this robot has {needs}."
        raise InputError(f"{words} State(q, v, robot.initial().z) takes the motion over.", field="initial")


def _check(time: float, times: np.ndarray, rtol: float, atol: float) -> None:
    if times.ndim != 1 or times.size < 2:
        raise InputError(f"{times.size} times; at least 2 are needed, the start and the end.", field="samples")
    if times[0] != 0 or times[-1] != time or not np.all(np.diff(times) > 0):
        raise InputError(f"the times must increase from 0 to {time:g} s.", field="samples")
    check_share(rtol, "rtol")
    check_share(atol, "atol")
