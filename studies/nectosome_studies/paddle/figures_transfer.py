"""Figures of sim-to-real corrections of the paddle on synthetic experiments.

Data: `transfer` (case, correction, ratio): mean, coverage [percent] of cases with a truth, recipe, noise, seed;
`transfer_maps` (what, A, f): thrust [N], made (A, f) | ratio; `transfer_plans` (truth, seed, plan,
count): total, found [percent].
"""

from typing import Any

import numpy as np
import plotly.graph_objects as go
import xarray as xr
from plotly.subplots import make_subplots

from nectosome.view.heatmap import MapAxis, diverging, maps
from nectosome.view.style import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, VERMILLION, Panel, dress, plain

from ..study import Sets

_HELD_OUT = "held-out"
_STYLES = {  # name, colour, dash
    "cn": ("Cn from peaks", ORANGE, "solid"),
    "svd": ("SVD", VERMILLION, "solid"),
    "cn-svd": ("Cn-SVD", PURPLE, "solid"),
    "cn-gp": ("Cn and Gaussian process", BLUE, "solid"),
    "cn-svd-raw": ("Cn-SVD, raw axes as printed", PURPLE, "dot"),
    "affine": ("affine", GREY, "dot"),
    "thin-plate": ("thin plate", GREEN, "dot"),
    "gp": ("Gaussian process", SKY, "dot"),
}
_AIMS = {
    "uniform": ("evenly", GREY, "solid"),
    "error": ("where least is known", BLUE, "solid"),
    "highest": ("for the largest", ORANGE, "dash"),
}


def recipes_panel(sets: Sets) -> Panel:
    """What is true in each of the synthetic experiments."""
    rows = []
    for name, here in _truths(sets["transfer"]).items():
        start = float(here["mean"].sel(correction="cn", ratio=0.0).median())
        recipe = plain(here["recipe"].values[0])
        rows.append(f'<tr><td>{plain(name)}</td><td>{recipe}</td><td class="number">{start:.1f} %</td></tr>')
    head = '<tr><th>truth</th><th>recipe</th><th class="number">error of the model</th></tr>'
    body = "\n".join(rows)
    text = f'<div class="wide"><table>\n<thead>{head}</thead>\n<tbody>\n{body}\n</tbody></table></div>'
    caption = (
        "The paper published no recordings: these are synthetic. a and b are amplitude and frequency, scaled from 0 to "
        "1 over the grid of Fig. 5. Peaks of the thrust, which give Cn, follow the same recipes."
    )
    return Panel("Sim-to-real: synthetic truths", caption, text)


def errors_panel(sets: Sets) -> Panel:
    """Mean errors against the share that is measured, medians over truths and seeds."""
    found = sets["transfer"]
    known = _cases(found, found["truth"] != _HELD_OUT)
    noises = sorted(set(known["noise"].values.tolist()), reverse=True)
    titles = [f"noise of {100 * noise:g} %" if noise else "without noise" for noise in noises]
    fig = make_subplots(1, len(noises), shared_yaxes=True, horizontal_spacing=0.05, subplot_titles=titles)
    for col, noise in enumerate(noises, start=1):
        here = _cases(known, known["noise"] == noise)
        _lines(fig, here, {"row": 1, "col": col})
        if noise:
            ends, floor = [0.0, 100 * float(here["ratio"].max())], float(here["floor"].median())
            line = {"color": BLACK, "dash": "dash", "width": 1}
            fig.add_scatter(x=ends, y=[floor] * 2, mode="lines", line=line, showlegend=False, row=1, col=col)
    _axes(fig)
    dress(fig, 480).update_layout(showlegend=True, margin_t=110, legend_y=1.1)
    coverage = {n: float(known["coverage"].sel(correction="cn-gp")[known["noise"].values == n].mean()) for n in noises}
    shares = " and ".join(f"{x:.1f} % ({title})" for x, title in zip(coverage.values(), titles, strict=True))
    caption = (
        "Synthetic experiments: mean relative error of the thrust at the points of the grid, all 110 but those of less "
        "than 1 % of the largest thrust; medians over truths and seeds. Table 3 is about the paper's own experiments, "
        "which are not published: these errors cannot be held against it. The dashed line is what noise alone makes. "
        f"95 % intervals of Cn and Gaussian process hold {shares} of what was not measured."
    )
    return Panel("Sim-to-real: errors by share measured", caption, fig)


