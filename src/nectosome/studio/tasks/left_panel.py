"""The narrow panel on the left: what its tabs share, and the figures, tables and words that fit it."""

import threading
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import plotly.graph_objects as go
import viser

from nectosome.studio.desk import Desk
from nectosome.studio.work import errors_shown
from nectosome.view.markup import plain, plain_figure
from nectosome.view.style import GREY, VERMILLION, dress

_CLEAR = "rgba(0, 0, 0, 0)"  # the page's frame of a plot lies under its edge


class PanelTask:
    """A task of the panel, whose errors are shown on the page."""

    def __init__(self, desk: Desk):
        self._desk, self._gui = desk, desk.gui
        self._drawing = threading.Lock()
        self._robot = 0  # how many there were: what is found for one before is not shown

    def _try(self, work: Callable[[], None]) -> None:
        with errors_shown(self._desk.tell):
            work()

    def _add_button(self, label: str, work: Callable[[], None], visible: bool = True) -> viser.GuiButtonHandle:
        button = self._gui.add_button(label, visible=visible)
        button.on_click(lambda _: self._try(work))
        return button

    def _tell_saved(self, path: Path) -> None:
        self._desk.tell(f"saved {self._desk.folder.name(path)}", False)


class Plot:
    """A folder with a figure, not seen at first, and whatever else is put into it."""

    def __init__(self, gui: viser.GuiApi, name: str | None = None, order: float | None = None):
        self._gui, self._order = gui, order
        self.folder = gui.add_folder(name, visible=False)
        self._handle: Any = None  # made when it is needed, as its program is large
        self._aspect = 0.0

    def show(self, figure: go.Figure, aspect: float) -> None:
        """Show a figure, `aspect` times as high as it is wide, in place of the last one."""
        figure = go.Figure(plain_figure(figure.to_dict())).update_layout(paper_bgcolor=_CLEAR)
        if self._handle is not None and aspect == self._aspect:
            self._handle.figure = figure
            return
        if self._handle is not None:
            self._handle.remove()
        config, self._aspect = {"displayModeBar": False}, aspect
        with self.folder:
            self._handle = self._gui.add_plotly(figure, aspect=aspect, config=config, order=self._order)


def add_text(gui: viser.GuiApi, label: str, example: str, value: str = "", **options: Any) -> viser.GuiTextHandle:
    """Add a field of text that shows an example while it is empty: the page's script puts it there."""
    field = gui.add_text(label, value, **options)
    gui.add_html(f'<span hidden data-of="{field._impl.uuid}" data-example="such as {plain(example)}"></span>')
    return field


def small(fig: go.Figure) -> go.Figure:
    """Dress a figure for the panel."""
    dress(fig, 250).update_layout(margin={"l": 56, "r": 12, "t": 28, "b": 44}, font_size=11, hovermode="closest")
    fig.update_xaxes(title_font_size=12, tickangle=0, nticks=5)
    return fig.update_yaxes(title_font_size=12, title_standoff=4, nticks=6)


def with_legend(fig: go.Figure) -> go.Figure:
    """Dress a figure for the panel whose height is that of its place, with a legend above."""
    legend = {"orientation": "h", "y": 1.0, "yanchor": "bottom", "x": 0.0}
    return small(fig).update_layout(height=None, showlegend=True, legend=legend)


def note(words: str, bad: bool = False) -> str:
    """A line of words, in colour where they are bad news."""
    colour = VERMILLION if bad else "inherit"
    return f'<div style="font-size:13px;padding:0 12px 6px;color:{colour}">{plain(words)}</div>'


def cells(rows: Sequence[Sequence[str]], name: str, lines: Sequence[str] = ()) -> str:
    """A table, called `name` on the page, whose columns stand to the right, and lines under it.

    Where that takes more than there is, the last column, that of units, goes on in another line.
    """
    cell = '<td style="text-align:right;padding:1px 0 1px 5px;white-space:{}">{}</td>'
    kinds = [*["nowrap"] * (len(rows[0]) - 1), "normal"]
    body = "".join(
        f"<tr>{''.join(cell.format(kind, plain(text)) for kind, text in zip(kinds, row, strict=True))}</tr>"
        for row in rows
    )
    said = "".join(f'<div style="color:{GREY};padding-top:3px">{plain(line)}</div>' for line in lines)
    return _block(name, f'<table style="width:100%;border-collapse:collapse">{body}</table>{said}')


def spelled(tables: Sequence[Sequence[Sequence[str]]], name: str, lines: Sequence[str]) -> str:
    """Tables too wide for the panel, called `name` on the page, row by row in words, and lines under them.

    The first row of each table has the names of its columns; a row is called as its first cell says.
    """
    out = list[str]()
    for (title, *columns), *rows in tables:
        out.append(f'<div style="padding-top:6px"><b>{plain(title)}</b></div>')
        for first, *others in rows:
            words = ", ".join(f"{column} {cell}".strip() for column, cell in zip(columns, others, strict=True) if cell)
            out.append(f'<div style="padding-top:3px">{plain(f"{first}: {words}" if words else first)}</div>')
    out += [f'<div style="color:{GREY};padding-top:6px">{plain(line)}</div>' for line in lines]
    return _block(name, "".join(out))


def _block(name: str, body: str) -> str:
    return f'<div style="font-size:12px;padding:0 12px 8px;overflow-x:auto" id="{name}">{body}</div>'
