"""Programs from a design, or one of its equal limbs, to quantities of its motion or rest, and their derivatives."""

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core import State, Status, safe_norm
from nectosome.core.programs.remember import runs_long
from nectosome.core.se3 import dot, dot_t
from nectosome.core.tracers import Untraced
from nectosome.description import RobotDescription, numeric_paths, resolve, with_values
from nectosome.mechanism import Free, Planar, Robot, continuous_loops, in_plane
from nectosome.model import Template, build, instantiate, template_of
from nectosome.solve import Symmetry, cycle_means, equilibrium, in_still_water, with_stream
from nectosome.solve.equal_limbs import OneLimb, one_limb, with_one_limb
from nectosome.solve.orbit import cycle_settings, orbit

from .quantities import AT_REST, QUANTITIES, AtRest, PeriodicSwim, SteadySwim

SAMPLES = 257  # of a cycle
_RTOL = 1e-5


class AlikeLimbs(eqx.Module):
    """One of the equal limbs of all designs, as a template to be filled with the numbers of a design."""

    one: OneLimb  # of the robot as its file describes it
    template: Template
    numbers: Float[Array, "k"]
    where: tuple[tuple[int, ...], ...] = eqx.field(static=True)  # of each variable among the numbers

    def of(self, whole: Robot, x: Float[Array, "n"]) -> OneLimb:
        """That of the robot of a design, whose variables have the values x; both may be traced."""
        numbers = self.numbers
        for k, group in enumerate(self.where):
            numbers = numbers.at[np.array(group, int)].set(x[k])
        part = replace(instantiate(self.template, numbers), water=whole.water, share=self.one.robot.share)
        return replace(self.one, whole=whole, robot=replace(part, made_from=Untraced()))


def alike_limbs(
    description: RobotDescription, names: Sequence[str], corners: Sequence[Mapping[str, float]], carried: bool
) -> AlikeLimbs | None:
    """Limbs that all do the same in a robot and in its designs at all `corners`, which set one of the `names` each.

    None where there are none, and where a design's part is not that of the robot with the number of its variable:
    batteries, which serve one limb there, and places of the first part are variables of the whole.
    """
    limbs, parts = list[OneLimb](), list[RobotDescription]()
    for values in ({}, *corners):
        design = with_values(description, values)
        robot = in_still_water(build(design)) if carried else build(design)
        limb = one_limb(robot, robot.initial())
        if limb is None or (limbs and not _alike(limb, limbs[0])):
            return None
        limbs.append(limb)
        parts.append(with_one_limb(design))
    known = numeric_paths(parts[0])
    inside = {name: tuple(path for path in resolve(description, name) if path in known) for name in names}
    also = tuple(path for group in inside.values() for path in group)
    template, numbers = template_of(parts[0], also)
    places = {name: tuple(map(template.paths.index, group)) for name, group in inside.items()}
    for values, part in zip(corners, parts[1:], strict=True):
        other, own = template_of(part, also)
        expected = np.array(numbers)
        for name, value in values.items():
            expected[[*places[name]]] = value
        if other.plan != template.plan or not np.array_equal(expected, np.asarray(own)):
            return None
    return AlikeLimbs(limbs[0], template, numbers, tuple(places.values()))


def _alike(one: OneLimb, other: OneLimb) -> bool:
    """Whether states of both parts make states of their robots alike."""
    if (one.count, one.rows, one.own_rows) != (other.count, other.rows, other.own_rows):
        return False
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in ("origin", "of_q", "of_v"))


class PlanInputs(NamedTuple):
    """What the programs of a design take besides the design itself."""

    values: Float[Array, "k"]  # of the robot, in the order of its template
    ends: Float[Array, "n 2"]  # of the box, logarithms where a variable has them
    period: Float[Array, ""]  # of a cycle [s], times the variable that it is inverse to; NaN where there is none known
    drawn: Float[Array, "2 k"] | None = None  # factors on the values of a design, and what is added then


class MotionQuantities(NamedTuple):
    """Quantities of the motion of a design, and how it was solved."""

    quantities: Float[Array, "k"]
    status: Array
    residual: Array
    state: State  # of the steady motion, or at the start of a cycle


class Plan(eqx.Module):
    """What a program depends on besides numbers."""

    template: Template
    where: tuple[tuple[int, ...], ...] = eqx.field(static=True)  # of each variable among the robot's numbers
    log: tuple[bool, ...] = eqx.field(static=True)
    used: tuple[str, ...] = eqx.field(static=True)

    def robot(self, numbers: PlanInputs, u: Array) -> tuple[Robot, Array]:
        """Robot of a design, and the values of its variables."""
        x = numbers.ends[:, 0] + u * (numbers.ends[:, 1] - numbers.ends[:, 0])
        log = np.array(self.log)
        x = jnp.where(log, jnp.exp(jnp.where(log, x, 0.0)), x)
        values = numbers.values
        for k, group in enumerate(self.where):
            values = values.at[np.array(group)].set(x[k])
        values = values if numbers.drawn is None else values * numbers.drawn[0] + numbers.drawn[1]
        return instantiate(self.template, values), x

    @abstractmethod
    def motion(self, numbers: PlanInputs, u: Array, guess: State, warm: Array) -> MotionQuantities:
        """Solve for the motion of a design from a state; `warm` where that is of a design nearby."""


