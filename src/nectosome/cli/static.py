"""`nectosome static`: the shape of a robot at rest."""

import time as clock
from typing import TYPE_CHECKING

from rich.text import Text

from nectosome.cli.options import Robot, Settings
from nectosome.cli.output import Outputs, tell, write
from nectosome.cli.page import columns, ending, number, page, reaction_unit
from nectosome.cli.progress import progress_bar
from nectosome.cli.weights import weigh
from nectosome.units import InputError

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np

    from nectosome.solve import Static

    Rows = list[tuple[str, ...]]


def static(
    robot: Robot,
    /,
    *,
    settings: Settings = None,
    outputs: Outputs = Outputs(),
) -> int:
    """Find the static equilibrium of a robot under weight, buoyancy and other steady loads; drives stay at t = 0."""
    outputs.check()

    from nectosome import model, robots

    description = robots.describe(robot, settings or ())

    from nectosome.core import Status
    from nectosome.solve import prepare_results, static

    start = clock.perf_counter()
    with progress_bar(description.name):
        built = model.build(description)
        weigh(built, robot)
        prepare_results(built, 1)
        try:
            found = static(built)
        except InputError as error:
            raise InputError(error.message, file=robot) from None
        status = Status(int(found.status))
        if status == Status.NO_EQUILIBRIUM:
            tell(f"{description.name}: {_why(found)}")
            return 1
        results = found.results({"robot": robot, "set": settings or []})
    results.attributes["seconds"] = round(clock.perf_counter() - start, 3)
    tables = [_places(results.arrays), _reactions(results.arrays), _forces(results.arrays)]
    shown = [columns(*rows[0]) for rows in tables]
    for table, rows in zip(shown, tables, strict=True):
        for row in rows[1:]:
            table.add_row(*row)
    full = [table for table in shown if table.row_count]
    write(page(Text(results.attributes["title"], "bold"), full, [ending(results.attributes)]))
    if outputs.given:
        from nectosome.view import show_still

        full_rows = [rows for rows in tables if len(rows) > 1]
        outputs.write(results.to_dataset(), lambda data, path: show_still(data, path, full_rows))
    if status == Status.UNSTABLE:
        tell(f"{description.name}: {status.reason}.")
        return 1
    return 0


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


def _places(arrays: "Mapping[str, np.ndarray]") -> "Rows":
    """Where the tips of rods and the centres of bodies lie, and how far rods are bent."""
    rows: Rows = [("tip of rod, centre of body", "x", "y", "z", "unit", "largest bending strain")]
    for part in arrays["part"]:
        own = arrays["station_part"] == part
        is_rod = arrays["station_x"][own][0] == 0  # the first station of a rigid part is its centre
        x, y, z = arrays["position"][0, own][-1 if is_rod else 0]
        strain = abs(arrays["bending_strain"][0, own]).max()
        rows.append((str(part), number(x), number(y), number(z), "m", number(strain) if strain > 0 else ""))
    return rows


def _reactions(arrays: "Mapping[str, np.ndarray]") -> "Rows":
    rows: Rows = [("driven joint", "reaction", "unit")]
    for name, reaction in zip(arrays["prescribed"], arrays["reaction"][0], strict=True):
        rows.append((str(name), number(reaction), reaction_unit(str(name))))
    return rows


def _forces(arrays: "Mapping[str, np.ndarray]") -> "Rows":
    """Sums over all parts."""
    rows: Rows = [("load", "x", "y", "z", "unit")]
    forces = arrays["load_force"][0].sum(axis=1)
    rounding = 1e-12 * abs(forces).max()
    for name, force in zip(arrays["load"], forces, strict=True):
        if (abs(force) > rounding).any():
            rows.append((str(name).replace("_", " "), *(number(x if abs(x) > rounding else 0.0) for x in force), "N"))
    return rows
