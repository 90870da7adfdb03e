"""Figures of the fishtail: fits to recordings; tracking of references, errors by frequency; tables of what was fitted.

Data, in SI units: as `fit.part` and `control_study.part` give them.
"""

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from nectosome.identification.hysteresis.files import BENCH_UNITS
from nectosome.view.style import Panel, plain

from .. import charts
from ..study import Sets
from .comparison import WORDS

if TYPE_CHECKING:
    import xarray as xr

_MS, _DEGREES, _BAR = 1e3, 57.29577951308232, 1e-5


def panels(sets: Sets) -> list[Panel]:
    """Figures of `figures.toml` that have data, and a table behind each part's."""
    drawn = charts.panels("fishtail", sets)
    tracking = [title for title in drawn if title in ("Tracking", "A dead band of the valve", _BANDS)]
    tables = {"fishtail_told": parameters_panel, "fishtail_margins": margins_panel}
    told, margins = ([make(sets[name])] if name in sets else [] for name, make in tables.items())
    fits = [panel for title, panel in drawn.items() if title not in tracking]
    return [*fits, *told, *(drawn[title] for title in tracking), *margins]


_BANDS = "Which controller at which frequency"


def parameters_panel(found: "xr.Dataset") -> Panel:
    """Parameters with their intervals."""
    rows = []
    for name in found["parameter"].values:
        one = found.sel(parameter=name)
        scale, unit = BENCH_UNITS[one["unit"].item()]
        value, low, high = (scale * float(one[key]) for key in ("value", "low", "high"))
        rows.append(_row(plain(name), (f"{value:#.4g}", f"{low:#.4g} to {high:#.4g}")) + f"<td>{unit}</td>")
    head = _row("parameter", ("value", "95 % interval"), "th") + "<th>unit</th>"
    caption = (
        "Of the fit with the valve's limit, to synthetic recordings. Slopes are sums of the first weights, in "
        "displacement by pressure; all must be above 0 for the hysteresis to have an inverse. Of the paper's 14 "
        "numbers 11 are identifiable: gains of hysteresis and dynamics are one, and the tenth play never moves."
    )
    return Panel("Parameters of the fishtail", caption, _table(head, rows))


def margins_panel(found: "xr.Dataset") -> Panel:
    """Margins of gain, phase and delay."""
    sizes = [float(x) for x in found["amplitude"].values]
    rows = []
    for law in found["controller"].values:
        for k, size in enumerate(sizes):
            gain, phase, delay = (float(found[what].sel(controller=law)[k]) for what in ("gain", "phase", "delay"))
            numbers = f"{_BAR * size:g}", f"{gain:.2f}", f"{_DEGREES * phase:.0f}", f"{_MS * delay:.0f}"
            rows.append(_row(plain(WORDS[str(law)]), numbers))
    heads = "amplitude (bar)", "gain margin", "phase margin (deg)", "delay margin (ms)"
    caption = (
        "Additional gain, lag or delay at which the loop becomes unstable, by first harmonics of the response of the "
        "model to sines of the command, whose hysteresis depends on their amplitude. Learning changes no margins."
    )
    return Panel("Margins of the loops", caption, _table(_row("controller", heads, "th"), rows))


def _row(name: str, numbers: Iterable[str], tag: str = "td") -> str:
    """Cells of a name and of numbers."""
    return f"<{tag}>{name}</{tag}>" + "".join(f'<{tag} class="number">{text}</{tag}>' for text in numbers)


def _table(head: str, rows: Sequence[str]) -> str:
    body = "\n".join(f"<tr>{row}</tr>" for row in rows)
    return f'<div class="wide"><table>\n<thead><tr>{head}</tr></thead>\n<tbody>\n{body}\n</tbody></table></div>'
