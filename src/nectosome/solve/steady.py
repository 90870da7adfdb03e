"""Steady motion (relative equilibrium) of a robot with steady drives, its stability, and what it does without one."""

from collections.abc import Iterable
from typing import Any, ClassVar, Literal, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core import Solution, State, Status, safe_norm
from nectosome.core.programs.remember import remembered
from nectosome.core.rows import on_device
from nectosome.core.se3 import dot_t
from nectosome.core.tracers import traced, without_derivatives
from nectosome.mechanism import Robot, continuous_loops
from nectosome.model import RobotLike, robot_of, robot_without_ramps
from nectosome.units import InputError

from .branches import settle
from .equilibrium import equilibrium
from .results import Run, at_one_time
from .simulate import simulate
from .small_motions import Stability, eigenvalues, is_stable, small_motion
from .stream import goes_along, in_still_water, in_stream, water_velocity
from .symmetry import Symmetry, find_symmetry

_STILL = 1e-3  # [largest velocity] amplitude that counts as steady
_ALIKE = 0.98  # autocorrelation of a velocity at one period


class Regime(NamedTuple):
    """Kind of motion at the end of a run."""

    kind: Literal["steady", "oscillating", "irregular", "lost"]
    frequency: float  # [Hz] of an oscillation; else NaN

    def __str__(self) -> str:
        words = {
            "steady": "it settles to a steady motion",
            "oscillating": f"it keeps oscillating at {self.frequency:.3g} Hz (limit cycle)",
            "irregular": "it keeps moving without a period",
            "lost": "the run stops before its end (divergence)",
        }
        return words[self.kind]


