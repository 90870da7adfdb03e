"""Figures of searches for a design: what every start reached and cost, how a search went on, the best designs."""

from html import escape
from itertools import cycle
from typing import Any

import numpy as np
import plotly.graph_objects as go
import xarray as xr
from jaxtyping import Float
from plotly.subplots import make_subplots

from nectosome.view.style import BLACK, CYCLE, GREY, Panel, dress, plain

from .axes import log_ticks

MARKED = {1: "circle", 5: "square", 20: "diamond"}  # iterations with a mark, as in Fig. 4
_CLOCK = {  # ticks of a logarithmic axis of times [s]
    "tickvals": [1e-3, 1e-2, 0.1, 1, 10, 60, 600, 3600, 36000],
    "ticktext": ["1 ms", "10 ms", "0.1 s", "1 s", "10 s", "1 min", "10 min", "1 h", "10 h"],
}
ANY_SPEED = (
    "With the paper's limit, 0.5 N m at any motor speed, the fastest design turns at 22 rad/s, where its motor has no "
    "torque at 6 V."
)
_COLUMNS = (  # variable, heading, unit, units in 1 SI, decimals
    ("L", "length", "mm", 1e3, 1),
    ("tip_radius", "tip radius", "mm", 1e3, 2),
    ("alpha", "hook angle", "deg", 180 / np.pi, 2),
    ("omega", "motor speed", "rad/s", 1.0, 2),
    ("E", "Young's modulus", "MPa", 1e-6, 2),
    ("speed", "swimming speed", "m/s", 1.0, 3),
    ("torque", "torque", "N m", 1.0, 3),
)


def starts_panel(starts: xr.Dataset) -> Panel:
    """Speed that every start of every solver reached, and the time that it took."""
    titles = ("speed that this share of starts reaches", "time of a start, and the median")
    fig = make_subplots(1, 2, column_widths=[0.58, 0.42], horizontal_spacing=0.16, subplot_titles=titles)
    names = [str(s) for s in starts["solver"].values]
    sentences, rows = [], []
    for i, (name, colour) in enumerate(zip(names, cycle(CYCLE))):
        own = starts.isel(solver=i)
        style: Any = {"mode": "lines", "legendgroup": name, "row": 1, "col": 1}
        thin, bold = ({"color": colour, "width": width, "shape": "vh"} for width in (1, 2.6))
        for k, seed in enumerate(own["seed"].values):
            x, y = _from_best(own["speed"].isel(seed=k).values)
            seeded = {"name": f"{plain(name)}, seed {seed}", "showlegend": False, "hoverinfo": "skip"}
            fig.add_scatter(x=x, y=y, opacity=0.45, line=thin, **seeded, **style)
        x, y = _from_best(own["speed"].values)
        hover = "%{y:.4f} m/s or more: %{x:.0f} % of starts"
        fig.add_scatter(x=x, y=y, line=bold, name=plain(name), hovertemplate=hover, **style)
        _add_times(fig, own, len(names) - i, colour)
        rows.append(f"{plain(name)}<br>{duration(_middle(own['seconds'].values))}")
        sentences.append(_sentence(name, own))
    printed, seconds = starts.attrs.get("printed_speed"), starts.attrs.get("printed_seconds")
    if printed is not None:
        _add_printed(fig, [0, 100], printed)
    if seconds is not None:
        mark = {"color": BLACK, "symbol": "diamond", "size": 11}
        style = {"mode": "markers", "marker": mark, "name": "paper", "showlegend": False, "row": 1, "col": 2}
        fig.add_scatter(x=[seconds], y=[0], hovertemplate="%{x:.0f} s", **style)
        rows.append(f"paper<br>{duration(seconds)}")
    fig.update_xaxes(title="share of starts (%)", range=(0, 100), col=1)
    fig.update_yaxes(title="swimming speed (m/s)", col=1)
    fig.update_xaxes(title="time of one start", type="log", col=2, **_CLOCK)
    low = 0.5 - (seconds is not None)
    places = [len(names) - i for i in range(len(rows))]
    fig.update_yaxes(tickvals=places, ticktext=rows, range=(low, len(names) + 0.5), col=2)
    dress(fig, 430).update_layout(showlegend=True, hovermode="closest", legend_y=1.1, margin_t=76)
    fig.update_yaxes(showgrid=False, zeroline=False, col=2)
    seeds, each = starts.sizes["seed"], starts.sizes["start"]
    caption = (
        f"Computed: {seeds} x {each} starts of each solver, sorted by the speed that they reach (thick; thin: one "
        f"seed). Starts that failed count as slowest, so that their line ends early. {' '.join(sentences)} {ANY_SPEED}"
    )
    if seconds is not None or printed is not None:
        caption += " Printed: the paper's best speed (dashed) and its mean time of an optimisation, on its own machine."
    return Panel("What every start reached", caption, fig)


