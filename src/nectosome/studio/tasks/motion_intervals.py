"""The tab with the interval of every number of the motion, and what makes it wide."""

from concurrent.futures import CancelledError
from functools import partial
from typing import Any, Literal

import numpy as np

from nectosome.description import dump_robot
from nectosome.designs.prediction_intervals import HIGH, LOW, Draws
from nectosome.designs.uncertain_runs import DRAWS, LEAST_DRAWS, spread
from nectosome.io import save_dataset
from nectosome.io.tables import number
from nectosome.studio.desk import Desk
from nectosome.studio.folder import NOTHING
from nectosome.studio.work import Progress
from nectosome.units import InputError, count
from nectosome.view.intervals import show_intervals, velocity_bands

from .left_panel import PanelTask, Plot, cells, note, spelled, with_legend

_VERBS: dict[str, Literal["periodic", "steady"]] = {"periodic motion": "periodic", "steady motion": "steady"}
_MOST = 400  # draws
_RANKED = 5  # sources that are named
_CANCELLED = "The intervals were cancelled. Begun again, they go on from the draws that were computed."


class Intervals(PanelTask):
    """Lays out the tab."""

    def __init__(self, desk: Desk):
        super().__init__(desk)
        gui = desk.gui
        self._found: Draws | None = None
        hint = f"Robots that are drawn, {LEAST_DRAWS} to {_MOST}: more make the ends surer."
        self._draws: Any = gui.add_number("Draws", DRAWS, min=LEAST_DRAWS, max=_MOST, step=1, hint=hint)
        self._add_button("Compute intervals", self._begin)
        self._shown: Any = gui.add_dropdown("Show", (NOTHING,))
        self._shown.on_update(self._chosen)
        self._table = gui.add_html("")
        self._plot = Plot(gui)
        self._causes = gui.add_html("")
        with gui.add_folder("Saved intervals"):
            self._name = gui.add_text("Name", "intervals")
            self._add_button("Save draws (.nc)", self._save)
            self._add_button("Save page (.html)", self._save_page)

    def renew(self) -> None:
        """Forget the intervals of the robot before."""
        with self._drawing:
            self._robot, self._found = self._robot + 1, None
            self._shown.options, self._plot.folder.visible = (NOTHING,), False
            self._table.content = self._causes.content = ""

    def _chosen(self, event: Any) -> None:
        if event.client is not None:  # not by us, who draw once all is set
            self._try(self._draw)

    def _begin(self) -> None:
        answer, description = self._desk.answer, self._desk.description
        verb = None if answer is None else _VERBS.get(answer.kind)
        if verb is None:
            raise InputError("there is no lasting motion yet: intervals are of one, steady or periodic.")
        draws, machines = int(self._draws.value), self._desk.machines
        request = "\n".join(("intervals", verb, str(draws), dump_robot(description)))

        def compute(progress: Progress) -> Draws:
            with machines.kept(request) as folder, machines.executor() as executor:
                found = spread(description, verb, draws=draws, folder=folder, executor=executor, progress=progress)
                if found is None:
                    raise CancelledError
                return found

        self._desk.work.begin(machines.named("intervals"), compute, partial(self._take, self._robot), _CANCELLED)

    def _take(self, robot: int, found: Draws) -> None:
        with self._drawing:
            if robot != self._robot:
                return
            self._found = found
        tables = tuple(dict.fromkeys(found.keys[k].heading for k in _varying(found)))
        self._shown.options = tables or (NOTHING,)
        self._shown.value = found.keys[found.main].heading if found.main is not None else NOTHING
        self._draw()

    def _draw(self) -> None:
        """Show the intervals of a table, the band of the velocity, and what makes them wide."""
        with self._drawing:
            found, heading = self._found, self._shown.value
            if found is None:
                return
            own = [k for k in _varying(found) if found.keys[k].heading == heading]
            rows = [_spelled(found, k) for k in own]
            heads = (f"{heading}: value, and its {100 * (HIGH - LOW):.0f} % interval", "", "")
            self._table.content = spelled([[heads, *rows]], "studio-intervals", ()) if own else note("Nothing varies.")
            figure = velocity_bands(found.to_dataset())
            self._plot.folder.visible = figure is not None
            if figure is not None:
                self._plot.show(with_legend(figure), 0.8)
            self._causes.content = cells(_causes(found), "studio-causes", _words(found))

    def _computed(self) -> Draws:
        """Raises InputError where there are none."""
        if self._found is None:
            raise InputError("there are no intervals yet.")
        return self._found

    def _save(self) -> None:
        found = self._computed()
        path = self._desk.folder.target(self._name.value, ".nc")
        save_dataset(found.to_dataset(), path)
        self._tell_saved(path)

    def _save_page(self) -> None:
        found = self._computed()
        path = self._desk.folder.target(self._name.value, ".html")
        show_intervals(found, path)
        self._tell_saved(path)


def _varying(found: Draws) -> list[int]:
    return [k for k in range(len(found.keys)) if found.ends[0, k] < found.ends[1, k]]


def _spelled(found: Draws, k: int) -> tuple[str, str, str]:
    """A number, its value, and both ends of its interval."""
    low, high = map(number, found.ends[:, k])
    return found.keys[k].name, f"{number(found.values[0, k])} {found.keys[k].unit}".strip(), f"{low} to {high}"


def _causes(found: Draws) -> list[tuple[str, str]]:
    """What makes the numbers wide, by its mean share."""
    shares = found.mean_shares
    if np.isnan(shares).all():
        return [("not known exactly", "share"), ("too few draws to tell", "")]
    order = np.argsort(-shares)[:_RANKED]
    return [("not known exactly", "mean share"), *((found.sources[k].name, f"{100 * shares[k]:.0f} %") for k in order)]


def _words(found: Draws) -> list[str]:
    more = ", with what models of the water leave out" if found.wet.any() else ""
    seen = f"Intervals by {count(int(found.found.sum()), 'draw')}{more}"
    return [f"{words}." for words in (seen, *found.cautions, *found.lost, *found.advice, *found.useless)]
