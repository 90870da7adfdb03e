"""Tables of a cycle, or of the last beats of a run: speed forward, stroke, energy per metre, the flow about loads."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from nectosome.description import DIRECTIONS, RobotDescription, robot_of_run
from nectosome.io.tables import Label, Number, Table, number
from nectosome.model.fitting_loads import FITS, loads_of, several
from nectosome.units import InputError
from nectosome.units.zero import counts_as_zero

from ..flow_numbers import flow_rows, loads_of_water, out_of_range
from ..transport import direction

_BACKWARDS = 0.1  # of the speed: a robot that drifts sideways swims neither way


def forward_speeds(
    arrays: Mapping[str, np.ndarray],
    attributes: Mapping[str, Any],
    weights: np.ndarray,
    mean: np.ndarray,
    end: np.ndarray,
) -> tuple[float, float]:
    """Return a `mean` velocity along the mean of the body's forward axis, and one at the `end` along it there [m/s].

    `weights` are those of the samples in the mean, where the steps of the solver are not known. NaN of a file of an
    older version, which names no forward axis.
    """
    if "forward" not in attributes:
        return math.nan, math.nan
    axis = np.array(DIRECTIONS[attributes["forward"]])
    rotation, ahead = arrays["rotation"][:, 0], arrays.get("ahead_mean")
    if ahead is None:
        ahead, points = direction(axis, rotation, weights)
        ahead = ahead if points else np.full(3, math.nan)
    return float(mean @ ahead), float(end @ rotation[-1] @ axis)


def backwards(forward: Any, speed: Any, fastest: Any) -> Any:
    """Return whether a robot goes clearly backwards: not sideways, and by more than what counts as zero."""
    return (forward < -_BACKWARDS * speed) & (counts_as_zero(forward, 0.0, fastest) == 0)


def tail_first(forward: float, speed: float, fastest: float, part: str, attributes: Mapping[str, Any]) -> list[str]:
    """Return a note where a robot goes clearly backwards; `fastest` is the largest speed of its part [m/s]."""
    if not backwards(forward, speed, fastest):
        return []
    axis = attributes.get("forward", "x")
    why = f"forward is the {axis} axis of {part}, by the field forward of its file"
    return [f"it swims tail first: forward speed {number(forward)} m/s; {why}"]


EFFICIENCIES = {"efficiency": ("quasi-propulsive efficiency", ""), "froude_efficiency": ("Froude efficiency", "")}
_STROKE = {
    "body_length": ("body length", "m"),
    "body_lengths_per_second": ("body lengths per second", "1/s"),
    "stride_length": ("stride length in body lengths", ""),
    "tail_amplitude": ("tail amplitude", "m"),
    "strouhal": ("Strouhal number", ""),
    "slip": ("slip", ""),
}
_POWERS = {
    "drives": ("drives", "power", ""),
    "positive": ("drives, no regeneration", "power_positive", "_positive"),
    "electrical": ("motors, electrical", "electrical_power", "_electrical"),
    "battery": ("batteries", "battery_power", "_battery"),
}
OF_BEATS = ("forward_speed", "power", "power_positive", *_STROKE, *EFFICIENCIES)
OF_BEATS += tuple(
    f"{what}{kind}" for what in ("energy_per_metre", "cost_of_transport") for _, _, kind in _POWERS.values()
)
"""Names of the means that both tables need of a run."""


def stroke(
    means: Mapping[str, np.ndarray],
    fastest: float,
    heading: str = "stroke",
    more: Mapping[str, tuple[str, str]] | None = None,
) -> Table:
    """Return body lengths, the tail's beat and `more`; no rows for a body that stays, of a largest speed [m/s]."""
    rows = []
    if not counts_as_zero(float(means["forward_speed"]), 0.0, fastest):
        known = _STROKE | dict(more or {})
        each = ((Label(key, name), Number(float(means[key]), unit)) for key, (name, unit) in known.items())
        rows = [row for row in each if row[1].measured]
    return Table("stroke", {"what": heading, "value": ""}, rows, computed=True)