def regime_of(run: Run) -> Regime:
    """Regime of the last half of a run, from its velocities at even samples."""
    if int(run.status) != Status.SOLVED:
        return Regime("lost", float("nan"))
    v, time = np.asarray(run.value.state.v), np.asarray(run.value.time)
    size = np.maximum(np.max(np.abs(v), axis=0), 1e-9)
    if np.max(np.ptp(v[3 * time.size // 4 :], axis=0) / size) <= _STILL:
        return Regime("steady", float("nan"))
    v = v[time.size // 2 :]
    widest = v[:, np.argmax(np.std(v, axis=0) / size)]
    lags = np.arange(1, 2 * widest.size // 3)
    alike = np.array([np.corrcoef(widest[:-k], widest[k:])[0, 1] for k in lags])
    below = np.flatnonzero(alike < 0)
    if not below.size:
        return Regime("irregular", float("nan"))
    best = below[0] + int(np.argmax(alike[below[0] :] >= _ALIKE))
    if alike[best] < _ALIKE:
        return Regime("irregular", float("nan"))
    while best + 1 < alike.size and alike[best + 1] > alike[best]:
        best += 1
    return Regime("oscillating", 1 / (lags[best] * (time[1] - time[0])))


class Steady(Run):
    """Steady motion: a Run with one sample. `stats["growth"]` [1/s] is the largest real part of its eigenvalues."""

    # complex [1/s], the fastest growing first; empty if unsolved or traced
    eigenvalues: np.ndarray = eqx.field(kw_only=True)
    title: ClassVar[str] = "steady motion"

    @property
    def stability(self) -> Stability:
        """Of its eigenvalues."""
        return Stability.of(self.eigenvalues)

    @property
    def reason(self) -> str:
        """Its status in words, with what small motions do."""
        status = Status(int(self.status))
        return self.stability.says(status) if status in (Status.SOLVED, Status.UNSTABLE) else status.reason

    @property
    def velocity(self) -> Float[Array, "3"]:
        """Of the first part's first station through the water, in its own frame [m/s]."""
        return remembered(velocity_of, self.value.system, self.state)

    @property
    def speed(self) -> Float[Array, ""]:
        """Of the first part's first station through the water [m/s]."""
        return safe_norm(self.velocity)

    @property
    def forward_speed(self) -> Float[Array, ""]:
        """The same along the robot's forward axis [m/s]; negative where it goes backwards."""
        return self.velocity @ self.value.system.ahead

    def instead(self, time: float = 10.0) -> Regime:
        """Regime that the robot reaches from rest in a simulation of `time` [s], for a robot without steady motion."""
        return regime_of(simulate(self.value.system, time, samples=int(100 * time) + 1, whole=True))


def steady(robot: RobotLike, *, settings: Iterable[str] = (), guess: State | None = None) -> Steady:
    """Relative equilibrium of a robot: all that its equations depend on stays as it is, the rest goes on evenly.

    The robot is given by name, path, description or built, with `settings` such as "E=3MPa". It is looked for from
    `guess` (a state nearby, such as that of a similar robot), else from rest, and in a uniform current that carries it
    along seen from the water; ramps of drives are left out, and loops
    of servos are continuous, whatever their update rates. Status SOLVED; UNSTABLE where small disturbances grow (the
    equilibrium is handed over all the same); NO_EQUILIBRIUM where none was found; UNSTEADY_DRIVES where drives or loads
    change with time. Scaled residual at most 1e-10, else it is not solved. Derivatives with respect to the robot,
    forward and reverse, are those of the implicit function theorem; a traced robot has its status, and no eigenvalues.
    Raises InputError for what is no robot, and where nothing is free to move.
    """
    outside = continuous_loops(robot_without_ramps(robot_of(robot, settings)))
    carried = goes_along(outside)
    robot = in_still_water(outside) if carried else outside
    if not robot.tree.free_v.size:
        raise InputError("nothing of this robot is free to move: it has no steady state to be found.")
    symmetry, zero = find_symmetry(robot), on_device(0.0)

    def back(x: State) -> State:
        """As it is seen from the ground."""
        return remembered(in_stream, outside, zero, x) if carried else x

    x = robot.initial() if guess is None else in_stream(outside, zero, guess, -1.0) if carried else guess
    if not symmetry.steady:
        return _result(outside, back(x), Status.UNSTEADY_DRIVES, {}, np.zeros(0), on_device(np.nan))
    found: Solution = remembered(equilibrium_of, robot, symmetry, x, on_device(guess is not None))
    if traced(found):
        there, at = without_derivatives((robot, found.value.state))
        shaky = (found.status == int(Status.SOLVED)) & ~remembered(is_stable, there, at, symmetry)
        status = jnp.where(shaky, int(Status.UNSTABLE), found.status)
        where = at_one_time(outside, back(found.value.state))
        return Steady(where, status, found.stats, found.residual, eigenvalues=np.zeros(0, complex))
    if int(found.status) != Status.SOLVED and guess is None and not np.any(symmetry.rates(robot.start.v.size)):
        falls: Solution = remembered(settle, robot, x)  # a motion without rates is rest, such as on a stop
        if int(falls.status) == Status.SOLVED:
            found = remembered(equilibrium_of, robot, symmetry, falls.value, on_device(True))
    state, status = found.value.state, Status(int(found.status))
    values = np.zeros(0, complex)
    stats: dict[str, Any] = dict(found.stats)
    if status == Status.SOLVED:
        values = eigenvalues(small_motion(robot, state), symmetry)
        stats["growth"] = values[0].real if values.size else 0.0
        if not Stability.of(values).stable:
            status = Status.UNSTABLE
    return _result(outside, back(state), status, stats, values, found.residual)


def velocity_of(robot: Robot, x: State) -> Float[Array, "3"]:
    """Velocity of the first part's first station through the water, in its own frame [m/s]."""
    q, v, _ = robot.tree.complete(jnp.zeros(()), x.q, x.v)
    shape = robot.tree.shape(q)
    flow = water_velocity(robot, jnp.zeros(1), shape.position[:1])[0]
    return robot.tree.twists(shape, v)[0, 3:] - dot_t(shape.rotation[0], flow)


def equilibrium_of(robot: Robot, symmetry: Symmetry, guess: State, warm: Any) -> Solution:
    """Call `equilibrium`, as a module function that `remembered` can name."""
    return equilibrium(robot, symmetry, guess, warm)


def _result(robot: Robot, x: State, status: Status, stats: dict[str, Any], values: np.ndarray, left) -> Steady:
    stats = {key: on_device(value) for key, value in stats.items()}
    return Steady(at_one_time(robot, x), status, stats, left, eigenvalues=values)
