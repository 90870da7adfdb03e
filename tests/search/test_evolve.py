"""Searches without derivatives: one contract for all solvers, and what each of them is for."""

import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from nectosome.search import CmaEs, DifferentialEvolution, Genetic, ParetoFront, evolve
from nectosome.search.covariance import undominated
from nectosome.search.generations import FILE
from nectosome.units import InputError
from nectosome.units.ranges import Ranges

pytest.importorskip("pymoo")
BOX = Ranges(("a", "b"), (-2.0, 0.01), (3.0, 10.0), log=("b",))
INSIDE = np.array([0.7, 0.4])
SOLVERS = [CmaEs(), Genetic(population=24), DifferentialEvolution(population=20)]
EVERY = [*SOLVERS, ParetoFront(population=24)]
named = {"ids": lambda s: type(s).__name__}


def bowl(x, at=INSIDE):
    """A sphere, in the logarithm of b."""
    return (x[:, 0] - at[0]) ** 2 + np.log(x[:, 1] / at[1]) ** 2


def valley(x):
    """Rosenbrock's, least at (1, 1)."""
    return 100 * (x[:, 1] - x[:, 0] ** 2) ** 2 + (1 - x[:, 0]) ** 2


def egg_box(x):
    """Rastrigin's, least at (0.9, -1.3): 121 minima in a box of 11."""
    z = x - [0.9, -1.3]
    return 10 * z.shape[1] + np.sum(z**2 - 10 * np.cos(2 * np.pi * z), axis=1)


def circles(x):
    """Squared distances from two points, whose front is the line between them: sqrt(f1) + sqrt(f2) = 1."""
    return np.stack([np.sum((x - p) ** 2, axis=1) for p in ((0.0, 1.0), (1.0, 1.0))], axis=1)


def asked(solver, **more):
    """A short run of any solver."""
    objective = circles if solver.objectives == 2 else bowl
    return evolve(objective, BOX, solver, **{"evaluations": 150, "key": "one"} | more)


def same(one, two):
    return np.array_equal(one.rows, two.rows) and np.array_equal(one.values, two.values)


@pytest.mark.parametrize("solver", SOLVERS, **named)
@pytest.mark.parametrize("at", [INSIDE, np.array([3.0, 0.01])], ids=["inside", "corner"])
def test_the_least_of_a_bowl_is_found_inside_and_on_the_bounds(solver, at):
    found = evolve(lambda x: bowl(x, at), BOX, solver, evaluations=6000, target=1e-7)
    assert found.value <= 1e-7
    assert found.message == "the target of 1e-07 is reached"
    np.testing.assert_allclose(found.best, at, rtol=1e-3)
    assert np.all((found.rows >= BOX.bounds[:, 0]) & (found.rows <= BOX.bounds[:, 1]))
    assert np.all(np.diff(found.history) <= 0)
    assert found.history[-1] == found.value


@pytest.mark.parametrize("solver", [CmaEs(), DifferentialEvolution()], **named)
def test_a_curved_valley_is_followed(solver):
    found = evolve(valley, Ranges("ab", -2, 2), solver, evaluations=6000, target=1e-10)
    np.testing.assert_allclose(found.best, [1, 1], atol=1e-4)


def test_restarts_find_what_one_run_does_not():
    box = Ranges("ab", -5.0, 6.0)
    alone = [evolve(egg_box, box, CmaEs(restarts=0), seed=k).value for k in range(4)]
    again = [evolve(egg_box, box, CmaEs(), evaluations=20_000, seed=k, target=1e-8).value for k in range(4)]
    assert sum(v > 0.9 for v in alone) >= 2
    assert max(again) <= 1e-8


def test_the_genetic_algorithm_finds_the_least_of_many_minima():
    """To what a population of 40 tells in 100 generations."""
    found = evolve(egg_box, Ranges("ab", -5.0, 6.0), Genetic(population=40), evaluations=4000)
    assert found.value < 1e-2


def test_nsga2_finds_the_front_between_two_circles():
    found = evolve(circles, Ranges("ab", -1.0, 2.0), ParetoFront(population=40), evaluations=2000)
    front = found.values[found.front]
    assert np.abs(np.sqrt(front).sum(axis=1) - 1).max() < 0.05
    assert front[0, 0] < 0.01
    assert front[-1, 1] < 0.01
    assert np.all(np.diff(front[:, 0]) > 0)
    assert len(front) > 40