def _from_best(speed: Float[np.ndarray, "..."]) -> tuple[Float[np.ndarray, "n"], Float[np.ndarray, "n"]]:
    """Share of starts [percent] that reach at least each speed, the fastest first and once more at 0 percent."""
    best = np.sort(speed[np.isfinite(speed)])[::-1]
    share = 100 * np.arange(len(best) + 1) / max(speed.size, 1)
    return share[: len(best) + 1 if len(best) else 0], np.concatenate([best[:1], best])


def _add_times(fig: go.Figure, own: xr.Dataset, place: float, colour: str) -> None:
    """Draw the time of each start of a solver as a dot, in a band around `place`, with a tick at the median."""
    seconds = own["seconds"].values.ravel()
    hovered = np.stack([own[name].values.ravel() for name in ("speed", "torque", "evaluations", "rejected")], axis=-1)
    band = place + 0.24 * np.sin(2.4 * np.arange(seconds.size))  # spread, the same each time
    hover = (
        "%{x:.3g} s, %{customdata[0]:.4f} m/s at %{customdata[1]:.3f} N m<br>"
        "%{customdata[2]:.0f} evaluations, %{customdata[3]:.0f} rejected"
    )
    dots = {"color": colour, "size": 5, "opacity": 0.55}
    where = {"mode": "markers", "showlegend": False, "name": plain(own["solver"].item()), "row": 1, "col": 2}
    fig.add_scatter(x=seconds, y=band, marker=dots, customdata=hovered, hovertemplate=hover, **where)
    tick = {"symbol": "line-ns", "size": 30, "line": {"width": 2.5, "color": BLACK}}
    fig.add_scatter(x=[_middle(seconds)], y=[place], marker=tick, hovertemplate="median %{x:.3g} s", **where)


def _sentence(name: str, own: xr.Dataset) -> str:
    speed = own["speed"].values
    solved = int(np.isfinite(speed).sum())
    if not solved:
        return f"{name}: none of {speed.size} starts succeeded."
    work, no = _middle(own["evaluations"].values), _middle(own["rejected"].values)
    return (
        f"{name}: {solved} of {speed.size} starts succeeded, the best at {np.nanmax(speed):.4f} m/s; "
        f"median {work:.0f} evaluations, {no:.0f} rejected."
    )


def _middle(values: Float[np.ndarray, "..."]) -> float:
    """Median of the finite values; NaN where there are none."""
    finite = values[np.isfinite(values)]
    return float(np.median(finite)) if finite.size else float("nan")


def duration(seconds: float) -> str:
    """Time as people say it."""
    for size, unit in ((3600, "h"), (60, "min"), (1, "s")):
        if seconds >= 1.5 * size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds:.2g} s" if np.isfinite(seconds) else "-"


def _add_printed(fig: go.Figure, ends: list[float], speed: float, col: int = 1) -> None:
    """Draw the printed speed from one end to the other."""
    line = {"color": BLACK, "dash": "dash", "width": 1.4}
    words = {"name": f"printed best, {speed:g} m/s", "hovertemplate": "printed %{y:.3f} m/s"}
    fig.add_scatter(x=ends, y=[speed] * 2, mode="lines", line=line, showlegend=col == 1, row=1, col=col, **words)


