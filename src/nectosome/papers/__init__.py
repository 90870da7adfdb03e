"""One study per published robot, those of measuring, each scored against what papers print, and the gallery."""

from collections.abc import Callable

from .fishtail import study as fishtail
from .flagellum import study as flagellum
from .gallery import study as gallery
from .measure import study as measure
from .paddle import study as paddle
from .poseidrone import study as poseidrone
from .study import Progress, Study
from .track import study as track

__all__ = ["STUDIES", "Progress", "Study"]

STUDIES: dict[str, Callable[[bool, Progress], Study]] = {
    "flagellum": flagellum.run,
    "paddle": paddle.run,
    "poseidrone": poseidrone.run,
    "fishtail": fishtail.run,
    "measure": measure.run,
    "track": track.run,
    "gallery": gallery.run,
}
