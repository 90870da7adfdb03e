"""What a task of the studio may use of the tab that it is in, and what a task is."""

from collections.abc import Callable
from pathlib import Path
from typing import Protocol

import numpy as np
import viser
import xarray as xr
from jaxtyping import Float

from nectosome.description import RobotDescription
from nectosome.designs import Problem

from .answers import Answer
from .folder import WorkFolder
from .rig_room import RigRoom
from .work import Machines, Work


class Desk(Protocol):
    """A browser tab, with one robot at a time."""

    gui: viser.GuiApi
    folder: WorkFolder
    work: Work
    machines: Machines
    rigs: RigRoom
    description: RobotDescription
    problem: Problem

    @property
    def answer(self) -> Answer | None:
        """The motion that is shown; None until there is one."""
        ...

    @property
    def sliders(self) -> list[str]:
        """Names of the quantities that have a slider."""
        ...

    @property
    def shown_time(self) -> float:
        """Time of the run that is shown [s]."""
        ...

    def tell(self, words: str, bad: bool) -> None:
        """Show a message under the numbers; it stays until the user does the next thing."""
        ...

    def notify(self, title: str, words: str) -> viser.NotificationHandle:
        """Show a notice at the edge of the page, whatever else is seen there, until it is removed."""
        ...

    def on_closed(self, leave: Callable[[], None]) -> None:
        """Call `leave` when the tab is closed; it may not wait."""
        ...

    def open(self, robot: str | Path) -> None:
        """Take a robot that ships, by name, or a file. Raises InputError where it cannot be read: nothing changes."""
        ...

    def open_run(self, path: Path) -> None:
        """Show a saved run, and take its robot. Raises InputError where the file is no run."""
        ...

    def become(self, description: RobotDescription) -> None:
        """Take other numbers of the same robot: the sliders follow, and its motion is computed."""
        ...

    def on_seen(self, tell: Callable[[Answer], None]) -> None:
        """Call `tell` with the first answer of each robot, before it is shown."""
        ...

    def go_live(self, run: xr.Dataset) -> None:
        """Show from now on what `live` shows; it continues a run of this robot."""
        ...

    def live(self, instant: xr.Dataset, path: Float[np.ndarray, "n 3"]) -> None:
        """Show the next instant of a live run (see `Stage.go_on`); nothing where the robot has changed."""
        ...

    def end_live(self, run: xr.Dataset | None, words: str) -> None:
        """Keep the live run, to play it; without one compute the robot's motion again."""
        ...


class StudioTask(Protocol):
    """A tab in the panel on the left, laid out where it is made."""

    def renew(self) -> None:
        """Begin anew for `desk.description`, another robot, and `desk.problem`."""
        ...


Tasks = dict[str, Callable[[Desk], StudioTask]]  # by the tab's name
