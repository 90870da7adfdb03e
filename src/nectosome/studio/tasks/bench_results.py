"""The tab with what was measured: recordings, means by conditions and tracks of videos, as the commands saved them."""

from pathlib import Path
from typing import Any

from nectosome.io import load_dataset
from nectosome.studio.desk import Desk
from nectosome.studio.folder import NOTHING
from nectosome.studio.uploads import received
from nectosome.units import shorten
from nectosome.view.saved_recordings import SavedRecording, saved_recording

from .left_panel import PanelTask, Plot, note, spelled, with_legend

_ROW = 0.28  # height of a plot, as a share of its width
_ROOM = 0.25  # around all


class BenchResults(PanelTask):
    """Lays out the tab."""

    def __init__(self, desk: Desk):
        super().__init__(desk)
        gui = desk.gui
        self._found: SavedRecording | None = None
        hint = "As nectosome measure --save or nectosome track --save wrote it, also with --means."
        self._file: Any = gui.add_dropdown("File", (NOTHING,), hint=hint)
        self._add_button("Open", self._open)
        gui.add_button("Look again").on_click(lambda _: self.renew())
        sent = gui.add_upload_button("Send a recording or a track (.nc)")
        sent.on_upload(lambda _: self._try(lambda: self._send(sent.value.name, sent.value.content)))
        self._title = gui.add_html("")
        self._plot = Plot(gui)
        with self._plot.folder:
            self._shown: Any = gui.add_dropdown("Show", (NOTHING,))
            self._shown.on_update(self._chosen)
        self._words = gui.add_html("")

    def renew(self) -> None:
        """Look which files there are; what is shown stays, as it is of no robot."""
        self._file.options = self._desk.folder.choices(".nc")

    def _chosen(self, event: Any) -> None:
        if event.client is not None:  # not by us, who draw once all is set
            self._try(self._draw)

    def _open(self) -> None:
        name = self._file.value
        if name != NOTHING:
            self._take(self._desk.folder.existing(name), name)

    def _send(self, name: str, data: bytes) -> None:
        with received(name, data) as path:
            self._take(path, path.name)

    def _take(self, path: Path, name: str) -> None:
        data = load_dataset(path)
        found = saved_recording(data, name)
        said = found.summary
        lines = [*map(str.strip, said.above), *said.notes, *(f"beware: {x}" for x in (*said.warnings, *said.cautions))]
        with self._drawing:
            self._found = found
            self._title.content = note(f"{shorten(name)}: {data.attrs['title']}")
            self._shown.options = tuple(found.panels)
            self._shown.visible, self._plot.folder.visible = len(found.panels) > 1, True
            self._words.content = spelled([table.texts() for table in said.tables], "studio-measured", lines)
        self._desk.tell(f"opened {shorten(name)}", False)
        self._draw()

    def _draw(self) -> None:
        with self._drawing:
            if self._found is None or self._shown.value not in self._found.panels:
                return
            figure: Any = self._found.panels[self._shown.value].figure
            rows = sum(1 for key in figure.layout if key.startswith("yaxis"))
            named = figure.layout.showlegend  # of a recording each plot has its name beside it
            self._plot.show(with_legend(figure).update_layout(showlegend=named), max(rows, 2) * _ROW + _ROOM)