def history_panel(history: xr.Dataset) -> Panel:
    """Best speed so far against iterations and evaluations."""
    titles = ("by iteration", "by evaluation")
    fig = make_subplots(1, 2, shared_yaxes=True, horizontal_spacing=0.05, subplot_titles=titles)
    iteration = history["iteration"].values
    ends: tuple[list[float], list[float]] = ([], [])
    for i, colour in zip(range(history.sizes["solver"]), cycle(CYCLE)):
        own = history.isel(solver=i)
        name, speed = plain(own["solver"].item()), own["speed"].values
        for col, x in ((1, iteration), (2, own["evaluations"].values)):
            keep = (iteration > 0) & (x > 0)
            hover = f"{name}<br>%{{y:.4f}} m/s at {'iteration' if col == 1 else 'evaluation'} %{{x:.0f}}"
            style: Any = {"name": name, "hovertemplate": hover, "legendgroup": name, "row": 1, "col": col}
            line = {"color": colour, "shape": "hv", "width": 2.2}
            fig.add_scatter(x=x[keep], y=speed[keep], mode="lines", line=line, showlegend=col == 1, **style)
            marked = keep & np.isin(iteration, list(MARKED)) & np.isfinite(speed)
            marker = _hollow([MARKED[int(k)] for k in iteration[marked]], 11, colour, 2.4)
            fig.add_scatter(x=x[marked], y=speed[marked], mode="markers", marker=marker, showlegend=False, **style)
            ends[col - 1].extend(x[keep & np.isfinite(speed)].tolist())
    for k, symbol in MARKED.items():
        key = {"mode": "markers", "marker": _hollow(symbol, 10, GREY, 2), "name": f"iteration {k}"}
        fig.add_scatter(x=[None], y=[None], row=1, col=1, **key)
    printed = history.attrs.get("printed_speed")
    if printed is not None:
        for col, x in enumerate(ends, start=1):
            if x:
                _add_printed(fig, [min(x), max(x)], printed, col)
    fig.update_xaxes(title="iteration", col=1)
    fig.update_xaxes(title="evaluations", col=2)
    dress(fig, 420).update_layout(showlegend=True, hovermode="closest", legend_y=1.1, margin_t=76)
    for col, x in enumerate(ends, start=1):
        fig.update_xaxes(type="log", col=col, **log_ticks(x))
    fig.update_yaxes(title="best speed so far (m/s)", col=1)
    caption = (
        "Computed: the fastest design so far that keeps the limits, in one search of each solver; no line where there "
        "was none yet, and none after its end. An iteration means something else to each solver; evaluations "
        f"compare better. Marks: the iterations of Fig. 4. {ANY_SPEED}"
    )
    if printed is not None:
        caption += " Printed: the paper's best speed (dashed)."
    return Panel("How the searches went on", caption, fig)


def _hollow(symbol: str | list[str], size: float, colour: str, width: float) -> dict[str, Any]:
    """Marker that is white inside."""
    return {"symbol": symbol, "size": size, "color": "white", "line": {"color": colour, "width": width}}


def best_panel(best: xr.Dataset) -> Panel:
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
        strong = ' class="match"' if whose.startswith("ours") else ""
        body.append(f'<tr><td{strong}>{escape(whose)}</td><td class="number">{rank}</td>{cells}</tr>')
    head, lines = f'<tr><th>source</th><th class="number">rank</th>{heads}</tr>', "\n".join(body)
    text = f'<div class="wide"><table>\n<thead>{head}</thead>\n<tbody>\n{lines}\n</tbody></table></div>'
    printed = np.array([not whose.startswith("ours") for whose in source])
    caption = (
        "Best designs found here, computed, and those printed in Table II of the paper. The first is one to build: the "
        f"paper's motor drives it at the battery's 7.4 V. {ANY_SPEED}"
    )
    if np.any(np.isfinite(best["torque"].values[printed])):
        caption += " The paper prints no torque of a design; the torque beside its designs is computed here."
    if "above_motor_line" in best:
        above = best["above_motor_line"].values > 1e-6  # more than what the search leaves
        caption += f" {int(above.sum())} of these {above.size} designs need more torque than it has at 7.4 V."
    return Panel("Best designs", caption, text)


def _fixed(value: float, decimals: int) -> str:
    return f"{value:.{decimals}f}" if np.isfinite(value) else "-"
