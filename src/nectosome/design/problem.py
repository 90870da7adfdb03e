"""A steady motion as a design task: variables of a robot, an objective, constraints."""

import hashlib
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Float

from nectosome.core import Solution, State, Status
from nectosome.core.remember import remembered
from nectosome.io import InputError, RobotDescription, did_you_mean, dump_robot, resolve, with_values
from nectosome.robots import Blueprint, blueprint_of, build, fill
from nectosome.solve import Symmetry, equilibrium, find_symmetry

from .constraints import Constraint
from .quantities import QUANTITIES, Swim
from .record import Compute
from .task import Evaluation, Task
from .variables import Box, Variable

_TOLD = ("speed", "torque", "power", "drive_rate")  # remembered of every evaluation
FORWARD = {
    "x": (1.0, 0.0, 0.0),
    "-x": (-1.0, 0.0, 0.0),
    "y": (0.0, 1.0, 0.0),
    "-y": (0.0, -1.0, 0.0),
    "z": (0.0, 0.0, 1.0),
    "-z": (0.0, 0.0, -1.0),
}


class Numbers(NamedTuple):
    """What the programs of a design take besides the design itself."""

    values: Float[Array, "k"]  # of the robot, in the order of its blueprint
    ends: Float[Array, "n 2"]  # of the box, logarithms where a variable has them


@dataclass(frozen=True)
class SteadyDesign(Task):
    """Make a quantity of the steady motion as good as it gets, within ranges and limits.

    - description: the robot; what is no variable stays as it is there.
    - objective: a name of `QUANTITIES`, made high or low as it says.
    - forward: `x`, `-x`, ... `-z`: the direction of the world in which speed counts.

    Raises InputError for an unknown objective or direction, no variable, or one that is named twice.
    """

    description: RobotDescription
    variables: tuple[Variable, ...]
    objective: str = "speed"
    constraints: tuple[Constraint, ...] = ()
    forward: str = "x"
    names: tuple[str, ...] = field(init=False)
    constraint_names: tuple[str, ...] = field(init=False)

    def __post_init__(self) -> None:
        """Check what can be checked before anything is computed."""
        if self.objective not in QUANTITIES:
            near = did_you_mean(self.objective, QUANTITIES)
            raise InputError(f'"{self.objective}" is no quantity of a steady motion.{near}', field="objective")
        if self.forward not in FORWARD:
            raise InputError(f'"{self.forward}" is no direction. Write one of {", ".join(FORWARD)}.', field="forward")
        if not self.variables:
            raise InputError("there is nothing to choose: at least one variable is needed.", field="variables")
        paths = [path for v in self.variables for path in resolve(self.description, v.name)]
        double = next((path for path in paths if paths.count(path) > 1), None)
        if double is not None:
            raise InputError(f"{double} is named twice.", field="variables")
        object.__setattr__(self, "names", tuple(v.name for v in self.variables))
        object.__setattr__(self, "constraint_names", tuple(str(c) for c in self.constraints))

    @property
    def box(self) -> Box:
        """From the unit box to values and back."""
        return Box(self.variables)

    def key(self) -> str:
        """Text of all that the numbers depend on."""
        ranges = "; ".join(f"{v.name} {v.text()}" for v in self.variables)
        robot = hashlib.sha256(dump_robot(self.description).encode()).hexdigest()[:16]
        limits = "; ".join(self.constraint_names) or "none"
        return f"{self.objective} along {self.forward} over {ranges}; limits: {limits}; robot {robot}"

    def robot_at(self, u: Float[np.ndarray, "n"]) -> RobotDescription:
        """Description of the robot at a design."""
        values = self.box.values(u)
        return with_values(self.description, {v.name: float(x) for v, x in zip(self.variables, values, strict=True)})

    def accepts(self, evaluation: Evaluation) -> str:
        """A start must be solved, keep all limits and swim forward."""
        refused = super().accepts(evaluation)
        return refused or ("swims backward" if evaluation.outputs["speed"] <= 0 else "")

    def symmetry(self) -> Symmetry:
        """Symmetry of the robot. Raises InputError where it has no steady motion, whatever its numbers."""
        try:
            symmetry = find_symmetry(build(self.description))
        except ValueError as error:
            raise InputError(str(error), field=self.description.name) from None
        if not symmetry.steady:
            raise InputError(f"{self.description.name} has no steady motion: {Status.UNSTEADY_DRIVES.reason}.")
        return symmetry

    def plan(self) -> tuple["Plan", Numbers]:
        """What the programs of a design need: what they depend on besides numbers, and the numbers."""
        symmetry = self.symmetry()
        groups = [tuple(resolve(self.description, v.name)) for v in self.variables]
        blueprint, numbers = blueprint_of(self.description, tuple(path for group in groups for path in group))
        wanted = {self.objective, *(name for c in self.constraints for name in c.weights), *_TOLD}
        used = [name for name in QUANTITIES if name in wanted]  # in one order: what asks for the same is one program
        where = tuple(tuple(blueprint.paths.index(path) for path in group) for group in groups)
        log = tuple(v.log for v in self.variables)
        return Plan(blueprint, symmetry, where, log, tuple(used), FORWARD[self.forward]), Numbers(
            numbers, jnp.asarray(self.box.ends)
        )

    def prepare(self) -> Compute:
        """Return evaluate(u, slopes, memory); the memory is the state of a steady motion nearby."""
        plan, numbers = self.plan()
        rest = build(self.description).initial()
        _, unravel = ravel_pytree(rest)
        sign = -1.0 if QUANTITIES[self.objective].best == "high" else 1.0

        def evaluate(u: np.ndarray, slopes: bool, memory: np.ndarray | None) -> Evaluation:
            guess, warm = (rest, False) if memory is None else (unravel(jnp.asarray(memory)), True)
            program = judge_with_slopes if slopes else judge
            found, steep, solution = remembered(
                program, plan, numbers, jnp.asarray(u, dtype=float), guess, jnp.asarray(warm)
            )
            status = Status(int(solution.status))
            if status != Status.SOLVED:
                return Evaluation.unsolved(u, len(self.constraints), status.reason)
            values = dict(zip(plan.used, np.asarray(found).tolist(), strict=True))
            evaluation = Evaluation(
                u,
                sign * values[self.objective],
                np.array([c.excess(values) for c in self.constraints]),
                outputs={name: values[name] for name in dict.fromkeys((*_TOLD, self.objective))},
                memory=np.asarray(ravel_pytree(solution.value.state)[0]),
            )
            if not slopes:
                return evaluation
            slope = dict(zip(plan.used, np.asarray(steep), strict=True))
            rows = [c.slope(slope) for c in self.constraints]
            return replace(
                evaluation,
                slope=sign * slope[self.objective],
                constraint_slopes=np.array(rows).reshape(len(self.constraints), len(u)),
            )

        return evaluate


