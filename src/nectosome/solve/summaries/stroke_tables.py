"""Tables of a cycle, or of the last beats of a run: the stroke, and energy per metre and cost of transport."""

import math
from collections.abc import Mapping

import numpy as np

from nectosome.io.tables import Label, Number, Table
from nectosome.units.zero import counts_as_zero

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
    return Table("transport", heads, rows, computed=True)
