"""`nectosome steady`: the motion that a robot with steady drives keeps."""

import time as clock

from nectosome.cli.options import Loads, Robot, Settings
from nectosome.cli.output import Outputs, tell, write
from nectosome.cli.progress import progress_bar
from nectosome.cli.summary import summary
from nectosome.cli.weights import weigh
from nectosome.units import InputError

_WATCHED = 10.0  # s of simulation that show what happens where nothing is steady


def steady(
    robot: Robot,
    /,
    *,
    settings: Settings = None,
    outputs: Outputs = Outputs(),
    loads: Loads = False,
) -> int:
    """Find the steady motion of a robot and its stability."""
    outputs.check()

    from nectosome import model, robots

    description = robots.describe(robot, settings or ())

    from nectosome.core import Status
    from nectosome.solve import prepare_results
    from nectosome.solve import steady as find

    start = clock.perf_counter()
    with progress_bar(description.name) as update:
        built = model.build(description)
        weigh(built, robot)
        prepare_results(built, 1)
        try:
            found = find(built)
        except InputError as error:
            raise InputError(error.message, file=robot) from None
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
    told = f"{description.name}: {status.reason}. Simulated from rest for {_WATCHED:.0f} s, {instead}."
    cycle = ' Its cycle is found by "nectosome periodic".' if instead.kind == "oscillating" else ""
    tell(f"{told}{cycle}")
    return 1