def test_a_front_holds_what_nothing_beats():
    costs = np.array([[1, -1], [2, -2], [3, -2], [5, -3], [1, -1.5], [4, -3], [4, -3]], float)
    assert undominated(costs).tolist() == [4, 1, 5]
    for k in (1, 2, 3):
        costs = np.random.default_rng(k).normal(size=(200, k))
        beaten = (costs[:, None] >= costs).all(axis=2) & ~np.eye(200, dtype=bool)
        np.testing.assert_array_equal(np.sort(undominated(costs)), np.flatnonzero(~beaten.any(axis=1)))


@pytest.mark.parametrize("solver", EVERY, **named)
def test_a_seed_tells_the_candidates_whatever_else_draws_random_numbers(solver):
    one = asked(solver, seed=3)
    np.random.seed(int.from_bytes(os.urandom(4)))
    assert same(one, asked(solver, seed=3))
    assert not same(one, asked(solver, seed=4))


@pytest.mark.parametrize("solver", EVERY, **named)
def test_it_goes_on_where_it_was_cut_off(solver, tmp_path):
    whole = asked(solver, folder=tmp_path)
    raw = (tmp_path / FILE).read_bytes()
    lines = raw.splitlines(keepends=True)
    computed = []

    def objective(x):
        computed.append(len(x))
        return circles(x) if solver.objectives == 2 else bowl(x)

    for kept, left in (
        (len(raw), 0),
        (len(b"".join(lines[:3])), len(lines) - 3),
        (len(b"".join(lines[:2])) + 40, None),
    ):
        (tmp_path / FILE).write_bytes(raw[:kept])
        computed.clear()
        found = evolve(objective, BOX, solver, evaluations=150, key="one", folder=tmp_path)
        assert same(found, whole)
        assert ("cut off" in found.note) == (left is None)
        assert len(computed) == (len(lines) - 2 if left is None else left)
        assert (tmp_path / FILE).read_bytes() == raw


def test_more_evaluations_go_on_in_the_same_folder(tmp_path):
    asked(SOLVERS[0], folder=tmp_path)
    assert same(asked(SOLVERS[0], folder=tmp_path, evaluations=300), asked(SOLVERS[0], evaluations=300))


def test_a_folder_of_other_work_is_refused(tmp_path):
    asked(SOLVERS[0], folder=tmp_path)
    wider = Ranges(BOX.names, (-2.0, 0.01), (3.0, 11.0), log=("b",))
    for change in (
        {"seed": 1},
        {"key": "two"},
        {"solver": CmaEs(restarts=1)},
        {"solver": Genetic()},
        {"ranges": wider},
    ):
        with pytest.raises(InputError, match=r"other work.*another folder"):
            evolve(
                **{"objective": bowl, "ranges": BOX, "solver": SOLVERS[0], "key": "one", "folder": tmp_path} | change
            )


@pytest.mark.skipif(os.name != "posix", reason="processes are killed the POSIX way")
def test_nothing_is_lost_when_the_process_is_killed(tmp_path):
    code = f"""
import time
import numpy as np
from nectosome.search import CmaEs, evolve
from nectosome.units.ranges import Ranges
def slow(x):
    time.sleep(0.02)
    return np.sum((x - 0.3) ** 2, axis=1)
evolve(slow, Ranges("abc", 0, 1), CmaEs(), seed=5, evaluations=3000, folder={str(tmp_path)!r})
"""
    process = subprocess.Popen([sys.executable, "-c", code])
    until = time.monotonic() + 60
    while time.monotonic() < until and not ((tmp_path / FILE).exists() and (tmp_path / FILE).stat().st_size > 5000):
        time.sleep(0.01)
    process.send_signal(signal.SIGKILL)
    assert process.wait() == -signal.SIGKILL
    made = (tmp_path / FILE).read_bytes().count(b"\n") - 1
    computed = []

    def quick(x):
        computed.append(len(x))
        return np.sum((x - 0.3) ** 2, axis=1)

    ranges = Ranges("abc", 0, 1)
    found = evolve(quick, ranges, CmaEs(), seed=5, evaluations=1000, folder=tmp_path)
    assert made > 0
    assert len(computed) == found.generation[-1] + 1 - made
    assert same(found, evolve(quick, ranges, CmaEs(), seed=5, evaluations=1000))


