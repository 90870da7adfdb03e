"""Tables of the study as rows of text: what was measured beside what came out, the authors' errors, pieces of water."""

from typing import NamedTuple

import xarray as xr

Row = tuple[str, ...]


class TextTable(NamedTuple):
    """A table: its heads, then its rows."""

    heads: Row
    rows: list[Row]


def compared(swims: xr.Dataset) -> TextTable:
    """Distance, speed and peak-to-peak yaw by amplitude: measured with their spread, ours, what ours is off."""
    rows = []
    for name, unit, factor in (("distance", "cm", 100), ("speed", "cm/s", 100), ("yaw_swing", "deg", 1)):
        theirs = factor * swims[f"measured_{name}"]
        mean, spread = theirs.mean("swim"), theirs.std("swim", ddof=1)
        cells = [f"{a:.1f} ± {b:.1f}" for a, b in zip(mean.values, spread.values, strict=True)]
        rows.append((f"{WORDS[name]} ({unit}), measured", *cells))
        for angles in swims["angles"].values:
            ours = factor * swims[name].sel(angles=angles)
            cells = [f"{x:.1f} ({100 * (x / y - 1):+.0f} %)" for x, y in zip(ours.values, mean.values, strict=True)]
            rows.append((f"ours, {ANGLES[angles]}", *cells))
    return TextTable(("", *_amplitudes(swims)), rows)


def verdict(swims: xr.Dataset) -> str:
    """At which amplitudes the distance is within 10 % of the measured one, by the commanded angles."""
    ours, theirs = swims["distance"].sel(angles="commanded"), swims["measured_distance"].mean("swim")
    off = [(k, 100 * float(x)) for k, x in zip(swims["amplitude"].values, (ours / theirs - 1).values, strict=True)]
    near = [f"{k} deg" for k, x in off if abs(x) <= _NEAR]
    far = [f"{k} deg ({x:+.0f} %)" for k, x in off if abs(x) > _NEAR]
    within, beyond = ", ".join(near) or "at no amplitude", ", ".join(far) or "at no amplitude"
    return f"Distance within {_NEAR:.0f} % of the measured one: {within}. Beyond: {beyond}."


def errors_beside(swims: xr.Dataset) -> TextTable:
    """The authors' table: ours by angles, Navier-Stokes, Genesis."""
    rows = []
    for quantity in swims["quantity"].values:
        unit, factor = ("deg", 1) if quantity == "yaw" else ("cm", 100)
        ours = [(f"ours, {ANGLES[a]}", swims["error"].sel(angles=a)) for a in swims["angles"].values]
        theirs = [(str(c), swims["printed_error"].sel(code=c)) for c in swims["code"].values]
        for i, (who, error) in enumerate((*ours, *theirs)):
            cells = [f"{factor * x:.2f}" for x in error.sel(quantity=quantity).values]
            rows.append((f"{_QUANTITIES[quantity]} ({unit})" if i == 0 else "", who, *cells))
    return TextTable(("root mean square", "of", *_amplitudes(swims)), rows)


def by_piece(swims: xr.Dataset, pieces: xr.Dataset) -> TextTable:
    """Distance with one piece of the water left out or replaced, and what it is off from the measured one."""
    measured = swims["measured_distance"].mean("swim").values
    ours = swims.sel(angles="commanded")
    waters = [("as it is", ours["distance"].values)]
    waters += [(str(what), x) for what, x in zip(pieces["what"].values, pieces["distance"].values, strict=True)]
    rows = [
        (what, *(f"{100 * x:.1f} ({100 * (x / y - 1):+.0f} %)" for x, y in zip(distance, measured, strict=True)))
        for what, distance in waters
    ]
    return TextTable(("water", *_amplitudes(swims)), [("measured", *(f"{100 * x:.1f}" for x in measured)), *rows])


def _amplitudes(swims: xr.Dataset) -> Row:
    return tuple(f"{x} deg" for x in swims["amplitude"].values)


_NEAR = 10.0  # percent
WORDS = {"distance": "distance in 3.97 s", "speed": "speed from 2 s on", "yaw_swing": "peak-to-peak yaw from 2 s on"}
ANGLES = {"commanded": "commanded angles", "logged": "logged angles", "identified": "angles of identified motors"}
_QUANTITIES = {
    "across": "centre of mass across",
    "along": "centre of mass along",
    "head_across": "head across",
    "head_along": "head along",
    "yaw": "yaw",
}
