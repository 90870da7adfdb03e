"""Files of a scene: a video of a run, or one picture of it."""

from collections.abc import Callable, Iterator
from fractions import Fraction
from pathlib import Path

import numpy as np
import xarray as xr

from nectosome.io.atomic import write_atomic
from nectosome.io.extras import package
from nectosome.vision.video.clip import write_video

from .canvas import Picture
from .drawing import Scene


def write_film(
    run: xr.Dataset,
    path: str | Path,
    *,
    end: float,
    size: tuple[int, int],
    camera: str | tuple[float, float, float],
    rate: int = 30,
    speed: float = 1.0,
    progress: Callable[[float], None] = lambda share: None,
) -> int:
    """Write a video (.mp4) of a run until `end` [s], `rate` frames a second, at `speed` times real time.

    `size` [px] is even. `progress` gets the share of frames done; an exception in it ends the film, and no file stays.
    Returns how many frames they are. Raises InputError where nothing is to be seen or nothing can be written.
    """
    start = float(run["time"].values[0])
    count = max(round((end - start) * rate / speed), 1)
    decimals = max(2, int(np.ceil(np.log10(rate / speed))))  # so that no two frames tell the same time
    note = "" if speed == 1 else f"{speed:g} x real time"
    scene = Scene(run, end, size, camera, note, decimals)
    times = np.minimum(start + np.arange(count) * speed / rate, end)

    def frames() -> Iterator[tuple[float, Picture]]:
        for k, picture in enumerate(scene.pictures(times)):
            progress(k / count)
            yield k / rate, picture

    write_atomic(path, lambda beside: write_video(beside, frames(), Fraction(rate)))
    return count


def write_still(
    run: xr.Dataset,
    path: str | Path,
    *,
    at: float,
    end: float,
    size: tuple[int, int],
    camera: str | tuple[float, float, float],
) -> None:
    """Write the picture that a video of a run until `end` has `at` a time [s], as .svg if it is called so, else PNG.

    Raises InputError as the video does.
    """
    scene = Scene(run, end, size, camera, decimals=3)
    if Path(path).suffix == ".svg":
        write_atomic(path, scene.svg(at).encode())
        return
    (picture,) = scene.pictures(np.array([at]))
    _, data = package("cv2", "video").imencode(".png", picture)
    write_atomic(path, data.tobytes())
