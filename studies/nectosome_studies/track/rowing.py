"""FP3JP rows before a rendered camera, and the tracker gets its joint angles back (Fig. 4 of Hu et al. 2024).

The motion is the cycle of the simulated paddle at 0.6 Hz and 75 deg. The tracker gets what a person sees: the colours
of the layers and the length of the arm; the truth is used only for the errors.
"""

import tempfile
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr
from jaxtyping import Float
from scipy.interpolate import CubicSpline

from nectosome.vision.video import SegmentSheet, track_segments

from .render import (
    Bubbles,
    Film,
    Floor,
    Occluder,
    Paddle,
    PaddleScene,
    Port,
    RenderCamera,
    RenderLens,
    Strip,
    write_clip,
)

PARTS = ("arm", "segment1", "segment2", "segment3")
RATE = 60.0  # Hz, of the camera
_JOINT = 0.003  # m: a layer ends so far from its hinge
_THICK = 0.006  # m, of the layers from above
_BLUE, _RED, _GREEN, _YELLOW = (45.0, 75.0, 200.0), (200.0, 45.0, 40.0), (40.0, 170.0, 60.0), (220.0, 200.0, 40.0)
_HUES = {"arm": (205, 245), "segment1": (345, 15), "segment2": (110, 150), "segment3": (40, 65)}  # deg
_ABOVE, _DEPTH, _FLOOR = 1.2, 0.25, -0.35  # m: camera over the surface, paddle and floor below it


@dataclass(frozen=True)
class RowingMotion:
    """Where the middle and the direction of each layer are over a cycle, and how long the layers are."""

    period: float  # [s]
    lengths: Float[np.ndarray, "parts"]  # [m], from hinge to hinge
    splines: CubicSpline  # middle x, y [m] and direction [rad] of each part

    @classmethod
    def of(cls, cycle: xr.Dataset, lengths: dict[str, float]) -> "RowingMotion":
        """Motion of a cycle that is as long as its first and last sample are apart."""
        rows = []
        for part in PARTS:
            first = int(np.flatnonzero(cycle["station_part"].values == part)[0])  # the middle of the link
            place, turn = cycle["position"].values[:, first], cycle["rotation"].values[:, first]
            rows += [place[:, 0], place[:, 1], np.unwrap(np.arctan2(turn[:, 1, 0], turn[:, 0, 0]))]
        values = np.array(rows).T
        values[-1] = values[0]
        time = cycle["time"].values
        splines = CubicSpline(time, values, bc_type="periodic")
        return cls(float(time[-1]), np.array([lengths[part] for part in PARTS]), splines)

    def at(self, t: Float[np.ndarray, "t"]) -> Float[np.ndarray, "t parts 3"]:
        """Middle x, y [m] and direction [rad] of each layer."""
        return self.splines(np.mod(t, self.period)).reshape(len(t), len(PARTS), 3)

    def ends(self, t: Float[np.ndarray, "t"]) -> Float[np.ndarray, "t parts 2 2"]:
        """Start and end of each layer [m]."""
        now = self.at(t)
        half = (0.5 * self.lengths - _JOINT)[:, None] * np.stack([np.cos(now[..., 2]), np.sin(now[..., 2])], axis=-1)
        return np.stack([now[..., :2] - half, now[..., :2] + half], axis=2)


@dataclass(frozen=True)
class Shot:
    """How it is filmed: the camera, the water and the file, with their degradations."""

    scale: float = 500.0  # px/m in the plane of the paddle
    grain: float = 2.0  # counts
    defocus: float = 0.6  # px
    shutter: float = 0.25  # of the time between frames
    gain: float = 1.0
    lens: float = 1.0  # 1: straight lines stay straight, 0: equidistant
    surface: bool = True  # the camera is in the air above the water
    bar: float = 0.0  # m, wide, over the path of the paddle
    bubbles: int = 0
    quality: int | None = None  # of H.264; None: nothing is lost
    fit: str = "moments"


def camera(shot: Shot) -> RenderCamera:
    """A camera that looks straight down on the paddle."""
    side = 2 * round(0.32 * shot.scale)
    sight = _ABOVE + _DEPTH / 1.333 if shot.surface else _ABOVE + _DEPTH
    port = Port((0.0, 0.0, _DEPTH), (0.0, 0.0, 1.0)) if shot.surface else None
    lens = RenderLens(shot.scale * sight, shot.lens)
    return RenderCamera((side, side), lens, (0.0, 0.0, _DEPTH + _ABOVE), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), port)


