"""What a paper claims beside what we find, in a few plain lines that are made from the rows of its study.

The `claims.toml` beside a study says what the paper claims, which rows show it, and, where they differ, why. Printed
numbers, ours and the word are those of the rows.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from nectosome.view.scorecard import Row, ends, in_shown_unit, number

from .study import fits, read_book

WORDS = {
    "calibration": "calibrated",
    "construction": "true by construction",
    "method": "checked on synthetic data",
    "misprint": "misprint in the paper",
    "missing": "needs your data",
    "own": "ours alone",
}
"""What is said of rows that have no verdict."""


class Claim(NamedTuple):
    """A line: what is claimed, the numbers, and a word on how they compare."""

    what: str
    printed: str
    ours: str
    word: str


HEADS = ("claim", "printed or measured", "ours", "")
"""Over the columns of claims."""


class Judgement(NamedTuple):
    """A paper in short: where it was printed, its claims, three sentences on them, titles of figures that show it."""

    reference: str
    claims: list[Claim]
    sentences: list[str]
    pictures: list[str]


def judgement(study: str, rows: Sequence[Row]) -> Judgement | None:
    """What `claims.toml` of a study makes of its rows; None where a study is of no paper.

    Raises RuntimeError where a claim has not rows of one kind.
    """
    try:
        found = read_book(study, "claims.toml")
    except FileNotFoundError:
        return None
    claims = [_claim(study, entry, rows) for entry in found["claims"]]
    return Judgement(found["reference"], claims, found["judgement"], found["pictures"])


def _claim(study: str, entry: Mapping[str, Any], rows: Sequence[Row]) -> Claim:
    places = [f"{study}/{place}" for place in entry["rows"]]
    shown = [row for row in rows if fits(places, row["id"])]
    if len({row["kind"] for row in shown}) != 1:
        raise RuntimeError(f'{study}: the claim "{entry["claim"]}" names rows of no kind or of several')
    compared = f"{word(shown)}{_because(entry, shown)}"
    return Claim(entry["claim"], numbers(shown, "printed"), numbers(shown, "ours"), compared)


def word(rows: Sequence[Row]) -> str:
    """How rows of one kind compare with what is printed, in a word or two."""
    verdicts = {row["verdict"] for row in rows}
    if rows[0]["kind"] in WORDS:
        beside = rows[0]["kind"] == "own" and rows[0]["printed"] is not None
        return "no verdict" if beside else WORDS[rows[0]["kind"]]
    verb = {"prediction": "predicted", "identification": "identified"}[rows[0]["kind"]]
    if "differs" in verdicts:
        return f"{verb}, differs"
    if "better" in verdicts:
        return f"{verb}, better than printed" if verdicts == {"better"} else f"{verb}, as good as printed or better"
    return f"{verb} within {_within(rows)}" if verdicts == {"match"} and _within(rows) else verb


def _because(entry: Mapping[str, Any], rows: Sequence[Row]) -> str:
    """The reason, only where there is something to explain."""
    return f": {entry['because']}" if "because" in entry and any(row["verdict"] == "differs" for row in rows) else ""


def _within(rows: Sequence[Row]) -> str:
    """The largest error, in percent to two digits that count, rounded up; of printed zeros in their unit."""
    errors = [abs(row["error"]) for row in rows if row["error"] is not None]
    if not errors:
        values, unit = _all_numbers(rows, "ours")
        return _three_digits(max(map(abs, values)), unit) if rows[0]["printed"] == 0 else ""
    if max(errors) == 0:
        return "the printed range" if any(map(_is_range, rows)) else "the printed digits"
    step = 10.0 ** (math.floor(math.log10(max(errors))) - 1)
    return f"{math.ceil(max(errors) / step - 1e-9) * step:.2g} %"


def _is_range(row: Row) -> bool:
    return row["printed"] is not None and len(set(ends(row["printed"]))) == 2


def numbers(rows: Sequence[Row], which: str) -> str:
    """The number of rows, `printed` or `ours`, with its unit, or the range of several; nothing where there is none."""
    values, unit = _all_numbers(rows, which)
    if not values:
        return ""
    low, high = _three_digits(min(values), "1"), _three_digits(max(values), unit)
    return high if _three_digits(min(values), unit) == high else f"{low} to {high}"


def _all_numbers(rows: Sequence[Row], which: str) -> tuple[list[float], str]:
    """Numbers of all rows that have one, and their unit; none where units differ."""
    found = [in_shown_unit(row, which) for row in rows]
    same = len({unit for _, unit in found}) == 1
    return [x for values, _ in found for x in values] if same else [], found[0][1]


def _three_digits(value: float, unit: str) -> str:
    return number(value, unit, 3)
