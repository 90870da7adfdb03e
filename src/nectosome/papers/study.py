"""What a study hands over, and how a computed number is scored against a printed one."""

import time
import tomllib
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import Future, as_completed
from dataclasses import dataclass, field
from importlib.resources import files
from typing import Any, Literal

import xarray as xr

from nectosome.core.remember import forget
from nectosome.view.style import Panel

Kind = Literal["prediction", "calibration", "synthetic", "measurement"]
Sets = Mapping[str, xr.Dataset]
Progress = Callable[[str, float], None]  # what is being done, share of the study that is done


@dataclass(frozen=True)
class Study:
    """Outcome of a study: scorecard rows, the runs behind them, how long it took, and what else there is to draw."""

    name: str
    title: str
    about: str
    rows: list[dict[str, Any]]
    runs: dict[str, xr.Dataset]
    seconds: float
    data: dict[str, xr.Dataset] = field(default_factory=dict)  # by figure
    figures: Callable[[Sets, Sets], list[Panel]] | None = None  # of data and runs; speeds of the runs where None
    recorded: bool = False  # the runs are recordings, not simulations


@dataclass(frozen=True)
class StudyPart:
    """What one part of a study hands over: numbers by scorecard row, and what there is to draw."""

    numbers: dict[str, float | None]
    data: dict[str, xr.Dataset] = field(default_factory=dict)
    runs: dict[str, xr.Dataset] = field(default_factory=dict)


def gathered(
    parts: Iterable[tuple[float, Callable[[bool, Progress], StudyPart]]], quick: bool, progress: Progress
) -> StudyPart:
    """Parts of a study together, each with the share of the time that it takes."""
    done, begun = StudyPart({}), 0.0
    for share, part in parts:
        made = part(quick, lambda what, of, at=begun, wide=share: progress(what, at + wide * of))
        done = StudyPart(done.numbers | made.numbers, done.data | made.data, done.runs | made.runs)
        begun += share
        forget()
    progress("scorecard", 1.0)
    return done


def collected(waiting: Mapping[Future[Any], str], tell: Callable[[int], None]) -> dict[str, Any]:
    """Results of futures by name, in the order given; `tell` gets the number of those that are there."""
    for count, future in enumerate(as_completed(waiting), start=1):
        future.result()
        tell(count)
    return {name: future.result() for future, name in waiting.items()}


def finished(
    name: str,
    title: str,
    about: str,
    began: float,
    done: StudyPart,
    figures: Callable[[Sets, Sets], list[Panel]] | None = None,
    kind: Callable[[str], Kind] = lambda row: "prediction",
) -> Study:
    """Study whose numbers fill all rows of its book; it began at a time of `time.perf_counter` [s]."""
    rows = scored(printed(name), done.numbers, kind)
    return Study(name, title, about, rows, done.runs, time.perf_counter() - began, done.data, figures)


def drawn(makers: Iterable[tuple[tuple[str, ...], Callable[[Sets], Panel]]], given: Sets) -> list[Panel]:
    """Panels of all makers whose datasets, named before each, are given."""
    return [make(given) for needed, make in makers if all(name in given for name in needed)]


def scored(
    book: dict[str, dict[str, Any]], numbers: dict[str, float | None], kind: Callable[[str], Kind]
) -> list[dict[str, Any]]:
    """All rows that a paper's book has, in its order."""
    missing = sorted(set(numbers) ^ set(book))
    if missing:
        raise RuntimeError(f"scorecard rows without a number, or numbers without a row: {missing}")
    return [score(row, entry, numbers[row], kind(row)) for row, entry in book.items()]


def printed(study: str) -> dict[str, dict[str, Any]]:
    """What a paper prints, by row id, from the `printed.toml` beside its study."""
    text = files("nectosome.papers").joinpath(study, "printed.toml").read_text(encoding="utf-8")
    return tomllib.loads(text)


def score(row: str, entry: dict[str, Any], ours: float | None, kind: Kind = "prediction") -> dict[str, Any]:
    """Scorecard row of a computed number.

    The verdict is `match` within the entry's tolerance [percent], or `within` [its unit] of a printed zero, and
    anywhere below a printed limit (`at_most`); `better` on the side that the entry calls better; else `differs`.
    Where the paper prints only a direction (sign 1 or -1) it is that which must agree; where it prints nothing the row
    is `not reproducible`, as where there is no number of ours.
    """
    reference = entry.get("printed")
    error = None
    if reference and ours is not None:
        error = 100 * (ours - reference) / abs(reference)
    if ours is None:
        verdict = "not reproducible"
    elif reference is not None:
        near = abs(ours) <= entry["within"] if error is None else abs(error) <= entry["tolerance"]
        near = near or (entry.get("at_most", False) and ours <= reference)
        ahead = {"high": ours > reference, "low": ours < reference}.get(entry.get("better", ""), False)
        verdict = "match" if near else "better" if ahead else "differs"
    elif "direction" in entry:
        verdict = "match" if ours * entry["direction"] > 0 else "differs"
    else:
        verdict = "not reproducible"
    return {
        "id": row,
        "quantity": entry["quantity"],
        "unit": entry["unit"],
        "printed": reference,
        "ours": None if ours is None else float(ours) + 0.0,  # no minus zero
        "error": error,
        "tolerance": entry.get("tolerance"),
        "verdict": verdict,
        "kind": kind,
        "note": entry.get("note", ""),
    }
