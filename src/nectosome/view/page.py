"""Pages that need nothing but themselves: HTML with the programs inside that draw its figures and scenes."""

import json
from collections.abc import Iterable, Sequence
from itertools import count
from pathlib import Path

import plotly.graph_objects as go
import plotly.io as pio
from plotly.offline import get_plotlyjs

from nectosome.io import write_atomic

from .markup import plain, plain_figure, sealed, with_nonce
from .style import Panel, Scenes

_CSS = """
body { font: 15px/1.5 system-ui, sans-serif; color: #222; margin: 0 auto; max-width: 1240px; padding: 0 24px 64px; }
h1 { margin: 28px 0 4px; } h2 { margin: 44px 0 8px; border-bottom: 2px solid #0072B2; } h3 { margin: 28px 0 4px; }
.small, figcaption { color: #555; font-size: 13.5px; } figcaption { max-width: 110ch; } figure { margin: 0 0 12px; }
.wide { overflow-x: auto; } table { border-collapse: collapse; font-size: 13.5px; width: 100%; }
th, td { text-align: left; padding: 5px 7px; border-bottom: 1px solid #dfe3e7; vertical-align: top; }
th { background: #f1f4f6; white-space: nowrap; } .number { text-align: right; }
.number, .short { white-space: nowrap; }
td.quantity { min-width: 19em; } code { font-size: 12.5px; }
.verdict { min-width: 6em; font-weight: 600; } .match { color: #0072B2; } .better { color: #00714f; }
.differs { color: #b34700; } .no { color: #666; } nav a { margin-right: 1.2em; }
.scenes button { font: inherit; padding: 3px 10px; margin: 0 6px 6px 0; border: 1px solid #b8c4cc; border-radius: 4px;
  background: #f1f4f6; cursor: pointer; } .scenes button.on { background: #0072B2; border-color: #0072B2; color: #fff; }
.scenes iframe { width: 100%; height: 520px; border: 1px solid #dfe3e7; }
"""
_CONFIG = {"displaylogo": False, "responsive": True, "plotlyServerURL": ""}
_PLOTTER, _PLAYER = "plotly.min.js", "scenes.js"
# A browser has room for some scenes at once: one that is out of view is put away.
_PLAY = """const nonce = document.currentScript.nonce;
const scenePage = PAGE.map((text) => text.replaceAll("<script", `<script nonce="${nonce}"`));
function playScene(box, name) {
  const data = document.getElementById(name).textContent;
  box.dataset.chosen = name;
  box.querySelectorAll("button").forEach((button) => button.classList.toggle("on", button.value === name));
  box.querySelector("iframe").srcdoc = scenePage[0] + data + scenePage[1];
}
addEventListener("DOMContentLoaded", () => {
  const seen = new IntersectionObserver((boxes) => boxes.forEach(({ target, isIntersecting }) => {
    if (isIntersecting) playScene(target, target.dataset.chosen);
    else target.querySelector("iframe").removeAttribute("srcdoc");
  }));
  document.querySelectorAll(".scenes").forEach((box) => {
    seen.observe(box);
    box.querySelectorAll("button").forEach((button) => {
      button.addEventListener("click", () => playScene(box, button.value));
    });
  });
});"""


def write_page(path: str | Path, title: str, parts: Iterable[str | Panel]) -> None:
    """Write a page of HTML and figures that works offline, whole or not at all. Raises InputError where it cannot."""
    parts = [*parts]
    figures = [part.figure for part in parts if isinstance(part, Panel)]
    programs = []
    if any(not isinstance(figure, str | Scenes) for figure in figures):
        programs.append(get_plotlyjs())
    if any(isinstance(figure, Scenes) for figure in figures):
        programs.append(_player())
    _write(path, title, [f"<script>{program}</script>" for program in programs], [f"<h1>{plain(title)}</h1>", *parts])


def write_panels(folder: Path, panels: Iterable[tuple[str, Panel]]) -> None:
    """Write a page for each panel, by its name, and the programs that they share. Raises InputError where it cannot."""
    used = set()
    for name, panel in panels:
        program = _PLAYER if isinstance(panel.figure, Scenes) else _PLOTTER
        used.add(program)
        _write(folder / f"{name}.html", panel.title, [f'<script src="{program}"></script>'], [panel])
    for program, text in ((_PLOTTER, get_plotlyjs), (_PLAYER, _player)):
        if program in used:
            write_atomic(folder / program, text().encode())


def _write(path: str | Path, title: str, scripts: Sequence[str], parts: Sequence[str | Panel]) -> None:
    head = f'<meta charset="utf-8"><meta name="viewport" content="width=device-width"><title>{plain(title)}</title>'

    def page(nonce: str) -> str:
        number = count(1)
        text = [
            f'<!doctype html>\n<html lang="en">\n<head>{head}\n<style>{_CSS}</style>',
            *(script.replace("<script", f'<script nonce="{nonce}"', 1) for script in scripts),
            "</head>\n<body>",
            *(part if isinstance(part, str) else _panel(part, f"figure-{next(number)}", nonce) for part in parts),
            "</body>\n</html>\n",
        ]
        return "\n".join(text)

    write_atomic(path, sealed(page).encode())


def _panel(panel: Panel, key: str, nonce: str) -> str:
    """Heading, figure and caption of a panel; `key` is its id, unique on the page."""
    figure = panel.figure
    if isinstance(figure, str):
        shown = f'<div id="{key}">{figure}</div>'
    else:
        shown = _scenes(figure, key) if isinstance(figure, Scenes) else with_nonce(_plot(figure, key), nonce)
    return f"<figure><h3>{plain(panel.title)}</h3>\n{shown}\n<figcaption>{plain(panel.caption)}</figcaption></figure>"


def _scenes(scenes: Scenes, key: str) -> str:
    """A frame that plays one recording, and buttons where there are several; it begins when it comes into view."""
    buttons, data = [], []
    for k, (name, recording) in enumerate(scenes.recordings.items()):
        own, words = f"{key}-scene-{k + 1}", plain(name.replace("_", " "))
        buttons.append(f'<button value="{own}">{words}</button>')
        data.append(f'<script type="text/plain" id="{own}">{recording}</script>')
    shown = "".join(buttons) if len(buttons) > 1 else ""
    frame = '<iframe title="Drag to turn, scroll to come nearer, press play"></iframe>'
    return f'<div class="scenes" id="{key}" data-chosen="{key}-scene-1">{shown}{frame}</div>\n{"".join(data)}'


def _plot(figure: go.Figure, key: str) -> str:
    return pio.to_html(
        plain_figure(figure.to_dict()),
        config=_CONFIG,
        auto_play=False,
        include_plotlyjs=False,
        full_html=False,
        default_height=f"{figure['layout']['height']}px",
        div_id=key,
    )


def _player() -> str:
    from .display.offline import player_page

    return _PLAY.replace("PAGE", json.dumps(player_page()).replace("<", "\\u003c"))
