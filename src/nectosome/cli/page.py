"""Pages in the terminal: titles, tables and lines; the summary of a run, and where it comes from."""

import json
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from rich.console import Group
from rich.table import Table
from rich.text import Text

from nectosome.description import drive_period, numeric_paths, parse_robot, with_values
from nectosome.units import InputError, count, show_quantity

if TYPE_CHECKING:
    import numpy as np

Arrays = Mapping[str, "np.ndarray"]

_SHARE = 0.1  # of a run: length of the means


def page(title: str, tables: Iterable[Table], lines: Iterable[str], said: Sequence[str] = ()) -> Group:
    """Return a title, what is `said` of it, tables and lines, with empty lines between them."""
    above = [Text(title, "bold"), Text(), Text("\n".join(said)), Text()][: 4 if said else 2]
    spaced = [thing for table in tables for thing in (table, Text())]
    return Group(*above, *spaced, Text("\n".join(lines)))


def columns(*names: str, rows: Iterable[Sequence[str]] = ()) -> Table:
    """Return a table with numbers flush right."""
    table = Table(box=None, pad_edge=False, header_style="bold", title_justify="left")
    for i, name in enumerate(names):
        table.add_column(name, justify="right" if i and name not in ("", "unit") else "left", no_wrap=bool(name))
    for row in rows:
        table.add_row(*row)
    return table


def powers(arrays: Arrays, loads: "np.ndarray", joints: "np.ndarray") -> Table:
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


def acting(arrays: Arrays, force: "np.ndarray", power: "np.ndarray", time: float) -> Table:
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


def stored(arrays: Arrays, energy: "np.ndarray") -> Table:
    """Return the mean energy [part, form] of each part that is not 0."""
    each = zip(arrays["part"], energy, strict=True)
    rows = [(str(part), *map(number, joules), "J") for part, joules in each if joules.any()]
    return columns("energy of part", *map(str, arrays["form"]), "unit", rows=rows)


def is_joint(coordinate: str) -> bool:
    """Return whether a prescribed coordinate is that of a joint, not of a rod's strain."""
    return not coordinate.rpartition(".")[2].isdigit()


def reaction_unit(coordinate: str) -> str:
    """Return the unit of the reaction of a prescribed coordinate; N m of a strain, whose coordinate has no length."""
    turns = coordinate.rpartition(".")[2] in ("angle", "wx", "wy", "wz")
    return "N m" if turns or not is_joint(coordinate) else "N"


def number(value: float) -> str:
    """Return a number with four digits."""
    return f"{value:.4g}"


def servos(arrays: Arrays, torque: "np.ndarray", speed: "np.ndarray") -> list[str]:
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


def ending(attributes: Mapping[str, Any]) -> str:
    """Return the status in words, and steps, iterations and time of the computation."""
    return f"status: {attributes['status']}, {attributes['status_reason']}{_effort(attributes)}"


def _effort(attributes: Mapping[str, Any]) -> str:
    """Steps, iterations and time, as far as they are known."""
    parts = []
    if "steps" in attributes:
        method = "implicit" if "jacobians" in attributes else "explicit"
        parts.append(f"{attributes['steps']} {method} steps, {attributes.get('rejected', '?')} rejected")
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


def summary(arrays: Arrays, attributes: Mapping[str, Any], loads: bool = False) -> Group:
    """Return body, joints, powers, energies and status; with `loads`, each load on each part, and each part's energy.

    Means are over a cycle; of other runs over the last whole beats, about a tenth of the run; without a whole beat
    over the last tenth.
    """
    import numpy as np

    time = np.asarray(arrays["time"], dtype=float)
    start, words = _window(time, attributes)
    weights = _weights(time, start)
    kept = weights > 0

    def mean(name: str) -> "np.ndarray":
        return np.tensordot(weights[kept], arrays[name][kept], axes=1)

    length = f", {time[-1]:.4g} s" if time.size > 1 else ""
    title = f"{attributes['title']}{length}"
    tables = [_body(arrays, mean("velocity")[0])]
    if any(map(is_joint, arrays["prescribed"])):
        tables.append(_joints(arrays, mean("reaction")))
    tables += [acting(arrays, mean("load_force"), mean("load_power"), time[-1] - start)] if loads else []
    if loads and "part_energy" in arrays:  # absent from files of other programs
        tables.append(stored(arrays, mean("part_energy")))
    tables += [
        powers(arrays, mean("load_power").sum(axis=1), mean("reaction_power")),
        _energies(arrays, mean("energy")),
    ]
    balance = float(np.max(arrays["power_balance"]))
    lines = [*words, f"power balance: off by {balance:.1e} at worst", *_servos(arrays), ending(attributes)]
    return page(title, tables, lines)


