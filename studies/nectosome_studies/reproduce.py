"""What `nectosome reproduce` does: studies of published robots, compared with the printed numbers."""

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from nectosome.cli.output import check_folder, check_target, report, tell, write
from nectosome.cli.progress import progress_bar
from nectosome.core.programs.remember import forget
from nectosome.io import save_dataset, write_atomic
from nectosome.io.file_system import make_folder
from nectosome.io.summary import Summary
from nectosome.io.tables import Number, Table
from nectosome.units import InputError, did_you_mean
from nectosome.view.scorecard import shown

from . import STUDIES
from .report import pages, write_figures, write_report
from .study import Study

_FIELDS = ("id", "quantity", "unit", "shown", "printed", "source", "ours", "error", "tolerance")
_FIELDS += ("within", "verdict", "kind", "note")
_SCORECARD = "scorecard.json"
_SHORT = {"percent": "%", "1": ""}


def reproduce(studies: Sequence[str], quick: bool, out: Path | None, force: bool) -> int:
    """Run studies, all without names, and print their rows; the exit code is 1 where one was not computed.

    With a folder the report, the scorecard, figures and runs are written to it. Raises InputError.
    """
    for name in studies:
        if name not in STUDIES:
            raise InputError(f'there is no study called "{name}".{did_you_mean(name, STUDIES)}')
    names = [name for name in STUDIES if not studies or name in studies]
    written = [*pages(names), _SCORECARD]
    if out is not None:
        _make_folder(out)
        for file in written:
            check_target(out / file, "--out", (".html", ".json"), force)

    done: list[Study] = []
    minutes = [STUDIES[name].minutes for name in names]
    with progress_bar("reproduce") as update:
        for k, name in enumerate(names):

            def progress(what: str, share: float, k: int = k) -> None:
                done = (sum(minutes[:k]) + minutes[k] * share) / sum(minutes)
                update(f"study {k + 1} of {len(names)}, {names[k]}: {what}", done)

            study = STUDIES[name].run(quick, progress)
            if out is not None:
                _save_runs(study, out)
            done.append(study)
            forget()

    rows = [_row(row) for study in done for row in study.rows]
    if out is not None:
        text = json.dumps({"rows": rows}, indent=2, allow_nan=False).encode() + b"\n"
        write_atomic(out / _SCORECARD, text)
        write_report(done, out)
        _make_folder(out / "figures")
        write_figures(done, out / "figures")
    write(Summary("Scorecard", [_table(rows), _times(done)], notes=_notes(rows)))
    report(*([out / written[0], out / _SCORECARD] if out else []))
    missing = [row["id"] for row in rows if row["ours"] is None and row["kind"] != "missing"]
    if missing:
        tell(f"not computed: {', '.join(missing)}.")
    return 1 if missing else 0


def _make_folder(out: Path) -> None:
    make_folder(out, "--out")
    check_folder(out, "--out")


def _save_runs(study: Study, out: Path) -> None:
    """Write runs to a folder of the study, other data of its figures to `data` in it."""
    for folder, datasets in ((out / study.name, study.runs), (out / study.name / "data", study.data)):
        if datasets:
            _make_folder(folder)
        for name, dataset in datasets.items():
            save_dataset(dataset, folder / f"{name}.nc")


def _row(row: dict[str, Any]) -> dict[str, Any]:
    """Return a row ready for JSON: plain numbers, and nothing where a number is not finite."""
    plain = {field: row[field].item() if hasattr(row[field], "item") else row[field] for field in _FIELDS}
    return {field: None if isinstance(x, float) and not math.isfinite(x) else x for field, x in plain.items()}


def _table(rows: list[dict[str, Any]]) -> Table:
    heads = {"id": "id", "printed": "printed", "ours": "ours", "error": "error", "tolerance": "within"}
    cells = [
        (
            row["id"],
            *(_number(row, name) for name in ("printed", "ours")),
            *(_cell(row[name], "%") for name in ("error", "tolerance")),
            row["verdict"] or row["kind"],
        )
        for row in rows
    ]
    return Table("scorecard", heads | {"verdict": "verdict"}, cells, listed=True)


def _number(row: dict[str, Any], which: str) -> Number | str:
    """Return what is printed, or ours: JSON has it in the row's unit, people in the one that they read it in."""
    if isinstance(row[which], list):
        return shown(row, which)
    return _cell(row[which], row["unit"], shown(row, which) if row["shown"] != row["unit"] else "")


def _cell(value: float | None, unit: str, text: str = "") -> Number:
    return Number(math.nan if value is None else value, _SHORT.get(unit, unit), shown=text)


def _notes(rows: list[dict[str, Any]]) -> list[str]:
    """Return the notes of the rows that do not simply match."""
    noted: dict[str, list[str]] = {}
    for row in rows:
        if row["note"] and row["verdict"] != "match":
            noted.setdefault(row["note"], []).append(row["id"])
    return [f"{', '.join(ids)}: {note}" for note, ids in noted.items()]


def _times(studies: list[Study]) -> Table:
    total = sum(study.seconds for study in studies)
    rows = [
        (
            study.name,
            _time(study.seconds),
            Number(share := study.seconds / (total or 1.0), shown=f"{100 * share:.0f} %"),
        )
        for study in studies
    ]
    return Table("studies", {"study": "study", "seconds": "time", "share": "share"}, [*rows, ("all", _time(total))])


def _time(seconds: float) -> Number:
    return Number(seconds, "s", shown=f"{seconds:.1f} s")
