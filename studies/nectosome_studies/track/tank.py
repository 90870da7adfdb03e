"""PoseiDRONE in its tank before two rendered cameras, tracked by three lamps on it and eight around its workspace.

As in Giorgio-Serchi et al. 2017, section 3: x goes along the tank, z up; the cameras look through its front glass.
"""

import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from nectosome.vision.video import MarkerSheet, track_markers

from .render import Film, Lamps, Port, RenderCamera, RenderLens, RodSolid, TankScene, write_clip

# nose, port and starboard, from the centre of mass, which is what is tracked [m]
BODY = np.array([[0.12, 0.0, 0.04], [-0.08, 0.11, 0.05], [-0.08, -0.09, 0.14]])
_NAMES = ("nose", "port", "starboard")
_SIZE, _FOCAL, _SCALE = (1280, 720), 900.0, 4.3  # px; and px/cm in the middle of the tank, which they give
_COLOURS = ((255.0, 60.0, 60.0), (60.0, 255.0, 60.0), (80.0, 80.0, 255.0))
_HUES = ((340, 20), (100, 140), (220, 260))  # deg
_LAMP = (255.0, 255.0, 255.0)
_RADIUS = 0.006  # m, of a lamp
_GLASS, _THICK = -0.5, 0.012  # y of the glass's outer face, and its thickness [m]
_PLACES = {"left": (-0.85, -1.8, 0.75), "right": (0.85, -1.8, 0.65)}  # m, of the cameras
_LOOK = (0.0, 0.0, 0.3)
_CLICK = 4.0  # px, by which a person may miss a lamp

Path3 = Callable[[Float[np.ndarray, "t"]], tuple[Float[np.ndarray, "t 3"], Float[np.ndarray, "t 3"]]]


@dataclass(frozen=True)
class Filming:
    """How the tank is filmed, with its degradations."""

    rate: float = 50.0  # Hz
    scale: float = 4.3  # px/cm, in the middle of the tank
    grain: float = 2.0  # counts
    defocus: float = 0.7  # px
    shutter: float = 0.2  # of the time between frames
    veil: float = 0.05  # share of the light
    lens: float = 1.0  # 1: straight lines stay straight
    pane: bool = True
    known_pane: bool = True  # whether the sheet says where the glass is
    bar: float = 0.0  # m, diameter of a rod between the right camera and the robot
    late: float = 0.0  # s, by which the right camera is late, which the sheet says
    quality: int = 3  # of MJPEG
    lens_terms: str | None = None  # estimated with the cameras


def lamps_at() -> Float[np.ndarray, "8 3"]:
    """Places of the known lamps [m]."""
    return np.array([(x, y, z) for x in (-0.6, 0.6) for y in (-0.25, 0.3) for z in (0.05, 0.6)])


def markers_of(path: Path3) -> Callable[[Float[np.ndarray, "t"]], Float[np.ndarray, "t m 3"]]:
    """Places of the markers on a body that goes along a path."""

    def at(t: Float[np.ndarray, "t"]) -> Float[np.ndarray, "t m 3"]:
        place, angle = path(np.asarray(t, float))
        turn = Rotation.from_euler("ZYX", angle[:, ::-1]).as_matrix()
        return place[:, None] + np.einsum("tij,mj->tmi", turn, BODY)

    return at


def cameras(how: Filming) -> dict[str, RenderCamera]:
    """The two of them."""
    port = Port((0.0, _GLASS, 0.0), (0.0, 1.0, 0.0), _THICK) if how.pane else None
    share = how.scale / _SCALE
    lens = RenderLens(share * _FOCAL, how.lens)
    size = tuple(2 * round(share * n / 2) for n in _SIZE)
    return {name: RenderCamera((size[0], size[1]), lens, place, _LOOK, port=port) for name, place in _PLACES.items()}


def film(folder: Path, path: Path3, how: Filming, seconds: float, tell: Callable[[float], None]) -> list[Path]:
    """Render the videos, in the order of the sheet's cameras."""
    count = round(seconds * how.rate)
    out = []
    for n, (name, camera) in enumerate(cameras(how).items()):
        sensor = Film(how.rate, how.shutter, 4, how.defocus, how.veil, grain=how.grain, seed=n)
        rod = RodSolid((0.15, -0.3, 0.0), (0.15, -0.3, 1.0), 0.5 * how.bar) if how.bar and name == "right" else None
        own = Lamps(_RADIUS, _COLOURS)
        of = TankScene(camera, sensor, markers_of(path), own, lamps_at(), Lamps(_RADIUS, [_LAMP]), bar=rod, parts=4)
        later = how.late if name == "right" else 0.0

        def pictures(of: TankScene = of, later: float = later, n: int = n) -> Iterator[np.ndarray]:
            for k in range(count):
                tell((n + k / count) / 2)
                yield of.frame(k / how.rate + later)

        out.append(write_clip(folder / f"{name}.avi", pictures(), how.rate, "mjpeg", how.quality))
    return out


def sheet(how: Filming) -> MarkerSheet:
    """What a person writes: where the lamps are, about where they are seen, colours, and the tank's glass."""
    chance = np.random.default_rng(0)
    known = lamps_at()
    seen = {name: camera.sees(known) + chance.uniform(-_CLICK, _CLICK, (8, 2)) for name, camera in cameras(how).items()}
    points = {
        f"p{k}": {"at": tuple(at), "seen": {name: tuple(np.round(pixel[k])) for name, pixel in seen.items()}}
        for k, at in enumerate(known)
    }
    glass = {"point": (0.0, _GLASS, 0.0), "normal": (0.0, 1.0, 0.0), "thickness": _THICK}
    own = {"lens": how.lens_terms} if how.lens_terms else {}
    given = {
        "cameras": {"left": own, "right": {"offset": how.late, **own}},
        "points": points,
        "lamp": {"saturation": (0.0, 0.25), "value": (0.4, 1.0)},
        "markers": {
            name: {"at": tuple(at), "hue": tuple(np.deg2rad(hue)), "saturation": (0.4, 1.0), "value": (0.25, 1.0)}
            for name, at, hue in zip(_NAMES, BODY, _HUES, strict=True)
        },
    }
    return MarkerSheet.model_validate(given | ({"glass": glass} if how.pane and how.known_pane else {}))


def tracked(path: Path3, how: Filming, seconds: float, tell: Callable[[float], None]) -> xr.Dataset:
    """Film, track, and add the truth: `true_marker`, `true_position` [m] and `true_angle` [rad]."""
    with tempfile.TemporaryDirectory() as folder:
        found = track_markers(film(Path(folder), path, how, seconds, tell), sheet(how))
    time = found["time"].values
    place, angle = path(time)
    return found.assign(
        true_marker=(("time", "name", "axis"), markers_of(path)(time), {"units": "m"}),
        true_position=(("time", "axis"), place, {"units": "m"}),
        true_angle=(("time", "turn"), angle, {"units": "rad"}),
    )


def marker_errors(found: xr.Dataset) -> Float[np.ndarray, "t m"]:
    """Distances of markers from where they were [m]; nan in gaps."""
    return np.linalg.norm(found["marker"].values - found["true_marker"].values, axis=2)
