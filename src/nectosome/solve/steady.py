"""Steady motion (relative equilibrium) of a robot with steady drives, found as a root, and its stability."""

from typing import Any, ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from nectosome.core import Solution, State, Status
from nectosome.core.remember import remembered
from nectosome.mechanism import Robot

from .equilibrium import equilibrium
from .regime import Regime, regime_of
from .results import Run, Trajectory
from .simulate import simulate
from .stability import modes
from .symmetry import Symmetry, find_symmetry

_NEUTRAL = 1e-7  # [largest eigenvalue] below, growth is rounding


class Steady(Run):
    """Steady motion: a Run with one sample. `stats["growth"]` [1/s] is the largest real part of its eigenvalues."""

    eigenvalues: np.ndarray = eqx.field(kw_only=True)  # complex [1/s], the fastest growing first; empty if unsolved
    title: ClassVar[str] = "steady motion"

    @property
    def state(self) -> State:
        """State at t = 0."""
        return jax.tree.map(lambda x: x[0], self.value.state)

    def instead(self, time: float = 10.0) -> Regime:
        """Regime that the robot reaches from rest in a simulation of `time` [s], for a robot without steady motion."""
        return regime_of(simulate(self.value.system, time, samples=int(100 * time) + 1))


def steady(robot: Robot, *, guess: State | None = None) -> Steady:
    """Relative equilibrium of a robot: a constant shape, and constant rates along the symmetry.

    The search starts from `guess` (such as the state of a similar robot), else from rest. Status SOLVED; UNSTABLE if
    small disturbances grow (the equilibrium is returned); NO_EQUILIBRIUM if none was found; UNSTEADY_DRIVES if drives
    or loads change with time. The scaled residual of a solution is at most 1e-10. Raises ValueError for a robot without
    free coordinates. For derivatives, jit and vmap see `equilibrium`.
    """
    if not robot.tree.free_v.size:
        raise ValueError("nothing of this robot is free to move: it has no steady state to be found.")
    symmetry = find_symmetry(robot)
    x = robot.initial() if guess is None else guess
    if not symmetry.steady:
        return _result(robot, x, Status.UNSTEADY_DRIVES, {}, np.zeros(0), jnp.asarray(jnp.nan))
    found: Solution = remembered(equilibrium_of, robot, symmetry, x, jnp.asarray(guess is not None))
    state, status = found.value.state, Status(int(found.status))
    eigenvalues = np.zeros(0, complex)
    stats: dict[str, Any] = dict(found.stats)
    if status == Status.SOLVED:
        eigenvalues = modes(robot, symmetry, state)
        stats["growth"] = eigenvalues[0].real if eigenvalues.size else 0.0
        if stats["growth"] > _NEUTRAL * np.max(np.abs(eigenvalues), initial=0.0):
            status = Status.UNSTABLE
    return _result(robot, state, status, stats, eigenvalues, found.residual)


def equilibrium_of(robot: Robot, symmetry: Symmetry, guess: State, warm: Any) -> Solution:
    """Call `equilibrium`, as a module function that `remembered` can name."""
    return equilibrium(robot, symmetry, guess, warm)


def _result(robot: Robot, x: State, status: Status, stats: dict[str, Any], eigenvalues: np.ndarray, residual) -> Steady:
    trajectory = Trajectory(robot, jnp.zeros(1), jax.tree.map(lambda x: jnp.asarray(x)[None], x))
    stats = {key: jnp.asarray(value) for key, value in stats.items()}
    return Steady(trajectory, jnp.asarray(int(status)), stats, residual, eigenvalues=eigenvalues)
