"""How bad a picture may be: each kind of degradation alone, made worse until the tracker breaks."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from nectosome.units import InputError

from . import rowing, tank
from .rowing import RowingMotion, Shot
from .tank import Filming, Path3

ANGLE, PLACE = np.deg2rad(0.5), 1e-3  # rad, m: rms that is required
SEEN = 0.5  # share of frames that must be seen
_FRAMES = 20  # of a paddle, five from frame to frame
_SECONDS = 0.4  # of the tank


class Degradation(NamedTuple):
    """A degradation: its name and unit, the setting that it changes, and levels, each worse than the one before."""

    name: str
    unit: str
    setting: str
    levels: Sequence[Any]


PADDLE = (
    Degradation("resolution", "px/cm", "scale", (1000.0, 700.0, 500.0, 350.0, 250.0, 180.0, 120.0)),
    Degradation("noise", "counts", "grain", (0.0, 2.0, 5.0, 10.0, 15.0, 20.0, 30.0, 45.0)),
    Degradation("defocus", "px", "defocus", (0.3, 0.6, 1.0, 1.5, 2.0, 3.0, 4.0)),
    Degradation("light", "share", "gain", (1.0, 0.5, 0.3, 0.2, 0.1, 0.05)),
    Degradation("shutter", "share of 1/60 s", "shutter", (0.0, 0.25, 0.5, 0.75, 1.0)),
    Degradation("compression", "H.264 crf", "quality", (4, 8, 12, 16, 20, 26)),
    Degradation("lens", "spread, 1: straight", "lens", (1.0, 0.9, 0.7, 0.5, 0.0)),
    Degradation("bar", "mm", "bar", (0.0, 0.005, 0.01, 0.02, 0.04, 0.08)),
    Degradation("bubbles", "", "bubbles", (0, 10, 30, 60, 120, 240)),
)
TANK = (
    Degradation("resolution", "px/cm", "scale", (4.3, 3.0, 2.2, 1.5, 1.0)),
    Degradation("noise", "counts", "grain", (0.0, 2.0, 5.0, 10.0, 20.0, 35.0)),
    Degradation("defocus", "px", "defocus", (0.4, 0.7, 1.2, 2.0, 3.0, 4.5)),
    Degradation("compression", "MJPEG quantiser", "quality", (2, 5, 10, 20, 31)),
    Degradation("lens, not told", "spread, 1: straight", "lens", (1.0, 0.97, 0.93, 0.85, 0.7)),
    Degradation("lens, k1 estimated", "spread, 1: straight", "lens", (1.0, 0.97, 0.93, 0.85, 0.7, 0.5)),
    Degradation("glass, not told", "", "known_pane", (True, False)),
    Degradation("rod", "mm", "bar", (0.0, 0.01, 0.03, 0.06, 0.12)),
    Degradation("offset of cameras", "s", "late", (0.0, 0.005, 0.01)),
)


def limits(motion: RowingMotion, path: Path3, tell: Callable[[float], None]) -> dict[str, xr.Dataset]:
    """`limits_paddle` and `limits_tank`: `rms` [rad, or m], `seen` and `level` (kind, step), and the `broken` step."""
    several = len(PADDLE) + len(TANK)
    made: dict[str, xr.Dataset] = {}
    for name, kinds, errors, limit, done in (
        ("limits_paddle", PADDLE, lambda kind, level: _paddle(motion, kind, level), ANGLE, 0),
        ("limits_tank", TANK, lambda kind, level: _tank(path, kind, level), PLACE, len(PADDLE)),
    ):
        rows = []
        for n, kind in enumerate(kinds):
            tell((done + n) / several)
            rows.append([_rms_and_seen(errors, kind, level) for level in kind.levels])
        made[name] = _table(kinds, rows, limit)
    return made


def _paddle(motion: RowingMotion, kind: Degradation, level: Any) -> np.ndarray:
    """Errors of the segments' directions [rad]."""
    change: dict[str, Any] = {kind.setting: level}
    found = rowing.tracked(motion, replace(Shot(), **change), _FRAMES, lambda share: None, every=5)
    return rowing.errors(found)[0]


def _tank(path: Path3, kind: Degradation, level: Any) -> np.ndarray:
    """Distances of the markers from where they were [m]."""
    change: dict[str, Any] = {kind.setting: level} | ({"lens_terms": "k1"} if "estimated" in kind.name else {})
    return tank.marker_errors(tank.tracked(path, replace(Filming(), **change), _SECONDS, lambda share: None))


def _rms_and_seen(
    errors: Callable[[Degradation, Any], np.ndarray], kind: Degradation, level: Any
) -> tuple[float, float]:
    """Rms of the errors, and the share that was seen: none where the tracker refuses the video."""
    try:
        off = errors(kind, level)
    except InputError:  # such as a calibration that is refused
        return np.nan, 0.0
    known = off[np.isfinite(off)]
    return float(np.sqrt(np.mean(known**2))) if known.size else np.nan, float(np.mean(np.isfinite(off)))


def _table(kinds: Sequence[Degradation], rows: list[list[tuple[float, float]]], limit: float) -> xr.Dataset:
    longest = max(map(len, rows))
    rms, seen, level = (np.full((len(kinds), longest), np.nan) for _ in range(3))
    broken = np.full(len(kinds), -1)
    for k, (kind, row) in enumerate(zip(kinds, rows, strict=True)):
        for n, (one, share) in enumerate(row):
            rms[k, n], seen[k, n], level[k, n] = one, share, float(kind.levels[n])
            if broken[k] < 0 and not (one <= limit and share >= SEEN):
                broken[k] = n
    return xr.Dataset(
        {
            "rms": (("kind", "step"), rms),
            "seen": (("kind", "step"), seen),
            "level": (("kind", "step"), level),
            "broken": ("kind", broken),
        },
        coords={"kind": [kind.name for kind in kinds], "unit": ("kind", [kind.unit for kind in kinds])},
        attrs={"limit": limit},
    )
