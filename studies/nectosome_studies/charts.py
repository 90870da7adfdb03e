"""Figures of a `figures.toml`: lines, marks, bars and bands over subplots, with titles and captions, all as data.

An entry of `[[figures]]` is a `Chart`. Its expressions name variables of its dataset (see `evaluate`).
"""

from collections.abc import Iterator, Sequence
from fnmatch import fnmatchcase
from typing import Any, Literal, NamedTuple

import numpy as np
import plotly.graph_objects as go
import xarray as xr
from plotly.subplots import make_subplots
from pydantic import BaseModel, ConfigDict

from nectosome.view import style
from nectosome.view.markup import plain
from nectosome.view.style import CYCLE, Panel, dress

from .evaluate import Names, array_of, filled
from .study import Sets, read_book, read_table

_COLOURS = {name: getattr(style, name.upper()) for name in ("blue", "vermillion", "green", "purple", "orange", "sky")}
_COLOURS |= {"black": style.BLACK, "grey": style.GREY, "light": "#b9bec5"}


class _Table(BaseModel):
    """A table of the file: a key that it does not know is refused."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class ChartAxis(_Table):
    """An axis; a text alone is its title."""

    title: str = ""
    log: bool = False
    zero: bool = False  # from zero on
    names: bool = False  # values are names, evenly spread
    reversed: bool = False
    ticks: list[float] | str = []  # or an expression
    step: float | None = None  # between ticks
    range: list[float] | None = None


class Trace(_Table):
    """A line, or one for each value of a dimension."""

    y: str
    x: str = ""  # that of the plot
    name: str = ""
    data: str = ""  # another dataset
    at: dict[str, str | float] = {}  # values of dimensions, nearest where they are numbers
    each: str = ""  # dimension: a line for each value, `{value}` in the name, its place `{number}`
    only: list[str] = []  # of its values
    styles: dict[str, dict[str, Any]] = {}  # name, color, dash, symbol by value; else by the order of colours
    kind: Literal["lines", "markers", "lines+markers", "bars", "across", "band"] = "lines"  # across: bars to the right
    color: str = "blue"
    dash: str = "solid"
    width: float = 2.0
    symbol: str = "circle"
    size: float = 8.0
    shape: str = "linear"
    error: str = ""  # half of the error bars
    low: str = ""  # lower edge of a band whose upper one is y
    if_there: str = ""  # variable without which it is left out


class Subplot(_Table):
    """A subplot."""

    title: str = ""
    x: ChartAxis | str = ""
    y: ChartAxis | str = ""
    over: str = ""  # x of its lines
    lines: list[Trace]
    levels: dict[str, float | str] = {}  # dotted lines across by their text
    uprights: dict[str, float | str] = {}  # and upright ones
    notes: dict[str, tuple[float, float]] = {}  # texts right below a point


class Facets(_Table):
    """All plots once more for each value of a dimension, or for each dataset whose name fits a pattern."""

    each: str = ""
    sets: str = ""
    title: str = "{value}"
    titles: dict[str, str] = {}
    abreast: int = 0  # in a row; all of them without it


class Chart(_Table):
    """A figure."""

    title: str
    caption: str
    data: str = ""
    needs: list[str] = []  # other datasets without which it is left out
    plots: list[Subplot]
    columns: int = 1  # of plots; with facets they stand one below the other
    facets: Facets | None = None
    every: dict[str, int] = {}  # each such sample along a dimension
    height: int = 420
    hover: str = "closest"
    legend: bool = True
    shared_x: bool = False
    shared_y: bool = False
    spacing: list[float] = [0.1, 0.1]  # between columns, rows
    heights: list[float] = []  # of rows, in parts
    layout: dict[str, Any] = {}


class _Cell(NamedTuple):
    """Where a plot is drawn, of which dataset."""

    row: int
    col: int
    plot: Subplot
    one: xr.Dataset
    title: str


def panels(study: str, sets: Sets) -> dict[str, Panel]:
    """Figures of a study's `figures.toml` whose datasets are given, by their titles; none without the file."""
    try:
        book = read_book(study, "figures.toml")
    except FileNotFoundError:
        return {}
    charts = [read_table(Chart, entry, study, "figures.toml") for entry in book["figures"]]
    drawn = [panel(chart, sets) for chart in charts if _is_there(chart, sets)]
    return {one.title: one for one in drawn}


