"""`nectosome mission`: a robot that goes through modes as time passes and things happen."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter
from rich.text import Text

from nectosome.cli.options import read_duration
from nectosome.cli.output import check_target, tell, write
from nectosome.cli.page import columns, ending, number, page
from nectosome.cli.progress import cancellable, progress_bar
from nectosome.io import InputError, save_dataset

if TYPE_CHECKING:
    import xarray as xr

_LONGEST = 0.1  # s, of a step


def mission(
    robot: Annotated[str, Parameter(help="Name of a robot that ships, or a robot file.")],
    file: Annotated[Path | None, Parameter(help="Mission file; by default the one that ships for the robot.")] = None,
    /,
    *,
    settings: Annotated[
        list[str] | None, Parameter("--set", help="PATH=VALUE, such as omega=14.4rad/s; may be repeated.")
    ] = None,
    step: Annotated[str, Parameter(help="Length of a time step.", allow_leading_hyphen=True)] = "1ms",
    save: Annotated[Path | None, Parameter(help="Write the run to this netCDF file (.nc).")] = None,
    plot: Annotated[Path | None, Parameter(help="Write a page with the run to this file (.html).")] = None,
) -> int:
    """Take a robot through the modes of a mission and tell when each of them ended."""
    seconds = read_duration(step, "--step")
    if seconds > _LONGEST:
        raise InputError(f'"{step}" is out of range: it must be at most {_LONGEST} s.', field="--step")
    for target, option, suffix in ((save, "--save", ".nc"), (plot, "--plot", ".html")):
        if target is not None:
            check_target(target, option, suffix)

    from nectosome import robots
    from nectosome.io.describe_mission import load_mission

    description = robots.describe(robot, settings or ())
    path = file or robots.mission_of(robot)
    if path is None:
        raise InputError(f"no mission ships for {robot}. Give the file of one.", field="file")
    modes = load_mission(path, description)
    with progress_bar(description.name) as update:

        def compute(going_on: Callable[[], bool]) -> Any:
            def progress(mode: str, share: float) -> bool:
                update(mode, share)
                return going_on()

            return robots.run_mission(modes, step=seconds, progress=progress)

        flown = cancellable(compute)
    asked = {"robot": robot, "mission": str(path), "set": settings or [], "step": seconds}
    found = robots.mission_data(flown, asked)
    write(_told(found))
    if save is not None:
        save_dataset(found, save)
    if plot is not None:
        from nectosome.view import show_mission

        show_mission(found, plot)
    if flown.reason:
        tell(f"{description.name}: {flown.reason}.")
        return 130 if flown.reason.startswith("cancelled") else 1
    return 0


def _told(found: "xr.Dataset") -> Any:
    """Modes and their events, and where the robot came."""
    table = columns("mode", "ended by", "at", "x", "z", "mean surge", "unit")
    began, start = 0.0, found["x"].values[0]
    passed = (found[name].values for name in ("event_mode", "event", "event_time"))
    for name, event, time in zip(*passed, strict=True):
        here = found.isel(time=int(abs(found["time"].values - time).argmin()))
        x, z = float(here["x"]), float(here["z"])
        surge = number((x - start) / (time - began)) if time > began else ""
        table.add_row(str(name), str(event), number(float(time)), number(x), number(z), surge, "s, m, m/s")
        began, start = float(time), x
    return page(Text(found.attrs["title"], "bold"), [table], [ending(found.attrs)])
