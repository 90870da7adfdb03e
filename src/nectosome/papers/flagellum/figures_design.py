"""Figures of a design study: what was found and how, from the datasets and runs that a study hands over.

Each dataset has a figure. All numbers are SI; NaN where nothing was found. After the bar: attributes, each of which may
be absent.

- `starts` (solver, seed, start): speed, torque, seconds, evaluations, rejected | printed_speed, printed_seconds
- `history` (solver, iteration): speed, evaluations | printed_speed
- `best` (rank): L, tip_radius, alpha, omega, E, speed, torque; source, which is "ours" for ours
- `map` (design, omega, young): speed, torque; perhaps here_omega, here_young (design) | torque_limit
- `sensitivity` (variable, output): percent, for one percent more of the variable | label
- `trend` (fixed, point): value, young, speed
- `composite` (rule, beta): young | target, measured, printed_beta
- `static_test` (case, marker, axis): measured, fitted; perhaps weight (case) | young, young_low, young_high, truth,
  synthetic
- `pool` (design): printed_simulated, printed_measured, ours, kind
"""

from collections.abc import Callable, Mapping
from html import escape
from typing import TYPE_CHECKING

import numpy as np

from nectosome.view import series
from nectosome.view.style import Panel

from . import figures_landscape as landscape
from . import figures_prototype as prototype
from . import figures_search
from .figures import HANDLING, designs_scene

if TYPE_CHECKING:
    import xarray as xr

Data = Mapping[str, "xr.Dataset"]
BESIDE = ("old_soft", "row1", "optimum")
ITERATIONS = ("iteration1", "iteration5", "iteration20")
_COLUMNS = (  # variable, heading, unit, units in 1 SI, decimals
    ("L", "length", "mm", 1e3, 1),
    ("tip_radius", "tip radius", "mm", 1e3, 2),
    ("alpha", "hook angle", "deg", 180 / np.pi, 2),
    ("omega", "motor speed", "rad/s", 1.0, 2),
    ("E", "Young's modulus", "MPa", 1e-6, 2),
    ("speed", "swimming speed", "m/s", 1.0, 3),
    ("torque", "torque", "N m", 1.0, 3),
)


def panels(data: Data, runs: Data) -> list[Panel]:
    """Every figure whose data or runs are there."""
    makers: list[tuple[str, Callable[[xr.Dataset], Panel]]] = [
        ("starts", figures_search.starts_panel),
        ("history", figures_search.history_panel),
        ("best", best_panel),
        ("map", landscape.map_panel),
        ("map", landscape.torque_panel),
        ("sensitivity", landscape.sensitivity_panel),
        ("trend", landscape.trend_panel),
        ("composite", prototype.composite_panel),
        ("static_test", prototype.static_test_panel),
        ("pool", prototype.pool_panel),
    ]
    found = [make(data[name]) for name, make in makers if name in data]
    if "optimum" in runs and any(name in runs for name in BESIDE[:2]):
        found.insert(0, optimum_panel(runs))
    if all(name in runs for name in ITERATIONS):
        found.insert(1 if found else 0, iterations_panel(runs))
    return found


def optimum_panel(runs: Data) -> Panel:
    """The optimum beside the old design and the printed optimum, in 3-D."""
    caption = "Simulated shapes during the last revolution of the motor, to scale and at the same motor angle. "
    if "row1" in runs:
        caption += "The printed optimum is row 1 of Table II, its speed computed here. "
    labels = {"old_soft": "old design", "row1": "printed optimum", "optimum": "our optimum"}
    scene = designs_scene(runs, _with_speeds(runs, labels))
    return Panel("The optimum beside the old design", f"{caption}Forward is left. {HANDLING}", scene)


def iterations_panel(runs: Data) -> Panel:
    """Designs of a search for an optimum (Fig. 4), in 3-D."""
    caption = (
        "Simulated shapes of the designs at the 1st, 5th and 20th iteration of one search, as in Fig. 4 of the paper, "
        "during the last revolution of the motor, to scale and at the same motor angle. "
    )
    labels = {name: f"iteration {name.removeprefix('iteration')}" for name in ITERATIONS}
    scene = designs_scene(runs, _with_speeds(runs, labels))
    return Panel("Designs of one search", f"{caption}Forward is left. {HANDLING}", scene)


def _with_speeds(runs: Data, labels: Mapping[str, str]) -> dict[str, str]:
    """Labels with the steady speed, of the runs that are there."""
    return {name: f"{text}: {series.steady_speed(runs[name]):.3f} m/s" for name, text in labels.items() if name in runs}


def best_panel(best: "xr.Dataset") -> Panel:
    """Table of the best designs beside those of Table II."""
    heads = "".join(f'<th class="number">{escape(head)}<br>({unit})</th>' for _, head, unit, _, _ in _COLUMNS)
    source = [str(s) for s in best["source"].values]
    body = []
    for i, whose in enumerate(source):
        cells = "".join(
            f'<td class="number">{_fixed(scale * float(best[name].values[i]), decimals)}</td>'
            for name, _, _, scale, decimals in _COLUMNS
        )
        rank = source[: i + 1].count(whose)
        strong = ' class="match"' if whose == "ours" else ""
        body.append(f'<tr><td{strong}>{escape(whose)}</td><td class="number">{rank}</td>{cells}</tr>')
    lines = "\n".join(body)
    text = (
        f'<div class="wide"><table>\n<thead><tr><th>source</th><th class="number">rank</th>{heads}</tr></thead>\n'
        f"<tbody>\n{lines}\n</tbody></table></div>"
    )
    printed = np.array(source) != "ours"
    if "above_motor_line" in best:
        above = best["above_motor_line"].values > 0
        line = f"{int(above.sum())} of these {above.size} designs need more torque than their motor has on its line."
    else:
        line = ""
    caption = "Best designs found here, computed, and those printed in Table II of the paper."
    if np.any(np.isfinite(best["torque"].values[printed])):
        caption += " The paper prints no torque of a design; the torque beside its designs is computed here."
    return Panel("Best designs", f"{caption} {line}".strip(), text)


def _fixed(value: float, decimals: int) -> str:
    return f"{value:.{decimals}f}" if np.isfinite(value) else "-"
