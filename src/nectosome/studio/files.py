"""The tab with files: open robots and runs of the working folder, or sent ones, and save what is there."""

from collections.abc import Callable
from concurrent.futures import CancelledError
from functools import partial
from pathlib import Path
from typing import Any

import imageio.v3 as imageio
import xarray as xr

from nectosome.description import dump_robot, save_robot
from nectosome.io import save_dataset
from nectosome.io.atomic import write_atomic
from nectosome.io.extras import package
from nectosome.robots.shipped import file_names
from nectosome.units import InputError
from nectosome.view.display.offline import page_of
from nectosome.view.display.playback import repeated
from nectosome.view.film import write_film, write_still

from .answers import Answer
from .desk import Desk
from .folder import NOTHING
from .uploads import received
from .viewer import Viewer
from .work import Progress, errors_shown

_ROBOTS, _RUNS = (".yaml", ".yml"), (".nc",)
_PICTURE = (1280, 720)  # px, of what is drawn anew
_HEIGHT = 1080  # px, of what is as wide as the page shows it


class Files:
    """Lays out the tab. Errors are shown on the page."""

    def __init__(self, desk: Desk, viewer: Viewer):
        self._desk, self._viewer, self._folder, gui = desk, viewer, desk.folder, desk.gui
        with gui.add_folder("Open"):
            self._robots: Any = gui.add_dropdown("Robot", ("",))
            gui.add_button("Open robot").on_click(lambda _: self._run(self._open_robot))
            self._runs: Any = gui.add_dropdown("Run", ("",))
            gui.add_button("Open run").on_click(lambda _: self._run(self._open_run))
            gui.add_button("Look again").on_click(lambda _: self.renew())
            sent = gui.add_upload_button("Send a robot (.yaml) or a run (.nc)")
            sent.on_upload(lambda _: self._run(lambda: self._take(sent.value.name, sent.value.content)))
        with gui.add_folder("Save"):
            self._length = gui.add_number("Video (s)", 5.0, min=0.5, max=60.0, step=0.5)
            self._name = gui.add_text("Name", "robot")
            for label, suffix, save in (
                ("Save robot (.yaml)", ".yaml", self._save_robot),
                ("Save run (.nc)", ".nc", self._save_run),
                ("Save picture (.png)", ".png", self._save_picture),
                ("Save picture (.svg)", ".svg", self._save_drawing),
                ("Save video (.mp4)", ".mp4", self._save_video),
                ("Save page that plays (.html)", ".html", self._save_page),
            ):
                work = partial(self._save, suffix, save)
                gui.add_button(label).on_click(lambda _, work=work: self._run(work))
        self.renew()

    def renew(self) -> None:
        """List the files that can be opened."""
        own = [name for name in self._folder.names(*_ROBOTS) if not name.endswith(".design.yaml")]
        self._robots.options = [*file_names(), *own]
        self._runs.options = self._folder.choices(*_RUNS)

    def _run(self, work: Callable[[], str | None]) -> None:
        with errors_shown(self._desk.tell):
            words = work()
            if words:
                self._desk.tell(words, bad=False)

    def _open_robot(self) -> None:
        name = self._robots.value
        self._desk.open(name if name in file_names() else self._folder.existing(name))

    def _open_run(self) -> None:
        if self._runs.value != NOTHING:
            self._desk.open_run(self._folder.existing(self._runs.value))

    def _take(self, name: str, data: bytes) -> None:
        with received(name, data) as path:
            if path.suffix in _RUNS:
                self._desk.open_run(path)
            elif path.suffix in _ROBOTS:
                self._desk.open(path)
            else:
                raise InputError("is neither a robot (.yaml) nor a run (.nc).", field=path.name)

    def _save(self, suffix: str, save: Callable[[Path], str | None]) -> str:
        """Save by the name on the page. Where `save` gives no words, the name of the file is shown."""
        path = self._folder.target(self._name.value, suffix)
        words = save(path)
        return self._saved(path) if words is None else words

    def _save_robot(self, path: Path) -> None:
        save_robot(self._desk.description, path)

    def _save_run(self, path: Path) -> None:
        save_dataset(_with_robot(self._shown()), path)

    def _save_picture(self, path: Path) -> None:
        write_atomic(path, imageio.imwrite("<bytes>", self._viewer.picture(_HEIGHT), extension=".png"))

    def _save_drawing(self, path: Path) -> None:
        """What is shown, from the same direction, without arrows and colours."""
        run = _with_robot(self._shown())
        end = float(run["time"].values[-1])
        write_still(run, path, at=self._desk.shown_time, end=end, size=_PICTURE, camera=self._viewer.direction)

    def _save_page(self, path: Path) -> None:
        answer = self._shown()
        write_atomic(path, page_of(answer.run, answer.robot, answer.period, self._viewer.look).encode())

    def _save_video(self, path: Path) -> str:
        """A periodic motion for the given time; of a run at most all of it."""
        answer, seconds, viewer = self._shown(), float(self._length.value), self._viewer.direction
        if answer.run.sizes["time"] < 2:
            raise InputError("it does not move: save a picture.")
        for package_name in ("cv2", "av"):
            package(package_name, "video")

        def compute(progress: Progress) -> None:
            run = _with_robot(answer)
            if answer.period:
                run = repeated(run, answer.period, seconds)
            start, end = (float(run["time"].values[k]) for k in (0, -1))

            def drawn(share: float) -> None:
                if not progress("drawing", share):
                    raise CancelledError

            write_film(run, path, end=min(end, start + seconds), size=_PICTURE, camera=viewer, progress=drawn)

        def done(_: None) -> None:
            self._desk.tell(self._saved(path), False)

        self._desk.work.begin("video", compute, done, cancelled="the video was cancelled.")
        return ""

    def _shown(self) -> Answer:
        answer = self._desk.answer
        if answer is None:
            raise InputError("there is no motion to save yet. One under a controller is kept when that is stopped.")
        return answer

    def _saved(self, path: Path) -> str:
        self.renew()
        return f"saved {self._folder.name(path)}"


def _with_robot(answer: Answer) -> xr.Dataset:
    """Run of an answer that carries its robot."""
    return answer.run.assign_attrs(robot=dump_robot(answer.robot))
