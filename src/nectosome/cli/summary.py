"""Summary of a run: position and velocity of the body, reactions of joints, powers, energies, power balance."""

import json
from typing import TYPE_CHECKING, Any

from rich.console import Group
from rich.table import Table
from rich.text import Text

from nectosome.cli.page import acting, columns, ending, is_joint, number, page, powers, reaction_unit, servos, stored
from nectosome.description import drive_period, numeric_paths, parse_robot, with_values
from nectosome.units import InputError, show_quantity

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np

    Arrays = Mapping[str, np.ndarray]

_SHARE = 0.1  # of a run: length of the means


def summary(arrays: "Arrays", attributes: "Mapping[str, Any]", loads: bool = False) -> Group:
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
    title = Text(f"{attributes['title']}{length}", "bold")
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


def _window(time: "np.ndarray", attributes: "Mapping[str, Any]") -> tuple[float, list[str]]:
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


def _beat(attributes: "Mapping[str, Any]") -> float | None:
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


def _servos(arrays: "Arrays") -> list[str]:
    """Largest torques and speeds of servos whose limits are known."""
    import numpy as np

    if "reaction_limit" not in arrays:
        return []
    return servos(arrays, *(np.abs(arrays[name]).max(axis=0) for name in ("reaction", "drive_velocity")))


def origin(attributes: "Mapping[str, Any]") -> Table:
    """Return the provenance of a run: settings, versions and time."""
    known: dict[str, Any] = json.loads(attributes["provenance"])
    table = columns("made with", "")
    for key, value in known.items():
        shown = ", ".join(f"{k} {_plain(v)}" for k, v in value.items()) if isinstance(value, dict) else _plain(value)
        table.add_row(key, shown)
    return table


def _plain(value: Any) -> str:
    return f"({', '.join(map(str, value))})" if isinstance(value, list) else str(value)


def _body(arrays: "Arrays", mean: "np.ndarray") -> Table:
    import numpy as np

    velocity, position = (arrays[name][-1, 0] for name in ("velocity", "position"))
    table = columns(str(arrays["part"][0]), "x", "y", "z", "size", "unit")
    rows = (("velocity at the end", velocity, "m/s"), ("mean velocity", mean, "m/s"), ("position", position, "m"))
    for name, vector, unit in rows:
        size = number(float(np.linalg.norm(vector))) if unit == "m/s" else ""
        table.add_row(name, *(number(x) for x in vector), size, unit)
    return table


def _joints(arrays: "Arrays", reaction: "np.ndarray") -> Table:
    table = columns("driven joint", "mean reaction", "unit")
    for name, force in zip(arrays["prescribed"], reaction, strict=True):
        if is_joint(str(name)):
            table.add_row(str(name), number(force), reaction_unit(str(name)))
    return table


def _energies(arrays: "Arrays", energies: "np.ndarray") -> Table:
    table = columns("energy", "mean", "unit")
    for name, joules in zip(arrays["form"], energies, strict=True):
        table.add_row(str(name), number(joules), "J")
    return table