class RestPlan(Plan):
    """The robot floats or hangs at rest, weight and buoyancy alone."""

    def motion(self, numbers: PlanInputs, u: Array, guess: State, warm: Array) -> MotionQuantities:
        """By the least potential of both."""
        resting = AtRest(self.robot(numbers, u)[0])
        quantities = jnp.stack([AT_REST[name].of(resting) for name in self.used])
        status = jnp.where(resting.lies.solved, int(Status.SOLVED), int(Status.NO_EQUILIBRIUM))
        return MotionQuantities(quantities, status, jnp.zeros(()), guess)


class MovingPlan(Plan):
    """The robot moves."""

    symmetry: Symmetry
    forward: tuple[float, float, float] = eqx.field(static=True)
    carried: bool = eqx.field(static=True)  # by a uniform current: its states are those seen from the water


class SteadyPlan(MovingPlan):
    """The motion is steady."""

    def motion(self, numbers: PlanInputs, u: Array, guess: State, warm: Array) -> MotionQuantities:
        """By the equilibrium of forces."""
        outside = continuous_loops(self.robot(numbers, u)[0])
        robot = in_still_water(outside) if self.carried else outside
        solution = equilibrium(robot, self.symmetry, guess, warm)
        carried = outside.water.flow(jnp.zeros(()), jnp.zeros((1, 3)))[0][0] if self.carried else jnp.zeros(3)
        swim = SteadySwim(robot, solution.value, self.forward, carried)
        quantities = jnp.stack([QUANTITIES[name].of_steady(swim) for name in self.used])
        return MotionQuantities(quantities, solution.status, solution.residual, solution.value.state)


class CyclePlan(MovingPlan):
    """The motion repeats itself with the drives, or with the turns of a motor, which find their own period."""

    flat: bool = eqx.field(static=True)  # it stays in the plane
    inverse_to: int = eqx.field(static=True)  # which variable the period is inverse to; -1: none
    samples: int = eqx.field(static=True)  # of a cycle
    limbs: AlikeLimbs | None  # where all of them do the same, one is solved

    def motion(self, numbers: PlanInputs, u: Array, guess: State, warm: Array) -> MotionQuantities:
        """By the periodic orbit."""
        robot, x = self.robot(numbers, u)
        period = numbers.period / jnp.abs(x[self.inverse_to]) if self.inverse_to >= 0 else numbers.period
        unknown = self.symmetry.crank is not None
        period = jnp.ones(()) if unknown else period
        times = jnp.linspace(0.0, 1.0, self.samples) * period
        settings = cycle_settings("implicit", jax.lax.stop_gradient(period), _RTOL, 1e-2 * _RTOL)
        still = in_still_water(robot) if self.carried else robot
        limb = None if self.limbs is None else self.limbs.of(still, x)
        system = limb.robot if limb is not None else in_plane(still) if self.flat else still
        solution = orbit(system, self.symmetry, guess, times, settings)
        states = solution.value.states
        start = jax.tree.map(lambda x: x[0], states)
        states = states if limb is None else jax.vmap(limb.whole_state)(states)
        times = times * solution.value.period if unknown else times
        states = with_stream(robot, times, states) if self.carried else states
        swim = PeriodicSwim(robot, cycle_means(robot, times, states), self._ahead(robot, states), times)
        quantities = jnp.stack([QUANTITIES[name].of_cycle(swim) for name in self.used])
        return MotionQuantities(quantities, solution.status, solution.residual, start)

    def _ahead(self, robot: Robot, states: State) -> Float[Array, "3"]:
        """Forward of a cycle: of a robot that may head anywhere, as its body is turned on the mean.

        With the rotations R of the body's first station, forward goes with the mean of $R(t) R_0^T$ from the pose in
        the file, R_0.
        """
        forward = jnp.asarray(self.forward)
        if self.limbs is not None:
            return forward  # the body goes along an axis of its own
        root = robot.tree.structure[0].joint
        turning = {i for i, name in enumerate(root.names) if name in ("angle", "wx", "wy", "wz")}
        if not issubclass(root, Planar | Free) or not (self.symmetry.spin or turning & set(self.symmetry.drift)):
            return forward

        def turned(x: State) -> Array:
            return robot.tree.shape(robot.tree.complete(jnp.zeros(()), x.q, x.v)[0]).rotation[0]

        first = dot_t(turned(robot.initial()), forward)
        ahead = jnp.mean(jax.vmap(lambda x: dot(turned(x), first))(jax.tree.map(lambda x: x[:-1], states)), axis=0)
        return ahead / safe_norm(ahead)


_Judged = tuple[MotionQuantities, Array]


@runs_long
def judge(plan: Plan, numbers: PlanInputs, u: Array, guess: State, warm: Array) -> _Judged:
    """Quantities of the motion of a design u, and no derivatives [0]."""
    return plan.motion(numbers, u, guess, warm), jnp.zeros(0)


@runs_long
def judge_with_derivatives(plan: Plan, numbers: PlanInputs, u: Array, guess: State, warm: Array) -> _Judged:
    """Quantities of the motion of a design u, and their derivatives [k, n]."""

    def quantities(u: Array) -> tuple[Array, MotionQuantities]:
        found = plan.motion(numbers, u, guess, warm)
        return found.quantities, found

    derivatives, found = jax.jacfwd(quantities, has_aux=True)(u)
    return found, derivatives
