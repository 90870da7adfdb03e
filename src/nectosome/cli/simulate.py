"""`nectosome simulate`: a robot through time, or through the modes of a mission."""

import time as clock
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from nectosome import view
from nectosome.cli.options import (
    Cluster,
    Loads,
    Robot,
    Settings,
    Whole,
    build_weighed,
    command,
    robot_named,
    value,
    whole,
)
from nectosome.cli.output import Outputs, tell, unsolved, write
from nectosome.cli.progress import cancellable, progress_bar
from nectosome.cli.spread import SpreadOptions, print_intervals
from nectosome.io.summary import Summary
from nectosome.io.tables import Number, Table
from nectosome.units import InputError, read_positive, read_quantity, show_quantity

if TYPE_CHECKING:
    import xarray as xr

_MOST_SAMPLES = 100_000
_LONGEST = 0.1  # s, of a time step of a mission
_TIME, _SAMPLES, _RTOL = "2.5s", 201, "1e-4"  # where none are given
_STEP, _RTOL_OF_MISSIONS = "10ms", "1e-6"


@command
def simulate(
    robot: Robot,
    /,
    *,
    settings: Settings = None,
    time: Annotated[str | None, value(f"Length of the run, with its unit; {_TIME} by default.")] = None,
    outputs: Outputs = Outputs(),
    method: Annotated[
        Literal["auto", "implicit", "explicit"],
        Parameter(help="Implicit for soft bodies, explicit where nothing is stiff; auto chooses."),
    ] = "auto",
    samples: Annotated[
        int | None, whole(f"Number of evenly spaced times that are kept; {_SAMPLES} by default.", 2, _MOST_SAMPLES)
    ] = None,
    rtol: Annotated[
        str | None, value(f"Relative tolerance of a time step; {_RTOL} by default, {_RTOL_OF_MISSIONS} in a mission.")
    ] = None,
    mission: Annotated[
        Path | None, Parameter(help="Mission file (.yaml), or the name of a robot that ships with one.")
    ] = None,
    step: Annotated[str | None, value(f"Longest time step of a mission; {_STEP} by default.")] = None,
    loads: Loads = False,
    every_limb: Whole = False,
    spread: SpreadOptions = SpreadOptions(),
    cluster: Cluster = None,
) -> int:
    """Simulate a robot in water, for a time or through the modes of a mission, and print a summary."""
    outputs.check()
    usual = _RTOL if mission is None else _RTOL_OF_MISSIONS
    tolerance = read_quantity(usual if rtol is None else rtol, "number", "--rtol")
    if not 0 < tolerance < 1:
        raise InputError(f'"{rtol}" is out of range: it must be more than 0 and less than 1.', field="--rtol")
    if mission is not None:
        spread.check("a mission", cluster)
        for option, given in (("--time", time), ("--samples", samples)):
            if given is not None:
                raise InputError("is not for a mission, whose modes say when it ends. Leave it out.", field=option)
        longest = read_positive(_STEP if step is None else step, "time", "--step")
        if longest > _LONGEST:
            raise InputError(f"{longest:g} s is out of range: it must be at most {_LONGEST} s.", field="--step")
        steps = {"step": longest, "method": method, "rtol": tolerance}
        return _run_mission(robot, settings, mission, steps, outputs)
    if step is not None:
        raise InputError("is for a --mission; without one, --rtol sets the steps. Leave it out.", field="--step")
    seconds = read_positive(_TIME if time is None else time, "time", "--time")
    count = _SAMPLES if samples is None else samples

    spread.check(cluster=cluster, loads=loads)
    if spread.spread:
        given = {"time": seconds, "method": method, "samples": count, "rtol": tolerance, "whole": every_limb}
        return print_intervals(robot, settings, "simulate", given, spread, cluster, outputs)
    description = robot_named(robot, settings)

    import jax

    from nectosome.core import Status
    from nectosome.solve import prepare_results
    from nectosome.solve import simulate as integrate

    steps = {"method": method, "samples": count, "rtol": tolerance}
    steps |= {"whole": True} if every_limb else {}
    inputs = {"robot": robot, "set": settings or [], "time": seconds, **steps}
    start = clock.perf_counter()
    with progress_bar(description.name) as update:

        def compute(progress: Callable[[str, float], bool]) -> Any:
            built = build_weighed(description, robot)
            prepare_results(built, count)
            run = integrate(built, seconds, **steps, progress=lambda share: progress("", share))
            kept = outputs.given or int(run.status) != Status.CANCELLED
            return run, run.results(inputs) if kept else None

        run, found = cancellable(compute, update)
    beyond: list[str] = []
    status = Status(int(run.status))
    if found is not None:
        found.attributes["seconds"] = round(clock.perf_counter() - start, 3)
        page = found.summary(loads)
        beyond = [*page.warnings]
        if status != Status.CANCELLED:
            write(page)
        if outputs.given:
            outputs.write(found.to_dataset(), view.show_run)
    came_to = f"at {float(jax.device_get(run.value.time)[-1]):.4g} s of {seconds:.4g} s."
    if status == Status.CANCELLED:
        tell(f"cancelled {came_to}" + (f" The part done is in {outputs.save}." if outputs.save else ""))
        return 130
    if status not in (Status.SOLVED, Status.EVENT):
        return unsolved(description.name, status, f"{status.reason}, {came_to}")
    return 1 if beyond else 0


