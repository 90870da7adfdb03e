"""Labels at the ends of lines, and ticks of logarithmic axes."""

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
import plotly.graph_objects as go

_GAP = 15  # pixels between labels


class LineEnd(NamedTuple):
    """The label at the end of a line: the value it belongs to, its text and colour."""

    value: float
    text: str
    colour: str


def log_ticks(values: Iterable[float]) -> dict[str, Any]:
    """Ticks of a logarithmic axis that shows positive values: each with its full number, few enough to read."""
    finite = np.array(list(values), dtype=float)
    finite = finite[np.isfinite(finite) & (finite > 0)]
    if not finite.size:
        return {}
    low, high = np.log10(finite.min()), np.log10(finite.max())
    steps = (1,) if high - low > 3.5 else (1, 2, 5) if high - low > 0.5 else (1, 1.5, 2, 2.5, 3, 4, 5, 6, 7, 8, 9)
    ticks = [m * 10.0**k for k in range(int(np.floor(low)) - 1, int(np.ceil(high)) + 2) for m in steps]
    return {"tickvals": ticks, "ticktext": [f"{t:g}" for t in ticks]}


def label_ends(
    fig: go.Figure, ends: Sequence[LineEnd], across: tuple[float, float], pixels: float, axis: str = ""
) -> None:
    """Write labels right of an axis that shows the values `across` over `pixels`, moved apart where they would touch.

    `axis` is the number of the subplot's axes in plotly's names ("" for the first).
    """
    per_value = pixels / (across[1] - across[0])
    ordered = sorted(ends, key=lambda end: end.value)
    places: list[float] = []
    for end in ordered:
        y = (end.value - across[0]) * per_value
        places.append(max(y, places[-1] + _GAP) if places else y)
    if places:  # half of what the pile grew upwards is taken back
        grown = places[-1] - (ordered[-1].value - across[0]) * per_value
        places = [place - 0.5 * grown for place in places]
    for end, place in zip(ordered, places, strict=True):
        across_from = {"x": 1, "xref": f"x{axis} domain", "xanchor": "left", "xshift": 6}
        up_at = {"y": place / pixels, "yref": f"y{axis} domain", "yanchor": "middle"}
        font = {"color": end.colour, "size": 12}
        fig.add_annotation(text=end.text, showarrow=False, font=font, **across_from, **up_at)
