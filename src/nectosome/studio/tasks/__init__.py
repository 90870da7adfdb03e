"""What a robot is worked on with in the studio: one tab for each task, in the panel on the left."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Protocol

from .control import Control
from .correct import Correct
from .design import Design
from .identify import Identify
from .map import Map
from .scorecard import Scorecard

if TYPE_CHECKING:
    from nectosome.studio.session import Session


class StudioTask(Protocol):
    """A tab, laid out where it is made, which is within the tab's context."""

    def renew(self) -> None:
        """Begin anew for `session.description`, another robot, and `session.problem`."""
        ...


# by the tab's name
TASKS: dict[str, Callable[["Session"], StudioTask]] = {
    "Design": Design,
    "Map": Map,
    "Identify": Identify,
    "Correct": Correct,
    "Control": Control,
    "Scorecard": Scorecard,
}