def _is_there(chart: Chart, sets: Sets) -> bool:
    pattern = chart.facets.sets if chart.facets else ""
    needed = [*chart.needs, *([chart.data] if chart.data else [])]
    return all(name in sets for name in needed) and (not pattern or any(fnmatchcase(name, pattern) for name in sets))


def panel(chart: Chart, sets: Sets) -> Panel:
    """A figure with its caption."""
    whole = sets[chart.data] if chart.data else xr.Dataset()
    cells = [*_cells(chart, whole, sets)]
    rows, cols = max(cell.row for cell in cells), max(cell.col for cell in cells)
    titles = {(cell.row, cell.col): cell.title for cell in cells}
    fig = make_subplots(
        rows, cols, shared_xaxes=chart.shared_x, shared_yaxes=chart.shared_y,
        subplot_titles=[titles.get((row + 1, col + 1), "") for row in range(rows) for col in range(cols)],
        horizontal_spacing=chart.spacing[0], vertical_spacing=chart.spacing[1], row_heights=chart.heights or None,
    )  # fmt: skip
    named = set[str]()
    for cell in cells:
        _draw(fig, cell, sets, named)
    for cell in cells:
        below = chart.facets is None or cell.row > rows - len(chart.plots)
        left = cell.col == 1 or not (chart.facets or chart.shared_y)
        _dress_axes(fig, cell, Names(sets, cell.one), below, left)
    dress(fig, chart.height).update_layout(showlegend=chart.legend, hovermode=chart.hover, **chart.layout)
    names = Names(sets, whole)
    return Panel(filled(chart.title, names), filled(chart.caption, names), fig)


