"""Many starts: the same whoever runs them, whatever befell the run before."""

import json
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

from nectosome.core.programs import remember
from nectosome.io import load_dataset, save_dataset
from nectosome.io.file_system import entries
from nectosome.search import (
    BatchTask,
    CmaEs,
    Evaluation,
    Gradient,
    Nsga2,
    Pattern,
    Result,
    Start,
    gather_starts,
    make_optimiser,
    multistart,
    read_search,
    read_starts,
)
from nectosome.units import InputError
from nectosome.units.ranges import Ranges

from .tasks import Compiled, Known

HERE = ThreadPoolExecutor(1)
TASK = Known("g08", holes=((2.0, 5.0, 0.3),))


def content(result):
    """All that must be the same; times are not."""
    return [
        (replace(s, evaluations=(), note="").__dict__ | {"evaluations": [numbers(e) for e in s.evaluations]})
        for s in result.starts
    ]


def numbers(e: Evaluation):
    arrays = (e.u, e.constraints, e.gradient, e.jacobian)
    return [a if a is None else a.tolist() for a in arrays], e.objective, e.reason, dict(e.outputs)


def same(a, b):
    return repr(content(a)) == repr(content(b))


def test_results_do_not_depend_on_who_computes_them(tmp_path):
    here = multistart(TASK, Pattern(), 5, seed=3, executor=HERE)
    with ThreadPoolExecutor(3) as three:
        assert same(here, multistart(TASK, Pattern(), 5, seed=3, executor=three))
    assert same(here, multistart(TASK, Pattern(), 5, seed=3, workers=1))
    assert same(here, multistart(TASK, Pattern(), 5, seed=3, workers=2, folder=tmp_path))
    assert same(here, multistart(TASK, Pattern(), 5, seed=3, executor=HERE, folder=tmp_path))
    assert not same(here, multistart(TASK, Pattern(), 5, seed=4, executor=HERE))


def test_the_first_start_begins_where_it_is_told_unless_that_is_refused(tmp_path):
    own = multistart(TASK, Gradient(), 2, draws=3000, executor=HERE)
    first = own.starts[1].start
    told = multistart(TASK, Gradient(), 2, draws=3000, first=first, executor=HERE)
    assert told.starts[0].start.tolist() == first.tolist()
    assert repr(content(told)[1]) == repr(content(own)[1])
    refused = multistart(TASK, Gradient(), 1, draws=3000, first=np.ones(2), executor=HERE).starts[0]
    assert refused.evaluations[0].u.tolist() == [1.0, 1.0]
    assert (refused.draws, refused.begun) == (own.starts[0].draws, True)  # the first draw of that start was refused too


def test_the_evaluations_of_a_run_are_read_while_it_is_under_way(tmp_path):
    seen = []
    result = multistart(
        TASK,
        Pattern(),
        3,
        executor=HERE,
        folder=tmp_path,
        progress=lambda done, best, evaluations, share: seen.append((done, list(map(len, read_starts(tmp_path))))),
    )
    for done, counts in seen:
        assert counts[:done] == [len(start.evaluations) for start in result.starts[:done]]
    read = read_starts(tmp_path)
    made = [[numbers(e) for e in start.evaluations] for start in result.starts]
    assert repr([[numbers(e) for e in start] for start in read]) == repr(made)  # text, since nan is not itself


def test_refused_designs_are_counted():
    """A share of 0.86 percent of the box of g08 is feasible; refused designs carry their reason."""
    result = multistart(TASK, Gradient(evaluations=1), 40, executor=HERE, draws=3000)
    draws = sum(start.draws for start in result.starts)
    assert 40 / draws == pytest.approx(0.0086, rel=0.3)
    for start in result.starts:
        assert start.begun
        assert sum(start.rejected.values()) == start.draws - 1
        assert start.rejected.keys() <= {"g0 is not kept", "g1 is not kept", "in a hole"}
        assert start.best_at(0).u.tolist() == start.start.tolist()
    assert any("in a hole" in start.rejected for start in result.starts)


