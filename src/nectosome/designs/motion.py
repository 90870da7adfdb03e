"""A steady or periodic motion as a design task: variables of a robot, an objective, constraints."""

import hashlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core import Status
from nectosome.core.described import is_zero
from nectosome.core.programs.remember import remembered
from nectosome.core.rows import on_device
from nectosome.description import (
    DIRECTIONS,
    RobotDescription,
    check_no_ramps,
    check_no_update_rate,
    check_numbers,
    check_updates,
    drive_frequencies,
    drive_period,
    dump_robot,
    get_value,
    numeric_paths,
    resolve,
    samples_at_updates,
    update_rates,
    with_values,
    without_ramps,
)
from nectosome.description.drives import ServoDrive
from nectosome.description.variables import Variable, chosen_values
from nectosome.mechanism import Robot, moves_in_plane
from nectosome.model import Template, build, template_of
from nectosome.search import Evaluate, Evaluation
from nectosome.solve import find_symmetry, goes_along, in_still_water, with_crank
from nectosome.units import InputError, show_quantity
from nectosome.units.expression import Formula

from .constraints import Constraint
from .design_task import DesignTask
from .plans import (
    SAMPLES,
    CyclePlan,
    Plan,
    PlanInputs,
    RestPlan,
    SteadyPlan,
    alike_limbs,
    judge,
    judge_with_derivatives,
)
from .quantities import AT_REST, QUANTITIES, Objective, formula_of

_INSIDE = {"tension": "tendon", "pressure": "chamber"}  # quantities of what pulls and presses
_RECORDED = ("speed", "torque", "power", "drive_rate")  # of every evaluation
_DEMAND = "voltage_demand"  # of robots with servos too


