"""`nectosome reproduce`: studies of published robots, compared with the printed numbers."""

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter
from rich.table import Table
from rich.text import Text

from nectosome.cli.output import Force, check_folder, check_target, progress_bar, tell, write
from nectosome.io import save_dataset, write_atomic
from nectosome.units import InputError, did_you_mean

if TYPE_CHECKING:
    from nectosome.papers import Study

_FIELDS = ("id", "quantity", "unit", "printed", "ours", "error", "tolerance", "verdict", "kind", "note")
_SCORECARD, _REPORT = "scorecard.json", "report.html"
_STYLES = {"match": "green", "better": "green", "differs": "yellow", "not reproducible": "dim"}


def reproduce(
    *studies: Annotated[str, Parameter(help="Names of studies; all of them by default.")],
    quick: Annotated[bool, Parameter(help="Shorter computations that still fill every row.")] = False,
    out: Annotated[
        Path | None, Parameter(help="Write report.html, scorecard.json, figures and runs to this folder.")
    ] = None,
    force: Force = False,
) -> int:
    """Run the studies of the published robots and print how they compare with the papers."""
    from nectosome.core.remember import forget
    from nectosome.papers import STUDIES
    from nectosome.papers.report import write_figures, write_report

    for name in studies:
        if name not in STUDIES:
            raise InputError(f'there is no study called "{name}".{did_you_mean(name, STUDIES)}')
    if out is not None:
        _make_folder(out)
        for file in (_SCORECARD, _REPORT):
            check_target(out / file, "--out", (".html", ".json"), force)

    done: list[Study] = []
    for name, run in STUDIES.items():
        if studies and name not in studies:
            continue
        with progress_bar(name) as update:
            study = run(quick, update)
        if out is not None:
            _save_runs(study, out)
        done.append(study)
        forget()

    rows = [_row(row) for study in done for row in study.rows]
    if out is not None:
        text = json.dumps({"rows": rows}, indent=2, allow_nan=False).encode() + b"\n"
        write_atomic(out / _SCORECARD, text)
        write_report(done, out / _REPORT)
        _make_folder(out / "figures")
        write_figures(done, out / "figures")
    write(_table(rows), _notes(rows), _times(done), *([f"written: {out / _REPORT}"] if out else []))
    missing = [row["id"] for row in rows if row["ours"] is None and row["verdict"] != "not reproducible"]
    if missing:
        tell(f"not computed: {', '.join(missing)}.")
    return 1 if missing else 0


def _make_folder(out: Path) -> None:
    try:
        out.mkdir(parents=True, exist_ok=True)
    except (OSError, ValueError) as error:
        raise InputError(f"cannot make the folder {out}: {getattr(error, 'strerror', error)}.", field="--out") from None
    check_folder(out, "--out")


def _save_runs(study: "Study", out: Path) -> None:
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
    table = Table(header_style="bold", title="Scorecard")
    for name in ("id", "printed", "ours", "unit", "error %", "within %", "verdict"):
        side = "right" if name in ("printed", "ours", "error %", "within %") else "left"
        table.add_column(name, justify=side, no_wrap=name == "id")
    for row in rows:
        verdict = Text(row["verdict"], _STYLES.get(row["verdict"], ""))
        numbers = [_number(row[name]) for name in ("printed", "ours", "error", "tolerance")]
        table.add_row(row["id"], *numbers[:2], row["unit"], *numbers[2:], verdict)
    return table


def _notes(rows: list[dict[str, Any]]) -> Text:
    """Return the notes of the rows that do not simply match."""
    noted: dict[str, list[str]] = {}
    for row in rows:
        if row["note"] and row["verdict"] != "match":
            noted.setdefault(row["note"], []).append(row["id"])
    return Text("\n".join(f"{', '.join(ids)}: {note}" for note, ids in noted.items()))


def _times(studies: "list[Study]") -> Table:
    total = sum(study.seconds for study in studies)
    table = Table(box=None, header_style="bold")
    for name in ("study", "time", "share"):
        table.add_column(name, justify="left" if name == "study" else "right")
    for study in studies:
        share = 100 * study.seconds / total if total else 0.0
        table.add_row(study.name, f"{study.seconds:.1f} s", f"{share:.0f} %")
    table.add_row("all", f"{total:.1f} s", "")
    return table


def _number(value: Any) -> str:
    return "" if value is None else f"{value:.4g}" if isinstance(value, int | float) else str(value)