class Plan(eqx.Module):
    """What the programs below depend on besides numbers."""

    blueprint: Blueprint
    symmetry: Symmetry
    where: tuple[tuple[int, ...], ...] = eqx.field(static=True)  # of each variable among the robot's numbers
    log: tuple[bool, ...] = eqx.field(static=True)
    used: tuple[str, ...] = eqx.field(static=True)
    forward: tuple[float, float, float] = eqx.field(static=True)


_Judged = tuple[Array, Array, Solution]


def judge(plan: Plan, numbers: Numbers, u: Array, guess: State, warm: Array) -> _Judged:
    """Quantities [k] of the steady motion of a design u, no slopes [0], and the solution."""
    found, solution = _quantities(plan, numbers, u, guess, warm)
    return found, jnp.zeros(0), solution


def judge_with_slopes(plan: Plan, numbers: Numbers, u: Array, guess: State, warm: Array) -> _Judged:
    """Quantities [k] of the steady motion of a design u, their slopes [k, n], and the solution."""

    def found(u: Array) -> tuple[Array, tuple[Array, Solution]]:
        values, solution = _quantities(plan, numbers, u, guess, warm)
        return values, (values, solution)

    slopes, (values, solution) = jax.jacfwd(found, has_aux=True)(u)
    return values, slopes, solution


def _quantities(plan: Plan, numbers: Numbers, u: Array, guess: State, warm: Array) -> tuple[Array, Solution]:
    values, ends = numbers
    x = ends[:, 0] + u * (ends[:, 1] - ends[:, 0])
    log = np.array(plan.log)
    x = jnp.where(log, jnp.exp(jnp.where(log, x, 0.0)), x)
    for k, group in enumerate(plan.where):
        values = values.at[np.array(group)].set(x[k])
    robot = fill(plan.blueprint, values)
    solution = equilibrium(robot, plan.symmetry, guess, warm)
    swim = Swim(robot, solution.value, plan.forward)
    return jnp.stack([QUANTITIES[name].of(swim) for name in plan.used]), solution
