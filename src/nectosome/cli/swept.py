"""A grid of a robot for a command: its axes are read, its progress told, what is done kept until all is through."""

import time as clock
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from nectosome.cli.output import tell
from nectosome.cli.progress import cancellable, progress_bar
from nectosome.io import InputError

if TYPE_CHECKING:
    import xarray as xr


def swept(
    robot: str, over: Sequence[str], settings: Sequence[str], *, samples: int = 257, folder: Path | None = None
) -> "tuple[xr.Dataset, dict[str, str]] | None":
    """What the robot's motion gives on the grid of the texts `over`, and the dimension of each axis; None if cancelled.

    Finished parts are kept in `folder`, where it goes on; `forget` removes them. Raises InputError.
    """
    from nectosome import robots
    from nectosome.design.grid import COUNT, read_axis
    from nectosome.design.sweep import sweep

    named = dict.fromkeys(text.partition("=")[0].strip() for text in over)
    if len(named) < len(over):
        raise InputError("names a quantity twice.", field="--over")
    counts = [text for text in over if text.partition("=")[0].strip() == COUNT]
    first = [f"{COUNT}={int(n)}" for text in counts for n in read_axis(text, None).values[:1]]
    description = robots.describe(robot, [*settings, *first])
    axes = [read_axis(text, description) for text in over]

    start = clock.perf_counter()
    with progress_bar(f"sweep of {robot}") as update:

        def work(going_on: Callable[[], bool]) -> "xr.Dataset":
            def progress(share: float) -> bool:
                update("", share)
                return going_on()

            values = {axis.name: axis.values for axis in axes}
            return sweep(robot, values, settings, samples=samples, folder=folder, progress=progress)

        found = cancellable(work)
    found.attrs["seconds"] = round(clock.perf_counter() - start, 3)
    if (found["status"] == "CANCELLED").any():
        tell("cancelled." + (f" The parts done are in {folder}; the same command goes on." if folder else ""))
        return None
    return found, {axis.name: axis.dimension for axis in axes}
