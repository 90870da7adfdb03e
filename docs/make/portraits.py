"""Pictures of the gallery's robots, and the swimmer that moves in the README, from the runs of `make reproduce`."""

from pathlib import Path

import numpy as np
from PIL import Image
from xarray import Dataset

from nectosome.io import load_dataset
from nectosome.view import write_still
from nectosome.view.drawing import Scene
from nectosome_studies.gallery.entries import ENTRIES

ROOT = Path(__file__).parents[2]
RUNS, IMAGES = ROOT / "out" / "gallery", ROOT / "docs" / "img"
PERIODS = 3  # along which the path of a portrait is drawn
FRAMES = 25  # a second


def viewer(seen: tuple[float, float]) -> tuple[float, float, float]:
    """Direction of an azimuth and a height over the horizon [deg]."""
    azimuth, height = np.radians(seen)
    return np.cos(height) * np.cos(azimuth), np.cos(height) * np.sin(azimuth), np.sin(height)


def portrait(run: Dataset, seen: tuple[float, float], path: Path) -> None:
    """Draw a robot at the end of its run."""
    end = float(run["time"][-1])
    last = run.sel(time=slice(end - PERIODS * run.attrs["period"], None))
    write_still(last, path, at=end, end=end, size=(1280, 720), camera=viewer(seen))


def moving(run: Dataset, seen: tuple[float, float], path: Path, periods: int, speed: float) -> None:
    """Write the last periods of a run as a moving picture that begins again, at `speed` times real time."""
    end = float(run["time"][-1])
    begin = end - periods * run.attrs["period"]
    last = run.sel(time=slice(begin, None))
    times = np.arange(begin, end, speed / FRAMES)
    scene = Scene(last, end, (720, 404), viewer(seen), "", 1)
    first, *others = [Image.fromarray(np.ascontiguousarray(frame[..., ::-1])) for frame in scene.pictures(times)]
    first.save(path, save_all=True, append_images=others, duration=1000 // FRAMES, loop=0, quality=70, method=6)


if __name__ == "__main__":
    for entry in ENTRIES:
        run = load_dataset(RUNS / f"{entry.name}.nc")
        portrait(run, entry.seen, IMAGES / f"gallery_{entry.name}.png")
        if entry.name == "turtle":
            moving(run, entry.seen, IMAGES / "turtle.webp", periods=3, speed=1.0)
