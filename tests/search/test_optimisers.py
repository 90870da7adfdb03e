"""Each optimiser finds known optima, sees no made-up number, and does the same twice."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

from nectosome.search import CmaEs, Evaluation, Gradient, Pattern, multistart
from nectosome.units import InputError

from .tasks import PROBLEMS, Known

HERE = ThreadPoolExecutor(1)


def run(task, optimiser, starts=4, seed=0):
    return multistart(task, optimiser, starts, seed, executor=HERE, draws=3000)


@pytest.mark.parametrize(
    ("problem", "optimiser", "within"),
    [
        ("disc", Gradient(), 1e-6),
        ("disc", Pattern(), 1e-5),
        ("disc", Pattern(directions="n+1"), 1e-5),
        ("disc", CmaEs(), 1e-5),
        ("valley", Gradient(), 1e-8),
        ("valley", Pattern(), 1e-4),
        ("valley", CmaEs(), 1e-8),
        ("line", Gradient(), 1e-6),
        ("line", Pattern(), 1e-6),
        ("line", CmaEs(), 1e-6),
        ("hs43", Gradient(), 1e-5),
        ("hs43", Pattern(), 1e-2),
        ("disc", Pattern(models=True, evaluations=100), 1e-3),
        ("hs43", CmaEs(), 1e-4),
        ("g08", Pattern(), 1e-6),
        ("g08", CmaEs(), 1e-6),
    ],
    ids=lambda value: type(value).__name__ if not isinstance(value, str | float) else value,
)
def test_known_optima_are_found(problem, optimiser, within):
    """Best of four starts; `within` in units of the objective."""
    known = PROBLEMS[problem]
    result = run(Known(problem), optimiser)
    best = result.best()[0].best
    assert best.objective == pytest.approx(known.best, abs=within)
    assert best.violation <= 1e-6
    assert Known(problem).own(best.u) == pytest.approx(known.where, abs=100 * within**0.5)


@pytest.mark.parametrize(("problem", "within"), [("hs71", 5e-5), ("g06", 1e-2), ("g08", 1e-6)])
def test_exact_derivatives_find_the_way_from_designs_that_break_constraints(problem, within):
    """From anywhere in the box; two constraints of hs71 are an equality, the feasible share of g06 is 0.007 percent."""
    result = run(Known(problem, anywhere=True), Gradient(), starts=20)
    assert result.best()[0].best.objective == pytest.approx(PROBLEMS[problem].best, abs=within)
    assert all(len(start.evaluations) <= 100 for start in result.starts)


def test_exact_derivatives_need_few_evaluations():
    counts = [len(start.evaluations) - start.draws for start in run(Known("hs43"), Gradient(), 10).starts]
    assert max(counts) <= 20


HOLES = ((0.4, 0.3, 0.15), (0.3, -0.3, 0.15), (0.3, 0.0, 0.1))


@pytest.mark.parametrize("optimiser", [Gradient(), Pattern(), CmaEs()], ids=lambda s: type(s).__name__)
@pytest.mark.parametrize("holes", [HOLES, ((0.12, 0.0, 0.1),), tuple((np.cos(a), np.sin(a), 0.4) for a in range(6))])
def test_holes_are_walked_around(optimiser, holes):
    """The lowest point of a bowl is found though designs on the way have no solution, and none gets a number."""
    result = run(Known("circles", holes=holes), optimiser, starts=12)
    assert result.share(1.0) >= 0.75 or sum(s.best.objective < 1e-6 for s in result.starts) >= 9
    unsolved = [e for start in result.starts for e in start.evaluations if not e.solved]
    assert unsolved
    for e in unsolved:
        assert e.reason == "in a hole"
        assert np.isnan(e.objective)
        assert np.all(np.isnan(e.constraints))
        assert e.violation == np.inf


def test_a_blocked_search_says_so():
    """The optimum of the disc lies in a hole: the search ends at its edge and does not call that an optimum."""
    result = run(Known("disc", holes=((0.786, 0.618, 0.1),)), Gradient())
    for start in result.starts:
        assert not start.converged
        assert "there is no solution: in a hole" in start.message
        assert 0.0457 < start.best.objective < 0.2


def test_constraints_that_cannot_be_kept_are_told():
    class Impossible(Known):
        def prepare(self):
            evaluate = super().prepare()

            def harder(u, derivatives, memory):
                e = evaluate(u, derivatives, memory)
                return replace(e, constraints=e.constraints + 5)

            return harder

    for optimiser in (Gradient(), CmaEs()):
        result = run(Impossible("disc", anywhere=True), optimiser, 2)
        assert not any(start.converged for start in result.starts)
        assert all(start.best is None for start in result.starts)


@pytest.mark.parametrize("optimiser", [Gradient(), Pattern(), Pattern(models=True, evaluations=60), CmaEs()])
def test_optimisers_do_the_same_twice_and_beside_each_other(optimiser):
    task = Known("disc", holes=((0.3, 0.3, 0.1),))
    with ThreadPoolExecutor(3) as three:
        runs = [multistart(task, optimiser, 4, seed=7, executor=executor) for executor in (HERE, three, HERE)]
    paths = [[[e.u.tobytes() for e in start.evaluations] for start in result.starts] for result in runs]
    assert paths[0] == paths[1] == paths[2]
    assert len({tuple(path) for path in paths[0]}) == 4


def test_nothing_is_left_in_the_users_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for optimiser in (Gradient(), Pattern(), CmaEs()):
        run(Known("disc"), optimiser, 1)
    assert list(tmp_path.iterdir()) == []


def test_evaluations_are_limited():
    for optimiser in (Gradient(evaluations=7), Pattern(evaluations=50), CmaEs(evaluations=50)):
        for start in run(Known("disc"), optimiser, 2).starts:
            assert not start.converged
            assert len(start.evaluations) - start.draws <= 60


def test_meshes_are_the_first_steps():
    task = Known("disc", anywhere=True)
    for mesh, first in ((0.05, 0.05), ((0.03, 0.2), 0.03)):
        (start,) = run(task, Pattern(mesh=mesh), 1).starts
        steps = np.array([e.u - start.start for e in start.evaluations[1:3]])
        assert steps == pytest.approx(np.array([[first, 0], [-first, 0]]), abs=1e-12)


def test_numbers_that_are_not_finite_are_no_solution():
    class Overflowing(Known):
        def prepare(self):
            evaluate = super().prepare()

            def wild(u, derivatives, memory):
                e = evaluate(u, derivatives, memory)
                if u[0] > 0.7:
                    return replace(e, objective=-np.inf)
                return replace(e, gradient=e.gradient * np.nan) if derivatives and u[1] < 0.3 else e

            return wild

    for optimiser in (Gradient(), Pattern(), CmaEs()):
        result = run(Overflowing("disc"), optimiser)
        reasons = {e.reason for start in result.starts for e in start.evaluations} | set(result.starts[0].rejected)
        assert reasons & {"the objective is not finite", "the derivatives are not finite"}
        assert all(np.isnan(e.objective) for s in result.starts for e in s.evaluations if not e.solved)


def test_mistakes_in_a_task_are_raised():
    class Mistaken(Known):
        def prepare(self):
            return lambda u, derivatives, memory: Evaluation(u, 1.0, np.zeros(2 if u[0] > 0.5 else 1))

    with pytest.raises(ValueError, match="gives no derivatives where the optimiser needs them"):
        run(_NoDerivatives("disc", anywhere=True), Gradient())
    with pytest.raises(ValueError, match="gives 2 constraints; the task names 1"):
        run(Mistaken("disc", anywhere=True), Pattern())
    with pytest.raises(ValueError, match="needs a reason"):
        Evaluation.unsolved(np.zeros(2), 1, "")


class _NoDerivatives(Known):
    def prepare(self):
        evaluate = super().prepare()
        return lambda u, derivatives, memory: evaluate(u, False, memory)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Pattern(mesh=-1.0), "mesh: is -1.0; it must be positive"),
        (lambda: Pattern(mesh=1e-6), "smallest_mesh: is 1e-05; it must be positive and below mesh"),
        (lambda: Pattern(smallest_mesh=float("nan")), "smallest_mesh: is nan"),
        (lambda: Pattern(evaluations=0), "evaluations: is 0; it must be at least 1"),
        (lambda: Gradient(tolerance=0.0), "tolerance: is 0.0; it must lie between 0 and 0.1"),
        (lambda: Gradient(smallest_step=2.0), "smallest_step: is 2.0"),
        (lambda: Gradient(evaluations=-3), "evaluations: is -3"),
        (lambda: CmaEs(spread=0.0), "spread: is 0.0; it must lie between 0 and 1"),
        (lambda: CmaEs(population=3), "population: is 3; it must be at least 4"),
        (lambda: CmaEs(tolerance=0.5), "tolerance: is 0.5; it must lie between 0 and spread"),
        (lambda: CmaEs(evaluations=0), "evaluations: is 0"),
        (
            lambda: run(Known("disc"), Pattern(mesh=(0.1, 0.1, 0.1))),
            "mesh: has not one number for each",
        ),
    ],
)
def test_bad_options_are_told(make, message):
    with pytest.raises(InputError, match=message):
        make()
