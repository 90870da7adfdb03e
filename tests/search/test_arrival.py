"""Searches end when they have arrived, count what is likely, and take only the values that a variable has."""

import itertools
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cache
from typing import ClassVar

import numpy as np
import pytest

from nectosome.search import CmaEs, Differential, Evaluation, Genetic, Gradient, Pattern, Task, minimise, multistart
from nectosome.units import InputError

from .tasks import Known

HERE = ThreadPoolExecutor(1)
ALL = [Gradient(), Pattern(), CmaEs(), Differential(), Genetic(population=20)]
named = {"ids": lambda value: type(value).__name__}


@dataclass(frozen=True)
class Flat(Task):
    """A speed near 0.05 that hardly depends on its second variable, known to seven digits; a limit binds."""

    noise: float = 1e-7
    names: ClassVar = ("a", "b", "c")
    constraint_names: ClassVar = ("g",)

    def key(self) -> str:
        return f"flat {self.noise}"

    def prepare(self):
        weights, at, limit = np.array([1.0, 1e-3, 0.3]), np.array([0.5, 0.4, 0.3]), np.array([[-1.0, 0.0, 0.1]])

        def evaluate(u, derivatives, memory):
            off = self.noise * np.random.default_rng([*u.view(np.uint32)]).uniform(-1, 1, 5)
            f = -0.05 * (1 - weights @ (u - at) ** 2) * (1 + off[0])
            e = Evaluation(u, f, 0.6 + limit @ u + off[1])
            return replace(e, gradient=0.1 * weights * (u - at) + 0.1 * off[2:], jacobian=limit) if derivatives else e

        return evaluate


@pytest.mark.parametrize(("optimiser", "most"), [*zip(ALL, (12, 450, 1500, 2500, 4000), strict=True)], **named)
def test_a_search_that_has_arrived_ends(optimiser, most):
    """By hand -0.0491823 at 0.6273, 0.4, 0.2727; without the tolerance it took 31, 654, 3899, 5010, 5000."""
    for start in multistart(Flat(), optimiser, 2, executor=HERE).starts:
        assert start.converged
        assert start.value == pytest.approx(-0.0491823, rel=1e-3 if optimiser == ALL[-1] else 2e-4)
        assert len(start.evaluations) - start.draws <= most


@pytest.mark.parametrize("optimiser", ALL, **named)
def test_what_still_gets_better_goes_on(optimiser):
    """A curved valley towards 0: the share of the objective that a step brings stays the same."""
    patient = replace(optimiser, objective_tolerance=0.0)
    ends = [minimise(Known("valley"), one, np.array([0.1, 0.2]), seed=2).value for one in (optimiser, patient)]
    assert ends[0] < max(1e-4, 30 * ends[1])


def test_a_tolerance_that_makes_no_sense_is_refused():
    for tolerance in (-1e-5, 1.0, np.nan):
        with pytest.raises(InputError, match="objective_tolerance: is"):
            Gradient(objective_tolerance=tolerance)


@pytest.mark.parametrize("optimiser", ALL, **named)
def test_the_work_that_is_left_is_what_is_likely(optimiser):
    """Not what is allowed: at first what the optimiser usually takes, then what the first start took."""
    told = []
    result = multistart(Flat(), optimiser, 2, executor=HERE, progress=lambda *now: told.append(now))
    assert told[-1][3] == told[-1][0] / 2 == 1
    assert all(0 <= share <= 1 for *_, share in told)
    made = [len(start.evaluations) for start in result.starts]
    assert 0.2 < optimiser.likely(Flat().space) / np.mean(made) < 5


LEVELS = (11, 0, 0, 6)  # of Rosen and Suzuki's problem: -5, -4, ..., 5 and -5, -3, ..., 5


@dataclass(frozen=True)
class Between(Known):
    """The same with its first and last variable held."""

    ends: tuple[float, float] = (0.0, 0.0)

    def prepare(self):
        evaluate, (a, d) = super().prepare(), self.ends

        def inner(u, derivatives, memory):
            e = evaluate(np.array([a, *u[1:3], d]), derivatives, memory)
            free = np.array([0.0, 1.0, 1.0, 0.0])
            return replace(e, u=u, gradient=e.gradient * free, jacobian=e.jacobian * free)

        return inner


@cache
def best_in_steps() -> float:
    """By a search for each pair of values near the best one, the others free."""
    pairs = itertools.product(np.linspace(0, 1, LEVELS[0])[3:8], np.linspace(0, 1, LEVELS[3])[1:4])
    tasks = (Between("hs43", anywhere=True, ends=pair) for pair in pairs)
    return min(minimise(task, Gradient(), np.full(4, 0.5)).value for task in tasks)


@pytest.mark.parametrize("optimiser", ALL[:4], **named)
def test_variables_in_steps_take_their_values_only(optimiser):
    """The best of all pairs of values; what was found lies on them."""
    task = Known("hs43", levels=LEVELS)
    result = multistart(task, optimiser, 3, 1, executor=HERE, draws=3000)
    for e in (e for start in result.starts for e in start.evaluations):
        for u, levels in zip(e.u, LEVELS, strict=True):
            assert not levels or u * (levels - 1) == pytest.approx(round(u * (levels - 1)), abs=1e-9)
    within = {Gradient: 1e-5, CmaEs: 1e-3}.get(type(optimiser), 2e-2)
    assert result.best()[0].value == pytest.approx(best_in_steps(), rel=within)
