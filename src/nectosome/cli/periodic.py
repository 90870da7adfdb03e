"""`nectosome periodic`: the cycle that a robot keeps whose drives repeat themselves."""

import time as clock
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
from nectosome.cli.output import Outputs, unsolved, write
from nectosome.cli.progress import progress_bar
from nectosome.cli.spread import SpreadOptions, print_intervals
from nectosome.units import InputError, read_positive

if TYPE_CHECKING:
    from nectosome.mechanism import Robot as BuiltRobot

_FLAT = 1e-6  # of the radius: a pitch as small is rounding
_FEWEST, _MOST = 17, 10_000  # samples: fewer miss the peaks and spoil the means


@command
def periodic(
    robot: Robot,
    /,
    *,
    settings: Settings = None,
    period: Annotated[str | None, value("Period; by default that of the drives, or of a motor's turns.")] = None,
    samples: Annotated[int, whole("Number of evenly spaced times of the cycle that are kept.", _FEWEST, _MOST)] = 129,
    outputs: Outputs = Outputs(),
    loads: Loads = False,
    multipliers: Annotated[
        Literal["largest", "all"], Parameter(help="Factors of small disturbances over a cycle, with errors.")
    ] = "largest",
    every_limb: Whole = False,
    spread: SpreadOptions = SpreadOptions(),
    cluster: Cluster = None,
) -> int:
    """Find the periodic motion (limit cycle) of a robot, its cycle averages and its stability."""
    seconds = None if period is None else read_positive(period, "time", "--period")
    outputs.check()

    spread.check("--multipliers" if multipliers == "all" else "", cluster, loads)
    if spread.spread:
        given = {"period": seconds, "samples": samples, "whole": every_limb}
        return print_intervals(robot, settings, "periodic", given, spread, cluster, outputs)
    description = robot_named(robot, settings)
    if seconds is None and not description.powered:
        from nectosome.description import drive_period

        seconds = drive_period(description)  # a motor may find its own: known with the cycle

    from nectosome.core import Status
    from nectosome.solve import periodic as find
    from nectosome.solve import prepare_means, reading
    from nectosome.solve.summaries.cycle_summary import cycle_summary
    from nectosome.solve.weights import sinking

    start = clock.perf_counter()
    with progress_bar(f"{description.name}: finding the cycle"):
        built = build_weighed(description, robot)
        prepare_means(built, samples)
        try:
            found = find(built, seconds, samples=samples, whole=every_limb)
        except InputError as error:
            raise InputError(error.message, field=error.field, file=robot) from None
        status = Status(int(found.status))
        if status not in (Status.SOLVED, Status.SETTLED, Status.UNSTABLE):
            way_out = " Leave --period out to take that of the robot file." if status == Status.OTHER_PERIOD else ""
            more = dict[str, Any]()
            if status == Status.NO_TURN:
                way_out = " Give it more voltage or less load; nectosome static finds where it may rest."
            if status == Status.NO_PERIOD:
                way_out = sinking(description, built, reading(found, "velocity.z")) or _of_motors(built, period)
                if not way_out:
                    seen = found.instead()
                    way_out = f" {seen.words(float(found.stats['period']))}"
                    more = {"instead": {key: x for key, x in seen._asdict().items() if x == x}}
            return unsolved(description.name, status, f"{status.reason}.{way_out}", more)
        inputs = {"robot": robot, "set": settings or [], "period": float(found.stats["period"]), "samples": samples}
        inputs |= {"whole": True} if every_limb else {}
        means = found.mean_results(inputs)
        means.attributes["seconds"] = round(clock.perf_counter() - start, 3)
        page = cycle_summary(means.arrays, found.course(), means.attributes, loads, multipliers == "all")
        write(page)
        if outputs.given:
            results = found.results(inputs)
            results.attributes["seconds"] = means.attributes["seconds"]
            outputs.write(results.to_dataset(), view.show_run)
    if status == Status.UNSTABLE:
        return unsolved(description.name, status)
    return 1 if page.warnings else 0


def _of_motors(robot: "BuiltRobot", period: str | None) -> str:
    """Why a robot with motors at speeds of their own has no such cycle; empty for others."""
    from nectosome.solve import find_symmetry, free_hinges

    free = [robot.coordinate_names[k] for k in free_hinges(robot, find_symmetry(robot))]
    if free and period is not None:
        return f" The motor of {free[0]} finds its own speed, and the period with it: leave --period out."
    if len(free) > 1:
        return f" The motors of {' and '.join(free)} each find their own speed. Simulate the robot."
    return ""
