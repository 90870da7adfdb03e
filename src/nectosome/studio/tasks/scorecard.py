"""The tab with scorecards: what was printed, what was computed here, row by row, of runs in the working folder."""

import json
from pathlib import Path
from typing import Any

from nectosome.studio.desk import Desk
from nectosome.units import InputError
from nectosome.view.markup import plain
from nectosome.view.scorecard import VERDICTS, Row, percent, shown, summary

from .left_panel import note

_NAME = "scorecard.json"
_NONE = "none yet: nectosome reproduce makes one"
_ALL = "all"
_TEXTS = ("id", "quantity", "unit", "source", "verdict", "kind", "note")
_NUMBERS = ("ours", "error", "tolerance")


class Scorecard:
    """Lays out the tab: which file, which study, which rows, and these."""

    def __init__(self, desk: Desk):
        self._desk, gui = desk, desk.gui
        self._rows: list[Row] = []
        self._file: Any = gui.add_dropdown("File", (_NONE,))
        self._study: Any = gui.add_dropdown("Study", (_ALL,))
        self._only: Any = gui.add_dropdown("Rows", (_ALL, *VERDICTS, "others"))
        gui.add_button("Look again").on_click(lambda _: self.renew())
        self._page = gui.add_html("")
        self._file.on_update(lambda _: self._open())
        for choice in (self._study, self._only):
            choice.on_update(lambda _: self._show())
        self.renew()

    def renew(self) -> None:
        """Look which scorecards there are."""
        self._file.options = self._desk.folder.names(_NAME) or [_NONE]
        self._open()

    def _open(self) -> None:
        name, self._rows = self._file.value, []
        try:
            self._rows = [] if name == _NONE else read_rows(self._desk.folder.existing(name))
        except InputError as error:  # told here: a file of the folder is not what the user may be doing
            self._page.content = note(str(error), bad=True)
            return
        self._study.options = [_ALL, *dict.fromkeys(_study(row) for row in self._rows)]
        self._show()

    def _show(self) -> None:
        chosen = [row for row in self._rows if self._study.value in (_ALL, _study(row))]
        if self._only.value != _ALL:
            kind = self._only.value
            chosen = [r for r in chosen if (r["verdict"] == kind if kind in VERDICTS else r["verdict"] not in VERDICTS)]
        self._page.content = rows_html(chosen) if self._rows else ""


def read_rows(path: Path) -> list[Row]:
    """Rows of a scorecard file. Raises InputError where it is none."""
    try:
        rows = json.loads(path.read_text(encoding="utf-8"))["rows"]
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        raise InputError("this is not a scorecard.", file=path.name) from None
    if not isinstance(rows, list):
        raise InputError("this is not a scorecard: its rows are no list.", file=path.name)
    for k, row in enumerate(rows):
        good = isinstance(row, dict) and all(isinstance(row.get(name), str) for name in _TEXTS)
        good = good and all(isinstance(row.get(name), int | float | None) for name in _NUMBERS)
        if not good or not _readable(row):
            raise InputError(f"row {k + 1} is not that of a scorecard.", file=path.name)
    return rows


def _readable(row: Row) -> bool:
    """Whether what is printed is a number, a range or nothing, and units are known where they are converted."""
    try:
        return all(shown(row, which) for which in ("printed", "ours"))
    except (KeyError, TypeError, ValueError, AttributeError):
        return False


def rows_html(rows: list[Row]) -> str:
    """How many there are of each verdict, then one after the other, with their reasons."""
    each = "".join(_row(row) for row in rows)
    head = f'<div style="font-size:13px;padding:0 12px" id="studio-scorecard"><p>{plain(summary(rows))}</p>'
    return f"{head}{each}</div>"


def _row(row: Row) -> str:
    mark, colour = VERDICTS.get(row["verdict"], ("&#8211;", "#666"))
    theirs, ours = (plain(shown(row, which)) for which in ("printed", "ours"))
    values = f"{plain(row['source'] or 'printed')} {theirs}, ours <b>{ours}</b>"
    if row["error"] is not None:
        within = f" ({percent(row['tolerance'])} allowed)" if row["tolerance"] is not None else ""
        values += f", off by {percent(row['error'])}{within}"
    note = f'<div style="color:#555">{plain(row["note"])}</div>' if row["note"] else ""
    verdict = (
        f'<span style="color:{colour}">{mark} {plain(row["verdict"] or "no verdict")}</span>, {plain(row["kind"])}'
    )
    style = "border-top:1px solid #dfe3e7;padding:5px 0"
    head = f'<div style="{style}" title="{plain(row["id"])}">{plain(row["quantity"])}'
    return f"{head}<br>{values}<br>{verdict}{note}</div>"


def _study(row: Row) -> str:
    """Name of the study that a row is of."""
    return row["id"].partition("/")[0]
