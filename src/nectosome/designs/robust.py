"""Designs of robots that are not known exactly: a quantile of the objective, limits that hold with a probability.

What is not known takes the same places in the draws of all designs (common random numbers), so that designs differ by
what is chosen only. Quantiles are those of the draws, between two of them by their median-unbiased place (Hyndman and
Fan 1996, definition 8), and their derivatives are those of these two.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float

from nectosome.core.rows import on_device
from nectosome.description import (
    RobotDescription,
    drive_frequencies,
    drive_period,
    numeric_paths,
    numeric_values,
    resolve,
    update_rates,
    with_values,
    without_ramps,
)
from nectosome.io.schema.structure import changed
from nectosome.search import Evaluate, Evaluation
from nectosome.units import InputError, check_whole

from .constraints import percent
from .motion import MotionDesign
from .plans import CyclePlan, Plan, PlanInputs
from .uncertain_runs import LEAST_DRAWS, draws_of, with_left_open

DRAWS = 16
LOST = "draws_without_motion"
"""Output of an evaluation that counts them."""
UNSURE = "standard_error_of_quantile"
"""Output of an evaluation: that of the objective's quantile, by resampled draws."""
_AGAIN = 200  # resamples


def weights_of(values: Float[np.ndarray, "k"], quantile: float) -> Float[np.ndarray, "k"]:
    """Weights of values whose sum is a quantile of them: of the two next to the place (k + 1/3) q + 1/3."""
    place = np.clip((len(values) + 1 / 3) * quantile + 1 / 3, 1, len(values)) - 1
    rank = np.argsort(np.argsort(values, kind="stable"))
    return np.maximum(1 - np.abs(rank - place), 0.0)


def quantile_error(values: Float[np.ndarray, "k"], quantile: float) -> float:
    """Standard error of a quantile of independent draws by resampling them (bootstrap, Efron 1979); NaN with infinite
    ones. Those of a Latin hypercube are surer."""
    rows = np.sort(values[np.random.default_rng(0).integers(0, len(values), (_AGAIN, len(values)))], axis=1)
    place = float(weights_of(np.arange(len(values)), quantile) @ np.arange(len(values)))
    low, share = int(place), place % 1
    ends = rows[:, low], rows[:, min(low + 1, len(values) - 1)]
    return float(np.std((1 - share) * ends[0] + share * ends[1])) if np.isfinite(rows).all() else math.nan


def shares_between(quantile: float, draws: int) -> tuple[float, float]:
    """Quantiles of the whole between which a quantile of so many independent draws lies, to one standard error.

    That of the place of an order statistic, sqrt(q (1 - q)/(k + 2)) (David and Nagaraja 2003, 3.1).
    """
    error = math.sqrt(quantile * (1 - quantile) / (draws + 2))
    return max(quantile - error, 0.0), min(quantile + error, 1.0)


def least_draws(quantile: float) -> int:
    """Draws among which a quantile has a place between two."""
    return max(LEAST_DRAWS, math.ceil(2 / 3 / min(quantile, 1 - quantile) - 1 / 3 - 1e-9))


