"""`nectosome sweep`: what a robot's motion gives on a grid of its quantities."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter
from rich.console import Group
from rich.text import Text

from nectosome.cli.options import read_count
from nectosome.cli.output import check_target, write
from nectosome.cli.page import columns, number, page
from nectosome.description.paths import shortest
from nectosome.io import save_dataset
from nectosome.units import InputError, count, show_quantity

if TYPE_CHECKING:
    import xarray as xr

import time as clock
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from nectosome.cli.output import tell
from nectosome.cli.progress import cancellable, progress_bar

if TYPE_CHECKING:
    import xarray as xr


def swept(
    robot: str, over: Sequence[str], settings: Sequence[str], *, samples: int = 257, folder: Path | None = None
) -> "tuple[xr.Dataset, dict[str, str]] | None":
    """What the robot's motion gives on the grid of the texts `over`, and the dimension of each axis; None if cancelled.

    Finished parts are kept in `folder`, where it goes on; `forget` removes them. Raises InputError.
    """
    from nectosome import robots
    from nectosome.designs.axes import COUNT, read_axis
    from nectosome.designs.sweep import sweep

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


def sweep(
    robot: Annotated[str, Parameter(help="Name of a robot that ships, or a robot file.")],
    /,
    *,
    over: Annotated[
        list[str], Parameter(help="NAME=from:to:step or NAME=values, such as A=30:75:5deg or N=1,2,3; may be repeated.")
    ],
    settings: Annotated[
        list[str] | None, Parameter("--set", help="PATH=VALUE, such as E=3MPa; may be repeated.")
    ] = None,
    samples: Annotated[
        str, Parameter(help="How many moments of a cycle its means are taken of.", allow_leading_hyphen=True)
    ] = "257",
    save: Annotated[Path | None, Parameter(help="Write all numbers to this netCDF file (.nc).")] = None,
    plot: Annotated[Path | None, Parameter(help="Write a page with maps, or curves, to this file (.html).")] = None,
) -> int:
    """Find the steady or periodic motion at every point of a grid, and what it gives on the mean.

    With --save finished parts are kept beside the file until all is done, and a sweep that was stopped goes on.
    """
    moments = read_count(samples, "--samples", least=17, most=10_000)
    for target, option, suffix in ((save, "--save", ".nc"), (plot, "--plot", ".html")):
        if target is not None:
            check_target(target, option, suffix)
    if plot is not None and len(over) > 2:
        raise InputError("shows one or two quantities, not more. Save the sweep instead.", field="--plot")

    folder = None if save is None else save.with_suffix(".parts")
    computed = swept(robot, over, settings or (), samples=moments, folder=folder)
    if computed is None:
        return 130
    found, dimensions = computed
    write(_page(found, dimensions))
    if save is not None and folder is not None:
        from nectosome.designs.sweep import forget

        save_dataset(found, save)
        forget(folder)
    if plot is not None:
        from nectosome.view import show_sweep

        show_sweep(found, plot)
    return 0


def _page(found: "xr.Dataset", dimensions: dict[str, str]) -> Group:
    """Where each quantity is lowest and highest, and how many points were solved how."""
    from nectosome.designs.sweep import telling

    dims = tuple(map(str, found["status"].dims))
    table = columns("mean over a cycle", "lowest", "at", "highest", "at", "unit")
    for values in telling(found).values():
        ends = [values.isel(end(dims)) for end in (values.argmin, values.argmax)]  # type: ignore[arg-type]
        cells = [cell for end in ends for cell in (number(float(end)), _place(end, dimensions))]
        table.add_row(str(values.name).replace("_", " "), *cells, values.attrs["units"])
    words = found["status"].to_series().value_counts()
    solved = ", ".join(f"{n} {status}" for status, n in words.items())
    line = f"{count(found['status'].size, 'point')}: {solved}; {found.attrs['seconds']:.1f} s to compute"
    return page(Text(str(found.attrs["title"]), "bold"), [table], [line])


def _place(value: "xr.DataArray", dimensions: dict[str, str]) -> str:
    """Where on the axes a value is, by as much of their names as tells them apart."""
    names = shortest(dimensions)
    return ", ".join(f"{names[dim]}={show_quantity(float(value[dim]), kind)}" for dim, kind in dimensions.items())
