"""How a search for a design goes on: what each start reached so far, as a figure, and the best designs, as a table."""

from itertools import cycle
from typing import NamedTuple

import numpy as np
import plotly.graph_objects as go

from nectosome.designs import QUANTITIES, MotionDesign
from nectosome.search import Evaluation
from nectosome.units import show_quantity
from nectosome.view.style import CYCLE, readable, span

from .left_panel import cells, note, small

_SHOWN = 3  # designs of the table


class SearchProgress(NamedTuple):
    """A task, and the evaluations of each start so far."""

    task: MotionDesign
    starts: list[list[Evaluation]]

    @property
    def evaluations(self) -> int:
        """How many there are."""
        return sum(map(len, self.starts))

    @property
    def best(self) -> list[tuple[int, Evaluation]]:
        """Number of each start that found something, and the best that it found; the best of all first."""
        kept = [(k, [e for e, fits in zip(s, self.fits(s), strict=True) if fits]) for k, s in enumerate(self.starts)]
        found = [(k, min(own, key=lambda e: e.objective)) for k, own in kept if own]
        return sorted(found, key=lambda one: one[1].objective)

    def fits(self, start: list[Evaluation]) -> list[bool]:
        """Which evaluations of a start keep all limits; not those of designs that were drawn and refused."""
        begun = next((k for k, e in enumerate(start) if not self.task.accepts(e)), len(start))
        return [k >= begun and e.feasible(self.task.tolerance) for k, e in enumerate(start)]

    def objective_text(self, e: Evaluation) -> str:
        """Objective of a design, with its unit."""
        return show_quantity(e.outputs[self.task.objective], QUANTITIES[self.task.objective].dimension)


def figure(search: SearchProgress) -> go.Figure:
    """Best objective so far against evaluations, one line a start; crosses did not keep the limits."""
    fig, name = go.Figure(), search.task.objective
    pick = np.fmax if search.task.highest else np.fmin
    shown: list[float] = []
    for k, (start, colour) in enumerate(zip(search.starts, cycle(CYCLE))):
        value = np.array([e.outputs.get(name, np.nan) if e.solved else np.nan for e in start], dtype=float)
        fits = np.array(search.fits(start), dtype=bool)
        x, best = np.arange(1, value.size + 1), pick.accumulate(np.where(fits, value, np.nan))
        line = {"color": colour, "shape": "hv", "width": 2}
        fig.add_scatter(x=x, y=best, mode="lines", line=line, name=f"start {k + 1}", hovertemplate="%{y:.4g} at %{x}")
        cross = {"color": colour, "symbol": "x-thin-open", "size": 6}
        off = ~fits & np.isfinite(value)
        fig.add_scatter(x=x[off], y=value[off], mode="markers", marker=cross, showlegend=False, hoverinfo="skip")
        shown += best[np.isfinite(best)].tolist()
    if shown:  # what keeps no limit may lie far away
        fig.update_yaxes(range=span(shown, 0.15))
    unit = QUANTITIES[name].unit
    fig.update_xaxes(title="evaluations", rangemode="tozero")
    fig.update_yaxes(title=f"{readable(name)} ({unit})" if unit != "1" else readable(name))
    return small(fig).update_layout(showlegend=len(search.starts) > 1)


def table(search: SearchProgress) -> str:
    """The best designs beside each other, those of different starts."""
    best, task = search.best[:_SHOWN], search.task
    if not best:
        return note("No design so far keeps all limits.")
    rows = [["", *(f"start {k + 1}" for k, _ in best)]]
    for name in task.units:
        dimension = QUANTITIES[name].dimension
        rows.append([readable(name), *(show_quantity(e.outputs[name], dimension) for _, e in best)])
    values = [task.box.values(e.u) for _, e in best]
    for k, v in enumerate(task.variables):
        rows.append([v.name, *(show_quantity(float(own[k]), v.dimension) for own in values)])
    first = best[0][1]
    limits = [name for name, g in zip(task.constraint_names, first.constraints, strict=True) if g > -1e-4]
    ends = [v.name for v in task.at_an_end(first.u)]
    notes = {"at its limit": limits, "at an end of its range, widen it if the robot allows": ends}
    return cells(rows, "studio-designs", [f"{words}: {', '.join(names)}" for words, names in notes.items() if names])
