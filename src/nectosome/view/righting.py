"""Figure of a righting curve: the lever with which weight and buoyancy turn a robot back, over its heel."""

import numpy as np
import plotly.graph_objects as go
from jaxtyping import Float

from .style import BLUE, GREY, Panel, dress


def righting_panel(heels: Float[np.ndarray, "n"], arms: Float[np.ndarray, "n"], height: float) -> Panel:
    """Righting arms [m] at heels [rad], and the line of the metacentric height [m] that they begin with."""
    degrees, near = np.degrees(heels), heels <= 1.0
    most = float(np.abs(arms).max()) or 1.0
    factor, unit = (1e3, "mm") if most < 0.5 else (1.0, "m")
    fig = go.Figure()
    start = arms[0] + height * heels[near]
    line = {"color": GREY, "dash": "dot"}
    fig.add_scatter(x=degrees[near], y=factor * start, mode="lines", line=line, name="by the metacentric height")
    fig.add_scatter(x=degrees, y=factor * arms, mode="lines", line={"color": BLUE}, name="righting arm")
    fig.update_xaxes(title="heel to starboard (deg)", dtick=30, range=[0, float(degrees[-1])])
    fig.update_yaxes(title=f"righting arm GZ ({unit})", range=[-1.15 * factor * most, 1.15 * factor * most])
    caption = (
        "Above 0 the robot turns back; beyond the last zero it turns over. Joints and trim are held, and it rises and "
        "sinks until it displaces its mass. Dotted: the metacentric height times the angle."
    )
    return Panel("Righting arm", caption, dress(fig, 380))