def _cells(chart: Chart, whole: xr.Dataset, sets: Sets) -> Iterator[_Cell]:
    """All plots in their places."""
    if chart.facets is None:
        for k, plot in enumerate(chart.plots):
            yield _Cell(k // chart.columns + 1, k % chart.columns + 1, plot, whole, plot.title)
        return
    facets, shown = chart.facets, list[tuple[str, xr.Dataset]]()
    if facets.sets:
        shown = [(name, one) for name, one in sets.items() if fnmatchcase(name, facets.sets)]
    else:
        shown = [(str(value), whole.sel({facets.each: value})) for value in whole[facets.each].values]
    abreast = facets.abreast or len(shown)
    for k, (value, one) in enumerate(shown):
        one = one.isel({dim: slice(None, None, step) for dim, step in chart.every.items() if dim in one.dims})
        title = facets.titles.get(value, facets.title).replace("{value}", plain(value))
        for j, plot in enumerate(chart.plots):
            head = filled(title, Names(sets, one)) if j == 0 else plot.title
            yield _Cell(k // abreast * len(chart.plots) + j + 1, k % abreast + 1, plot, one, head)


def _draw(fig: go.Figure, cell: _Cell, sets: Sets, named: set[str]) -> None:
    """Draw all lines of a plot; the first one of a name stands in the legend."""
    where: Any = {"row": cell.row, "col": cell.col}
    for trace in cell.plot.lines:
        of = sets[trace.data] if trace.data else cell.one
        if trace.if_there and trace.if_there not in of:
            continue
        of = of.sel({k: x for k, x in trace.at.items() if isinstance(x, str)})
        of = of.sel({k: x for k, x in trace.at.items() if not isinstance(x, str)}, method="nearest")
        values = [str(value) for value in of[trace.each].values] if trace.each else [""]
        for k, value in enumerate(values):
            if trace.only and value not in trace.only:
                continue
            one = of.isel({trace.each: k}) if trace.each else of
            look = trace.model_dump() | ({"color": CYCLE[k % len(CYCLE)]} if trace.each else {})
            look |= trace.styles.get(value, {})
            names = Names(sets, one)
            called = look["name"].replace("{value}", plain(value)).replace("{number}", str(k + 1))
            look["name"] = filled(called, names)
            legend = bool(look["name"]) and look["name"] not in named
            named.add(look["name"])
            _add(fig, trace, look, cell.plot.over, names, legend, where)
    line, names = {"color": style.BLACK, "dash": "dot", "width": 1}, Names(sets, cell.one)
    for text, at in cell.plot.levels.items():
        fig.add_hline(y=float(array_of(str(at), names)[0]), line=line, annotation_text=text, **where)
    for text, at in cell.plot.uprights.items():
        fig.add_vline(x=float(array_of(str(at), names)[0]), line=line, annotation_text=text, **where)
    for text, (x, y) in cell.plot.notes.items():
        fig.add_annotation(text=text, x=x, y=y, xanchor="left", yanchor="top", showarrow=False, **where)


def _add(
    fig: go.Figure, trace: Trace, look: dict[str, Any], over: str, names: Names, legend: bool, where: dict[str, int]
) -> None:
    colour = _COLOURS.get(look["color"], look["color"])
    x, y = (array_of(expression, names) for expression in (trace.x or over, trace.y))
    x = np.repeat(x, y.size) if x.size == 1 < y.size else x
    y = np.repeat(y, x.size) if y.size == 1 < x.size else y
    shown: dict[str, Any] = {"name": look["name"], "showlegend": legend, "legendgroup": look["name"], **where}
    if trace.kind in ("bars", "across"):
        across = {"orientation": "h"} if trace.kind == "across" else {}
        fig.add_bar(x=x, y=y, marker_color=colour, **across, **shown)
        return
    if trace.kind == "band":
        edge = np.concatenate([y, array_of(trace.low, names)[::-1]])
        fill = f"rgba({', '.join(str(int(colour[k : k + 2], 16)) for k in (1, 3, 5))}, 0.25)"
        both = np.concatenate([x, x[::-1]])
        band = {"mode": "lines", "fill": "toself", "fillcolor": fill, "line": {"width": 0}, "hoverinfo": "skip"}
        fig.add_scatter(x=both, y=edge, **band, **shown)
        return
    if "lines" in trace.kind:
        shown["line"] = {"color": colour, "dash": look["dash"], "width": look["width"], "shape": look["shape"]}
    if "markers" in trace.kind:
        shown["marker"] = {"color": colour, "size": look["size"], "symbol": look["symbol"]}
    if trace.error:
        shown["error_y"] = {"array": array_of(trace.error, names), "color": colour}
    fig.add_scatter(x=x, y=y, mode=trace.kind, **shown)


def _dress_axes(fig: go.Figure, cell: _Cell, names: Names, below: bool, left: bool) -> None:
    for update, given, titled in ((fig.update_xaxes, cell.plot.x, below), (fig.update_yaxes, cell.plot.y, left)):
        axis = ChartAxis(title=given) if isinstance(given, str) else given
        how: dict[str, Any] = {"title": filled(axis.title, names)} if titled and axis.title else {}
        how |= {"type": "log"} if axis.log else {"type": "category"} if axis.names else {}
        how |= {"rangemode": "tozero"} if axis.zero else {}
        how |= {"autorange": "reversed"} if axis.reversed else {}
        ticks: Sequence[Any] = array_of(axis.ticks, names).tolist() if isinstance(axis.ticks, str) else axis.ticks
        how |= {"tickvals": ticks} if len(ticks) else {}
        how |= {"dtick": axis.step} if axis.step else {}
        how |= {"range": axis.range} if axis.range else {}
        update(row=cell.row, col=cell.col, **how)