def test_a_start_that_nobody_accepts_is_reported():
    result = multistart(TASK, Gradient(), 3, executor=HERE, draws=5)
    failed = [start for start in result.starts if not start.begun]
    assert failed
    for start in failed:
        assert start.message.startswith("none of 5 drawn designs was accepted, mostly because g")
        assert (start.best, start.start, start.converged, len(start.evaluations)) == (None, None, False, 5)
    assert result.share() <= 1 - len(failed) / 3


def test_a_finished_folder_computes_nothing(tmp_path):
    task = Known("disc", log=str(tmp_path))
    counted = lambda: sum(len(file.read_bytes()) for file in tmp_path.glob("[0-9]*"))  # noqa: E731
    first = multistart(task, Gradient(), 3, folder=tmp_path / "run", executor=HERE)
    made = counted()
    assert made == first.evaluations
    assert same(first, multistart(task, Gradient(), 3, folder=tmp_path / "run", executor=HERE))
    assert counted() == made
    more = multistart(task, Gradient(), 5, folder=tmp_path / "run", executor=HERE)
    assert content(more)[:3] == content(first)
    assert counted() == more.evaluations


@pytest.mark.parametrize("optimiser", [Gradient(), Pattern(evaluations=60), CmaEs(evaluations=60)])
def test_a_record_cut_anywhere_is_taken_up(tmp_path, optimiser):
    task = Known("disc", holes=((0.3, 0.3, 0.2),))
    whole = multistart(task, optimiser, 1, seed=5, folder=tmp_path, executor=HERE)
    (file,) = tmp_path.glob("start_*.jsonl")
    raw = file.read_bytes()
    for n in np.linspace(0, len(raw), 25).astype(int):
        file.write_bytes(raw[:n])
        again = multistart(task, optimiser, 1, seed=5, folder=tmp_path, executor=HERE)
        assert same(whole, again)
        assert bool(again.starts[0].note) == (n > 100 and raw[n - 1 : n] != b"\n")
    assert multistart(task, optimiser, 1, seed=5, folder=tmp_path, executor=HERE).starts[0].note == ""


def test_times_survive(tmp_path):
    task = Known("disc", pause=1e-3)
    first = multistart(task, Gradient(), 1, folder=tmp_path, executor=HERE)
    assert first.starts[0].seconds >= 1e-3 * first.evaluations
    again = multistart(task, Gradient(), 1, folder=tmp_path, executor=HERE)
    assert again.starts[0].seconds == first.starts[0].seconds


@pytest.mark.parametrize("workers", [None, 2])
def test_a_cancelled_run_keeps_what_is_done(tmp_path, workers):
    task = Known("disc", pause=2e-3)
    how = {"workers": workers} if workers else {"executor": HERE}
    seen = []

    def progress(done, best, evaluations, share):
        seen.append((done, best is None, evaluations))
        return done < 2

    part = multistart(task, Gradient(), 12, folder=tmp_path, progress=progress, **how)
    assert part.cancelled
    ended = [start for start in part.starts if not start.cancelled]
    assert 2 <= len(ended) <= len(part.starts) <= 12
    assert seen[-1][0] >= 2
    assert [s[2] for s in seen] == sorted(s[2] for s in seen)
    rest = multistart(task, Gradient(), 12, folder=tmp_path, **how)
    assert not rest.cancelled
    assert same(rest, multistart(task, Gradient(), 12, executor=HERE))


