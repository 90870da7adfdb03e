"""Searches of whole batches: where they end, and what each optimiser is for."""

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace

import numpy as np
import pytest

from nectosome.search import (
    BatchTask,
    CmaEs,
    Differential,
    Genetic,
    Gradient,
    Nsga2,
    Pattern,
    Result,
    front,
    minimise,
    undominated,
)
from nectosome.units import InputError
from nectosome.units.ranges import Ranges

pytest.importorskip("pymoo")
BOX = Ranges(("a", "b"), (-2.0, 0.01), (3.0, 10.0), log=("b",))
INSIDE = np.array([0.7, 0.4])
EVERYWHERE = CmaEs(spread=0.3, restarts=20, unsolved="last")
ONE_GOAL = [EVERYWHERE, Genetic(population=24, objective_tolerance=0), Differential(population=20)]
EVERY = [*ONE_GOAL, Nsga2(population=24)]
FILE = "start_0000.jsonl"
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


def search(objective, ranges, optimiser=EVERYWHERE, evaluations=10_000, text="", **more):
    task = BatchTask(objective, ranges, 1 + isinstance(optimiser, Nsga2), text)
    return minimise(task, replace(optimiser, evaluations=evaluations), **more)


def asked(optimiser, **more):
    """A short run of any optimiser."""
    objective = circles if isinstance(optimiser, Nsga2) else bowl
    return search(objective, BOX, optimiser, **{"evaluations": 150, "text": "one"} | more)


def rows(found, ranges=BOX):
    return ranges.values(np.array([e.u for e in found.evaluations]))


def untimed(raw):
    """Records of a journal without the time that they took."""
    data = [json.loads(line)["data"] for line in raw.splitlines()]
    return [[e | {"seconds": 0.0} for e in record.get("evaluations", [])] for record in data]


def same(one, two):
    first, second = ([(e.u.tobytes(), e.objectives.tobytes()) for e in found.evaluations] for found in (one, two))
    return first == second


@pytest.mark.parametrize("optimiser", ONE_GOAL, **named)
@pytest.mark.parametrize("at", [INSIDE, np.array([3.0, 0.01])], ids=["inside", "corner"])
def test_the_least_of_a_bowl_is_found_inside_and_on_the_bounds(optimiser, at):
    found = search(lambda x: bowl(x, at), BOX, optimiser, evaluations=6000, target=1e-7, seed=0)
    assert found.value <= 1e-7
    assert found.message == "the target of 1e-07 is reached"
    np.testing.assert_allclose(BOX.values(found.best.u), at, rtol=1e-3)
    assert np.all((rows(found) >= BOX.bounds[:, 0]) & (rows(found) <= BOX.bounds[:, 1]))
    assert found.values.min() == found.value == found.best.objective


@pytest.mark.parametrize("optimiser", [EVERYWHERE, Differential()], **named)
def test_a_curved_valley_is_followed(optimiser):
    box = Ranges("ab", -2, 2)
    found = search(valley, box, optimiser, evaluations=6000, target=1e-10)
    np.testing.assert_allclose(box.values(found.best.u), [1, 1], atol=1e-4)


def test_restarts_find_what_one_run_does_not():
    box = Ranges("ab", -5.0, 6.0)
    alone = [search(egg_box, box, replace(EVERYWHERE, restarts=0), seed=k).value for k in range(4)]
    again = [search(egg_box, box, evaluations=20_000, seed=k, target=1e-8).value for k in range(4)]
    assert sum(v > 0.9 for v in alone) >= 2
    assert max(again) <= 1e-8


def test_the_genetic_algorithm_finds_the_least_of_many_minima():
    """To what a population of 40 tells in 100 generations."""
    found = search(egg_box, Ranges("ab", -5.0, 6.0), Genetic(population=40), evaluations=4000)
    assert found.value < 1e-2


def test_nsga2_finds_the_front_between_two_circles():
    found = search(circles, Ranges("ab", -1.0, 2.0), Nsga2(population=40), evaluations=2000)
    members = np.array([e.objectives for e in front(found.evaluations)])
    assert np.abs(np.sqrt(members).sum(axis=1) - 1).max() < 0.05
    assert members[0, 0] < 0.01
    assert members[-1, 1] < 0.01
    assert np.all(np.diff(members[:, 0]) > 0)
    assert len(members) > 40


def test_a_front_holds_what_nothing_beats():
    costs = np.array([[1, -1], [2, -2], [3, -2], [5, -3], [1, -1.5], [4, -3], [4, -3]], float)
    assert undominated(costs).tolist() == [4, 1, 5]
    for k in (1, 2, 3):
        costs = np.random.default_rng(k).normal(size=(200, k))
        beaten = (costs[:, None] >= costs).all(axis=2) & ~np.eye(200, dtype=bool)
        np.testing.assert_array_equal(np.sort(undominated(costs)), np.flatnonzero(~beaten.any(axis=1)))


