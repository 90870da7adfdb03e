"""`nectosome sweep`: what a robot's motion gives on a grid of its quantities."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter
from rich.console import Group
from rich.text import Text

from nectosome.cli.options import read_count
from nectosome.cli.output import check_target, write
from nectosome.cli.page import columns, number, page
from nectosome.cli.swept import swept
from nectosome.io import InputError, save_dataset, show_quantity
from nectosome.io.errors import count
from nectosome.io.paths import shortest

if TYPE_CHECKING:
    import xarray as xr


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
        from nectosome.design.sweep import forget

        save_dataset(found, save)
        forget(folder)
    if plot is not None:
        from nectosome.view import show_sweep

        show_sweep(found, plot)
    return 0


def _page(found: "xr.Dataset", dimensions: dict[str, str]) -> Group:
    """Where each quantity is lowest and highest, and how many points were solved how."""
    from nectosome.design.means import telling

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