@pytest.mark.parametrize("starts", [2, 7])
def test_a_worker_that_is_far_from_its_next_evaluation_is_ended(tmp_path, starts):
    """Starts that wait for a worker do not keep the run from its end."""
    task, begun = Known("disc", pause=600.0, log=str(tmp_path)), []

    def progress(done, best, evaluations, share):
        assert evaluations == 0  # none is complete
        if any(file.name.isdigit() for file in tmp_path.iterdir()):  # an evaluation is under way
            begun.append(time.perf_counter())
        return not begun

    part = multistart(task, Gradient(), starts, progress=progress, workers=2)
    assert part.cancelled and not part.starts
    assert time.perf_counter() - begun[0] < 60


def test_that_workers_compile_is_told_before_there_are_evaluations():
    seen = []

    def progress(done, best, evaluations, share):
        seen.append((evaluations, bool(remember.compiling)))

    multistart(Compiled("disc"), Gradient(), 2, progress=progress, workers=2)
    assert (0, True) in seen
    assert not remember.compiling


def test_a_cancelled_run_has_the_best_so_far(tmp_path):
    """Of a start that is not at its end, in the journal that another call goes on from."""
    seen = []

    def progress(done, best, evaluations, share):
        seen.append(best)
        return best is None or best.objective > 20.0

    task = Known("disc", pause=5e-3, anywhere=True)
    part = multistart(task, Pattern(), 1, 5, folder=tmp_path, executor=ThreadPoolExecutor(1), progress=progress)
    (start,) = part.starts
    assert part.cancelled and start.cancelled and start.message == "cancelled"
    assert (start.draws, start.begun) == (1, True)
    assert start.value == part.best()[0].value <= seen[-1].objective
    assert part.to_dataset().sizes["evaluation"] == len(start.evaluations)
    whole = multistart(task, Pattern(), 1, 5, folder=tmp_path, executor=HERE)
    assert [e.u.tobytes() for e in start.evaluations] == [
        e.u.tobytes() for e in whole.starts[0].evaluations[: len(start.evaluations)]
    ]


def test_a_folder_without_an_evaluation_is_anybody_s(tmp_path):
    """One that fails leaves none, or what was in it; one that was killed is in nobody's way."""

    class Refused(Known):
        def prepare(self):
            raise InputError("makes no sense")

    deep = tmp_path / "a" / "b"
    for error, task, optimiser in (
        ("makes no sense", Refused("disc"), Gradient()),
        ("has no derivatives", BatchTask(lambda x: x[:, 0], Ranges("a", 0, 1)), Gradient()),
        ("needed: the task has one objective", Known("disc"), Nsga2()),
    ):
        with pytest.raises(InputError, match=error):
            multistart(task, optimiser, 1, folder=deep, executor=HERE)
        assert not (tmp_path / "a").exists()
    deep.mkdir(parents=True)
    (deep / "notes.txt").write_text("mine")
    with pytest.raises(InputError, match="makes no sense"):
        multistart(Refused("disc"), Gradient(), 1, folder=deep, executor=HERE)
    assert {path.name for path in deep.iterdir()} == {"lock", "notes.txt"}
    multistart(Known("disc"), Gradient(), 1, seed=4, folder=deep, executor=HERE)
    file = deep / "start_0000.jsonl"
    file.write_bytes(file.read_bytes().splitlines(keepends=True)[0])  # as of one that was killed while it compiled
    assert multistart(Known("line"), Gradient(), 1, seed=5, folder=deep, executor=HERE).starts
    with pytest.raises(InputError, match="holds another task"):
        multistart(Known("disc"), Gradient(), 1, seed=4, folder=deep, executor=HERE)


def test_an_interrupted_run_keeps_what_is_done(tmp_path):
    task = Known("disc", pause=1e-3)

    def progress(done, best, evaluations, share):
        if done:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        multistart(task, Gradient(), 6, folder=tmp_path, progress=progress, workers=2)
    kept = sum(b'"end"' in file.read_bytes() for file in tmp_path.glob("start_*.jsonl"))
    assert kept >= 1
    assert len(multistart(task, Gradient(), 6, folder=tmp_path, workers=2).starts) == 6


