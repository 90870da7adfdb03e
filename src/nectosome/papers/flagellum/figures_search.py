"""Figures of searches for a design: what every start reached and cost, and how a search went on."""

from itertools import cycle
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from nectosome.view.style import BLACK, CYCLE, GREY, Panel, dress, log_ticks, plain

if TYPE_CHECKING:
    import plotly.graph_objects as go
    import xarray as xr

MARKED = {1: "circle", 5: "square", 20: "diamond"}  # iterations with a mark, as in Fig. 4
_CLOCK = {
    1e-3: "1 ms",
    1e-2: "10 ms",
    0.1: "0.1 s",
    1: "1 s",
    10: "10 s",
    60: "1 min",
    600: "10 min",
    3600: "1 h",
    36000: "10 h",
}


def starts_panel(starts: "xr.Dataset") -> Panel:
    """Speed that every start of every solver reached, and the time that it took."""
    from plotly.subplots import make_subplots

    titles = ("speed that this share of starts reaches", "time of a start, and the median")
    fig = make_subplots(1, 2, column_widths=[0.58, 0.42], horizontal_spacing=0.16, subplot_titles=titles)
    names = [str(s) for s in starts["solver"].values]
    sentences, rows = [], []
    for i, (name, colour) in enumerate(zip(names, cycle(CYCLE))):
        own = starts.isel(solver=i)
        for k, seed in enumerate(own["seed"].values):
            thin = {"color": colour, "width": 1, "shape": "vh"}
            x, y = _from_best(own["speed"].isel(seed=k).values)
            fig.add_scatter(
                x=x,
                y=y,
                mode="lines",
                opacity=0.45,
                line=thin,
                legendgroup=name,
                showlegend=False,
                hoverinfo="skip",
                name=f"{plain(name)}, seed {seed}",
                row=1,
                col=1,
            )
        x, y = _from_best(own["speed"].values)
        bold = {"color": colour, "width": 2.6, "shape": "vh"}
        hover = "%{y:.4f} m/s or more: %{x:.0f} % of starts"
        fig.add_scatter(
            x=x, y=y, mode="lines", line=bold, legendgroup=name, name=plain(name), hovertemplate=hover, row=1, col=1
        )
        _add_times(fig, own, len(names) - i, colour)
        rows.append(f"{plain(name)}<br>{duration(_middle(own['seconds'].values))}")
        sentences.append(_sentence(name, own))
    printed, seconds = starts.attrs.get("printed_speed"), starts.attrs.get("printed_seconds")
    if printed is not None:
        _add_printed(fig, [0, 100], printed)
    if seconds is not None:
        mark = {"color": BLACK, "symbol": "diamond", "size": 11}
        fig.add_scatter(
            x=[seconds],
            y=[0],
            mode="markers",
            marker=mark,
            name="paper",
            showlegend=False,
            hovertemplate="%{x:.0f} s",
            row=1,
            col=2,
        )
        rows.append(f"paper<br>{duration(seconds)}")
    fig.update_xaxes(title="share of starts (%)", range=(0, 100), col=1)
    fig.update_yaxes(title="swimming speed (m/s)", col=1)
    ticks = {"tickvals": list(_CLOCK), "ticktext": list(_CLOCK.values())}
    fig.update_xaxes(title="time of one start", type="log", col=2, **ticks)
    low = 0.5 - (seconds is not None)
    places = [len(names) - i for i in range(len(rows))]
    fig.update_yaxes(tickvals=places, ticktext=rows, range=(low, len(names) + 0.5), col=2)
    dress(fig, 430).update_layout(showlegend=True, hovermode="closest", legend_y=1.1, margin_t=76)
    fig.update_yaxes(showgrid=False, zeroline=False, col=2)
    seeds, each = starts.sizes["seed"], starts.sizes["start"]
    caption = (
        f"Computed: {seeds} x {each} starts of each solver, sorted by the speed that they reach (thick; thin: one "
        "seed). Starts that failed count as slowest, so that their line ends early. " + " ".join(sentences)
    )
    if seconds is not None or printed is not None:
        caption += " Printed: the paper's best speed (dashed) and its mean time of an optimisation, on its own machine."
    return Panel("What every start reached", caption, fig)