@pytest.mark.parametrize("optimiser", EVERY, **named)
def test_a_seed_tells_the_candidates_whatever_else_draws_random_numbers(optimiser):
    one = asked(optimiser, seed=3)
    np.random.seed(int.from_bytes(os.urandom(4)))
    assert same(one, asked(optimiser, seed=3))
    assert not same(one, asked(optimiser, seed=4))


@pytest.mark.parametrize("optimiser", EVERY, **named)
def test_it_goes_on_where_it_was_cut_off(optimiser, tmp_path):
    whole = asked(optimiser, folder=tmp_path)
    raw = (tmp_path / FILE).read_bytes()
    lines = raw.splitlines(keepends=True)
    computed = []

    def objective(x):
        computed.append(len(x))
        return circles(x) if isinstance(optimiser, Nsga2) else bowl(x)

    for kept, left in (
        (len(raw), 0),
        (len(b"".join(lines[:3])), len(lines) - 3),
        (len(b"".join(lines[:2])) + 40, None),
    ):
        (tmp_path / FILE).write_bytes(raw[:kept])
        computed.clear()
        found = search(objective, BOX, optimiser, evaluations=150, text="one", folder=tmp_path)
        assert same(found, whole)
        assert ("incomplete or damaged" in found.note) == (left is None)
        assert len(computed) == (len(lines) - 2 if left is None else left)
        assert untimed((tmp_path / FILE).read_bytes()) == untimed(raw)


def test_more_evaluations_go_on_in_the_same_folder(tmp_path):
    asked(ONE_GOAL[0], folder=tmp_path)
    assert same(asked(ONE_GOAL[0], folder=tmp_path, evaluations=300), asked(ONE_GOAL[0], evaluations=300))


def test_a_folder_of_other_work_is_refused(tmp_path):
    asked(ONE_GOAL[0], folder=tmp_path)
    wider = Ranges(BOX.names, (-2.0, 0.01), (3.0, 11.0), log=("b",))
    asked_for = {"objective": bowl, "ranges": BOX, "optimiser": ONE_GOAL[0], "text": "one", "folder": tmp_path}
    for change, held in (
        ({"seed": 2}, "another seed"),
        ({"text": "two"}, "another task"),
        ({"optimiser": CmaEs(restarts=1)}, "another optimiser, or other options of it"),
        ({"optimiser": Genetic()}, "another optimiser"),
        ({"ranges": wider}, "another task"),
    ):
        with pytest.raises(InputError, match=rf"holds {held}.*another folder"):
            search(**asked_for | change)


