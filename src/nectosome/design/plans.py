"""Programs from a design to the quantities of its motion, steady or periodic, and their slopes."""

from abc import abstractmethod
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core import State
from nectosome.mechanism import Robot, in_plane
from nectosome.robots import Blueprint, fill
from nectosome.solve import Symmetry, cycle_means, equilibrium
from nectosome.solve.orbit import cycle_settings, orbit

from .quantities import QUANTITIES, Stroke, Swim

_SAMPLES, _RTOL = 257, 1e-5  # of a cycle


class Numbers(NamedTuple):
    """What the programs of a design take besides the design itself."""

    values: Float[Array, "k"]  # of the robot, in the order of its blueprint
    ends: Float[Array, "n 2"]  # of the box, logarithms where a variable has them
    period: Float[Array, ""]  # of a cycle [s], times the variable that it is inverse to; NaN of a steady motion


class Found(NamedTuple):
    """What the motion of a design gives."""

    quantities: Float[Array, "k"]
    status: Array
    residual: Array
    state: State  # of the steady motion, or at the start of a cycle


class Plan(eqx.Module):
    """What a program depends on besides numbers."""

    blueprint: Blueprint
    symmetry: Symmetry
    where: tuple[tuple[int, ...], ...] = eqx.field(static=True)  # of each variable among the robot's numbers
    log: tuple[bool, ...] = eqx.field(static=True)
    used: tuple[str, ...] = eqx.field(static=True)
    forward: tuple[float, float, float] = eqx.field(static=True)

    def robot(self, numbers: Numbers, u: Array) -> tuple[Robot, Array]:
        """Robot of a design, and the values of its variables."""
        x = numbers.ends[:, 0] + u * (numbers.ends[:, 1] - numbers.ends[:, 0])
        log = np.array(self.log)
        x = jnp.where(log, jnp.exp(jnp.where(log, x, 0.0)), x)
        values = numbers.values
        for k, group in enumerate(self.where):
            values = values.at[np.array(group)].set(x[k])
        return fill(self.blueprint, values), x

    @abstractmethod
    def found(self, numbers: Numbers, u: Array, guess: State, warm: Array) -> Found:
        """What the motion of a design gives, looked for from a state; `warm` where that is of a design nearby."""


class SteadyPlan(Plan):
    """The motion is steady."""

    def found(self, numbers: Numbers, u: Array, guess: State, warm: Array) -> Found:
        """By the equilibrium of forces."""
        robot, _ = self.robot(numbers, u)
        solution = equilibrium(robot, self.symmetry, guess, warm)
        swim = Swim(robot, solution.value, self.forward)
        quantities = jnp.stack([QUANTITIES[name].of_steady(swim) for name in self.used])
        return Found(quantities, solution.status, solution.residual, solution.value.state)


class CyclePlan(Plan):
    """The motion repeats itself with the drives."""

    flat: bool = eqx.field(static=True)  # it stays in the plane
    pace: int = eqx.field(static=True)  # which variable the period is inverse to; -1: none

    def found(self, numbers: Numbers, u: Array, guess: State, warm: Array) -> Found:
        """By the periodic orbit."""
        robot, x = self.robot(numbers, u)
        period = numbers.period / jnp.abs(x[self.pace]) if self.pace >= 0 else numbers.period
        times = jnp.linspace(0.0, 1.0, _SAMPLES) * period
        settings = cycle_settings("implicit", jax.lax.stop_gradient(period), _RTOL, 1e-2 * _RTOL)
        system = in_plane(robot) if self.flat else robot
        solution = orbit(system, self.symmetry, guess, times, settings)
        states = solution.value.states
        stroke = Stroke(cycle_means(robot, times, states), self.forward)
        quantities = jnp.stack([QUANTITIES[name].of_cycle(stroke) for name in self.used])
        return Found(quantities, solution.status, solution.residual, jax.tree.map(lambda x: x[0], states))


_Judged = tuple[Found, Array]


def judge(plan: Plan, numbers: Numbers, u: Array, guess: State, warm: Array) -> _Judged:
    """What the motion of a design u gives, and no slopes [0]."""
    return plan.found(numbers, u, guess, warm), jnp.zeros(0)


def judge_with_slopes(plan: Plan, numbers: Numbers, u: Array, guess: State, warm: Array) -> _Judged:
    """What the motion of a design u gives, and the slopes of its quantities [k, n]."""

    def quantities(u: Array) -> tuple[Array, Found]:
        found = plan.found(numbers, u, guess, warm)
        return found.quantities, found

    slopes, found = jax.jacfwd(quantities, has_aux=True)(u)
    return found, slopes
