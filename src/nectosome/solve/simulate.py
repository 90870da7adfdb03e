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
from nectosome.core.programs.remember import Bound, remembered, runs_long
from nectosome.core.rows import all_on_device, on_device
from nectosome.core.tracers import Untraced, traced
from nectosome.mechanism import ImpulsiveStart, Robot, check_inertia, from_rest, reduced
from nectosome.model import RobotLike, robot_of
from nectosome.units import InputError, check_choice, check_share, check_whole, read_numbers, read_positive

from .equal_limbs import EQUAL_LIMBS, OneLimb, one_limb, with_equal_limbs
from .integrate import AcceptedSteps, Guard, Integration, Method, Settings, begin, integrate, steps_until
from .results import Results, Run, Trajectory, results_of
from .run_means import run_means, states_at

METHODS = ("auto", "implicit", "explicit")
TIGHTER = 0.1  # tolerance of explicit steps that are chosen here: errors of free motion add up
_ROWS, _WIDEST = 20, 20  # how often progress is told, about, and after how many samples at most
_LONGEST_CALL = 0.3  # [s] about: Ctrl-C is heard between calls
_FIRST_CALL = 8  # attempts at steps in the first one


class SimulationRun(Run):
    """A Run from t = 0 on."""

    # None of a run from a given state, and of a robot without prescribed joints
    start: ImpulsiveStart | None = eqx.field(kw_only=True)
    steps: Untraced = eqx.field(kw_only=True, default=Untraced())  # `AcceptedSteps`; None of a traced run

    @property
    def reason(self) -> str:
        """Its status in words, with the disturbances that are left out where equal limbs are solved as one."""
        return with_equal_limbs(super().reason, self.stats)

    def results(self, settings: dict[str, Any] | None = None) -> Results:
        """Results as of any run, with the impulse at the start [N m s, N s], its energy [J], and means of beats."""
        d = self.diagnosis()
        found = results_of(self, d, settings)
        if self.steps.value is not None and self.steps.value.t.size:
            means = run_means(self.value.system, self.steps.value, np.asarray(self.value.time), found.attributes)
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
    whole: bool = False,
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
    - whole: limbs that are equal, go evenly around an axis, and do the same are solved all the same one by one; else
      one of them is, with its share of the body (without `until`).

    Returns a SimulationRun, a Solution whose value is a Trajectory up to where the run came; its status says why it
    ended there. Of a traced robot or state it runs in one piece, without `progress`, has all times, with NaN after an
    early end, and forward derivatives: those of the steps taken. Raises InputError for what is no robot, and for a
    time, sample count or tolerance that makes no sense.
    """
    time = read_positive(time, "time", "time")
    check_choice(method, METHODS, "method")
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
        kind, rtol, atol = "explicit", TIGHTER * rtol, TIGHTER * atol
    zero, step, *limits = all_on_device(0.0, min(1e-3, 5e-4 * time), rtol, atol, max_steps)
    stepping = Settings(kind, *limits)
    x, start = system.initial(), None
    if initial is not None:
        x = _of_robot(initial, x)
    elif isinstance(system, Robot) and system.prescribed_names:
        start = remembered(from_rest, system, zero, x)
        x = start.state
    limb = one_limb(system, x) if isinstance(system, Robot) and not (pure or whole or until) else None
    equations = reduced(system) if limb is None else limb.robot
    m = begin(zero, x if limb is None else limb.start, stepping, step)
    if pure:
        m, later = _integrate(equations, m, jnp.asarray(times[1:]), stepping, until)
        states = jax.tree.map(lambda a, b: jnp.concatenate([a[None], b]), x, later)
        return SimulationRun(Trajectory(system, jnp.asarray(times), states), m.status, _counts(m), zero, start=start)
    steps, most = [], _FIRST_CALL
    run = Bound(steps_long, equations, stepping)
    if until is not None:  # a Python function, which `Bound` does not take
        run = partial(_guarded, equations, stepping, guard=until)
    for end in times[1:][_rows(times.size - 1)] if progress else times[-1:]:
        while int(m.status) == Status.SOLVED and float(m.t) < end:
            began, before = monotonic(), int(m.steps)
            m, more, count = run(m, *all_on_device(end, most))
            more = jax.tree.map(lambda x, n=int(count): np.asarray(x)[:n], more)
            steps.append(more if limb is None else limb.whole_steps(more))
            most = max(int(_LONGEST_CALL / (monotonic() - began) * (int(m.steps) - before)), 1)
        if progress and int(m.status) == Status.SOLVED and progress(float(end) / time) is False:
            return _solution(system, m, x, times[times <= end], steps, Status.CANCELLED, start, limb)
    return _solution(system, m, x, times, steps, Status(int(m.status)), start, limb)


@runs_long
def steps_long(
    system: Mechanical,
    settings: Settings,
    state: Integration,
    until: Float[Array, ""],
    most: Int[Array, ""],
    guard: Guard | None = None,
) -> tuple[Integration, AcceptedSteps, Int[Array, ""]]:
    """Call `steps_until`, as a function that `Bound` can name."""
    return steps_until(system, state, until, most, settings, guard)


_guarded, _integrate = eqx.filter_jit(steps_long), eqx.filter_jit(integrate)


def _counts(m: Integration) -> dict[str, Array]:
    memory = {} if m.memory is None else {"jacobians": m.memory.refreshes}
    return {"steps": m.steps, "rejected": m.rejected, **memory}


def _solution(
    system: Mechanical,
    m: Integration,
    x: State,
    times: np.ndarray,
    steps: list[AcceptedSteps],
    status: Status,
    start: ImpulsiveStart | None,
    limb: OneLimb | None,
) -> SimulationRun:
    times = times[times <= min(float(m.end), float(m.t))]
    if status == Status.EVENT:
        times = np.append(times[times < float(m.end)], float(m.end))
    first = jax.tree.map(lambda x: np.asarray(x)[None], x)
    state, taken = first, None
    if steps:
        taken = jax.tree.map(lambda *x: np.concatenate(x), *steps)
    if taken is not None and taken.t.size:
        later = states_at(taken, times[1:])
        state = jax.tree.map(lambda a, b: np.concatenate([a, b]), first, later)
    trajectory = Trajectory(system, on_device(times), jax.tree.map(on_device, state))
    counts = _counts(m) | ({} if limb is None else {EQUAL_LIMBS: on_device(limb.count)})
    return SimulationRun(trajectory, status, counts, on_device(0.0), start=start, steps=Untraced(taken))


def _rows(n: int) -> np.ndarray:
    """Places among n samples after which progress is told: about twenty, of many samples every twentieth."""
    width = min(-(-n // _ROWS), _WIDEST)
    return np.minimum(np.arange(width - 1, n + width - 1, width), n - 1)


def _of_robot(given: State, own: State) -> State:
    """A state of the robot whose initial state is `own`; `()` stands for no states of loads, however many loads.

    Raises InputError where it is not one of this robot: it has other coordinates, or other states of loads.
    """
    shapes, expected = ([np.shape(leaf) for leaf in jax.tree.leaves(x)] for x in (given, own))
    if shapes == expected and len(expected) == 2:
        return State(given.q, given.v, own.z)
    if jax.tree.structure(given) != jax.tree.structure(own) or shapes != expected:
        has = f"{np.size(given.q)} coordinates and {len(shapes) - 2} states of loads"
        needs = f"{np.size(own.q)} and {len(expected) - 2}"
        words = f"it is of a robot of another structure: it has {has}, where this robot has {needs}."
        raise InputError(f"{words} State(q, v, robot.initial().z) takes the motion over.", field="initial")
    return given


def _check(time: float, times: np.ndarray, rtol: float, atol: float) -> None:
    if times.ndim != 1 or times.size < 2:
        raise InputError(f"{times.size} times; at least 2 are needed, the start and the end.", field="samples")
    if times[0] != 0 or times[-1] != time or not np.all(np.diff(times) > 0):
        raise InputError(f"the times must increase from 0 to {time:g} s.", field="samples")
    check_share(rtol, "rtol")
    check_share(atol, "atol")
