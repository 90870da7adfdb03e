"""The tab that makes a simulated grid agree with a few experiments, and says which to make next."""

import json
import threading
from concurrent.futures import CancelledError
from contextlib import suppress
from typing import Any

import plotly.graph_objects as go
import xarray as xr

from nectosome.identification import METHODS, CorrectedGrid, correct
from nectosome.io import load_dataset, provenance, save_dataset
from nectosome.measure import load_campaign
from nectosome.studio.desk import Desk
from nectosome.studio.work import Progress, errors_shown
from nectosome.units import InputError, read_positive
from nectosome.view.corrected_grid import curves_panel, grid_maps, parameter_map, predictions_panel, unknown_map
from nectosome.view.corrected_words import lines, read_lines, tables

from .left_panel import note, spelled, with_legend

_NOTHING = "nothing there yet"
_OWN = "the best for the grid"
_AIMS = {"where the least is known": "error", "for the highest": "highest", "for the lowest": "lowest"}
_MOST = 50  # experiments to come
_MARKS = "Dots: measured. Diamonds: to be measured next. Star: the best of the grid."


class Correct:
    """Lays out the tab."""

    def __init__(self, session: Desk):
        self._session, gui = session, session.gui
        self._drawing = threading.Lock()
        self._found: xr.Dataset | None = None
        self._figures: dict[str, go.Figure] = {}
        self._grid: Any = gui.add_dropdown("Simulated grid", (_NOTHING,), hint="As a saved map, or sweep --save.")
        hint = "A file that lists recordings and the conditions of each."
        self._campaign: Any = gui.add_dropdown("Campaign", (_NOTHING,), hint=hint)
        gui.add_button("Look again").on_click(lambda _: self.renew())
        hint = "Such as force.y; -force.y where the sensor reads the other way. Empty: the one that both have."
        self._quantity = gui.add_text("Quantity", "", hint=hint)
        hint = "NAME=VALUE that the simulator takes, such as Cn=1. Empty: that of the sweep's robot."
        self._parameter = gui.add_text("Parameter", "", hint=hint)
        self._lowpass = gui.add_text("Low pass", "", hint="Cutoff for the peaks of recordings, such as 10 Hz.")
        self._method = gui.add_dropdown("Method", (_OWN, *METHODS))
        self._aim = gui.add_dropdown("Next experiments", tuple(_AIMS))
        self._count = gui.add_number("How many", 3, min=1, max=_MOST, step=1)
        gui.add_button("Correct").on_click(lambda _: self._told(self._begin))
        self._place = gui.add_folder(None, visible=False)
        with self._place:
            self._shown: Any = gui.add_dropdown("Show", ("corrected",))
            self._shown.on_update(lambda _: self._told(self._draw))
        self._plot: Any = None  # made when it is needed, as its program is large
        self._words = gui.add_html("")
        self._saving = gui.add_folder(None, visible=False)
        with self._saving:
            self._name = gui.add_text("Name", "corrected")
            gui.add_button("Save corrected grid (.nc)").on_click(lambda _: self._told(self._save))

    def renew(self) -> None:
        """Look which grids and campaigns there are; what was corrected stays, as it is of no robot that is shown."""
        folder = self._session.folder
        self._grid.options = folder.names(".nc") or [_NOTHING]
        self._campaign.options = folder.names(".yaml", ".yml") or [_NOTHING]

    def _told(self, work: Any) -> None:
        with errors_shown(self._session.tell):
            work()

    def _begin(self) -> None:
        folder, names = self._session.folder, (self._grid.value, self._campaign.value)
        for name, what in zip(names, ("simulated grid", "campaign"), strict=True):
            if name == _NOTHING:
                raise InputError(f"there is no {what} in the working folder.")
        grid = load_dataset(folder.existing(names[0]))
        campaign = load_campaign(folder.existing(names[1]))
        for planned in campaign.planned:
            folder.listed(planned.path)
        cutoff = self._lowpass.value.strip()
        lowpass = read_positive(cutoff, "frequency", "Low pass") if cutoff else None
        method = None if self._method.value == _OWN else self._method.value
        asked: dict[str, Any] = {"quantity": self._quantity.value.strip() or None, "method": method}
        asked |= {"parameter": self._parameter.value.strip() or None, "lowpass": lowpass}
        asked |= {"aim": _AIMS[self._aim.value], "count": int(self._count.value)}

        def compute(progress: Progress) -> CorrectedGrid | None:
            progress(0.0, "reading")
            with suppress(CancelledError):
                return correct(grid, campaign, **asked, progress=lambda what, share: progress(share, what))
            return None

        def done(found: CorrectedGrid | None) -> None:
            if found is None:
                self._session.tell("the correction was cancelled.", False)
                return
            settings = dict(zip(("sim", "campaign"), names, strict=True)) | asked
            found.data.attrs |= {
                "title": f"{found.column} of {names[0]}, corrected with {names[1]}",
                "provenance": json.dumps(provenance({key: value and str(value) for key, value in settings.items()})),
            }
            self._take(found, asked["aim"])

        self._session.work.begin("correcting", compute, done)

    def _take(self, found: CorrectedGrid, aim: str) -> None:
        data = found.data
        said = spelled(tables(data, aim), "studio-correction", lines(data, found.observed))
        with self._drawing:
            self._found, self._figures = data, _figures(data, aim)
            self._shown.options = list(self._figures)
            self._words.content = "".join(map(note, (_MARKS, *read_lines(found.observed)))) + said
            self._place.visible = self._saving.visible = True
        self._session.tell(f"corrected: {data.attrs['title']}", False)
        self._draw()

    def _draw(self) -> None:
        with self._drawing:
            drawn = self._figures.get(self._shown.value)
            if drawn is None:
                return
            if self._plot is None:
                with self._place:
                    self._plot = self._session.gui.add_plotly(drawn, aspect=1.0, config={"displayModeBar": False})
            else:
                self._plot.figure = drawn

    def _save(self) -> None:
        with self._drawing:
            found = self._found
        if found is not None:
            path = self._session.folder.target(self._name.value, ".nc")
            save_dataset(found, path)
            self._session.tell(f"saved {path.relative_to(self._session.folder.root).as_posix()}", False)


def _figures(found: xr.Dataset, aim: str) -> dict[str, go.Figure]:
    """What can be shown, by its name: maps of two conditions, curves of one, and predictions in any case."""
    out: dict[str, Any] = {}
    if found["simulated"].ndim == 1:
        out["curves"] = curves_panel(found, aim).figure
    if found["simulated"].ndim == 2:
        out |= {name: grid_maps(found, aim, name) for name in ("corrected", "simulated")}
        out |= {"what is not known": unknown_map(found), "parameter": parameter_map(found)}
    out["predictions"] = predictions_panel(found).figure
    return {name: with_legend(fig) for name, fig in out.items() if fig is not None}