@dataclass(frozen=True)
class RobustDesign(MotionDesign):
    """Maximise or minimise a quantile of a quantity of a robot's motion, under limits that hold with a probability.

    - quantile: of the objective, 0 for that of the design itself, with all numbers as its file gives them.
    - draws, seed: how many values of what is not known, and the seed of their places.

    What varies is off about the value that is chosen, by the same share as in the file, or by the same amount where it
    may be negative. A draw without a motion is worse than all others: a design for which a quantile is made of such a
    one is not solved. Limits without a probability hold for the design itself.

    Raises InputError as `MotionDesign` does, for a robot of which all is known exactly, and for too few draws.
    """

    quantile: float = 0.0
    draws: int = DRAWS
    seed: int = 1
    whole: bool = True  # limbs that are equal in the file differ in the draws

    def __post_init__(self) -> None:
        """Check what can be checked before anything is computed."""
        super().__post_init__()
        check_whole(self.draws, "draws", LEAST_DRAWS)
        for share in filter(None, (self.quantile, *(c.probability for c in self.constraints))):
            if self.draws < least_draws(share):
                words = f"{self.draws} are too few for {percent(share)}: it takes {least_draws(share)} or more."
                raise InputError(words, field="draws")
        self._draws  # noqa: B018  they are made here
        moved = {*drive_frequencies(self.description)} & {*self._drawn_paths}
        if moved and update_rates(self.description):
            words = "has a spread and changes the period, in which updates of a servo's loop must be a whole number."
            raise InputError(f"{words} Give it exactly.", field=min(moved))

    @property
    def objective_name(self) -> str:  # pyright: ignore[reportIncompatibleVariableOverride]
        """The objective as it is written, with its quantile."""
        name = self.formula.text
        return f"{name}, {percent(self.quantile)} quantile" if self.quantile else name

    @property
    def units(self) -> dict[str, str]:
        """Units of the quantities that describe a design: the objective, then those of the design itself."""
        own = super().units
        return {self.objective_name: own[self.objective_name], self.formula.text: own[self.objective_name]} | own

    def key(self) -> str:
        """Text of all that the numbers depend on."""
        goal = f"{percent(self.quantile)} quantile; " if self.quantile else ""
        return f"{goal}{super().key()}; {self.draws} draws, seed {self.seed}"

    @cached_property
    def _filled(self) -> RobotDescription:
        """The robot with numbers that its file leaves open and no variable changes, so that they can be drawn."""
        return with_left_open(self.description, (with_values(self.description, x) for x in super()._corners))

    @cached_property
    def _draws(self) -> list[dict[str, float]]:
        """Values by path of what is not known in each draw, for the robot of the file."""
        try:
            return draws_of(self._filled, self.draws, self.seed)[1:]
        except InputError as error:
            raise InputError(error.message, field=error.field or self.description.name) from None

    @property
    def _drawn_paths(self) -> tuple[str, ...]:
        return tuple(self._draws[0])

    @property
    def _corners(self) -> list[dict[str, float]]:
        return [*super()._corners, *self._draws]

    @property
    def _without_ramps(self) -> RobotDescription:
        return without_ramps(self._filled)

    @cached_property
    def _changes(self) -> list[dict[str, tuple[float, float]]]:
        """By path, in each draw: a factor on the number of a design, and what is added then."""
        own, known = numeric_values(self._filled), numeric_paths(self._filled)

        def change(path: str, x: float) -> tuple[float, float]:
            value = float(own[path])
            return (x / value, 0.0) if known[path].scales(value) else (1.0, x - value)

        return [{path: change(path, x) for path, x in drawn.items()} for drawn in self._draws]

    def _case(self, u: np.ndarray, plan: Plan, numbers: PlanInputs, draw: int) -> tuple[RobotDescription, PlanInputs]:
        if draw < 0:
            nothing = np.stack([np.ones(numbers.values.shape), np.zeros(numbers.values.shape)])
            return self.robot_at(u), numbers._replace(drawn=on_device(nothing))
        changes = self._changes[draw]
        rows = np.array([changes.get(path, (1.0, 0.0)) for path in plan.template.paths]).T
        chosen = {path: x for name, x in self.values(u).items() for path in resolve(self.description, name)}
        moved = {path: x * changes[path][0] + changes[path][1] for path, x in chosen.items() if path in changes}
        robot = changed(self._filled, chosen | self._draws[draw] | moved)
        period = numbers.period
        if isinstance(plan, CyclePlan) and {*drive_frequencies(robot)} & changes.keys():
            rate = abs(self.box.values(u)[plan.inverse_to]) if plan.inverse_to >= 0 else 1.0
            period = on_device(drive_period(robot) * rate)
        return robot, numbers._replace(drawn=on_device(rows), period=period)

    def prepare(self) -> Evaluate:
        """Return evaluate(u, derivatives, memory); the memory is the state of a motion nearby."""
        one, sign = self._evaluator(), -1.0 if self.highest else 1.0
        level = 1 - self.quantile if self.highest else self.quantile  # the objective is minimised
        levels = [level if self.quantile else 0.0, *(constraint.probability for constraint in self.constraints)]

        def evaluate(u: np.ndarray, derivatives: bool, memory: np.ndarray | None) -> Evaluation:
            own = one(u, derivatives and 0.0 in levels, memory)
            if not own.solved:
                return own
            drawn = [one(u, False, own.memory, draw) for draw in range(self.draws)]
            lost = [e.reason for e in drawn if not e.solved]
            table = np.array([np.where(e.solved, _numbers(e), np.inf) for e in drawn])
            weights = np.array(
                [weights_of(x, q) if q else np.zeros(self.draws) for x, q in zip(table.T, levels, strict=True)]
            )
            used = np.flatnonzero(weights.any(axis=0))
            if derivatives and np.isfinite(table[used]).all():
                drawn = {k: one(u, True, drawn[k].memory, k) for k in used}
            failed = next((drawn[k].reason for k in used if not drawn[k].solved), "")
            if failed:
                words = f"{max(len(lost), 1)} of {self.draws} draws have no motion: {failed}"
                return Evaluation.unsolved(u, len(self.constraints), words)

            def mixed(of: Callable[[Evaluation], np.ndarray]) -> np.ndarray:
                """Of the draws that make a quantile; of the design itself where none is asked for."""
                rows = np.einsum("ik,ki...->i...", weights[:, used], np.array([of(drawn[k]) for k in used]))
                return np.array([row if q else of(own)[i] for i, (row, q) in enumerate(zip(rows, levels, strict=True))])

            values = mixed(_numbers)
            outputs = {**own.outputs, self.objective_name: sign * values[0], LOST: float(len(lost))}
            if self.quantile:
                outputs[UNSURE] = quantile_error(table[:, 0], level)
            found = replace(own, objective=values[0], constraints=values[1:], outputs=outputs)
            if not derivatives:
                return found
            slopes = mixed(_slopes)
            return replace(found, gradient=slopes[0], jacobian=slopes[1:])

        return evaluate


def _numbers(e: Evaluation) -> Float[np.ndarray, "m"]:
    """The objective, then the constraints."""
    return np.array([e.objective, *e.constraints])


def _slopes(e: Evaluation) -> Float[np.ndarray, "m n"]:
    """Their derivatives."""
    assert e.gradient is not None
    assert e.jacobian is not None
    return np.vstack([e.gradient, e.jacobian])