def _run_mission(robot: str, settings: list[str] | None, file: Path, steps: dict[str, Any], outputs: Outputs) -> int:
    """Run the modes of a mission, print when each of them ended, and return the exit code."""
    from nectosome import solve
    from nectosome.description.mission import load_mission
    from nectosome.robots import mission_of

    description = robot_named(robot, settings)
    path = mission_of(str(file)) or file
    modes = load_mission(path, description)
    with progress_bar(description.name) as update:
        run = cancellable(lambda progress: solve.run_mission(modes, **steps, progress=progress), update)
    inputs = {"robot": robot, "mission": str(path), "set": settings or [], **steps}
    found = solve.mission_data(run, inputs)
    write(_modes(found))
    outputs.write(found, lambda data, path: view.show_mission(data, path))
    if run.reason:
        tell(f"{description.name}: {run.reason}.")
        return 130 if run.reason.startswith("cancelled") else 1
    return 0


def _modes(found: "xr.Dataset") -> Summary:
    """Modes, the events that ended them, and the position then."""
    heads = {"mode": "mode", "event": "ended by", "time": "at", "x": "x", "z": "z"}
    heads["velocity_x_mean"] = "mean velocity along x"
    rows = list[tuple[str | Number, ...]]()
    place = found["position"].sel(axis=["x", "z"])
    began, start = 0.0, float(place.values[0, 0])
    passed = (found[name].values for name in ("event_mode", "event", "event_time"))
    for name, event, time in zip(*passed, strict=True):
        x, z = map(float, place.values[abs(found["time"].values - time).argmin()])
        speed = [Number((x - start) / (float(time) - began), "m/s")] if time > began else []
        rows.append((str(name), str(event), Number(float(time), "s"), Number(x, "m"), Number(z, "m"), *speed))
        began, start = float(time), x
    tables = [Table("modes", heads, rows, listed=True)]
    if "battery_energy" in found:
        used = zip(map(str, found["battery"].values), map(float, found["battery_energy"].values), strict=True)
        cells = [(name, Number(joules, "J", shown=show_quantity(joules, "energy"))) for name, joules in used]
        tables.append(Table("batteries", {"battery": "battery", "energy": "energy used"}, cells))
    soft = [found.attrs["soft_contacts"]] if "soft_contacts" in found.attrs else []
    return Summary(str(found.attrs["title"]), tables, cautions=soft, attributes=found.attrs)
