"""Runs as on the stage of the studio: scenes of a report that turn and play, a button for each, without a server."""

import json
from collections.abc import Mapping
from html import escape
from importlib.util import find_spec
from typing import TYPE_CHECKING

import numpy as np

from nectosome.description import RobotDescription, drive_period
from nectosome.units import InputError

from .saved import check_drawable
from .tubes import description

if TYPE_CHECKING:
    import xarray as xr

_PERIODS = 3
_SECONDS = 5.0  # of what does not repeat itself
_MARK = 'window.__VISER_EMBED_DATA__="'  # what viser puts a scene behind, in a page that is the same for all

_HEAD = """<style>
.scenes button { font: inherit; padding: 3px 10px; margin: 0 6px 6px 0; border: 1px solid #b8c4cc; border-radius: 4px;
  background: #f1f4f6; cursor: pointer; } .scenes button.on { background: #0072B2; border-color: #0072B2; color: #fff; }
.scenes iframe { width: 100%; height: 560px; border: 1px solid #dfe3e7; }
</style>
<script>const scenePage = PAGE;
function playScene(button) {
  const box = button.closest(".scenes"), data = document.getElementById(button.value).textContent;
  box.querySelectorAll("button").forEach(b => b.classList.toggle("on", b === button));
  box.querySelector("iframe").srcdoc = scenePage[0] + data + scenePage[1];
}
const cameIntoView = new IntersectionObserver(boxes => boxes.filter(box => box.isIntersecting).forEach(box => {
  cameIntoView.unobserve(box.target);
  if (!box.target.querySelector(".on")) playScene(box.target.querySelector("button"));
}));
document.querySelectorAll(".scenes").forEach(box => cameIntoView.observe(box));</script>"""


class Scenes:
    """Scenes of one page. What all of them share stands in it once."""

    def __init__(self):
        self._around: list[str] = []  # the page before a scene's data, and after

    def figure(self, runs: "Mapping[str, xr.Dataset]", key: str) -> str:
        """Buttons and a frame for the last three periods, or five seconds, of each run that carries its robot.

        The first one is begun when the frame comes into view: a browser has room for some scenes at once, not for all.
        Empty where no run does, and where viser is not installed. `key` is unique on the page.
        """
        shown = {name: robot for name, run in runs.items() if (robot := _robot(run)) is not None}
        if not shown or find_spec("viser") is None:
            return ""
        buttons, data = [], []
        for k, (name, robot) in enumerate(shown.items()):
            held = f"{key}-scene-{k + 1}"
            buttons.append(
                f'<button value="{held}" onclick="playScene(this)">{escape(name.replace("_", " "))}</button>'
            )
            data.append(f'<script type="text/plain" id="{held}">{self._data(runs[name], robot)}</script>')
        title = "Turn and play: choose a run, drag the scene, press play"
        frame = f'<iframe title="{title}"></iframe>'
        caption = "The last periods of each simulation, in their own time. Drag to turn, scroll to come nearer."
        return (
            f'<figure><h3>Scenes that turn and play</h3>\n<div class="scenes">{"".join(buttons)}{frame}</div>\n'
            f"{''.join(data)}\n<figcaption>{caption}</figcaption></figure>"
        )

    def head(self) -> str:
        """What the scenes need, to come after their figures in the page; empty without any."""
        if not self._around:
            return ""
        return _HEAD.replace("PAGE", json.dumps(self._around).replace("<", "\\u003c"))

    def _data(self, run: "xr.Dataset", robot: RobotDescription) -> str:
        from .stage.offline import page_of
        from .stage.stage import Look

        time = run["time"].values
        try:
            long = _PERIODS * drive_period(robot)
        except InputError:
            long = _SECONDS
        last = run.isel(time=slice(int(np.searchsorted(time, time[-1] - long)), None))
        before, _, rest = page_of(last, robot, 0.0, Look()).partition(_MARK)
        data, quote, after = rest.partition('"')
        self._around = [before + _MARK, quote + after]
        return data


def _robot(run: "xr.Dataset") -> RobotDescription | None:
    """Robot of a run that can be drawn."""
    if "position" not in run or run.sizes.get("time", 0) < 2:
        return None
    try:
        check_drawable(run, "")
    except InputError:
        return None
    return description(run)