def truths_panel(sets: Sets) -> Panel:
    """The same, truth by truth."""
    truths = _truths(sets["transfer"])
    rows = -(-len(truths) // 3)
    spacing: Any = {"horizontal_spacing": 0.03, "vertical_spacing": 0.1}
    fig = make_subplots(rows, 3, shared_xaxes=True, shared_yaxes=True, subplot_titles=list(truths), **spacing)
    for k, here in enumerate(truths.values()):
        _lines(fig, here, {"row": 1 + k // 3, "col": 1 + k % 3}, ("cn", "svd", "cn-svd", "gp", "cn-gp"), legend=k == 0)
    _axes(fig, rows)
    dress(fig, 620).update_layout(showlegend=True, margin_t=80, legend_y=1.05)
    inside = float(truths[_HELD_OUT]["coverage"].sel(correction="cn-gp").mean())
    caption = (
        "Synthetic experiments with noise, medians over seeds: each truth has a recipe of its own. That of the "
        "held-out one was written when the methods were done; 95 % intervals of Cn and Gaussian process hold "
        f"{inside:.0f} % of it: fewer than they say, since a ring at 0.8 Hz breaks the pattern that was measured."
    )
    return Panel("Sim-to-real, truth by truth", caption, fig)


def maps_panel(sets: Sets) -> Panel:
    """Errors over amplitude and frequency, with the points that were measured."""
    found = sets["transfer_maps"]
    thrust = found["thrust"]
    measured = thrust.sel(what="measured")
    names = ("simulated", "cn", "svd", "cn-svd", "cn-gp")
    titles = {name: _STYLES[name][0] if name in _STYLES else name for name in names}
    shown = {titles[name]: (100 * (thrust.sel(what=name) / measured - 1)).values for name in names}
    x, y = MapAxis(found["f"].values, "frequency (Hz)"), MapAxis(np.degrees(found["A"].values), "amplitude (deg)")
    fig = maps(x, y, shown, diverging(np.array([60.0]), "percent"))
    rows, cols = np.nonzero(found["made"].values)
    for col in range(1, len(names) + 1):
        style: Any = {"mode": "markers", "marker": {"size": 5, "color": BLACK}, "name": "measured"}
        fig.add_scatter(x=x.values[cols], y=y.values[rows], showlegend=col == 1, row=1, col=col, **style)
    caption = (
        "Synthetic experiments in which thrust drops above 1.1 Hz, with noise of 2 %: relative errors, as in Fig. 5 "
        f"with a share of {found.attrs['ratio']:g} measured. Colours end at 60 %."
    )
    return Panel("Sim-to-real: where errors are left", caption, fig)


def plans_panel(sets: Sets) -> Panel:
    """What the next experiment is worth by how it is chosen."""
    found = sets["transfer_plans"].median("seed")
    words = {"total": "sum |e| / sum F (percent)", "found": "optimum found (percent of largest)"}
    shown = [(name, str(truth)) for name in words for truth in found["truth"].values]
    # an optimum may be found at once
    shown = [(name, truth) for name, truth in shown if np.ptp(found[name].sel(truth=truth).values) > 0]
    fig = make_subplots(1, len(shown), horizontal_spacing=0.09, subplot_titles=[truth for _, truth in shown])
    for col, (name, truth) in enumerate(shown, start=1):
        for plan, (word, colour, dash) in _AIMS.items():
            y = found[name].sel(plan=plan, truth=truth)
            style: Any = {"line": {"color": colour, "dash": dash, "width": 2.5}, "row": 1, "col": col}
            style["showlegend"] = col == 1
            fig.add_scatter(x=found["count"], y=y, mode="lines", name=f"chosen {word}", **style)
        fig.update_yaxes(title=words[name], col=col)
    fig.update_xaxes(title="experiments made")
    fig.update_yaxes(rangemode="tozero")
    dress(fig, 400).update_layout(showlegend=True, margin_t=90, legend_y=1.12)
    caption = (
        "Synthetic experiments with noise of 2 %, corrected by Cn and Gaussian process, medians over seeds. The first "
        "four are spread evenly; then each is chosen by the results of those before it. Each experiment costs the same."
    )
    return Panel("Which experiment next", caption, fig)


def _cases(found: xr.Dataset, which: xr.DataArray) -> xr.Dataset:
    return found.isel(case=np.flatnonzero(which))


def _truths(found: xr.Dataset) -> dict[str, xr.Dataset]:
    """Cases with noise, by truth."""
    noisy = _cases(found, found["noise"] == found["noise"].max())
    return {name: _cases(noisy, noisy["truth"] == name) for name in dict.fromkeys(noisy["truth"].values.tolist())}


def _lines(
    fig: go.Figure,
    cases: xr.Dataset,
    where: dict[str, int],
    methods: tuple[str, ...] = tuple(_STYLES),
    legend: bool = True,
) -> None:
    """Median error of each method over cases."""
    for method in methods:
        if method not in cases["correction"].values:
            continue
        name, colour, dash = _STYLES[method]
        y = cases["mean"].sel(correction=method).median("case")
        line = {"color": colour, "dash": dash, "width": 2.5}
        shown = legend and where == {"row": 1, "col": 1}
        fig.add_scatter(x=100 * y["ratio"], y=y, mode="lines+markers", line=line, name=name, showlegend=shown, **where)


def _axes(fig: go.Figure, rows: int = 1) -> None:
    fig.update_xaxes(title="share measured (percent)", row=rows)
    fig.update_yaxes(type="log", tickvals=[0.1, 0.3, 1, 3, 10, 30, 100])
    fig.update_yaxes(title="mean |error| (percent)", col=1)
