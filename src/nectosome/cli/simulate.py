"""`nectosome simulate`: a robot through time."""

import time as clock
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import Parameter

from nectosome.cli.mission import fly
from nectosome.cli.options import read_count
from nectosome.cli.output import check_target, tell, write
from nectosome.cli.progress import cancellable, progress_bar
from nectosome.cli.summary import summary
from nectosome.cli.weights import weigh
from nectosome.io import save_dataset
from nectosome.units import InputError, read_positive, read_quantity

_MOST_SAMPLES = 100_000
_TIME, _METHOD, _SAMPLES, _RTOL, _STEP = "2.5s", "auto", "201", "1e-4", "1ms"


def simulate(
    robot: Annotated[str, Parameter(help="Name of a robot that ships, or a robot file.")],
    /,
    *,
    settings: Annotated[
        list[str] | None, Parameter("--set", help="PATH=VALUE, such as omega=14.4rad/s; may be repeated.")
    ] = None,
    time: Annotated[str, Parameter(help="How long, with its unit.", allow_leading_hyphen=True)] = _TIME,
    save: Annotated[Path | None, Parameter(help="Write the run to this netCDF file (.nc).")] = None,
    method: Annotated[
        Literal["auto", "implicit", "explicit"],
        Parameter(help="Implicit for soft bodies, explicit for systems without stiff springs."),
    ] = _METHOD,
    samples: Annotated[
        str, Parameter(help="How many moments are kept, evenly spaced.", allow_leading_hyphen=True)
    ] = _SAMPLES,
    rtol: Annotated[str, Parameter(help="Relative tolerance of a time step.", allow_leading_hyphen=True)] = _RTOL,
    mission: Annotated[
        Path | None, Parameter(help="Mission (.yaml) whose modes it goes through, or a robot whose own one ships.")
    ] = None,
    step: Annotated[str, Parameter(help="Length of a mission's time steps.", allow_leading_hyphen=True)] = _STEP,
    plot: Annotated[Path | None, Parameter(help="Write a page with figures to this file (.html).")] = None,
    loads: Annotated[
        bool,
        Parameter(negative=(), help="Tell the mean force and power of each load on each part, and each part's energy."),
    ] = False,
) -> int:
    """Simulate a robot in water, for a time or through the modes of a mission, and print a summary."""
    for target, option, suffix in ((save, "--save", ".nc"), (plot, "--plot", ".html")):
        if target is not None:
            check_target(target, option, suffix)
    if mission is not None:
        for option, given, usual in (
            ("--time", time, _TIME),
            ("--method", method, _METHOD),
            ("--samples", samples, _SAMPLES),
            ("--rtol", rtol, _RTOL),
        ):
            if given != usual:
                raise InputError("a mission takes even steps until its modes end. Leave it out.", field=option)
        return fly(robot, settings, mission, read_positive(step, "time", "--step"), save, plot)
    if step != _STEP:
        raise InputError("is of a mission; else steps follow from --rtol. Leave it out.", field="--step")
    seconds = read_positive(time, "time", "--time")
    moments = read_count(samples, "--samples", least=2, most=_MOST_SAMPLES)
    tolerance = read_quantity(rtol, "number", "--rtol")
    if not 0 < tolerance < 1:
        raise InputError(f'"{rtol}" is out of range: it must be more than 0 and less than 1.', field="--rtol")

    from nectosome import model, robots

    description = robots.describe(robot, settings or ())

    from nectosome.core import Status
    from nectosome.solve import prepare_results
    from nectosome.solve import simulate as integrate

    asked = {"robot": robot, "set": settings or [], "time": seconds}
    asked |= {"method": method, "samples": moments, "rtol": tolerance}
    start = clock.perf_counter()
    with progress_bar(description.name) as update:

        def compute(going_on: Callable[[], bool]) -> Any:
            def progress(share: float) -> bool:
                update("", share)
                return going_on()

            built = model.build(description)
            weigh(built, robot)
            prepare_results(built, moments)
            run = integrate(built, seconds, samples=moments, method=method, rtol=tolerance, progress=progress)
            wanted = save is not None or plot is not None or int(run.status) != Status.CANCELLED
            return run, run.results(asked) if wanted else None

        run, found = cancellable(compute)
    status = Status(int(run.status))
    if found is not None:
        found.attributes["seconds"] = round(clock.perf_counter() - start, 3)
        if status != Status.CANCELLED:
            write(summary(found.arrays, found.attributes, loads))
        if save is not None:
            save_dataset(found.to_dataset(), save)
        if plot is not None:
            from nectosome.view import show_run

            show_run(found.to_dataset(), plot)
    came_to = f"at {float(run.value.time[-1]):.4g} s of {seconds:.4g} s."
    if status == Status.CANCELLED:
        tell(f"cancelled {came_to}" + (f" The part done is in {save}." if save is not None else ""))
        return 130
    if status not in (Status.SOLVED, Status.EVENT):
        tell(f"{description.name}: {status.reason}, {came_to}")
        return 1
    return 0
