"""The report: one page with the scorecard of all studies and the figures that each study brings."""

from collections.abc import Iterator, Sequence
from html import escape
from pathlib import Path

from nectosome.io import provenance
from nectosome.view import series
from nectosome.view.page import write_page, write_panels
from nectosome.view.run_page import origin
from nectosome.view.scenes import last_periods
from nectosome.view.scorecard import summary, table
from nectosome.view.style import Panel

from .study import Study


def write_report(studies: Sequence[Study], path: str | Path) -> None:
    """Write the report of all studies as one HTML file that works offline, whole or not at all.

    Raises InputError where it cannot be written.
    """
    rows = [row for study in studies for row in study.rows]
    links = "".join(f'<a href="#{escape(s.name)}">{escape(s.title)}</a>' for s in studies)
    parts: list[str | Panel] = [
        f'<p class="small">{escape(origin(provenance({})))}</p>',
        f'<nav><a href="#scorecard">Scorecard</a>{links}</nav>',
        f'<h2 id="scorecard">Scorecard</h2>\n<p>{escape(summary(rows))}</p>',
        table(rows),
        f'<p class="small">{escape(_LEGEND)}</p>',
    ]
    for study in studies:
        parts += _section(study)
    write_page(path, "nectosome: published robots, reproduced", parts)


_LEGEND = (
    "Error: ours against printed. Prediction: nothing was fitted to the printed number; calibration: something was; "
    "synthetic: compared with data made by a model; measurement: taken, or identified, from recordings that "
    "others made. Figures show simulations unless they say measured."
)


def write_figures(studies: Sequence[Study], folder: str | Path) -> None:
    """Write every figure of the studies as a page of its own into a folder that exists; they share their programs.

    Raises InputError where it cannot be written.
    """
    each = ((f"{study.name}-{i + 1}", panel) for study in studies for i, panel in enumerate(_panels(study)))
    write_panels(Path(folder), each)


def _section(study: Study) -> Iterator[str | Panel]:
    yield f'<h2 id="{escape(study.name)}">{escape(study.title)}</h2>\n<p>{escape(study.about)}</p>'
    what = "recordings" if study.recorded else "simulations"
    yield f'<p class="small">{len(study.runs)} {what}, {study.seconds:.0f} s.</p>'
    for name, run in study.runs.items():
        if run.attrs.get("status", "SOLVED") != "SOLVED":
            yield f"<p><b>Run {escape(name)} did not succeed</b>: {escape(run.attrs['status_reason'])}.</p>"
    yield from _panels(study)
    scenes = last_periods(study.runs)
    if scenes is not None:
        caption = "The last periods of each simulation, in their own time. Drag to turn, scroll to come nearer."
        yield Panel("Scenes of the simulations", caption, scenes)


def _panels(study: Study) -> list[Panel]:
    if study.figures is not None:
        return study.figures(study.data, study.runs)
    return [series.speeds_panel(study.runs)] if study.runs else []