def test_progress_is_told_and_may_cancel(tmp_path):
    told = []

    def progress(evaluations, best):
        told.append((evaluations, best))
        return len(told) < 3

    found = asked(SOLVERS[0], folder=tmp_path, progress=progress)
    assert found.cancelled
    assert found.message == "cancelled"
    assert told[-1] == (len(found.rows), found.value)
    told.clear()
    again = asked(SOLVERS[0], folder=tmp_path, progress=lambda *at: told.append(at))
    assert told[0][0] > len(found.rows)
    assert not again.cancelled
    assert again.message.endswith("evaluations made")
    assert same(again, asked(SOLVERS[0]))


@pytest.mark.parametrize("solver", EVERY, **named)
def test_what_has_no_value_is_never_the_best(solver, tmp_path):
    """Half of the box has none, with the minimum on its edge; after the journal it has none either."""

    def holed(x):
        values = circles(x) if solver.objectives == 2 else bowl(x)
        values[x[:, 0] < 0.7] = np.inf
        return values

    found = evolve(holed, BOX, solver, evaluations=800, folder=tmp_path, key="holed")
    assert np.isinf(found.values).any()
    assert np.isfinite(found.values[found.front]).all()
    assert found.best[0] >= 0.7
    assert found.value < (0.6 if solver.objectives == 2 else 1e-2)
    assert same(evolve(holed, BOX, solver, evaluations=800, folder=tmp_path, key="holed"), found)


@pytest.mark.parametrize("solver", EVERY, **named)
def test_without_any_value_there_is_no_best(solver):
    found = evolve(lambda x: np.full((len(x), solver.objectives), np.inf), BOX, solver, evaluations=400)
    assert found.best is None
    assert found.value == np.inf
    assert found.front.size == 0
    assert found.close(1.0).shape == (0, 2)


def test_close_rows_tell_the_spread_of_equally_good_parameters():
    """Of a product, the factors are not told: rows of nearly the same value spread over the box."""
    found = evolve(lambda x: np.log(x[:, 0] * x[:, 1]) ** 2, Ranges("ab", 0.1, 10, log="ab"), evaluations=3000)
    close = found.close(1e-4)
    np.testing.assert_allclose(close.prod(axis=1), 1, rtol=0.011)
    assert np.ptp(np.log(close[:, 0])) > 1
    assert np.array_equal(close[0], found.best)
    data = found.to_dataset()
    assert data["row"].sel(parameter="a").size == len(found.rows)


def test_mistakes_are_told():
    for value, shown in ((np.nan, "no number at a = 1"), (-np.inf, "no number at a = 1")):
        with pytest.raises(InputError, match=shown):
            evolve(lambda x, v=value: np.where(x[:, 0] > 0.2, v, 0.0), Ranges("ab", [1, 0], [1, 9]), SOLVERS[0])
    with pytest.raises(ValueError, match=r"gives \(6, 2\) for 6 rows of 1 objective"):
        evolve(circles, BOX)
    for run, told in (
        (lambda: CmaEs(population=3), "CmaEs: population: is 3; it must be at least 4"),
        (lambda: CmaEs(restarts=-1), "CmaEs: restarts: is -1"),
        (lambda: CmaEs(tolerance=0.5), "0 < tolerance < spread"),
        (lambda: Genetic(population=0), "Genetic: population: is 0"),
        (lambda: ParetoFront(objectives=1), "ParetoFront: objectives: is 1"),
        (lambda: evolve(bowl, Ranges("a", 0, 1)), "two parameters or more"),
        (lambda: evolve(bowl, Ranges((), 0, 1)), "nothing to choose"),
        (lambda: evolve(bowl, BOX, evaluations=0), "evaluations: is 0"),
        (lambda: evolve(circles, BOX, ParetoFront(), target=1.0), "target: is of one objective"),
        (lambda: Ranges("ab", 0, 1, log="c"), "c: there is no such parameter"),
        (lambda: Ranges("aa", 0, 1), "a: is named twice"),
        (lambda: Ranges("ab", [0, 2], 1), "b: 2 to 1 is not a range"),
        (lambda: Ranges("ab", 0, 1, log="b"), "b: 0 has no logarithm"),
    ):
        with pytest.raises(InputError, match=told):
            run()


def test_pymoo_is_asked_for_where_it_is_missing(monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"pymoo is needed for Genetic: pip install \"nectosome\[pymoo\]\""):
        evolve(bowl, BOX, Genetic())
