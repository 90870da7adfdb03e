"""`nectosome static` and `steady`: the shape of a robot at rest, and the motion that it keeps with steady drives."""

import time as clock
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeVar

from cyclopts import Parameter

from nectosome import view
from nectosome.cli.options import Cluster, Loads, Robot, Settings, build_weighed, command, robot_named
from nectosome.cli.output import Outputs, unsolved, write
from nectosome.cli.progress import progress_bar
from nectosome.cli.spread import SpreadOptions, print_intervals
from nectosome.units import InputError

if TYPE_CHECKING:
    from nectosome import mechanism
    from nectosome.description import RobotDescription

_WATCHED = 10.0  # s of simulation that show what happens where nothing is steady
Found = TypeVar("Found")


OrderErrors = Annotated[
    bool, Parameter("--order-error", help="Say how far the order of each rod's strains puts its tip off.")
]


ShapeBranch = Annotated[
    Literal["first", "plus", "minus"] | None,
    Parameter("--branch", help="Of several shapes: first, under growing loads, or that on a side where it diverges."),
]


@command
def static(
    robot: Robot,
    /,
    *,
    settings: Settings = None,
    outputs: Outputs = Outputs(),
    order_error: OrderErrors = False,
    branch: ShapeBranch = None,
) -> int:
    """Find the static equilibrium of a robot under weight, buoyancy and other steady loads; drives stay at t = 0.

    A free robot floats or, if it is neutral, hangs: draught, trim, heel, metacentric heights, righting arms.

    Force and moment on the support are those of the robot on what holds it, about its root, as a load cell measures.
    """
    outputs.check()
    description = robot_named(robot, settings)

    from nectosome import solve
    from nectosome.core import Status
    from nectosome.solve.strain_orders import order_table
    from nectosome.solve.summaries.rest_summary import rest_summary

    start = clock.perf_counter()
    with progress_bar(f"{description.name}: finding the shape at rest"):
        found = _equilibrium(partial(solve.static, branch=branch), description, robot)
        status = Status(int(found.status))
        if status == Status.NO_EQUILIBRIUM:
            return unsolved(description.name, status, why=found.why)
        results = found.results({"robot": robot, "set": settings or []} | ({"branch": branch} if branch else {}))
    off = []
    if order_error:
        with progress_bar(f"{description.name}: shapes at rest with finer strains"):
            off = _named(partial(solve.strain_order_errors, branch=branch), description, robot)
    results.attributes["seconds"] = round(clock.perf_counter() - start, 3)
    curve = found.righting()
    floats = None if found.lies is None or curve is None else (found.lies, curve)
    page = rest_summary(found.value.system, results.arrays, results.attributes, floats)
    page = replace(
        page,
        notes=[*page.notes, *found.notes, *map(str, off)],
        facts=[*page.facts, *([order_table(off)] if off else [])],
    )
    write(page)
    if outputs.given:
        texts = [table.texts() for table in page.tables if table.rows]
        more = [
            view.righting_panel(*curve, float(lies.heel), float(lies.metacentric_heights[0]))
            for lies, curve in ([floats] if floats else [])
        ]
        outputs.write(results.to_dataset(), lambda data, path: view.show_still(data, path, texts, more))
    return (
        unsolved(description.name, status, why=f"{found.reason}.")
        if status == Status.UNSTABLE
        else 1
        if page.warnings
        else 0
    )


@command
def steady(
    robot: Robot,
    /,
    *,
    settings: Settings = None,
    outputs: Outputs = Outputs(),
    loads: Loads = False,
    spread: SpreadOptions = SpreadOptions(),
    cluster: Cluster = None,
) -> int:
    """Find the steady motion of a robot and its stability."""
    outputs.check()
    spread.check(cluster=cluster, loads=loads)
    if spread.spread:
        return print_intervals(robot, settings, "steady", {}, spread, cluster, outputs)
    description = robot_named(robot, settings)

    from nectosome import solve
    from nectosome.core import Status

    start = clock.perf_counter()
    with progress_bar(description.name) as update:
        update("finding the steady motion", 0.0)
        found = _equilibrium(solve.steady, description, robot)
        status = Status(int(found.status))
        if status in (Status.SOLVED, Status.UNSTABLE):
            results = found.results({"robot": robot, "set": settings or []})
            results.attributes["seconds"] = round(clock.perf_counter() - start, 3)
            page = results.summary(loads)
            write(page)
            if outputs.given:
                outputs.write(results.to_dataset(), view.show_run)
            if status == Status.SOLVED:
                return 1 if page.warnings else 0
        update("no steady motion; simulating what happens instead", 0.0)
        instead = found.instead(_WATCHED)
    cycle = ' Its cycle is found by "nectosome periodic".' if instead.kind == "oscillating" else ""
    watched = f"{found.reason}. Simulated from rest for {_WATCHED:.0f} s, {instead}.{cycle}"
    return unsolved(description.name, status, why=watched)


def _equilibrium(find: "Callable[[mechanism.Robot], Found]", description: "RobotDescription", robot: str) -> Found:
    """Equilibrium of a robot; a mistake names the robot."""
    from nectosome.solve import prepare_results

    built = build_weighed(description, robot)
    prepare_results(built, 1)
    return _named(find, built, robot)


def _named(find: Callable[[Any], Found], of: Any, robot: str) -> Found:
    """What is found of something; a mistake names the robot."""
    try:
        return find(of)
    except InputError as error:
        option = "--branch" if error.field == "branch" else None
        raise InputError(error.message, file=None if option else robot, field=option) from None
