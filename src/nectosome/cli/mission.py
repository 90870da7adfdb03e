"""A robot that goes through the modes of a mission as time passes and things happen: `simulate --mission`."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.text import Text

from nectosome.cli.output import Outputs, tell, write, written
from nectosome.cli.page import columns, ending, number, page
from nectosome.cli.progress import cancellable, progress_bar
from nectosome.units import InputError

if TYPE_CHECKING:
    import xarray as xr

_LONGEST = 0.1  # s, of a step


def fly(robot: str, settings: list[str] | None, file: Path, step: float, outputs: Outputs) -> int:
    """Run the modes of a mission, print when each of them ended, and return the exit code."""
    if step > _LONGEST:
        raise InputError(f"{step:g} s is out of range: it must be at most {_LONGEST} s.", field="--step")

    from nectosome import model, robots
    from nectosome.description.mission import load_mission

    description = robots.describe(robot, settings or ())
    path = robots.mission_of(str(file)) or file
    modes = load_mission(path, description)
    with progress_bar(description.name) as update:

        def compute(going_on: Callable[[], bool]) -> Any:
            def progress(mode: str, share: float) -> bool:
                update(mode, share)
                return going_on()

            return model.run_mission(modes, step=step, progress=progress)

        flown = cancellable(compute)
    asked = {"robot": robot, "mission": str(path), "set": settings or [], "step": step}
    found = model.mission_data(flown, asked)
    write(_told(found))
    if outputs.save or outputs.plot:
        from nectosome.view import show_mission

        paths = outputs.write_data(lambda: found) + outputs.write_page(lambda path: show_mission(found, path))
        write(*written(paths))
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
