"""Numbers of a column by conditions, as tables."""

import math
from typing import TYPE_CHECKING

from nectosome.io.summary import Summary
from nectosome.io.tables import Label, Number, Table
from nectosome.units import dimension_of, show_quantity

if TYPE_CHECKING:
    import xarray as xr

_WORDS = {
    "mean": "mean",
    "amplitude": "amplitude",
    "phase": "phase ahead",
    "loop_area": "loop area",
    "power": "power",
}


def means_table(found: "xr.Dataset") -> Summary:
    """A table for each number: its value, both standard errors and the 95 % interval at each of the conditions."""
    names = str(found.attrs["conditions"]).splitlines()
    labels = [_label(found, names, k) for k in range(found.sizes["condition"])]
    tables = [_counts(found, names, labels)]
    for name, word in _WORDS.items():
        if name not in found:
            continue
        unit = str(found[name].attrs["units"])
        heads = {"at": ", ".join(names), "value": word, "by_cycles": "+- by cycles", "by_repeats": "+- by repeats"}
        heads |= {"low": "95 % from", "high": "to"}
        keys = (name, *(f"{name}_{key}" for key in ("by_cycles", "by_repeats", "low", "high")))
        simulated = name == "mean" and "simulated" in found
        heads |= {"simulated": "simulated"} if simulated else {}
        rows = [
            (label, *(_cell(float(found[key][k]), unit) for key in (*keys, *(["simulated"] if simulated else []))))
            for k, label in enumerate(labels)
        ]
        tables.append(Table(name, heads, rows))
    against = str(found.attrs["against"])
    repeated = found["runs"].max() > 1
    pooled = "; the scatter of repeats is pooled over all conditions" if repeated else ""
    notes = [f"+-: one standard error; the interval is that of the larger one, by Student's t{pooled}"]
    if against:
        column = str(found.attrs["column"])
        notes.append(f"phase: by how much {column} is ahead of {against}; loop area: of {column} over {against}")
    notes += str(found.attrs["notes"]).splitlines()
    cautions = [] if repeated else ["no conditions were measured twice: what differs from run to run is in no interval"]
    return Summary(str(found.attrs["title"]), tables, notes=notes, cautions=cautions, attributes=found.attrs)


def _label(found: "xr.Dataset", names: list[str], k: int) -> Label:
    from nectosome.measure.labels import unit_of

    shown = ", ".join(show_quantity(float(found[name][k]), dimension_of(unit_of(found[name]))) for name in names)
    return Label(",".join(f"{name}={float(found[name][k]):.9g}" for name in names), shown or "all")


def _counts(found: "xr.Dataset", names: list[str], labels: list[Label]) -> Table:
    heads = {"at": ", ".join(names), "runs": "runs", "cycles": "whole cycles"}
    rows = [(label, *(Number(int(found[key][k])) for key in ("runs", "cycles"))) for k, label in enumerate(labels)]
    return Table("counts", heads, rows)


def _cell(value: float, unit: str) -> Number:
    if math.isnan(value):
        return Number(value, unit, shown="not known")
    return Number(value, unit)
