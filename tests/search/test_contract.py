"""What every optimiser keeps, whoever it is: one contract, one set of problems."""

import json
import os
import threading
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress

import numpy as np
import pytest

from nectosome.search import OPTIMISERS, Evaluation, Nsga2, make_optimiser, minimise, multistart
from nectosome.search.contract import Ask
from nectosome.search.evaluations import Recorder
from nectosome.units import InputError

from .tasks import Known
from .test_multistart import same

pytest.importorskip("pymoo")
HERE = ThreadPoolExecutor(1)
HOLED = Known("circles", holes=((0.3, 0.3, 0.2), (0.3, -0.3, 0.2)))
SHORT = {"evaluations": 60}
NEEDED = {"nsga2": {"versus": 0, "population": 12, "polish": 2}, "genetic": {"population": 12}}
EVERY = [make_optimiser(name, **SHORT | NEEDED.get(name, {})) for name in OPTIMISERS]
every = pytest.mark.parametrize("optimiser", EVERY, ids=lambda optimiser: optimiser.name)


def path(starts):
    return [[e.u.tobytes() for e in start.evaluations] for start in starts]


@every
def test_its_name_and_options_make_it_again(optimiser):
    assert make_optimiser(**json.loads(json.dumps(optimiser.describe()))) == optimiser
    with pytest.raises(InputError, match="evaluations: is 0; it must be at least 1"):
        make_optimiser(optimiser.name, **NEEDED.get(optimiser.name, {}), evaluations=0)


@every
def test_the_same_seed_and_start_give_the_same_designs_in_the_box(optimiser):
    """Whatever else draws random numbers, and beside other searches; other seeds give others."""
    runs = [multistart(HOLED, optimiser, 3, seed=7, executor=HERE)]
    np.random.seed(int.from_bytes(os.urandom(4)))
    with ThreadPoolExecutor(3) as three:
        runs.append(multistart(HOLED, optimiser, 3, seed=7, executor=three))
    assert path(runs[0].starts) == path(runs[1].starts)
    assert path(runs[0].starts) != path(multistart(HOLED, optimiser, 3, seed=8, executor=HERE).starts)
    designs = np.array([e.u for start in runs[0].starts for e in start.evaluations])
    assert np.all((designs >= 0) & (designs <= 1))


@every
@pytest.mark.parametrize("corner", [0.0, 1.0])
def test_it_may_begin_in_a_corner(optimiser, corner):
    start = minimise(Known("disc", anywhere=True), optimiser, np.full(2, corner))
    assert np.all([(e.u >= 0) & (e.u <= 1) for e in start.evaluations])
    assert any(e.u.tolist() == [corner, corner] for e in start.evaluations) or optimiser.name == "cmaes"


@every
def test_designs_without_a_solution_never_get_a_number(optimiser):
    result = multistart(HOLED, optimiser, 6, seed=1, executor=HERE)
    unsolved = [e for start in result.starts for e in start.evaluations if not e.solved]
    assert unsolved
    assert all(np.isnan(e.objective) and np.isnan(e.constraints).all() and e.violation == np.inf for e in unsolved)
    assert all(start.best.solved for start in result.starts if start.best is not None)


@every
def test_without_any_solution_it_ends_with_none(optimiser):
    class Nowhere(Known):
        def prepare(self):
            evaluate, calls = super().prepare(), []

            def once(u, derivatives, memory):
                calls.append(u)
                return evaluate(u, derivatives, memory) if len(calls) == 1 else Evaluation.unsolved(u, 1, "nowhere")

            return once

    start = minimise(Nowhere("circles"), optimiser, np.array([0.4, 0.4]))
    assert sum(e.solved for e in start.evaluations) == 1
    assert len(start.evaluations) > 1


@every
def test_a_search_that_was_killed_asks_for_nothing_twice(optimiser, tmp_path):
    """Its journal is cut after each tenth record, and within one: what is left of it is not computed again."""

    class Logged(Known):
        """A class of its own, whose program no other test has prepared."""

    log, folder = tmp_path / "log", tmp_path / "run"
    log.mkdir()
    task = Logged("circles", holes=HOLED.holes, log=str(log))
    counted = lambda: sum(len(file.read_bytes()) for file in log.iterdir())  # noqa: E731
    whole = multistart(task, optimiser, 1, seed=5, folder=folder, executor=HERE)
    assert counted() == whole.evaluations
    (file,) = folder.glob("start_*.jsonl")
    raw = file.read_bytes()
    lines = raw.splitlines(keepends=True)
    for kept in range(1, len(lines), 10):
        for torn in (0, 30):
            file.write_bytes(b"".join(lines[:kept]) + lines[kept][:torn])
            before = counted()
            again = multistart(task, optimiser, 1, seed=5, folder=folder, executor=HERE)
            assert same(whole, again)
            assert counted() - before == whole.evaluations - (kept - 1)
            assert file.read_bytes().count(b"\n") == len(lines)


@every
def test_it_ends_after_so_many_evaluations(optimiser):
    """But for the iteration that it is in, and the designs that are polished."""
    polished = 2 * 200 if isinstance(optimiser, Nsga2) else 0
    for start in multistart(HOLED, optimiser, 2, seed=1, executor=HERE).starts:
        assert len(start.evaluations) - start.draws <= SHORT["evaluations"] + 20 + polished
        assert list(start.marks) == sorted(start.marks)


@every
def test_a_search_that_is_given_up_leaves_no_thread(optimiser):
    search = optimiser.search(HOLED.space, np.array([0.2, 0.6]), 1)
    recorder, before = Recorder(HOLED), threading.active_count()
    with suppress(StopIteration):  # one that asks for all of its designs at once
        ask = next(search)
        for _ in range(2):
            assert isinstance(ask, Ask)
            ask = search.send(recorder(ask.points, ask.derivatives))
    search.close()
    assert threading.active_count() == before
