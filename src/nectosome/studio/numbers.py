"""The numbers of an answer as a small table, each with the history of what the sliders did to it, and messages."""

from collections import deque
from collections.abc import Iterable
from threading import RLock

import numpy as np
import viser

from nectosome.designs.quantities import QUANTITIES
from nectosome.units import show_quantity
from nectosome.view.markup import plain
from nectosome.view.style import VERMILLION

_KEPT = 60  # answers
_SHOWN = ("speed", "forward_speed", "thrust", "torque", "power", "efficiency", "cost_of_transport")
_PALE = 0.4  # of numbers and of the picture where they are not those of the sliders
_W, _H = 90, 22  # of a history [px]


class NumberTable:
    """Numbers of the last answers."""

    def __init__(self):
        self._history: dict[str, deque[float]] = {name: deque(maxlen=_KEPT) for name in _SHOWN}
        self._count = 0

    def add(self, numbers: dict[str, float]) -> None:
        """Take those of one more answer."""
        self._count += 1
        for name, history in self._history.items():
            history.append(numbers.get(name, np.nan))

    def forget(self) -> None:
        """Begin anew, for another robot."""
        for history in self._history.values():
            history.clear()

    def html(self, lines: Iterable[tuple[str, bool]], old: bool = False) -> str:
        """The table, under it lines of words, each with whether it is bad news. Picture and table are pale if `old`."""
        known = {name: history for name, history in self._history.items() if history and np.isfinite(history[-1])}
        rows = [self._row(name, history) for name, history in known.items() if np.nan_to_num(history).any()]
        said = (_line(words, bad) for words, bad in lines if words)
        pale = f"opacity:{_PALE}" if old else ""
        picture = f"<style>canvas{{{pale}}}</style>" if old else ""
        table = f'{picture}<table style="width:100%;border-collapse:collapse;{pale}">{"".join(rows)}</table>'
        below = f'<div style="margin-top:4px" id="studio-words">{"".join(said)}</div>'
        style = "font-size:13px;padding:0 12px 6px"
        return f'<div style="{style}" id="studio-answer" data-count="{self._count}">{table}{below}</div>'

    def _row(self, name: str, history: deque[float]) -> str:
        value, _, unit = show_quantity(history[-1], QUANTITIES[name].dimension).partition(" ")
        cells = (
            f'<td title="{plain(QUANTITIES[name].about)}">{name.replace("_", " ")}</td>',
            f'<td style="text-align:right;font-variant-numeric:tabular-nums" id="studio-{name}">{value}</td>',
            f'<td style="padding-left:4px;width:5em">{unit}</td><td>{_curve([*history])}</td>',
        )
        return f"<tr>{''.join(cells)}</tr>"


class Board:
    """The table on the page, over two messages: one about the motion that is shown, one about what the user did."""

    def __init__(self, gui: viser.GuiApi):
        self._page, self._table, self._lock = gui.add_html(""), NumberTable(), RLock()
        self._lines, self._old = {"motion": ("", False), "action": ("", False)}, False

    def forget(self) -> None:
        """Begin anew, for another robot."""
        with self._lock:
            self._table.forget()
            self.forget_action()

    def add(self, numbers: dict[str, float]) -> None:
        """Take the numbers of one more answer; they are shown with the next message."""
        with self._lock:
            self._table.add(numbers)

    def show_motion(self, words: str, bad: bool = False, old: bool = False) -> None:
        """Show a message about the motion, whose numbers are those of the last one where they are `old`."""
        with self._lock:
            self._old = old
            self._show("motion", words, bad)

    def show_action(self, words: str, bad: bool = False) -> None:
        """Show a message about what the user did; it stays until the next thing is done."""
        self._show("action", words, bad)

    def forget_action(self) -> None:
        """Drop the message about what the user did, with the next one."""
        with self._lock:
            self._lines["action"] = "", False

    def _show(self, about: str, words: str, bad: bool) -> None:
        with self._lock:
            self._lines[about] = words, bad
            self._page.content = self._table.html(self._lines.values(), self._old)


def _line(words: str, bad: bool) -> str:
    return f'<div style="color:{VERMILLION if bad else "inherit"}">{plain(words)}</div>'


def _curve(values: list[float]) -> str:
    """A line through the values, the last one marked."""
    y = np.array(values)
    known = np.isfinite(y)
    if known.sum() < 2:
        return f'<svg width="{_W}" height="{_H}"></svg>'
    low, high = y[known].min(), y[known].max()
    across = 3 + (_W - 6) * np.arange(y.size) / (y.size - 1)
    up = _H - 3 - (_H - 6) * ((y - low) / (high - low) if high > low else np.full(y.size, 0.5))
    points = " ".join(f"{a:.1f},{b:.1f}" for a, b, k in zip(across, up, known, strict=True) if k)
    dot = f'<circle cx="{across[known][-1]:.1f}" cy="{up[known][-1]:.1f}" r="2.5" fill="#0072B2"/>'
    line = f'<polyline points="{points}" fill="none" stroke="#0072B2" stroke-width="1.2"/>'
    return f'<svg width="{_W}" height="{_H}">{line}{dot}</svg>'
