"""One study per published robot or swimmer, those of measuring, each scored against what is printed; the gallery."""

from collections.abc import Callable

from .catshark import study as catshark
from .eel import study as eel
from .fishtail import study as fishtail
from .flagellum import study as flagellum
from .gallery import study as gallery
from .measure import study as measure
from .paddle import study as paddle
from .poseidrone import study as poseidrone
from .rexeel import study as rexeel
from .softlimb import study as softlimb
from .study import Progress, Study
from .track import study as track
from .vortex import study as vortex

__all__ = ["STUDIES", "Progress", "Study"]

STUDIES: dict[str, Callable[[bool, Progress], Study]] = {  # real measurements first
    "rexeel": rexeel.run,
    "softlimb": softlimb.run,
    "measure": measure.run,
    "catshark": catshark.run,
    "eel": eel.run,
    "vortex": vortex.run,
    "flagellum": flagellum.run,
    "paddle": paddle.run,
    "poseidrone": poseidrone.run,
    "fishtail": fishtail.run,
    "track": track.run,
    "gallery": gallery.run,
}
