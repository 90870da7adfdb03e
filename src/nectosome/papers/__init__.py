"""One study per published robot: it runs the experiment and scores it against what the paper prints."""

from collections.abc import Callable

from .flagellum import study as flagellum
from .measure import study as measure
from .paddle import study as paddle
from .study import Progress, Study

__all__ = ["STUDIES", "Progress", "Study"]

STUDIES: dict[str, Callable[[bool, Progress], Study]] = {
    "flagellum": flagellum.run,
    "paddle": paddle.run,
    "measure": measure.run,
}
