"""What a study hands over, and how a computed number is scored against a printed one."""

import tomllib
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import Future, as_completed
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any, TypeVar

import xarray as xr
from pydantic import BaseModel, ValidationError

from nectosome.core.programs.remember import forget
from nectosome.units import InputError, unit_to_si
from nectosome.view.scorecard import ends
from nectosome.view.style import Panel

FOLDER = Path(__file__).parent  # of all studies
KINDS = {
    "prediction": "nothing of the model is fitted to the number that it is held against",
    "identification": "found from recordings that others made",
    "calibration": "the model is fitted to this number, or with it to another one",
    "construction": "true by construction: a limit at its limit, symmetry, arithmetic, recovering what was put in",
    "method": "check of a method on synthetic data, made with known values",
    "misprint": "a printed number that does not follow from the others that its paper prints",
    "missing": "needs data that were not published",
    "own": "ours alone: nothing is printed or measured that it could be held against",
}
SOURCES = {
    "measured": "measured by those who print it",
    "computed": "computed by those who print it",
    "derived": "follows from printed numbers; nobody prints it",
    "input": "what synthetic data were made with",
}
Table = TypeVar("Table", bound=BaseModel)
_JUDGED = ("prediction", "identification")
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
    rows: list[dict[str, Any]] = field(default_factory=list)  # that stand in no book
    about: str = ""  # that is added to what `study.toml` says
    recorded: bool = False  # the runs are recordings


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
    return done


def collected(waiting: Mapping[Future[Any], str], tell: Callable[[int], None]) -> dict[str, Any]:
    """Results of futures by name, in the order given; `tell` gets the number of those that are there."""
    for count, future in enumerate(as_completed(waiting), start=1):
        future.result()
        tell(count)
    return {name: future.result() for future, name in waiting.items()}


def drawn(makers: Iterable[tuple[tuple[str, ...], Callable[[Sets], Panel]]], given: Sets) -> list[Panel]:
    """Panels of all makers whose datasets, named before each, are given."""
    return [make(given) for needed, make in makers if all(name in given for name in needed)]


def scored(book: dict[str, dict[str, Any]], numbers: dict[str, float | None]) -> list[dict[str, Any]]:
    """All rows that a paper's book has, in its order."""
    missing = sorted(set(numbers) ^ set(book))
    if missing:
        raise RuntimeError(f"scorecard rows without a number, or numbers without a row: {missing}")
    return [score(row, entry, numbers[row]) for row, entry in book.items()]


def printed(study: str) -> dict[str, dict[str, Any]]:
    """What a paper prints, by row id, from the `printed.toml` beside its study."""
    return read_book(study, "printed.toml")


def read_book(*path: str) -> dict[str, Any]:
    """A file of texts and numbers below this room. Raises FileNotFoundError."""
    return tomllib.loads(FOLDER.joinpath(*path).read_text(encoding="utf-8"))


def read_table(model: type[Table], entry: Mapping[str, Any], *path: str) -> Table:
    """A table of a file below this room. Raises InputError that names what is wrong in it."""
    try:
        return model.model_validate(entry)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"]))
        raise InputError(f"{first['msg']}.", file="/".join(path), field=where) from None


def fits(places: Iterable[str], row: str) -> bool:
    """Whether one of the places, which may hold `*`, is the id of a row."""
    return any(fnmatchcase(row, place) for place in places)


def score(row: str, entry: dict[str, Any], ours: float | None) -> dict[str, Any]:
    """Scorecard row of a computed number, of one of the `KINDS`, beside a printed one from one of the `SOURCES`.

    Only where ours could have missed a number of others there is a verdict: on a prediction or an identification. It
    is `match` within the entry's tolerance [percent], or `within` [its unit] of a printed zero, inside of a printed
    range (low, high), and anywhere below a printed limit (`at_most`); `better` on the side that the entry calls better
    of a number that others computed; else `differs`. Where the paper prints only a direction (sign 1 or -1) it is that
    which must agree. The error is that of the printed number, or of the nearest end of the range, 0 inside of it.

    Numbers are in `unit`; people read them in the unit `shown`, which is the same where the entry has none.
    """
    kind, reference, source = entry["kind"], entry.get("printed"), entry.get("source", "")
    told = reference is not None or "direction" in entry
    if kind not in KINDS or told != (source in SOURCES) or ("better" in entry and source != "computed"):
        raise RuntimeError(f"scorecard row {row}: no kind, no source of what is printed, or one that cannot be beaten")
    unit, shown = entry["unit"], entry.get("shown", entry["unit"])
    if shown != unit and unit_to_si(shown)[1] != unit_to_si(unit)[1]:
        raise RuntimeError(f"scorecard row {row}: a number in {unit} cannot be shown in {shown}")
    error = None if reference is None or ours is None else _error(ours, *ends(reference))
    return {
        "id": row,
        "quantity": entry["quantity"],
        "unit": unit,
        "shown": shown,
        "printed": reference,
        "source": source,
        "ours": None if ours is None else float(ours) + 0.0,  # no minus zero
        "error": error,
        "tolerance": entry.get("tolerance"),
        "within": entry.get("within"),
        "verdict": _verdict(entry, ours, error) if told and kind in _JUDGED and ours is not None else "",
        "kind": kind,
        "note": entry.get("note", ""),
    }


def _error(ours: float, low: float, high: float) -> float | None:
    """Error in percent of what is printed, of the nearest end of a range; None beside a zero."""
    nearest = min(max(ours, low), high)
    return 100 * (ours - nearest) / abs(nearest) if nearest else None


def _verdict(entry: dict[str, Any], ours: float, error: float | None) -> str:
    reference = entry.get("printed")
    if reference is None:
        return "match" if ours * entry["direction"] > 0 else "differs"
    low, high = ends(reference)
    if low < high:
        return "match" if low <= ours <= high else "differs"
    near = abs(ours) <= entry["within"] if error is None else abs(error) <= entry["tolerance"]
    if near or (entry.get("at_most", False) and ours <= reference):
        return "match"
    ahead = {"high": ours > reference, "low": ours < reference}.get(entry.get("better", ""), False)
    return "better" if ahead else "differs"