def _window(time: "np.ndarray", attributes: Mapping[str, Any]) -> tuple[float, list[str]]:
    """Start of the means [s], and a line about it."""
    if time.size < 2:
        return float(time[0]), []
    whole = float(time[-1] - time[0])
    if "period" in attributes:
        return float(time[0]), ["means: over the cycle"]
    beat = _beat(attributes)
    if beat is None or beat > whole * (1 + 1e-9):
        return float(time[-1]) - _SHARE * whole, [f"means: over the last {show_quantity(_SHARE * whole, 'time')}"]
    beats = max(int(_SHARE * whole / beat + 1e-9), 1)
    words = "beat" if beats == 1 else f"{beats} beats"
    return float(time[-1]) - beats * beat, [f"means: over the last {words}, {show_quantity(beats * beat, 'time')}"]


def _beat(attributes: Mapping[str, Any]) -> float | None:
    """Period of the drives of a run's robot [s] after their ramps; None where they have none."""
    try:
        robot = parse_robot(str(attributes["robot"]))
        ramps = [path for path in numeric_paths(robot) if path.endswith(".ramp")]
        return drive_period(with_values(robot, dict.fromkeys(ramps, 0.0)))
    except (InputError, KeyError):
        return None


def _weights(time: "np.ndarray", start: float) -> "np.ndarray":
    """Weights of samples in the mean from `start` to the end [s] of a piecewise linear signal."""
    import numpy as np

    if time.size < 2:
        return np.ones(1)
    step = np.diff(time)
    share = np.clip(
        (start - time[:-1]) / np.where(step > 0, step, 1.0), 0.0, 1.0
    )  # of each step that is before the start
    later = 0.5 * step * (1 - share**2)
    found = np.zeros(time.size)
    found[1:] += later
    found[:-1] += step * (1 - share) - later
    return found / found.sum()


def _servos(arrays: Arrays) -> list[str]:
    """Largest torques and speeds of servos whose limits are known."""
    import numpy as np

    if "reaction_limit" not in arrays:
        return []
    return servos(arrays, *(np.abs(arrays[name]).max(axis=0) for name in ("reaction", "drive_velocity")))


def origin(attributes: Mapping[str, Any]) -> Table:
    """Return the provenance of a run: settings, versions and time."""
    known: dict[str, Any] = json.loads(attributes["provenance"])
    table = columns("made with", "")
    for key, value in known.items():
        shown = ", ".join(f"{k} {_plain(v)}" for k, v in value.items()) if isinstance(value, dict) else _plain(value)
        table.add_row(key, shown)
    return table


def _plain(value: Any) -> str:
    return f"({', '.join(map(str, value))})" if isinstance(value, list) else str(value)


def _body(arrays: Arrays, mean: "np.ndarray") -> Table:
    import numpy as np

    velocity, position = (arrays[name][-1, 0] for name in ("velocity", "position"))
    table = columns(str(arrays["part"][0]), "x", "y", "z", "size", "unit")
    rows = (("velocity at the end", velocity, "m/s"), ("mean velocity", mean, "m/s"), ("position", position, "m"))
    for name, vector, unit in rows:
        size = number(float(np.linalg.norm(vector))) if unit == "m/s" else ""
        table.add_row(name, *(number(x) for x in vector), size, unit)
    return table


def _joints(arrays: Arrays, reaction: "np.ndarray") -> Table:
    each = zip(map(str, arrays["prescribed"]), reaction, strict=True)
    rows = [(name, number(force), reaction_unit(name)) for name, force in each if is_joint(name)]
    return columns("driven joint", "mean reaction", "unit", rows=rows)


def _energies(arrays: Arrays, energies: "np.ndarray") -> Table:
    each = zip(map(str, arrays["form"]), energies, strict=True)
    return columns("energy", "mean", "unit", rows=[(name, number(joules), "J") for name, joules in each])
