"""Figure of righting curves: the lever with which weight and buoyancy turn a robot back, over its heel to each side."""

import numpy as np
import plotly.graph_objects as go
from jaxtyping import Float

from .style import BLUE, GREY, ORANGE, Panel, dress


def righting_panel(
    heels: Float[np.ndarray, "n"],
    starboard: Float[np.ndarray, "n"],
    port: Float[np.ndarray, "n"],
    rest: float,
    height: float,
) -> Panel:
    """Righting arms [m] at heels [rad] to each side.

    Beside them lines of the metacentric height [m] from the heel `rest` [rad], to starboard.
    """
    degrees = np.degrees(heels)
    most = float(np.abs([starboard, port]).max()) or 1.0
    factor, unit = (1e3, "mm") if most < 0.5 else (1.0, "m")
    fig = go.Figure()
    sides = (
        ("to starboard", starboard, rest, {"color": BLUE}),
        ("to port", port, -rest, {"color": ORANGE, "dash": "dash"}),
    )
    for name, arms, lies, line in sides:
        near = np.abs(heels - lies) <= 1.0
        dotted, small = {"color": GREY, "dash": "dot"}, factor * height * (heels - lies)[near]
        by_height = {"name": "by the metacentric height", "showlegend": arms is starboard}
        fig.add_scatter(x=degrees[near], y=small, mode="lines", line=dotted, **by_height)
        fig.add_scatter(x=degrees, y=factor * arms, mode="lines", line=line, name=name)
    fig.update_xaxes(title="heel to starboard, heel to port (deg)", dtick=30, range=[0, float(degrees[-1])])
    fig.update_yaxes(title=f"righting arm GZ ({unit})", range=[-1.15 * factor * most, 1.15 * factor * most])
    caption = (
        "Above 0 the robot turns back; beyond the last zero it turns over. Judge it by the side with the smaller arms. "
        "Joints and trim are held, and it rises and sinks until it displaces its mass. Dotted: the metacentric height "
        "times the angle from where it is at rest."
    )
    return Panel("Righting arm", caption, dress(fig, 400).update_layout(showlegend=True))
