"""Units whose meaning depends on the quantity: g of an acceleration, C of a temperature, a name that ends in a unit."""

import re
from typing import NamedTuple

from .formats.headings import is_known_unit
from .formats.source import Column

_ACCELERATION = re.compile(
    r"(?i)(?:.*[\W_\d])?(?:\w*acc(?:el\w*)?|acc[xyz]|g-?force|imu)(?![a-bd-z])|a_?[xyz](?![a-z])"
)
_MASS = re.compile(r"(?i).*(?:mass|weight|load|balance|scale|payload|ballast|gewicht|last)|m(?![a-z])")
_TEMPERATURE = re.compile(r"(?i)(?:.*[\W_\d])?t(?:emp(?:erature\w*)?)?(?![a-z])|.*temp|.*thermo")
_FORCE = re.compile(r"(?i)(?:.*[\W_\d])?(?:force|thrust|lift|drag|pull|push|kraft|schub)")
_TORQUE = re.compile(r"(?i)(?:.*[\W_\d])?(?:torque|moment|drehmoment)")
_LENGTH = re.compile(r"(?i).*(?:pos|len|height|disp|dist|depth|travel|stroke|width|diam|level|gap|tip|x|y|z)")
_VOLUME = re.compile(r"(?i).*(?:vol|tank|chamber|reservoir|bladder|capacity|water|filling)|v(?![a-z])")
_DURATION = re.compile(r"(?i).*(?:time|duration|age|period|zeit|dauer)|t(?![a-z])")
_G = {"g": "gn", "gs": "gn", "G": "gn", "mg": "mgn"}
_MASSES = {"g", "mg", "kg", "Kg", "KG", "lb", "lbs", "oz"}
_LENGTHS = {"nm", "NM", "mm", "m"}
# in round brackets these may be words or letters: the names beside which they are units
_ALSO_WORDS = {"in": _LENGTH, "min": _DURATION, "h": _DURATION, "L": _VOLUME, "l": _VOLUME, "t": _MASS}
_ROUND = re.compile(r"(.*?)\s*\(([^()]*)\)")
_ENDS = re.compile(r"(?:.*[a-z0-9])?(?:[\s_]+(?:in\s)?|\s/\s)([A-Za-zµμ°%]+\d?(?:/[a-z]+\d?)?)", re.IGNORECASE)
_NO_UNITS = {"in", "min", "h", "hr", "t", "l", "d", "count", "counts", "frame", "frames", "day", "days", "px", "bar"}
_LETTERS = frozenset("NVAWJK%°")


class UnitMeaning(NamedTuple):
    """The unit that is meant, a remark on what was made of it, and a doubt to warn of."""

    unit: str
    remark: str = ""
    doubt: str = ""


def unit_of(column: Column) -> UnitMeaning:
    """Return what the unit of a column in a file means for a quantity of its name; "" where it may be several."""
    name, unit = column.name, column.unit
    if unit in _G and _ACCELERATION.match(name):
        return UnitMeaning(_G[unit], f"{unit} of an acceleration, 9.80665 m/s2{' / 1000' if unit == 'mg' else ''}")
    if unit in ("g", "gs", "mg") and not (_MASS.match(name) or _FORCE.match(name)):
        choice = f"unit: {unit}, for a mass, or unit: {_G[unit]}, of 9.80665 m/s2"
        return UnitMeaning("", doubt=f'"{unit}" may be grams or an acceleration: not converted. Write {choice}')
    if unit in _ALSO_WORDS and column.heading.endswith(")") and not _ALSO_WORDS[unit].match(name):
        return UnitMeaning(
            "", doubt=f'"{unit}" may be a unit or a word: not converted. If it is one, write unit: {unit}'
        )
    if unit in ("C", "F") and _TEMPERATURE.match(name):
        return UnitMeaning(f"deg{unit}")
    if unit in _MASSES and _FORCE.match(name):
        force = {"g": "gf", "mg": "mgf", "oz": "ozf", "lb": "lbf", "lbs": "lbf"}.get(unit, "kgf")
        return UnitMeaning(unit, doubt=f'is in "{unit}", a mass. If it is a force, write unit: {force}')
    if unit in _LENGTHS and _TORQUE.match(name):
        torque = "N mm" if unit == "mm" else "N m"
        return UnitMeaning(unit, doubt=f'is in "{unit}", a length. If it is a torque, write unit: {torque}')
    return UnitMeaning(unit)


def unit_in_name(name: str) -> str:
    """Return the unit with which a name ends (x_cm, force / N) or which it is (RPM), but not in brackets; else ""."""
    match = _ENDS.fullmatch(name)
    ending = match[1] if match else name if name.isalpha() else ""
    if ending.lower() in _NO_UNITS or (len(ending) == 1 and (match is None or ending not in _LETTERS)):
        return ""
    return ending if is_known_unit(ending) else ""


def unknown_bracket(name: str) -> str:
    """Return what stands in brackets at the end of a name and is no unit, as in "flap (left)"; else ""."""
    match = _ROUND.fullmatch(name)
    return match[2].strip() if match and not match[2].strip().isdigit() else ""
