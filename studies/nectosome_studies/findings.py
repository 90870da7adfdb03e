"""The strongest findings, failures among them: `findings.toml` picks a row and a figure for each, by importance."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from nectosome.view.scorecard import Row

from .claims import numbers, word
from .study import read_book


class Finding(NamedTuple):
    """What was found: its numbers, how they compare, and the figure of its study that shows it."""

    what: str
    printed: str
    source: str
    ours: str
    word: str
    study: str
    picture: str

    @property
    def text(self) -> str:
        """In a sentence."""
        theirs = f"{self.source} {self.printed}, " if self.printed else ""
        return f"{self.what}: {theirs}ours {self.ours} ({self.word})."


def findings(rows: Sequence[Row]) -> list[Finding]:
    """Those whose rows are given and have a number, in the order of their importance."""
    given = {row["id"]: row for row in rows if row["ours"] is not None}
    return [
        _finding(entry, given[entry["row"]])
        for entry in read_book("findings.toml")["findings"]
        if entry["row"] in given
    ]


def _finding(entry: Mapping[str, str], row: Row) -> Finding:
    printed, ours = (numbers([row], which) for which in ("printed", "ours"))
    how, study = word([row]).replace("predicted", entry.get("verb", "predicted")), row["id"].partition("/")[0]
    return Finding(entry["what"], printed, row["source"], ours, how, study, entry["picture"])
