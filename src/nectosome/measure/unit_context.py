"""Units whose meaning depends on the quantity: g beside an acceleration, C of a temperature, a name that ends in a unit."""

import re
from typing import NamedTuple

from .formats.headings import is_known_unit

_ACCELERATION = re.compile(
    r"(?i)(?:.*[\W_\d])?(?:\w*acc(?:el\w*)?|acc[xyz]|g-?force|imu)(?![a-bd-z])|a_?[xyz](?![a-z])"
)
_MASS = re.compile(r"(?i).*(?:mass|weight|load|balance|scale|payload|ballast|gewicht|last)|m(?![a-z])")
_TEMPERATURE = re.compile(r"(?i)(?:.*[\W_\d])?t(?:emp(?:erature\w*)?)?(?![a-z])|.*temp|.*thermo")
_FORCE = re.compile(r"(?i)(?:.*[\W_\d])?(?:force|thrust|lift|drag|pull|push|kraft|schub)")
_TORQUE = re.compile(r"(?i)(?:.*[\W_\d])?(?:torque|moment|drehmoment)")
_G = {"g": "gn", "G": "gn", "gs": "gn", "mg": "mgn", "mG": "mgn"}
_MASSES = {"g", "mg", "kg", "Kg", "KG", "lb", "lbs", "oz"}
_LENGTHS = {"nm", "NM", "mm", "m"}
_ROUND = re.compile(r"(.*?)\s*\(([^()]*)\)")
_ENDS = re.compile(r"(?:.*[a-z0-9])?(?:[\s_]+(?:in\s)?|\s/\s)([A-Za-zµμ°%]+\d?(?:/[a-z]+\d?)?)", re.IGNORECASE)
_WORDS = {
    "in",
    "min",
    "h",
    "hr",
    "t",
    "l",
    "d",
    "count",
    "counts",
    "frame",
    "frames",
    "day",
    "days",
    "px",
    "sec",
    "bar",
}
_LETTERS = {"N", "V", "A", "W", "J", "K", "%", "°"}


class UnitMeaning(NamedTuple):
    """The unit that is meant, a remark on what was made of it, and a doubt to warn of."""

    unit: str
    remark: str = ""
    doubt: str = ""


def unit_of(name: str, unit: str) -> UnitMeaning:
    """Return what the unit in a file means for a quantity of this name; "" where it may be several."""
    if unit in _G:
        if _ACCELERATION.match(name):
            return UnitMeaning(
                _G[unit], f"{unit} of an acceleration, 9.80665 m/s2{' / 1000' if unit[0] == 'm' else ''}"
            )
        if unit not in _MASSES or not (_MASS.match(name) or _FORCE.match(name)):
            choice = "unit: g, for a mass, or unit: gn, for 9.80665 m/s2"
            return UnitMeaning("", doubt=f'"{unit}" may be grams or an acceleration: not converted. Write {choice}')
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
    found = _ENDS.fullmatch(name)
    ending = found[1] if found else name
    if ending.lower() in _WORDS or (len(ending) == 1 and (found is None or ending not in _LETTERS)):
        return ""
    return ending if is_known_unit(ending) else ""


def unknown_bracket(name: str) -> str:
    """Return what stands in brackets at the end of a name and is no unit, as in "flap (left)"; else ""."""
    found = _ROUND.fullmatch(name)
    return found[2].strip() if found and not found[2].strip().isdigit() else ""
