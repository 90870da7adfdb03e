"""The tab that makes a simulated grid agree with a few experiments, and says which to make next."""

import json
from typing import Any

import plotly.graph_objects as go
import xarray as xr

from nectosome.identification import METHODS, CorrectedGrid, correct
from nectosome.io import load_dataset, provenance, save_dataset
from nectosome.measure import load_campaign
from nectosome.studio.desk import Desk
from nectosome.studio.folder import NOTHING
from nectosome.studio.work import Progress
from nectosome.units import InputError, read_positive
from nectosome.view.corrected_grid import curves_panel, grid_maps, parameter_map, predictions_panel, unknown_map
from nectosome.view.corrected_words import lines, read_lines, tables

from .left_panel import PanelTask, Plot, add_text, note, spelled, with_legend

_OWN = "the best for the grid"
_AIMS = {"where the least is known": "error", "for the highest": "highest", "for the lowest": "lowest"}
_MOST = 50  # experiments to come
_MARKS = "Dots: measured. Diamonds: to be measured next. Star: the best of the grid."


class Correct(PanelTask):
    """Lays out the tab."""

    def __init__(self, desk: Desk):
        super().__init__(desk)
        gui = desk.gui
        self._found: xr.Dataset | None = None
        self._figures: dict[str, go.Figure] = {}
        self._grid: Any = gui.add_dropdown("Simulated grid", (NOTHING,), hint="As a saved map, or sweep --save.")
        hint = "A file that lists recordings and the conditions of each."
        self._campaign: Any = gui.add_dropdown("Campaign", (NOTHING,), hint=hint)
        gui.add_button("Look again").on_click(lambda _: self.renew())
        hint = "-force.y where the sensor reads the other way. Empty: the one that both have."
        self._quantity = add_text(gui, "Quantity", "-force.y", hint=hint)
        hint = "NAME=VALUE that the simulator takes. Empty: that of the sweep's robot."
        self._parameter = add_text(gui, "Parameter", "Cn=1", hint=hint)
        self._lowpass = add_text(gui, "Low pass", "10 Hz", hint="Cutoff for the peaks of recordings.")
        self._method = gui.add_dropdown("Method", (_OWN, *METHODS))
        self._aim = gui.add_dropdown("Next experiments", tuple(_AIMS))
        self._count = gui.add_number("How many", 3, min=1, max=_MOST, step=1)
        self._add_button("Correct", self._begin)
        self._plot = Plot(gui)
        with self._plot.folder:
            self._shown: Any = gui.add_dropdown("Show", ("corrected",))
            self._shown.on_update(lambda _: self._try(self._draw))
        self._words = gui.add_html("")
        self._saving = gui.add_folder(None, visible=False)
        with self._saving:
            self._name = gui.add_text("Name", "corrected")
            self._add_button("Save corrected grid (.nc)", self._save)

    def renew(self) -> None:
        """Look which grids and campaigns there are; what was corrected stays, as it is of no robot that is shown."""
        self._grid.options = self._desk.folder.choices(".nc")
        self._campaign.options = self._desk.folder.choices(".yaml", ".yml")

    def _begin(self) -> None:
        folder, names = self._desk.folder, (self._grid.value, self._campaign.value)
        for name, what in zip(names, ("simulated grid", "campaign"), strict=True):
            if name == NOTHING:
                raise InputError(f"there is no {what} in the working folder.")
        grid = load_dataset(folder.existing(names[0]))
        campaign = load_campaign(folder.existing(names[1]))
        for planned in campaign.planned:
            folder.listed(planned.path)
        cutoff = self._lowpass.value.strip()
        options: dict[str, Any] = {
            "quantity": self._quantity.value.strip() or None,
            "method": None if self._method.value == _OWN else self._method.value,
            "parameter": self._parameter.value.strip() or None,
            "lowpass": read_positive(cutoff, "frequency", "Low pass") if cutoff else None,
            "aim": _AIMS[self._aim.value],
            "count": int(self._count.value),
        }

        def compute(progress: Progress) -> CorrectedGrid:
            progress("reading", 0.0)
            return correct(grid, campaign, **options, progress=progress)

        def done(found: CorrectedGrid) -> None:
            settings = dict(zip(("sim", "campaign"), names, strict=True)) | options
            found.data.attrs |= {
                "title": f"{found.column} of {names[0]}, corrected with {names[1]}",
                "provenance": json.dumps(provenance({key: value and str(value) for key, value in settings.items()})),
            }
            self._take(found, options["aim"])

        self._desk.work.begin("correcting", compute, done, cancelled="the correction was cancelled.")

    def _take(self, found: CorrectedGrid, aim: str) -> None:
        data = found.data
        texts = [table.texts() for table in tables(data, aim)]
        words = spelled(texts, "studio-correction", lines(data, found.observed))
        with self._drawing:
            self._found, self._figures = data, _figures(data, aim)
            self._shown.options = list(self._figures)
            self._words.content = "".join(map(note, (_MARKS, *read_lines(found.observed)))) + words
            self._plot.folder.visible = self._saving.visible = True
        self._desk.tell(f"corrected: {data.attrs['title']}", False)
        self._draw()

    def _draw(self) -> None:
        with self._drawing:
            if self._shown.value in self._figures:
                self._plot.show(self._figures[self._shown.value], 1.0)

    def _save(self) -> None:
        with self._drawing:
            found = self._found
        if found is not None:
            path = self._desk.folder.target(self._name.value, ".nc")
            save_dataset(found, path)
            self._tell_saved(path)


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