def _from_best(speed: Float[np.ndarray, "..."]) -> tuple[Float[np.ndarray, "n"], Float[np.ndarray, "n"]]:
    """Share of starts [percent] that reach at least each speed, the fastest first and once more at 0 percent."""
    best = np.sort(speed[np.isfinite(speed)])[::-1]
    share = 100 * np.arange(len(best) + 1) / max(speed.size, 1)
    return share[: len(best) + 1 if len(best) else 0], np.concatenate([best[:1], best])


def _add_times(fig: "go.Figure", own: "xr.Dataset", place: float, colour: str) -> None:
    """Draw the time of each start of a solver as a dot, in a band around `place`, with a tick at the median."""
    seconds = own["seconds"].values.ravel()
    tell = np.stack([own[name].values.ravel() for name in ("speed", "torque", "evaluations", "rejected")], axis=-1)
    band = place + 0.24 * np.sin(2.4 * np.arange(seconds.size))  # spread, the same each time
    hover = (
        "%{x:.3g} s, %{customdata[0]:.4f} m/s at %{customdata[1]:.3f} N m<br>"
        "%{customdata[2]:.0f} evaluations, %{customdata[3]:.0f} rejected"
    )
    dots = {"color": colour, "size": 5, "opacity": 0.55}
    where = {"mode": "markers", "showlegend": False, "name": plain(own["solver"].item()), "row": 1, "col": 2}
    fig.add_scatter(x=seconds, y=band, marker=dots, customdata=tell, hovertemplate=hover, **where)
    tick = {"symbol": "line-ns", "size": 30, "line": {"width": 2.5, "color": BLACK}}
    fig.add_scatter(x=[_middle(seconds)], y=[place], marker=tick, hovertemplate="median %{x:.3g} s", **where)


def _sentence(name: str, own: "xr.Dataset") -> str:
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


def _add_printed(fig: "go.Figure", ends: list[float], speed: float, col: int = 1) -> None:
    """Draw the printed speed from one end to the other."""
    style = {"color": BLACK, "dash": "dash", "width": 1.4}
    fig.add_scatter(
        x=ends,
        y=[speed] * 2,
        mode="lines",
        line=style,
        name=f"printed best, {speed:g} m/s",
        showlegend=col == 1,
        hovertemplate="printed %{y:.3f} m/s",
        row=1,
        col=col,
    )


def history_panel(history: "xr.Dataset") -> Panel:
    """Best speed so far against iterations and evaluations."""
    from plotly.subplots import make_subplots

    titles = ("by iteration", "by evaluation")
    fig = make_subplots(1, 2, shared_yaxes=True, horizontal_spacing=0.05, subplot_titles=titles)
    iteration = history["iteration"].values
    positive = iteration > 0
    ends: tuple[list[float], list[float]] = ([], [])
    for i, colour in zip(range(history.sizes["solver"]), cycle(CYCLE)):
        own = history.isel(solver=i)
        name, speed = plain(own["solver"].item()), own["speed"].values
        for col, x in ((1, iteration), (2, own["evaluations"].values)):
            keep = positive & (x > 0)
            shape = {"color": colour, "shape": "hv", "width": 2.2}
            hover = f"{name}<br>%{{y:.4f}} m/s at {'iteration' if col == 1 else 'evaluation'} %{{x:.0f}}"
            where = {"legendgroup": name, "row": 1, "col": col}
            fig.add_scatter(
                x=x[keep],
                y=speed[keep],
                mode="lines",
                line=shape,
                name=name,
                showlegend=col == 1,
                hovertemplate=hover,
                **where,
            )
            marked = keep & np.isin(iteration, list(MARKED)) & np.isfinite(speed)
            marker = {
                "symbol": [MARKED[int(k)] for k in iteration[marked]],
                "size": 11,
                "color": "white",
                "line": {"color": colour, "width": 2.4},
            }
            fig.add_scatter(
                x=x[marked],
                y=speed[marked],
                mode="markers",
                marker=marker,
                name=name,
                showlegend=False,
                hovertemplate=hover,
                **where,
            )
            ends[col - 1].extend(x[keep & np.isfinite(speed)].tolist())
    for k, symbol in MARKED.items():
        marker = {"symbol": symbol, "size": 10, "color": "white", "line": {"color": GREY, "width": 2}}
        fig.add_scatter(x=[None], y=[None], mode="markers", marker=marker, name=f"iteration {k}", row=1, col=1)
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
        "compare better. Marks: the iterations of Fig. 4."
    )
    if printed is not None:
        caption += " Printed: the paper's best speed (dashed)."
    return Panel("How the searches went on", caption, fig)