@pytest.mark.skipif(os.name != "posix", reason="processes are killed the POSIX way")
def test_nothing_is_lost_when_the_process_is_killed(tmp_path):
    code = f"""
import time
import numpy as np
from nectosome.search import BatchTask, CmaEs, minimise
from nectosome.units.ranges import Ranges
def slow(x):
    time.sleep(0.02)
    return np.sum((x - 0.3) ** 2, axis=1)
minimise(BatchTask(slow, Ranges("abc", 0, 1)), CmaEs(evaluations=3000), seed=5, folder={str(tmp_path)!r})
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
    found = search(quick, ranges, CmaEs(), seed=5, evaluations=700, folder=tmp_path)
    assert made > 0
    assert len(computed) == len(found.marks) - made
    assert same(found, search(quick, ranges, CmaEs(), seed=5, evaluations=700))


def test_progress_is_told_and_may_cancel(tmp_path):
    told = []

    def progress(evaluations, best):
        told.append((evaluations, best))
        return len(told) < 3

    found = asked(ONE_GOAL[0], folder=tmp_path, progress=progress)
    assert found.cancelled
    assert found.message == "cancelled"
    assert told[-1] == (len(found.evaluations), found.value)
    told.clear()
    again = asked(ONE_GOAL[0], folder=tmp_path, progress=lambda *at: told.append(at))
    assert told[0][0] > len(found.evaluations)
    assert not again.cancelled
    assert again.message.endswith("evaluations made")
    assert same(again, asked(ONE_GOAL[0]))


@pytest.mark.parametrize("optimiser", EVERY, **named)
def test_what_has_no_value_is_never_the_best(optimiser, tmp_path):
    """Half of the box has none, with the minimum on its edge; after the journal it has none either."""

    def holed(x):
        values = circles(x) if isinstance(optimiser, Nsga2) else bowl(x)
        values[x[:, 0] < 0.7] = np.inf
        return values

    found = search(holed, BOX, optimiser, evaluations=800, folder=tmp_path, text="holed")
    assert np.isinf(found.values).any()
    assert all(np.isfinite(e.objectives).all() for e in front(found.evaluations))
    assert BOX.values(found.best.u)[0] >= 0.7
    assert found.value < (0.6 if isinstance(optimiser, Nsga2) else 1e-2)
    assert same(search(holed, BOX, optimiser, evaluations=800, folder=tmp_path, text="holed"), found)


@pytest.mark.parametrize("optimiser", EVERY, **named)
def test_without_any_value_there_is_no_best(optimiser):
    found = search(
        lambda x: np.full((len(x), 1 + isinstance(optimiser, Nsga2)), np.inf), BOX, optimiser, evaluations=400
    )
    assert found.best is None
    assert found.value == np.inf
    assert front(found.evaluations) == []
    assert found.close(1.0) == []


def test_close_rows_tell_the_spread_of_equally_good_parameters():
    """Of a product, the factors are not told: rows of nearly the same value spread over the box."""
    box = Ranges("ab", 0.1, 10, log="ab")
    found = search(lambda x: np.log(x[:, 0] * x[:, 1]) ** 2, box, evaluations=3000)
    close = box.values(np.array([e.u for e in found.close(1e-4)]))
    np.testing.assert_allclose(close.prod(axis=1), 1, rtol=0.011)
    assert np.ptp(np.log(close[:, 0])) > 1
    assert np.array_equal(close[0], box.values(found.best.u))
    data = Result((found,), box.names, ()).to_dataset()
    assert data["u"].sel(variable="a").size == len(found.evaluations)


def test_mistakes_are_told():
    for value, shown in ((np.nan, "no number at a = 1"), (-np.inf, "no number at a = 1")):
        with pytest.raises(InputError, match=shown):
            search(lambda x, v=value: np.where(x[:, 0] > 0.2, v, 0.0), Ranges("ab", [1, 0], [1, 9]), ONE_GOAL[0])
    with pytest.raises(ValueError, match=r"gives \(6, 2\) for 6 rows of 1 objective"):
        search(circles, BOX, EVERYWHERE)
    for run, told in (
        (lambda: CmaEs(population=3), "CmaEs: population: is 3; it must be at least 4"),
        (lambda: CmaEs(restarts=-1), "CmaEs: restarts: is -1"),
        (lambda: CmaEs(tolerance=0.5), "tolerance: is 0.5; it must lie between 0 and spread"),
        (lambda: CmaEs(unsolved="kept"), 'unsolved: is "kept"'),
        (lambda: Genetic(population=0), "Genetic: population: is 0"),
        (lambda: minimise(BatchTask(bowl, BOX), Nsga2()), "Nsga2: versus: is needed: the task has one objective"),
        (lambda: search(bowl, BOX, Gradient()), "Gradient: start: is missing"),
        (lambda: search(bowl, BOX, Pattern()), "Pattern: start: is missing"),
        (lambda: search(bowl, BOX, Gradient(), start=np.full(2, 0.5)), "this objective has no derivatives"),
        (lambda: search(bowl, Ranges((), 0, 1)), "nothing to choose"),
        (lambda: search(bowl, BOX, evaluations=0), "evaluations: is 0"),
        (lambda: search(circles, BOX, Nsga2(), target=1.0), "target: is of one objective"),
        (lambda: Ranges("ab", 0, 1, log="c"), "c: there is no such parameter"),
        (lambda: Ranges("aa", 0, 1), "a: is named twice"),
        (lambda: Ranges("ab", [0, 2], 1), "b: 2 to 1 is no range"),
        (lambda: Ranges("ab", 0, 1, log="b"), "b: 0 has no logarithm"),
    ):
        with pytest.raises(InputError, match=told):
            run()


def test_pymoo_is_named_where_it_is_missing(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "pymoo.core", None)
    for optimiser in (Genetic(), Differential(), Nsga2()):
        with pytest.raises(InputError, match=r"the package pymoo is missing: pip install 'nectosome\[search\]'"):
            asked(optimiser, folder=tmp_path / "run")
    assert list(tmp_path.iterdir()) == []


def test_pattern_search_without_nomad_says_what_else_there_is(monkeypatch):
    monkeypatch.setitem(sys.modules, "PyNomad", None)
    with pytest.raises(InputError, match="optimiser: there is no wheel of NOMAD for this machine"):
        search(bowl, BOX, Pattern(), start=np.full(2, 0.5))


def test_one_parameter_is_enough():
    box = Ranges("a", -2.0, 3.0)
    found = search(lambda x: (x[:, 0] - 0.3) ** 2, box, target=1e-12)
    assert box.values(found.best.u)[0] == pytest.approx(0.3, abs=1e-6)
