"""Fronts: designs by what they give and what they cost, with those that no other one beats in both."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from nectosome.view.style import BLACK, VERMILLION, dress

if TYPE_CHECKING:
    import plotly.graph_objects as go


class Cost(NamedTuple):
    """What designs cost, and which of them are on the front; scalars by design.

    `searched`: cost and gain of designs that a search found between them; these make the front where they are given.
    """

    title: str
    values: Float[np.ndarray, "n"]
    members: Bool[np.ndarray, "n"]
    searched: tuple[Float[np.ndarray, "k"], Float[np.ndarray, "k"], Sequence[str]] | None = None  # and their names


def fronts(
    gain: Float[np.ndarray, "n"], title: str, costs: Sequence[Cost], names: Sequence[str], own: int | None = None
) -> "go.Figure":
    """All designs by gain and each of their costs, the front of each as a line; `own` is the design to compare with."""
    from plotly.subplots import make_subplots

    fig = make_subplots(1, len(costs), shared_yaxes=True, horizontal_spacing=0.05)
    for col, cost in enumerate(costs, start=1):
        where: Any = {"row": 1, "col": col, "showlegend": col == 1, "hovertemplate": "%{text}<br>%{x:.4g}, %{y:.4g}"}
        dots = {"color": "#9fb4c7", "size": 6}
        fig.add_scatter(x=cost.values, y=gain, mode="markers", marker=dots, text=names, name="designs", **where)
        order = np.flatnonzero(cost.members)[np.argsort(cost.values[cost.members])]
        style = {"line": {"color": VERMILLION, "width": 1.6}, "marker": {"color": VERMILLION, "size": 8}}
        x, y, text = cost.searched or (cost.values[order], gain[order], [names[k] for k in order])
        fig.add_scatter(x=x, y=y, mode="lines+markers", text=text, name="front", **style, **where)
        if own is not None:
            star = {"symbol": "star", "size": 16, "color": "white", "line": {"color": BLACK, "width": 1.5}}
            here = {"x": [cost.values[own]], "y": [gain[own]], "text": [names[own]]}
            fig.add_scatter(**here, mode="markers", marker=star, name="as published", **where)
        fig.update_xaxes(title=cost.title, row=1, col=col)
    fig.update_yaxes(title=title, col=1)
    return dress(fig, 420).update_layout(showlegend=True, hovermode="closest", legend_y=1.02, margin_t=60)