def scene(motion: RowingMotion, shot: Shot) -> PaddleScene:
    """The paddle and what is over it, before the camera."""
    film = Film(RATE, shot.shutter, 4, shot.defocus, gain=shot.gain, grain=shot.grain)
    paddle = Paddle((_BLUE, _RED, _GREEN, _YELLOW), _THICK, horn=(-0.02, 0.0))
    bar = Occluder(Strip((0.1, -0.3), (0.2, 0.3), shot.bar, (60.0, 60.0, 62.0))) if shot.bar else None
    bubbles = Bubbles(shot.bubbles) if shot.bubbles else None
    return PaddleScene(camera(shot), film, motion.ends, paddle, Floor(_FLOOR), 0.0, bar, bubbles)


def sheet(shot: Shot) -> SegmentSheet:
    """What a person writes: colours, and four points of a board in the plane of the paddle."""
    reach = 0.2
    corners = np.array([(x, y, 0.0) for x in (-reach, reach) for y in (-reach, reach)])
    seen = np.round(camera(shot).sees(corners), 1)  # read off the picture to a tenth of a pixel
    points = [{"at": tuple(at[:2]), "seen": tuple(pixel)} for at, pixel in zip(corners, seen, strict=True)]
    colour = {"saturation": (0.45, 1.0), "value": (0.15, 1.0)}
    segments = {name: {"hue": tuple(np.deg2rad(hue)), **colour} for name, hue in _HUES.items()}
    return SegmentSheet.model_validate({"points": points, "segments": segments, "fit": shot.fit, "smallest": 12})


def tracked(motion: RowingMotion, shot: Shot, frames: int, tell: Callable[[float], None], every: int = 1) -> xr.Dataset:
    """Film every so many frames, track, and add the truth: `true_direction` [rad] and `true_position` [m]."""
    of = scene(motion, shot)

    def pictures() -> Iterator[np.ndarray]:
        for k in range(frames):
            tell(k / frames)
            yield of.frame(k * every / RATE)

    name, codec = ("rowing.mkv", "ffv1") if shot.quality is None else ("rowing.mp4", "libx264")
    with tempfile.TemporaryDirectory() as folder:
        path = write_clip(Path(folder) / name, pictures(), RATE / every, codec, shot.quality)
        found = track_segments(path, sheet(shot))
    # the file keeps milliseconds; frames are numbered
    truth = motion.at(np.round(found["time"].values * RATE) / RATE)
    return found.assign(
        true_direction=(("time", "segment"), truth[..., 2], {"units": "rad"}),
        true_position=(("time", "segment", "axis"), truth[..., :2], {"units": "m"}),
    )


def errors(found: xr.Dataset) -> tuple[Float[np.ndarray, "t s"], Float[np.ndarray, "t s"]]:
    """Errors of directions [rad] and of middles [m]; nan in gaps."""
    turn = found["direction"].values - found["true_direction"].values
    off = np.linalg.norm(found["position"].values - found["true_position"].values, axis=2)
    return (turn + np.pi) % (2 * np.pi) - np.pi, off


def by_phase(found: xr.Dataset, motion: RowingMotion) -> xr.Dataset:
    """Joint angles of all cycles together, as in Fig. 4: `angle`, `scatter`, `simulated` [rad] (`joint`, `phase`).

    A period is a whole number of frames, so that each phase has a frame in every cycle; gaps are left out.
    """
    frames = round(motion.period * RATE)
    count = found.sizes["time"] // frames
    measured = found["joint_angle"].values[: count * frames].reshape(count, frames, -1)
    true = np.diff(found["true_direction"].values[:frames], axis=1)
    simulated = (true + np.pi) % (2 * np.pi) - np.pi
    measured = simulated + (measured - simulated + np.pi) % (2 * np.pi) - np.pi
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # a phase that no cycle shows stays nan
        mean, scatter = np.nanmean(measured, axis=0), np.nanstd(measured, axis=0)
    over = ("phase", "joint")
    return xr.Dataset(
        {
            name: (over, values, {"units": "rad"})
            for name, values in (("angle", mean), ("scatter", scatter), ("simulated", simulated))
        },
        coords={"phase": np.arange(frames) / frames, "joint": found["joint"]},
        attrs={"cycles": count, "period": motion.period},
    )