def test_a_folder_is_for_one_piece_of_work(tmp_path):
    run = {"task": Known("disc"), "optimiser": Pattern(mesh=(0.1, 0.2), evaluations=20), "starts": 2, "seed": 1}
    multistart(**run, folder=tmp_path, executor=HERE, about={"robot": "name: x"})
    for change, message in (
        ({"task": Known("circles")}, r"holds another task .* Take another folder"),
        ({"optimiser": Pattern(evaluations=21)}, "holds another optimiser, or other options of it"),
        ({"optimiser": Gradient()}, "holds another optimiser"),
        ({"seed": 2}, r"holds another seed \(1, now 2\)"),
        ({"draws": 7}, r"holds another number of draws \(200, now 7\)"),
        ({"starts": 1}, "holds 2 starts, 1 are asked for"),
    ):
        with pytest.raises(InputError, match=message):
            multistart(**{**run, **change}, folder=tmp_path, executor=HERE)
    held = read_search(tmp_path)
    assert held["about"] == {"robot": "name: x"}
    assert make_optimiser(**held["optimiser"]) == run["optimiser"]
    assert not multistart(**run, folder=tmp_path, executor=HERE).cancelled
    (tmp_path / "start_0000.jsonl").write_text("dear diary\n")
    with pytest.raises(InputError, match=r"start_0000.jsonl: this is not a journal"):
        multistart(**run, folder=tmp_path, executor=HERE)
    (tmp_path / "search.json").write_text("{}")
    with pytest.raises(InputError, match="another version"):
        read_search(tmp_path)
    (tmp_path / "search.json").unlink()
    with pytest.raises(InputError, match="holds starts, but no search"):
        multistart(**run, folder=tmp_path, executor=HERE)


def test_a_folder_is_for_one_process_at_a_time(tmp_path):
    pytest.importorskip("fcntl")
    refused = []

    def progress(done, best, evaluations, share):
        with pytest.raises(InputError, match=r"is in use by process \d+\.") as error:
            multistart(Known("disc"), Gradient(), 1, folder=tmp_path, executor=HERE)
        refused.append(error)

    multistart(Known("disc"), Gradient(), 1, folder=tmp_path, executor=HERE, progress=progress)
    assert refused


def test_a_record_of_another_optimiser_version_is_told(tmp_path):
    multistart(Known("disc"), Gradient(), 1, folder=tmp_path, executor=HERE)
    (file,) = tmp_path.glob("start_*.jsonl")
    lines = file.read_bytes().splitlines(keepends=True)
    file.write_bytes(b"".join([*lines[:5], lines[6]]))  # sound lines, but one is missing
    with pytest.raises(InputError, match="evaluation 5 is not the one that the optimiser asks for now"):
        multistart(Known("disc"), Gradient(), 1, folder=tmp_path, executor=HERE)


def test_the_best_are_distinct_and_counted():
    result = multistart(Known("disc"), Gradient(), 10, executor=HERE)
    assert len(result.best(5)) == 1
    assert result.share() == 1.0
    many = multistart(TASK, Gradient(), 20, executor=HERE, draws=3000)
    best = [start.best.objective for start in many.best(4)]
    assert best == sorted(best)
    assert len(best) == 4
    assert 0 < many.share(0.01) < many.share(0.9)


@pytest.mark.parametrize(("others", "share"), [((1e-14, -1e-14), 1.0), ((0.0, 0.0), 1.0), ((1e-3, 0.0), 0.5)])
def test_bests_that_are_0_but_for_rounding_are_the_same(others, share):
    """Beside 20, which was evaluated as well."""
    each = ([Evaluation(np.zeros(1), value, np.zeros(0)) for value in (20.0, best)] for best in others)
    starts = (Start(k, tuple(e), (), True, "", 1e-6) for k, e in enumerate(each))
    assert Result(tuple(starts), ("x",), ()).share() == share


