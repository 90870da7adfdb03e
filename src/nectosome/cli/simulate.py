"""`nectosome simulate`: a robot through time."""

import time as clock
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import Parameter

from nectosome.cli.mission import fly
from nectosome.cli.options import Loads, Robot, Settings, read_count
from nectosome.cli.output import Outputs, tell, write, written
from nectosome.cli.progress import cancellable, progress_bar
from nectosome.cli.summary import summary
from nectosome.cli.weights import weigh
from nectosome.units import InputError, read_positive, read_quantity

_MOST_SAMPLES = 100_000
_TIME, _METHOD, _SAMPLES, _RTOL, _STEP = "2.5s", "auto", "201", "1e-4", "1ms"  # where none are given


def simulate(
    robot: Robot,
    /,
    *,
    settings: Settings = None,
    time: Annotated[
        str | None, Parameter(help=f"Length of the run, with its unit; {_TIME} by default.", allow_leading_hyphen=True)
    ] = None,
    outputs: Outputs = Outputs(),
    method: Annotated[
        Literal["auto", "implicit", "explicit"] | None,
        Parameter(help="Implicit for soft bodies, explicit for systems without stiff springs; auto by default."),
    ] = None,
    samples: Annotated[
        str | None,
        Parameter(
            help=f"Number of evenly spaced times that are kept; {_SAMPLES} by default.", allow_leading_hyphen=True
        ),
    ] = None,
    rtol: Annotated[
        str | None,
        Parameter(help=f"Relative tolerance of a time step; {_RTOL} by default.", allow_leading_hyphen=True),
    ] = None,
    mission: Annotated[
        Path | None, Parameter(help="Mission file (.yaml), or the name of a robot that ships with one.")
    ] = None,
    step: Annotated[
        str | None,
        Parameter(help=f"Length of the time steps of a mission; {_STEP} by default.", allow_leading_hyphen=True),
    ] = None,
    loads: Loads = False,
) -> int:
    """Simulate a robot in water, for a time or through the modes of a mission, and print a summary."""
    outputs.check()
    if mission is not None:
        for option, given in (("--time", time), ("--method", method), ("--samples", samples), ("--rtol", rtol)):
            if given is not None:
                raise InputError("a mission takes even steps until its modes end. Leave it out.", field=option)
        return fly(robot, settings, mission, read_positive(step or _STEP, "time", "--step"), outputs)
    if step is not None:
        raise InputError("is of a mission; else steps follow from --rtol. Leave it out.", field="--step")
    seconds = read_positive(time or _TIME, "time", "--time")
    count = read_count(samples or _SAMPLES, "--samples", least=2, most=_MOST_SAMPLES)
    tolerance = read_quantity(rtol or _RTOL, "number", "--rtol")
    method = method or _METHOD
    if not 0 < tolerance < 1:
        raise InputError(f'"{rtol}" is out of range: it must be more than 0 and less than 1.', field="--rtol")

    from nectosome import model, robots

    description = robots.describe(robot, settings or ())

    from nectosome.core import Status
    from nectosome.solve import prepare_results
    from nectosome.solve import simulate as integrate

    asked = {"robot": robot, "set": settings or [], "time": seconds}
    asked |= {"method": method, "samples": count, "rtol": tolerance}
    start = clock.perf_counter()
    with progress_bar(description.name) as update:

        def compute(going_on: Callable[[], bool]) -> Any:
            def progress(share: float) -> bool:
                update("", share)
                return going_on()

            built = model.build(description)
            weigh(built, robot)
            prepare_results(built, count)
            run = integrate(built, seconds, samples=count, method=method, rtol=tolerance, progress=progress)
            kept = outputs.save or outputs.plot or int(run.status) != Status.CANCELLED
            return run, run.results(description, asked) if kept else None

        run, found = cancellable(compute)
    status = Status(int(run.status))
    if found is not None:
        found.attributes["seconds"] = round(clock.perf_counter() - start, 3)
        if status != Status.CANCELLED:
            write(summary(found.arrays, found.attributes, loads))
        write(*written(outputs.write_run(found.to_dataset)))
    came_to = f"at {float(run.value.time[-1]):.4g} s of {seconds:.4g} s."
    if status == Status.CANCELLED:
        tell(f"cancelled {came_to}" + (f" The part done is in {outputs.save}." if outputs.save else ""))
        return 130
    if status not in (Status.SOLVED, Status.EVENT):
        tell(f"{description.name}: {status.reason}, {came_to}")
        return 1
    return 0
