"""`nectosome static` and `steady`: the shape of a robot at rest, and the motion that it keeps with steady drives."""

import time as clock
from collections.abc import Callable
from typing import TYPE_CHECKING, TypeVar

from nectosome import robots
from nectosome.cli.options import Loads, Robot, Settings
from nectosome.cli.output import Outputs, progress_bar, tell, write
from nectosome.cli.page import Arrays, columns, ending, number, page, reaction_unit, summary
from nectosome.cli.weights import build_weighed
from nectosome.units import InputError

if TYPE_CHECKING:
    from nectosome import mechanism
    from nectosome.description import RobotDescription
    from nectosome.solve import Static

    Rows = list[tuple[str, ...]]

_WATCHED = 10.0  # s of simulation that show what happens where nothing is steady
Found = TypeVar("Found")


def static(robot: Robot, /, *, settings: Settings = None, outputs: Outputs = Outputs()) -> int:
    """Find the static equilibrium of a robot under weight, buoyancy and other steady loads; drives stay at t = 0."""
    outputs.check()
    description = robots.describe(robot, settings or ())

    from nectosome import solve
    from nectosome.core import Status

    start = clock.perf_counter()
    with progress_bar(description.name):
        found = _equilibrium(solve.static, description, robot)
        status = Status(int(found.status))
        if status == Status.NO_EQUILIBRIUM:
            tell(f"{description.name}: {_why(found)}")
            return 1
        results = found.results({"robot": robot, "set": settings or []})
    results.attributes["seconds"] = round(clock.perf_counter() - start, 3)
    tables = [_places(results.arrays), _reactions(results.arrays), _forces(results.arrays)]
    tables = [rows for rows in tables if len(rows) > 1]
    shown = [columns(*rows[0], rows=rows[1:]) for rows in tables]
    write(page(results.attributes["title"], shown, [ending(results.attributes)]))
    if outputs.given:
        from nectosome.view import show_still

        outputs.write(results.to_dataset(), lambda data, path: show_still(data, path, tables))
    if status == Status.UNSTABLE:
        tell(f"{description.name}: {status.reason}.")
        return 1
    return 0


def steady(robot: Robot, /, *, settings: Settings = None, outputs: Outputs = Outputs(), loads: Loads = False) -> int:
    """Find the steady motion of a robot and its stability."""
    outputs.check()
    description = robots.describe(robot, settings or ())

    from nectosome import solve
    from nectosome.core import Status

    start = clock.perf_counter()
    with progress_bar(description.name) as update:
        found = _equilibrium(solve.steady, description, robot)
        status = Status(int(found.status))
        if status in (Status.SOLVED, Status.UNSTABLE):
            results = found.results({"robot": robot, "set": settings or []})
            results.attributes["seconds"] = round(clock.perf_counter() - start, 3)
            write(summary(results.arrays, results.attributes, loads))
            if outputs.given:
                from nectosome.view import show_run

                outputs.write(results.to_dataset(), show_run)
        if status == Status.SOLVED:
            return 0
        update("no steady motion; simulating what happens instead", 0.0)
        instead = found.instead(_WATCHED)
    cycle = ' Its cycle is found by "nectosome periodic".' if instead.kind == "oscillating" else ""
    tell(f"{description.name}: {status.reason}. Simulated from rest for {_WATCHED:.0f} s, {instead}.{cycle}")
    return 1


def _equilibrium(find: "Callable[[mechanism.Robot], Found]", description: "RobotDescription", robot: str) -> Found:
    """Equilibrium of a robot; a mistake names the robot."""
    from nectosome.solve import prepare_results

    built = build_weighed(description, robot)
    prepare_results(built, 1)
    try:
        return find(built)
    except InputError as error:
        raise InputError(error.message, file=robot) from None


def _why(found: "Static") -> str:
    """Why there is no shape at rest, and what to do."""
    if not found.loose:
        share = float(found.stats["load"])
        return f"no shape at rest found: followed up to {share:.0%} of the loads, where it gives way or snaps over."
    parts = list(dict.fromkeys(name.partition(".")[0] for name in found.loose))
    path = f"{'' if parts[0] == 'body' else 'limbs.'}{parts[0]}.joint"
    return (
        f"nothing holds {', '.join(found.loose)}, so that there is no one place of rest. "
        f'Hold it, as with --set "{path}={{kind: fixed}}", or see nectosome steady.'
    )


def _places(arrays: Arrays) -> "Rows":
    """Where the tips of rods and the centres of bodies lie, and how far rods are bent."""
    rows: Rows = [("tip of rod, centre of body", "x", "y", "z", "unit", "largest bending strain")]
    for part in arrays["part"]:
        own = arrays["station_part"] == part
        is_rod = arrays["station_x"][own][0] == 0  # the first station of a rigid part is its centre
        x, y, z = arrays["position"][0, own][-1 if is_rod else 0]
        strain = abs(arrays["bending_strain"][0, own]).max()
        rows.append((str(part), number(x), number(y), number(z), "m", number(strain) if strain > 0 else ""))
    return rows


def _reactions(arrays: Arrays) -> "Rows":
    each = zip(map(str, arrays["prescribed"]), arrays["reaction"][0], strict=True)
    return [("driven joint", "reaction", "unit"), *((name, number(x), reaction_unit(name)) for name, x in each)]


def _forces(arrays: Arrays) -> "Rows":
    """Sums over all parts."""
    rows: Rows = [("load", "x", "y", "z", "unit")]
    forces = arrays["load_force"][0].sum(axis=1)
    rounding = 1e-12 * abs(forces).max()
    for name, force in zip(arrays["load"], forces, strict=True):
        if (abs(force) > rounding).any():
            rows.append((str(name).replace("_", " "), *(number(x if abs(x) > rounding else 0.0) for x in force), "N"))
    return rows