@dataclass(frozen=True)
class MotionDesign(DesignTask):
    """Maximise or minimise a quantity of a robot's motion, within ranges and limits.

    The motion is the steady one, or the periodic one where the drives change with time. There is none where all
    quantities are those of `AT_REST`: the robot floats or hangs in the water with its joints as at the start.

    - description: the robot; quantities that are no variables stay as they are there.
    - objective: as `Problem` has it; `best`: whether a high or a low value is, as `QUANTITIES` say unless given, high
      of others.
    - forward: `x`, `-x`, ... `-z`: the direction of the world along which speed and thrust count.
    - whole: every limb is solved, also where equal ones do the same.

    Raises InputError for an unknown objective or direction, no variable, or one that is named twice.
    """

    description: RobotDescription
    variables: tuple[Variable, ...]
    objective: Objective = "speed"
    constraints: tuple[Constraint, ...] = ()
    forward: str = "x"
    best: Literal["", "high", "low"] = ""
    whole: bool = False

    def __post_init__(self) -> None:
        """Check what can be checked before anything is computed."""
        self.formula  # noqa: B018  it is read here
        if self.forward not in DIRECTIONS:
            known = ", ".join(DIRECTIONS)
            raise InputError(f'"{self.forward}" is no direction. Write one of {known}.', field="forward")
        self._check_variables()
        paths = [path for v in self.variables for path in resolve(self.description, v.name)]
        double = next((path for path in paths if paths.count(path) > 1), None)
        if double is not None:
            raise InputError(f"{double} is named twice.", field="variables")
        for check in (check_no_ramps, check_no_update_rate):
            check(self.description, self.names)

    @cached_property
    def formula(self) -> Formula:
        """The objective, of quantities by name."""
        return formula_of(self.objective, "objective")

    @property
    def objective_name(self) -> str:  # pyright: ignore[reportIncompatibleVariableOverride]
        """The objective as it is written; a function by its name with brackets."""
        return self.formula.text

    @property
    def constraint_names(self) -> tuple[str, ...]:  # pyright: ignore[reportIncompatibleVariableOverride]
        """The limits, as they are written."""
        return tuple(map(str, self.constraints))

    @property
    def units(self) -> dict[str, str]:
        """Units of the quantities that describe a design, the objective first."""
        names = self._needed() if self._rests else (*self.formula.names, "speed", "torque", "power")
        units = {name: QUANTITIES[name].unit for name in names}
        return {self.objective_name: self.formula.unit(units)} | units

    def show_output(self, name: str, value: float) -> str:
        """An output of an evaluation with its unit, for people."""
        if name in QUANTITIES:
            return show_quantity(value, QUANTITIES[name].dimension)
        return f"{value:.4g} {self.units[name].removesuffix('1')}".strip()

    @property
    def own(self) -> Float[np.ndarray, "n"]:
        """The robot's own numbers, as places in the ranges."""
        return self.box.design(self.description)

    def chosen(self, u: Float[np.ndarray, "n"]) -> str:
        """File of the robot at a design."""
        return dump_robot(self.robot_at(u))

    def key(self) -> str:
        """Text of all that the numbers depend on."""
        ranges = "; ".join(f"{v.name} {v.text()}" for v in self.variables)
        robot = hashlib.sha256(dump_robot(self.description).encode()).hexdigest()[:16]
        limits = "; ".join(self.constraint_names) or "none"
        sense = "" if self.best in ("", self._usual) else f"{self.best} "
        limbs = "; every limb" if self.whole else ""
        return f"{sense}{self.formula.key} along {self.forward} over {ranges}; limits: {limits}; robot {robot}{limbs}"

    @property
    def highest(self) -> bool:
        """Whether the objective is maximised."""
        return (self.best or self._usual) == "high"

    @property
    def _usual(self) -> str:
        name = self.formula.text
        return QUANTITIES[name].best if name in QUANTITIES else "high"

    def robot_at(self, u: Float[np.ndarray, "n"]) -> RobotDescription:
        """Description of the robot at a design; a variable with +- keeps it, as a share unless it may be negative."""
        return with_values(self.description, chosen_values(self.description, self.values(u)))

    def accepts(self, evaluation: Evaluation) -> str:
        """A start must be solved, keep all limits and not swim backward; at rest derivatives lead to the limits."""
        if self._rests:
            return evaluation.reason  # what is neutral and level is too rare to be drawn
        refused = super().accepts(evaluation)
        return refused or ("swims backward" if evaluation.outputs.get("speed", 0.0) < 0 else "")

    def _needed(self) -> list[str]:
        """Quantities that objective and constraints are made of."""
        return [*self.formula.names, *(name for c in self.constraints for name in c.weights)]

    def _recorded(self) -> list[str]:
        """Quantities of every evaluation besides."""
        if self._rests:
            return []
        return [*_RECORDED, *([_DEMAND] if self._has_servos else [])]

    @property
    def _rests(self) -> bool:
        """Whether only quantities of the robot at rest are asked for: no motion is looked for then."""
        return {*self._needed()} <= AT_REST.keys()

    @property
    def may_saturate(self) -> bool:
        """Whether it has servos that move it, whose voltage may not be enough."""
        return self._has_servos and not self._rests

    @property
    def _has_servos(self) -> bool:
        return any(isinstance(drive, ServoDrive) for _, drive in self.description.powered.values())

    @property
    def _without_ramps(self) -> RobotDescription:
        return without_ramps(self.description)

    def _period(self) -> tuple[float, int]:
        """Period [s], and -1; or its product with the variable that it is inverse to, and which that is."""
        driven = set(drive_frequencies(self.description))
        for k, v in enumerate(self.variables):
            moved = driven & set(resolve(self.description, v.name))
            if moved and moved != driven:
                words = "changes the common period of the drives by leaps. Let one variable set all frequencies."
                raise InputError(words, field=v.name)
            if moved:
                return drive_period(with_values(self.description, {v.name: v.upper})) * abs(v.upper), k
        return drive_period(self.description), -1

    @cached_property
    def _jumping(self) -> str:
        """Variable that shifts the times at which strokes of unequal halves turn; "" where there is none."""
        shares = {path: f"{path.rpartition('.')[0]}.forward_share" for path in numeric_paths(self.description)}
        for v in self.variables:
            for path in resolve(self.description, v.name):
                unequal = shares[path] in shares and get_value(self.description, shares[path]) != 0.5
                if path.endswith(".forward_share") or (path.endswith(".phase") and unequal):
                    return v.name
        return ""

    @property
    def _corners(self) -> list[dict[str, float]]:
        """Each variable at each of its ends."""
        return [{v.name: x} for v in self.variables for x in (v.lower, v.upper)]

    def _flat(self, carried: bool) -> bool:
        """Whether the robot stays in the plane whatever is chosen."""
        robots = (build(with_values(self._without_ramps, values)) for values in ({}, *self._corners))
        return all(moves_in_plane(in_still_water(robot) if carried else robot) for robot in robots)

    def plan(self) -> tuple[Plan, PlanInputs]:
        """What the programs of a design need: what they depend on besides numbers, and the numbers.

        Raises InputError where the robot has no steady or periodic motion, whatever its numbers.
        """
        robot = build(self._without_ramps)
        if is_zero(self.description.water.gravity) and (weighs := [x for x in self._needed() if x in AT_REST]):
            words = "gravity is 0: neither weight nor buoyancy acts. Give the water a gravity, or leave it out."
            raise InputError(words, field=weighs[0])
        template, numbers, where, used = self._template()
        shared = template, where, tuple(v.log for v in self.variables), used
        ends = on_device(self.box.ends)
        if self._rests:
            return RestPlan(*shared), PlanInputs(numbers, ends, on_device(np.nan))
        if not robot.tree.free_v.size and not drive_frequencies(self.description):
            words = "nothing of this robot is free to move, or driven to and fro."
            raise InputError(words, field=self.description.name)
        driven = next((name for name in self._needed() if name in ("torque", "drive_rate")), "")
        self._check_motors(robot)
        if driven and not robot.prescribed_names and not robot.powered.groups:
            words = "no joint or strain of this robot has a prescribed motion, so that this is 0 whatever the design."
            remedy = "Limit tension or pressure instead, or a torque by the range of its quantity."
            raise InputError(f"{words} {remedy}", field=driven)
        kinds = {load.kind for part in self.description.parts.values() for load in part.loads.values()}
        kinds |= {"tendon"} if self.description.tendons else set()
        for name, kind in _INSIDE.items():
            if name in self._needed() and kind not in kinds:
                words = f"this robot has no {kind}, so that this is 0 whatever the design. Leave it out."
                raise InputError(words, field=name)
        carried = goes_along(robot)
        robot = in_still_water(robot) if carried else robot
        symmetry = with_crank(robot, find_symmetry(robot), robot.initial())
        forward, unknown = DIRECTIONS[self.forward], symmetry.crank is not None
        if symmetry.steady and not unknown:
            return SteadyPlan(*shared, symmetry, forward, carried), PlanInputs(numbers, ends, on_device(np.nan))
        period, inverse_to = (np.nan, -1) if unknown else self._period()
        samples = SAMPLES
        if rates := update_rates(self.description):
            if inverse_to >= 0:
                words = "changes the period, in which updates of a servo's loop must be a whole number. Sweep periods"
                name = self.variables[inverse_to].name
                raise InputError(f"{words} of such numbers, or leave update_rate out.", field=name)
            check_updates(rates, period)
            samples = samples_at_updates(rates, period, SAMPLES)
        names = [v.name for v in self.variables]
        limbs = None if self.whole else alike_limbs(self._without_ramps, names, self._corners, carried)
        if limbs is not None:
            symmetry = with_crank(limbs.one.robot, find_symmetry(limbs.one.robot), limbs.one.start)
        cycle = {"flat": limbs is None and self._flat(carried), "inverse_to": inverse_to, "samples": samples}
        plan = CyclePlan(*shared, symmetry, forward, carried, **cycle, limbs=limbs)
        return plan, PlanInputs(numbers, ends, on_device(period))

    def _template(self) -> tuple[Template, Float[Array, "k"], tuple[tuple[int, ...], ...], tuple[str, ...]]:
        """Template of the robot, its numbers, places of each variable among them, and the quantities that are used."""
        groups = [tuple(resolve(self.description, v.name)) for v in self.variables]
        also = *(path for group in groups for path in group), *self._drawn_paths
        template, numbers = template_of(self._without_ramps, also)
        needed = {*self._needed(), *self._recorded()}
        used = [name for name in QUANTITIES if name in needed]  # in one order: what asks for the same is one program
        return template, numbers, tuple(tuple(map(template.paths.index, group)) for group in groups), tuple(used)

    def _check_motors(self, robot: Robot) -> None:
        """Raise InputError for a quantity of motors or batteries that the robot does not have."""
        batteries = self.description.batteries.values()
        lacking = dict[str, str]()
        if not any(battery.stored for battery in batteries):
            lacking |= dict.fromkeys(("endurance", "range"), "battery with a capacity or energy")
        if not batteries:
            lacking |= dict.fromkeys(("battery_power", "cost_of_transport_battery"), "battery")
        if not robot.powered.groups:
            lacking |= dict.fromkeys(("current", "electrical_power", "cost_of_transport_electrical"), "motor")
        if not self._has_servos:
            lacking[_DEMAND] = "servo"
        for name in self._needed():
            if name in lacking:
                raise InputError(f"this robot has no {lacking[name]}. Leave it out.", field=name)

    def check_derivatives(self) -> None:
        """Raise InputError where derivatives are not exact, or the objective has none."""
        self._check_smooth()
        self._slopes(dict.fromkeys(self.formula.names, 1.0))

    def _check_smooth(self) -> None:
        if self._jumping:
            raise InputError(
                "moves the moment at which a stroke's acceleration jumps, so that derivatives are not exact. Take "
                "the optimiser pattern or cmaes.",
                field=self._jumping,
            )

    def _slopes(self, values: dict[str, float]) -> dict[str, float]:
        """Derivatives of the objective by its quantities. Raises InputError for a function that has none."""
        at = {name: on_device(values[name]) for name in self.formula.names}
        try:
            found = jax.grad(lambda quantities: self.formula.value(quantities, jnp))(at)
        except InputError as error:
            words = "Derivatives need jax.numpy instead of numpy and math. Or take the optimiser pattern or cmaes."
            raise InputError(f"{error.message} {words}", field=error.field) from error
        return {name: float(x) for name, x in found.items()}

    def equal_limbs(self) -> int:
        """Return how many limbs do the same, of which one is solved; 1 where each is."""
        plan, _ = self.plan()
        return plan.limbs.one.count if isinstance(plan, CyclePlan) and plan.limbs is not None else 1

    @property
    def _drawn_paths(self) -> tuple[str, ...]:
        """Numbers that differ in the draws of a design."""
        return ()

    def _case(self, u: np.ndarray, plan: Plan, numbers: PlanInputs, draw: int) -> tuple[RobotDescription, PlanInputs]:
        """Robot of a design, or of one of its draws, and what the programs need of it."""
        del plan, draw
        return self.robot_at(u), numbers

    def prepare(self) -> Evaluate:
        """Return evaluate(u, derivatives, memory); the memory is the state of a motion nearby."""
        return self._evaluator()

    def _evaluator(self) -> Callable[..., Evaluation]:
        """Return evaluate(u, derivatives, memory), which takes the number of a draw too."""
        (plan, numbers), needed = self.plan(), self._needed()
        limbs = plan.limbs if isinstance(plan, CyclePlan) else None
        rest = build(self._without_ramps).initial() if limbs is None else limbs.one.start
        leaves, structure = jax.tree.flatten(rest)
        ends = np.cumsum([leaf.size for leaf in leaves])[:-1]
        sign = -1.0 if self.highest else 1.0

        def evaluate(u: np.ndarray, derivatives: bool, memory: np.ndarray | None, draw: int = -1) -> Evaluation:
            if derivatives:
                self._check_smooth()
            try:
                robot, inputs = self._case(u, plan, numbers, draw)
                check_numbers(robot)
            except InputError as error:
                return Evaluation.unsolved(u, len(self.constraints), str(error).removesuffix("."))
            guess = rest
            if memory is not None:
                parts = zip(np.split(memory, ends), leaves, strict=True)
                guess = jax.tree.unflatten(structure, [part.reshape(leaf.shape) for part, leaf in parts])
            program = judge_with_derivatives if derivatives else judge
            warm = memory is not None
            found, jacobian = remembered(program, plan, inputs, np.asarray(u, dtype=float), guess, warm)
            status = Status(int(found.status))
            if status not in (Status.SOLVED, Status.SETTLED):
                return Evaluation.unsolved(u, len(self.constraints), status.reason)
            values = dict(zip(plan.used, np.asarray(found.quantities).tolist(), strict=True))
            undefined = next((name for name in needed if np.isnan(values[name])), None)
            if undefined is not None:
                return Evaluation.unsolved(u, len(self.constraints), f"{undefined} is not defined for this motion")
            objective = float(self.formula.value(values))
            if not np.isfinite(objective):
                zeros = [name for name in self.formula.names if values[name] == 0]
                why = f", as {' and '.join(zeros)} is 0" if zeros else ""
                reason = f"{self.formula.text} is NaN or infinite for this motion{why}"
                return Evaluation.unsolved(u, len(self.constraints), reason)
            evaluation = Evaluation(
                u,
                sign * objective,
                np.array([c.excess(values) for c in self.constraints]),
                outputs={name: values[name] for name in (*self._recorded(), *needed)} | {self.formula.text: objective},
                memory=np.concatenate([np.ravel(leaf) for leaf in jax.tree.leaves(found.state)]),
            )
            if not derivatives:
                return evaluation
            derivative = dict(zip(plan.used, np.asarray(jacobian), strict=True))
            rows = [c.weighted(derivative) for c in self.constraints]
            return replace(
                evaluation,
                gradient=sign * sum(x * derivative[name] for name, x in self._slopes(values).items()),
                jacobian=np.array(rows).reshape(len(self.constraints), len(u)),
            )

        return evaluate
