"""The report: a first page with what was found, a page for each paper, one of misprints, one of checks of methods."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path

import xarray as xr

from nectosome.io import provenance
from nectosome.view import series
from nectosome.view.markup import plain
from nectosome.view.page import write_page, write_panels
from nectosome.view.run_page import origin
from nectosome.view.scenes import is_drawable, last_periods
from nectosome.view.scorecard import Row, plain_table, summary, table
from nectosome.view.style import Panel

from .claims import HEADS, Judgement, judgement
from .findings import findings
from .study import KINDS, SOURCES, Study

_OPENS = "gallery/turtle"
FIRST, MISPRINTS, CHECKS = "report.html", "misprints.html", "checks.html"


def pages(studies: Iterable[str]) -> list[str]:
    """Files that the report of these studies consists of, the first page first."""
    return [FIRST, *(f"{study}.html" for study in studies), MISPRINTS, CHECKS]


def write_report(studies: Sequence[Study], folder: str | Path) -> None:
    """Write all pages into a folder that exists; each works offline and on its own, and is written whole or not at all.

    Raises InputError where one cannot be written.
    """
    folder = Path(folder)
    rows = [row for study in studies for row in study.rows]
    panels = {study.name: _panels(study) for study in studies}
    for study in studies:
        write_page(folder / f"{study.name}.html", study.title, _study_page(study, panels[study.name]))
    write_page(folder / MISPRINTS, "Misprints of the papers", [_BACK, _MISPRINTS, _proofs(rows)])
    write_page(folder / CHECKS, "Checks of methods", [_BACK, _CHECKS, *_checks(studies)])
    write_page(folder / FIRST, "nectosome: published robots, reproduced", _first_page(studies, rows, panels))


def write_figures(studies: Sequence[Study], folder: str | Path) -> None:
    """Write every figure of the studies as a page of its own into a folder that exists; they share their programs.

    Raises InputError where it cannot be written.
    """
    each = ((f"{study.name}-{i + 1}", panel) for study in studies for i, panel in enumerate(_panels(study)))
    write_panels(Path(folder), each)


_BACK = f'<nav><a href="{FIRST}">All papers</a></nav>'
_MISPRINTS = "<p>Printed numbers that do not follow from the others in the same paper, and what does.</p>"
_CHECKS = (
    "<p>How well the methods do on synthetic data, made with known values. No number here is held against a paper.</p>"
)


def _first_page(
    studies: Sequence[Study], rows: Sequence[Row], panels: Mapping[str, Sequence[Panel]]
) -> Iterator[str | Panel]:
    yield f'<p class="small">{plain(origin(provenance({})))}</p>'
    scene = last_periods(_swimmer(studies))
    if scene is not None:
        yield Panel("A swimmer", "Simulated, the end of a swim. Drag to turn, scroll to come nearer.", scene)
    found = findings(rows)
    if found:
        yield "<h2>What was found</h2>"
    for finding in found:
        yield f'<p><b>{plain(finding.text)}</b> <a href="{finding.study}.html">All of its study</a></p>'
        yield from _titled(panels[finding.study], [finding.picture])
    yield "<h2>Papers, robots and animals</h2>"
    for study in studies:
        link = f'<a href="{study.name}.html">{plain(study.title)}</a>'
        yield f"<p>{link}. {plain(summary(study.rows))}</p>"
    yield f'<p><a href="{MISPRINTS}">Misprints of the papers</a>, <a href="{CHECKS}">checks of methods</a></p>'
    yield _legend()


def _swimmer(studies: Sequence[Study]) -> dict[str, xr.Dataset]:
    """The run that opens the report: that of the gallery's turtle, or else the first."""
    runs = {f"{study.name}/{name}": run for study in studies for name, run in study.runs.items() if is_drawable(run)}
    name = _OPENS if _OPENS in runs else next(iter(runs), None)
    return {} if name is None else {name: runs[name]}


def _legend() -> str:
    words = [f"<b>{plain(word)}</b>: {plain(text)}" for word, text in (KINDS | SOURCES).items()]
    lines = "<br>".join([*words, "Figures show simulations unless they say measured."])
    return f'<h3>Words</h3><p class="small">{lines}</p>'


def _study_page(study: Study, panels: Sequence[Panel]) -> Iterator[str | Panel]:
    yield _BACK
    yield f"<p>{plain(study.about)}</p>"
    judged = judgement(study.name, study.rows)
    if judged is not None:
        yield from _judged(judged, panels)
    yield f"<details><summary>All numbers. {plain(summary(study.rows))}</summary>{table(study.rows)}</details>"
    what = f"{len(study.runs)} {'recordings' if study.recorded else 'simulations'}, " if study.runs else ""
    yield f'<p class="small">{what}{study.seconds:.0f} s.</p>'
    for name, run in study.runs.items():
        if run.attrs.get("status", "SOLVED") != "SOLVED":
            yield f"<p><b>Run {plain(name)} did not succeed</b>: {plain(run.attrs['status_reason'])}.</p>"
    yield from (panel for panel in panels if judged is None or panel.title not in judged.pictures)
    scenes = last_periods(study.runs)
    if scenes is not None:
        caption = "The last periods of each simulation, in their own time. Drag to turn, scroll to come nearer."
        yield Panel("Scenes of the simulations", caption, scenes)
    yield _legend()


def _judged(judged: Judgement, panels: Sequence[Panel]) -> Iterator[str | Panel]:
    yield f'<p class="small">{plain(judged.reference)}</p>'
    yield plain_table(HEADS, judged.claims)
    yield f"<p>{plain(' '.join(judged.sentences))}</p>"
    yield from _titled(panels, judged.pictures)


def _titled(panels: Sequence[Panel], titles: Sequence[str]) -> list[Panel]:
    return [panel for title in titles for panel in panels if panel.title == title]


def _proofs(rows: Sequence[Row]) -> str:
    return table([row for row in rows if row["kind"] == "misprint"])


def _checks(studies: Sequence[Study]) -> Iterator[str]:
    for study in studies:
        rows = [row for row in study.rows if row["kind"] == "method"]
        if rows:
            yield f"<h2>{plain(study.title)}</h2>{table(rows)}"


def _panels(study: Study) -> list[Panel]:
    if study.figures is not None:
        return study.figures(study.data, study.runs)
    return [series.speeds_panel(study.runs)] if study.runs else []