def test_progress_of_a_start_can_be_read_off():
    start = multistart(Known("disc"), Pattern(), 1, executor=HERE).starts[0]
    course = [start.best_at(n).objective for n in (0, 1, 5, 20, 10_000)]
    assert course == sorted(course, reverse=True)
    assert course[0] > course[2] > course[3] > start.best.objective == course[-1]


def test_datasets_hold_all_and_come_back(tmp_path):
    result = multistart(TASK, Gradient(), 3, executor=HERE, draws=30)
    data = result.to_dataset()
    save_dataset(data, tmp_path / "design.nc")
    assert load_dataset(tmp_path / "design.nc").equals(data)
    assert data.sizes["evaluation"] == result.evaluations
    for k, start in enumerate(result.starts):
        if start.best is not None:
            row = data.isel(evaluation=int(data["best"][k]))
            assert row["objective"] == start.best.objective
            assert row["evaluation_start"] == start.number
            assert row["outputs"].sel(output="x0") == start.best.outputs["x0"]
    assert multistart(Known("disc"), Gradient(), 1, executor=HERE).to_dataset()["iteration"].max() > 5


def test_numbers_that_make_no_sense_are_told():
    for change in ({"starts": 0}, {"seed": -1}, {"draws": 0}, {"workers": 0}):
        with pytest.raises(ValueError, match=f"{next(iter(change))} is -?[01]; it must be at least"):
            multistart(Known("disc"), Gradient(), **{"starts": 1, **change})


def test_optimisers_are_made_by_name():
    for optimiser in (Pattern(), Gradient(tolerance=1e-5), CmaEs(population=9), Pattern(mesh=(0.1, 0.2))):
        assert make_optimiser(**json.loads(json.dumps(optimiser.describe()))) == optimiser
    with pytest.raises(InputError, match=r'no optimiser "gradiant". Did you mean "gradient"'):
        make_optimiser("gradiant")
    with pytest.raises(InputError, match=r'pattern has no option "mash". Did you mean "mesh"'):
        make_optimiser("pattern", mash=1)
    with pytest.raises(InputError, match="evaluations: is 0"):
        make_optimiser("pattern", evaluations=0)
    with pytest.raises(InputError):
        make_optimiser("pattern", directions="3n")


def test_shares_of_the_starts_make_the_whole(tmp_path):
    task = Known("disc")
    whole = multistart(task, Gradient(), 5, seed=3, executor=HERE)
    shares = [tmp_path / f"share-{k}" for k in (1, 2)]
    for k, folder in enumerate(shares, start=1):
        part = multistart(task, Gradient(), 5, seed=3, executor=HERE, folder=folder, share=(k, 2))
        assert [start.number for start in part.starts] == [*range(k - 1, 5, 2)]
    assert gather_starts(shares, tmp_path / "all") == 5
    joined = {file: file.read_bytes() for file in entries(tmp_path / "all", "*.jsonl")}
    assert same(whole, multistart(task, Gradient(), 5, seed=3, executor=HERE, folder=tmp_path / "all"))
    assert {file: file.read_bytes() for file in entries(tmp_path / "all", "*.jsonl")} == joined  # nothing is computed
    with pytest.raises(InputError, match="holds files already"):
        gather_starts(shares, tmp_path / "all")
    with pytest.raises(InputError, match="2 of 5 starts are missing"):
        gather_starts(shares[:1], tmp_path / "new")
    with pytest.raises(InputError, match="are the same start"):
        gather_starts([*shares, shares[0]], tmp_path / "new")
    multistart(task, Gradient(), 5, seed=4, executor=HERE, folder=tmp_path / "other", share=(2, 2))
    with pytest.raises(InputError, match="is of another search than"):
        gather_starts([shares[0], tmp_path / "other"], tmp_path / "new")
    with pytest.raises(InputError, match="is no folder of a search"):
        gather_starts([tmp_path], tmp_path / "new")
    assert not (tmp_path / "new").exists()
