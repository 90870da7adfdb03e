"""Figures of PoseiDRONE's swimming: speeds measured and computed, and errors of the estimators of mass and drag.

Data: `swim` as `identification.surge_data` has it; `swim_as_printed`, the same by the printed estimator; `swim_draws`:
value (estimator, draw, parameter), truth (parameter), bias, coverage [percent] (estimator, parameter).
"""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from nectosome.view.fit_pages import surge_panel
from nectosome.view.style import BLACK, BLUE, CYCLE, ORANGE, Panel, dress, plain, readable

if TYPE_CHECKING:
    import xarray as xr

_MOST = 50.0  # percent, of errors that are shown


def panels(sets: Mapping[str, "xr.Dataset"]) -> list[Panel]:
    """Figs. 9 and 10 on synthetic recordings, and the estimators."""
    found, other = sets["swim"], sets["swim_as_printed"]
    shown = [surge_panel(found, k, other, "synthetic") for k in range(found.sizes["recording"])]
    note = " The paper published no recordings: this one is synthetic."
    named = zip(shown, ("Fig. 9", "Fig. 10"), strict=True)
    shown = [panel._replace(title=f"{panel.title}, as {f}", caption=panel.caption + note) for panel, f in named]
    return [*shown, estimators_panel(sets["swim_draws"])]


def estimators_panel(made: "xr.Dataset") -> Panel:
    """Errors of each estimator over many draws of noise, and the coverage of its intervals."""
    from plotly.subplots import make_subplots

    names = [str(name) for name in made["parameter"].values]
    estimators = [str(estimator) for estimator in made["estimator"].values]
    fig = make_subplots(1, 3, shared_yaxes=True, horizontal_spacing=0.03, column_widths=[0.37, 0.37, 0.26])
    off = 100 * (made["value"] / made["truth"] - 1)
    for col, name in enumerate(names, start=1):
        for k, estimator in enumerate(estimators):
            x = off.sel(parameter=name, estimator=estimator).values
            box: dict[str, Any] = {"boxpoints": False, "boxmean": True, "line_color": CYCLE[k % len(CYCLE)]}
            fig.add_box(x=x, y=[plain(estimator)] * x.size, orientation="h", **box, row=1, col=col)
        fig.update_xaxes(title=f"error of {readable(name)} (percent)", row=1, col=col)
        fig.update_xaxes(range=[-15, _MOST], row=1, col=col)
    for name, colour, symbol in zip(names, (BLUE, ORANGE), ("circle", "diamond"), strict=True):
        marker = {"color": colour, "size": 10, "symbol": symbol}
        x, y = made["coverage"].sel(parameter=name).values, [plain(estimator) for estimator in estimators]
        fig.add_scatter(x=x, y=y, mode="markers", marker=marker, name=f"coverage, {readable(name)}", row=1, col=3)
    fig.add_vline(x=95, line={"color": BLACK, "dash": "dash", "width": 1}, row=1, col=3)  # pyright: ignore[reportArgumentType]
    fig.update_xaxes(title="95 % intervals that hold (percent)", range=[-4, 104], row=1, col=3)
    fig.update_yaxes(autorange="reversed")
    beyond = [
        f" {estimator[:1].upper()}{estimator[1:]} the {readable(name)} is off by {x:.0f} %, which is not shown."
        for estimator in estimators
        for name in names
        if (x := float(made["bias"].sel(estimator=estimator, parameter=name))) > _MOST
    ]
    dress(fig, 420).update_layout(showlegend=True, hovermode="closest", margin_l=150, margin_t=50)
    fig.for_each_trace(lambda trace: trace.update(showlegend=trace.type == "scatter"))
    caption = (
        f"Synthetic recordings, {made.sizes['draw']} draws of noise: errors of the estimates (boxes hold half of them, "
        "the dashed line is the mean), and the share of 95 % intervals that hold the truth. As printed: eqs. 4 to 9 "
        f"behind a Savitzky-Golay filter on the speed alone.{''.join(beyond)}"
    )
    return Panel("Errors of the estimators", caption, fig)