def transport(means: Mapping[str, np.ndarray], most: float) -> Table:
    """Return mean powers with energies per metre and costs of transport, which a body that stays does not have.

    `most` is the largest power [W].
    """
    rows = list[tuple[Label | Number, ...]]()
    for key, (name, power, kind) in _POWERS.items():
        if power in means and means[power].size:
            watts = Number(float(means[power].sum()), "W", most)
            energy, cost = (float(means[f"{what}{kind}"]) for what in ("energy_per_metre", "cost_of_transport"))
            rows.append((Label(key, name), watts, *(() if math.isnan(cost) else (Number(energy, "J/m"), Number(cost)))))
    heads = {"of": "mean power of", "power": "power", "energy": "per metre", "cost": "cost of transport"}
    return Table("transport", heads, rows, computed=True, beside={"W": stream_power(means)})


def stream_power(arrays: Mapping[str, np.ndarray]) -> float:
    """Return the largest force of a load times the largest speed of the stream [W], beside which powers round."""
    return float(abs(arrays["load_force"]).max(initial=0.0) * abs(arrays.get("water_velocity", np.zeros(1))).max())


_HEADS = {"reynolds": "Re", "keulegan_carpenter": "KC", "reduced_frequency": "k", "stalled": "beyond stall"}
_HEADS |= {"formation": "L/D"}
_MEANING = "Re: Reynolds number; KC: Keulegan-Carpenter number; k: reduced frequency"
_OF_JETS = "L/D: formation number, length of a jet over its diameter"


def too_soft(attributes: Mapping[str, Any]) -> list[str]:
    """A sentence for contacts that are too soft to hold (`solve.soft_contacts`)."""
    return [attributes["soft_contacts"]] if "soft_contacts" in attributes else []


def regime(arrays: Mapping[str, np.ndarray], attributes: Mapping[str, Any]) -> tuple[list[Table], list[str], list[str]]:
    """Return a table of the numbers of loads on parts; what they mean, where other loads fit; warnings beyond ranges.

    `arrays` are those of results, with mean powers and forces (`loads_of_water`). Nothing of a robot that is not known,
    and of a run that has no such numbers.
    """
    try:
        description = robot_of_run(str(attributes["robot"]))
    except (InputError, KeyError):  # of another program, or of an older version
        return [], [], []
    if "flow_number" not in arrays:
        return [], [], []
    rows = list[tuple[Label | Number | str, ...]]()
    for row in flow_rows(arrays, description):
        label = Label(f"{row.name} on {row.where}", f"{row.name.replace('_', ' ')} on {row.where}")
        first, *others = (_number(row.numbers[key]) for key in _HEADS)
        rows.append((label, first, row.length, *others))
    heads = {"of": "regime", "reynolds": _HEADS["reynolds"], "length": "of its", **_HEADS}
    unknown = {
        key
        for k, key in enumerate(heads)
        if not any(isinstance(x := row[k], Number) and x.value == x.value for row in rows)
    }
    table = Table("regime", heads, rows, hidden=unknown - {"of", "length"})
    meaning = _MEANING if "formation" in unknown else f"{_MEANING}; {_OF_JETS}"
    notes = [meaning, *after_run(arrays, description)] if rows else []
    return [table], notes, out_of_range(arrays, description)


def _number(value: float) -> Number:
    return Number(value, shown="infinite" if math.isinf(value) else "")


def after_run(arrays: Mapping[str, np.ndarray], description: RobotDescription) -> list[str]:
    """A sentence for parts in the water that have other loads than those that fit, by the Reynolds numbers of a run."""
    known, fastest = description.in_water, dict[str, float]()
    for one in loads_of_water(arrays, description):
        if one.numbers["reynolds"] > fastest.get(one.part, 0.0):
            fastest[one.part] = one.numbers["reynolds"]
    alike = dict[tuple[str, ...], list[str]]()
    for name in (name for name in known if name in fastest):
        row, has, fits = loads_of(description, known[name], name, fastest[name])
        if fits != FITS:
            alike.setdefault((row, has, fits), []).append(name)
    return [
        f"{several(names)}: a {row} by shape and place, which takes {fits}; it has {has}"
        for (row, has, fits), names in alike.items()
    ]
