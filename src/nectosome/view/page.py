"""Pages that need nothing but themselves: HTML with the plotting library inside."""

from collections.abc import Iterable
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from nectosome.io import write_atomic

from .style import Panel

if TYPE_CHECKING:
    import plotly.graph_objects as go

_CSS = """
body { font: 15px/1.5 system-ui, sans-serif; color: #222; margin: 0 auto; max-width: 1240px; padding: 0 24px 64px; }
h1 { margin: 28px 0 4px; } h2 { margin: 44px 0 8px; border-bottom: 2px solid #0072B2; } h3 { margin: 28px 0 4px; }
.small, figcaption { color: #555; font-size: 13.5px; } figcaption { max-width: 110ch; } figure { margin: 0 0 12px; }
.wide { overflow-x: auto; } table { border-collapse: collapse; font-size: 13.5px; width: 100%; }
th, td { text-align: left; padding: 5px 7px; border-bottom: 1px solid #dfe3e7; vertical-align: top; }
th { background: #f1f4f6; white-space: nowrap; } .number { text-align: right; white-space: nowrap; }
td.quantity { min-width: 19em; } code { font-size: 12.5px; }
.verdict { min-width: 6em; font-weight: 600; } .match { color: #0072B2; } .better { color: #00714f; }
.differs { color: #b34700; } .no { color: #666; } nav a { margin-right: 1.2em; }
"""
_CONFIG = {"displaylogo": False, "responsive": True, "plotlyServerURL": ""}


_LIBRARY = "plotly.min.js"


def write_page(path: str | Path, title: str, parts: Iterable[str]) -> None:
    """Write a page of HTML `parts` that works offline, whole or not at all. Raises InputError where it cannot."""
    from plotly.offline import get_plotlyjs

    _write(path, title, f"<script>{get_plotlyjs()}</script>", parts)


def write_library(folder: str | Path) -> None:
    """Write the plotting library into a folder, for pages of single panels. Raises InputError where it cannot."""
    from plotly.offline import get_plotlyjs

    write_atomic(Path(folder) / _LIBRARY, get_plotlyjs().encode())


def write_panel(path: str | Path, panel: Panel) -> None:
    """Write a page of one panel that uses the library beside it. Raises InputError where it cannot."""
    _write(path, panel.title, f'<script src="{_LIBRARY}"></script>', [panel_html(panel, "figure")])


def _write(path: str | Path, title: str, script: str, parts: Iterable[str]) -> None:
    head = f'<meta charset="utf-8"><meta name="viewport" content="width=device-width"><title>{escape(title)}</title>'
    text = [
        f'<!doctype html>\n<html lang="en">\n<head>{head}\n<style>{_CSS}</style>',
        f"{script}\n</head>\n<body>",
        *parts,
        "</body>\n</html>\n",
    ]
    write_atomic(path, "\n".join(text).encode())


def panel_html(panel: Panel, key: str) -> str:
    """Heading, figure and caption of a panel; `key` is its id, unique on the page."""
    shown = f'<div id="{key}">{panel.figure}</div>' if isinstance(panel.figure, str) else _plot(panel.figure, key)
    return f"<figure><h3>{escape(panel.title)}</h3>\n{shown}\n<figcaption>{escape(panel.caption)}</figcaption></figure>"


def _plot(figure: "go.Figure", key: str) -> str:
    import plotly.io as pio

    return pio.to_html(
        figure,
        config=_CONFIG,
        auto_play=False,
        include_plotlyjs=False,
        full_html=False,
        default_height=f"{figure['layout']['height']}px",
        div_id=key,
    )
