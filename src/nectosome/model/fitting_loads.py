"""Moved parts before a run, the loads that fit them and those that they have, as tables."""

import math
from collections.abc import Sequence

import numpy as np

from nectosome.description import RobotDescription
from nectosome.description.auto_file import AutoLoads
from nectosome.description.auto_loads import SOURCES
from nectosome.description.which_load import ROWS, PartInWater, in_regime, in_words, lacking
from nectosome.io.discovery import plain_words
from nectosome.io.tables import Branch, Label, Number, Table
from nectosome.units import count, dimension_of, show_quantity

from .estimated_flow import STROUHAL, EstimatedFlow, estimated_flow

_COLUMNS = {
    "frequency": ("f", "Hz"),
    "sweep": ("sweep", "m"),
    "reynolds": ("Re", ""),
    "keulegan_carpenter": ("KC", ""),
    "angle": ("moored", "rad"),
    "speed": ("speed", "m/s"),
    "angle_at_speed": ("there", "rad"),
}
_MEANING = (
    "before a run, by the drives alone: sweep A from side to side; Re and KC on a robot that is held; the speed U at "
    f"which the Strouhal number f A/U is {STROUHAL}; moored and there: the angle of the chord to its path that half of "
    "the time is beyond, held and at that speed. Where motions alone drive, passive hinges and rods keep their shape; "
    "where forces do, all moves by its first harmonic. One that swims recoils: eel and fish have half of this KC."
)
FITS = "what it has"


def before_run(description: RobotDescription) -> tuple[list[Table], list[Branch]]:
    """What moves how, which loads fit it and in which regime, and what these numbers are.

    Nothing where no motion is known beforehand. Parts that move alike, such as copies, are one row.
    """
    alike, known = dict[tuple[str, ...], list[str]](), estimated_flow(description)
    for name, flow in known.items():
        words = loads_of(description, flow.piece, name, flow.reynolds)
        alike.setdefault((*words, *(_cell(flow, key).shown for key in _COLUMNS)), []).append(name)
    if not alike:
        return [], []
    labels = [Label(names[0], several(names)) for names in alike.values()]
    moved = [(label, *(_cell(known[label.key], key) for key in _COLUMNS)) for label in labels]
    fitted = [(label, *words[:3]) for label, words in zip(labels, alike, strict=True)]
    regimes = [(name, plain_words(row.regime)) for name, row in ROWS.items() if any(name == own for own, *_ in alike)]
    heads = {"part": "moved part", **{key: head for key, (head, _) in _COLUMNS.items()}}
    unknown = {key for key in _COLUMNS if all(math.isnan(getattr(known[label.key], key)) for label in labels)}
    tables = [
        Table("moved", heads, moved, hidden=unknown, apart=True),
        Table("fitting", {"part": "moved part", "as": "is a", "has": "has", "fits": "what fits"}, fitted),
        Table("regimes", {"as": "is a", "regime": "in which regime what fits holds"}, regimes),
    ]
    return tables, [Branch("numbers", _MEANING)]


def loads_of(description: RobotDescription, piece: PartInWater, name: str, reynolds: float) -> tuple[str, str, str]:
    """What a part is, the loads that it has, and those that fit: all of a limb whose water is that of a web."""
    row, part = in_regime(piece.row, reynolds), description.parts[name]
    has = ", ".join(dict.fromkeys(load.kind for load in part.loads.values())) or "none"
    fits, lacks = lacking(part, row, piece.last)
    on_web = any(web.loads and name in web.between for web in description.webs.values())
    return row, has, in_words(fits) if lacks and not on_web else FITS


def auto_table(chosen: Sequence[AutoLoads], description: RobotDescription) -> list[Table]:
    """The loads that `water: auto` has chosen, what the parts are to the water, and where their numbers are from."""
    known = description.in_water
    rows = [
        (one.place[-1], known[one.part].row, text.strip("{}").removeprefix("kind: "), SOURCES[one.loads[name].kind])
        for one in chosen
        for name, text in one.texts.items()
    ]
    heads = {"part": "water: auto", "as": "is a", "load": "chosen", "source": "numbers by"}
    return [Table("auto", heads, rows, listed=True)] if rows else []


def several(names: list[str]) -> str:
    """The first of some parts, and how many others there are."""
    return f"{names[0]} and {count(len(names) - 1, 'other')}" if len(names) > 1 else names[0]


def _cell(flow: EstimatedFlow, key: str) -> Number:
    """A number in two digits."""
    value, unit = getattr(flow, key), _COLUMNS[key][1]
    if math.isnan(value):
        return Number(value, unit)
    if unit == "rad":
        return Number(value, unit, shown=f"{np.degrees(value):.0f} deg")
    rounded = float(f"{value:.2g}")
    return Number(value, unit, shown=show_quantity(rounded, dimension_of(unit)) if unit else f"{rounded:g}")
