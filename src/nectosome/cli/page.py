"""Tables and lines of a summary in the terminal: powers, loads, energies, servos against their limits, the status."""

from typing import TYPE_CHECKING, Any

from rich.console import Group
from rich.table import Table
from rich.text import Text

from nectosome.units import count

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import numpy as np

    Arrays = Mapping[str, np.ndarray]


def page(title: Text, tables: "Sequence[Table]", lines: "Sequence[str]") -> Group:
    """Return a title, tables and lines, with empty lines between them."""
    spaced = [thing for table in tables for thing in (table, Text())]
    return Group(title, Text(), *spaced, Text("\n".join(lines)))


def columns(*names: str) -> Table:
    """Return an empty table with numbers flush right."""
    table = Table(box=None, pad_edge=False, header_style="bold", title_justify="left")
    for i, name in enumerate(names):
        table.add_column(name, justify="right" if i and name not in ("", "unit") else "left", no_wrap=bool(name))
    return table


def powers(arrays: "Arrays", loads: "np.ndarray", joints: "np.ndarray") -> Table:
    """Return mean powers of joints and loads that are not 0, and the sum of all."""
    table = columns("power into the robot", "mean", "unit")
    made: dict[str, float] = {}
    for name, watts in zip(map(str, arrays["prescribed"]), joints, strict=True):
        whole = name if is_joint(name) else name.rpartition(".")[0]  # a strain has several coordinates
        made[whole] = made.get(whole, 0.0) + watts
    for name, watts in (*made.items(), *zip(arrays["load"], loads, strict=True)):
        if watts != 0:
            table.add_row(str(name).replace("_", " "), number(watts), "W")
    table.add_row("sum", number(loads.sum() + joints.sum()), "W")
    return table


def acting(arrays: "Arrays", force: "np.ndarray", power: "np.ndarray", time: float) -> Table:
    """Return mean force [load, part, axis] and mean power [load, part] of each load on each part that are not 0.

    With a `time` [s] that the means are over also the energy.
    """
    table = columns("load on part", "x", "y", "z", "unit", "power", "unit", *(("energy", "unit") if time else ()))
    for i, load in enumerate(map(str, arrays["load"])):
        for k, part in enumerate(map(str, arrays["part"])):
            if force[i, k].any() or power[i, k]:
                pushes = (number(x) for x in force[i, k])
                gives = (number(time * power[i, k]), "J") if time else ()
                table.add_row(f"{load.replace('_', ' ')} on {part}", *pushes, "N", number(power[i, k]), "W", *gives)
    return table


def stored(arrays: "Arrays", energy: "np.ndarray") -> Table:
    """Return the mean energy [part, form] of each part that is not 0."""
    table = columns("energy of part", *map(str, arrays["form"]), "unit")
    for part, joules in zip(arrays["part"], energy, strict=True):
        if joules.any():
            table.add_row(str(part), *map(number, joules), "J")
    return table


def is_joint(coordinate: str) -> bool:
    """Return whether a prescribed coordinate is that of a joint, not of a rod's strain."""
    return not coordinate.rpartition(".")[2].isdigit()


def reaction_unit(coordinate: str) -> str:
    """Return the unit of the reaction of a prescribed coordinate."""
    return "N m" if coordinate.rpartition(".")[2] in ("angle", "wx", "wy", "wz") else "N"


def number(value: float) -> str:
    """Return a number with four digits."""
    return f"{value:.4g}"


def servos(arrays: "Arrays", torque: "np.ndarray", speed: "np.ndarray") -> list[str]:
    """Return torques [N m] and speeds [rad/s] of servos whose limits are known, and warnings where they exceed them."""
    from nectosome.solve import overloaded

    lines = []
    limits = zip(arrays["prescribed"], arrays["reaction_limit"], arrays["drive_velocity_limit"], strict=True)
    for (name, most, fastest), given, rate in zip(limits, torque, speed, strict=True):
        if most != most:  # NaN: none is known
            continue
        lines.append(
            f"servo of {name}: at most {number(given)} N m, {given / most:.0%} of its {number(most)} N m; "
            f"{number(rate)} rad/s, {rate / fastest:.0%} of its {number(fastest)} rad/s"
        )
    return [*lines, *(f"warning: {words}" for words in overloaded(arrays, torque, speed))]


def ending(attributes: "Mapping[str, Any]") -> str:
    """Return the status in words, and steps, iterations and time of the computation."""
    return f"status: {attributes['status']}, {attributes['status_reason']}{_effort(attributes)}"


def _effort(attributes: "Mapping[str, Any]") -> str:
    """Steps, iterations and time, as far as they are known."""
    parts = []
    if "steps" in attributes:
        parts.append(f"{attributes['steps']} steps, {attributes.get('rejected', '?')} rejected")
    if "cycles" in attributes:
        parts.append(
            f"{count(int(attributes['cycles']), 'cycle')}, {count(int(attributes['corrections']), 'correction')}"
        )
    if "multiplier" in attributes:
        parts.append(f"largest multiplier {attributes['multiplier']:.3g}")
    if "growth" in attributes:
        parts.append(f"slowest disturbance grows at {attributes['growth']:.3g} 1/s")
    if "jacobians" in attributes and "residuals" in attributes:
        parts.append(f"{attributes['residuals']} residuals, {attributes['jacobians']} Jacobians")
    if "seconds" in attributes:
        parts.append(f"{attributes['seconds']:.1f} s to compute")
    return "".join(f"; {part}" if i == 0 else f", {part}" for i, part in enumerate(parts))
