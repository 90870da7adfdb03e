"""The report: one page with the scorecard of all studies and the figures of each; and the page of a single run."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from nectosome.io import provenance

from . import (
    catshark,
    crawling,
    design,
    fishtail,
    flagellum,
    gallery,
    jets,
    measurements,
    mission,
    paddle,
    robot3d,
    schedule,
    series,
    swimming,
    tracked,
    tracking,
)
from .following import following_panels
from .page import panel_html, write_library, write_page, write_panel
from .scenes import Scenes
from .scorecard import summary, table
from .style import Panel
from .tubes import description

if TYPE_CHECKING:
    import xarray as xr


class Study(Protocol):
    """What a report needs of a study."""

    @property
    def name(self) -> str:
        """Short name, such as "flagellum"."""
        ...

    @property
    def title(self) -> str:
        """Heading of its section."""
        ...

    @property
    def about(self) -> str:
        """What is reproduced, in a paragraph."""
        ...

    @property
    def rows(self) -> Sequence[Mapping[str, Any]]:
        """Rows of the scorecard."""
        ...

    @property
    def runs(self) -> Mapping[str, "xr.Dataset"]:
        """Datasets of its simulations, by name."""
        ...

    @property
    def seconds(self) -> float:
        """How long it took [s]."""
        ...

    @property
    def data(self) -> Mapping[str, "xr.Dataset"]:
        """What else there is to draw, by figure."""
        ...


_POSEIDRONE = {  # by data that a part of the study leaves
    "swim": swimming.panels,
    "static_free": jets.panels,
    "crawl_told": crawling.panels,
    "mission": mission.panels,
    "schedule_cranks": schedule.panels,
}
_PANELS: dict[str, Callable[[Study], list[Panel]]] = {
    "flagellum": lambda study: flagellum.panels(study.runs) + design.panels(study.data, study.runs),
    "paddle": lambda study: paddle.panels(study.data, study.runs),
    "poseidrone": lambda study: [p for key, of in _POSEIDRONE.items() if key in study.data for p in of(study.data)],
    "fishtail": lambda study: [*fishtail.panels(study.data), *tracking.panels(study.data)],
    "measure": lambda study: measurements.panels(study.data),
    "track": lambda study: tracked.panels(study.data),
    "catshark": lambda study: catshark.panels(study.data),
    "gallery": lambda study: gallery.panels(study.runs),
}


def write_report(studies: Sequence[Study], path: str | Path) -> None:
    """Write the report of all studies as one HTML file that works offline, whole or not at all.

    Raises InputError where it cannot be written.
    """
    rows = [row for study in studies for row in study.rows]
    links = "".join(f'<a href="#{escape(s.name)}">{escape(s.title)}</a>' for s in studies)
    parts = [
        "<h1>nectosome: published robots, reproduced</h1>",
        f'<p class="small">{escape(_origin(provenance({})))}</p>',
        f'<nav><a href="#scorecard">Scorecard</a>{links}</nav>',
        f'<h2 id="scorecard">Scorecard</h2>\n<p>{escape(summary(rows))}</p>',
        table(rows),
        f'<p class="small">{escape(_LEGEND)}</p>',
    ]
    scenes = Scenes()
    for study in studies:
        parts += _section(study, scenes)
    write_page(path, "nectosome report", [*parts, scenes.head()])


_LEGEND = (
    "Error: ours against printed. Prediction: nothing was fitted to the printed number; calibration: something was; "
    "synthetic: compared with data made by a model; measurement: taken, or identified, from recordings that "
    "others made. Figures show simulations unless they say measured."
)


def write_figures(studies: Sequence[Study], folder: str | Path) -> None:
    """Write every figure of the studies as a page of its own into a folder that exists, with one plotting library.

    Raises InputError where it cannot be written.
    """
    write_library(folder)
    for study in studies:
        for i, panel in enumerate(_panels(study)):
            write_panel(Path(folder) / f"{study.name}-{i + 1}.html", panel)


def show_run(run: "xr.Dataset", path: str | Path) -> None:
    """Write a page about any one run, with its robot in motion, velocity, powers and energies.

    Of one under a controller also how the reference was followed. The page works offline and is written whole or not at
    all. Raises InputError where it cannot be written.
    """
    import json

    title = str(run.attrs.get("title") or "simulation")
    origin = json.loads(run.attrs.get("provenance") or "{}")
    robot = description(run)
    parts = [f"<h1>{escape(title)}</h1>"]
    if robot is not None:
        parts.append(f"<p>{escape(robot.about)}</p>")
    parts.append(f'<p class="small">{escape(" · ".join(filter(None, [_ended(run), _origin(origin)])))}</p>')
    panels = (robot3d.robot_panel, series.velocity_panel, series.power_panel, series.energy_panel)
    shown = [make(run) for make in panels]
    shown[1:1] = following_panels(run) if "reference" in run else []
    parts += [panel_html(panel, f"figure-{i + 1}") for i, panel in enumerate(shown)]
    write_page(path, title, parts)


def _section(study: Study, scenes: Scenes) -> Iterator[str]:
    yield f'<h2 id="{escape(study.name)}">{escape(study.title)}</h2>\n<p>{escape(study.about)}</p>'
    what = "recordings" if study.name in _MEASURED else "simulations"
    yield f'<p class="small">{len(study.runs)} {what}, {study.seconds:.0f} s.</p>'
    for name, run in study.runs.items():
        if run.attrs.get("status", "SOLVED") != "SOLVED":
            yield f"<p><b>Run {escape(name)} did not succeed</b>: {escape(_ended(run))}.</p>"
    for i, panel in enumerate(_panels(study)):
        yield panel_html(panel, f"{study.name}-{i + 1}")
    yield scenes.figure(study.runs, study.name)


_MEASURED = {"measure"}  # studies without a model


def _panels(study: Study) -> list[Panel]:
    if study.name in _PANELS:
        return _PANELS[study.name](study)
    own = [series.speeds_panel(study.runs)] if study.runs else []
    return own + design.panels(study.data, study.runs)


def _ended(run: "xr.Dataset") -> str:
    return str(run.attrs.get("status_reason", ""))


def _origin(origin: Mapping[str, Any]) -> str:
    """Version, time, machine and packages in a line."""
    if not origin:
        return ""
    packages = origin.get("packages", {})
    words = [
        f"nectosome {origin.get('nectosome', '')}",
        str(origin.get("time", "")),
        f"Python {origin.get('python', '')}",
        f"JAX {packages['jax']}" if "jax" in packages else "",
        str(origin.get("platform", "")),
        f"{origin['processors']} processors" if origin.get("processors") else "",
    ]
    return " · ".join(word for word in words if word)
