"""Units by name, as products of powers, and what they are in grams, metres, seconds and radians, exactly."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from math import prod
from typing import NamedTuple

_PREFIXES = (
    ("nano", "n", "1e-9"),
    ("micro", "u", "µ", "μ", "1e-6"),
    ("milli", "m", "1e-3"),
    ("centi", "c", "1e-2"),
    ("kilo", "k", "1e3"),
    ("mega", "M", "1e6"),
    ("giga", "G", "1e9"),
)
# Name, symbol, other spellings = number, of what. There is no poise: "7.4 MP" would be a viscosity
_DEFINITIONS = """
    gram g = 1 [mass]
    meter m = 1 [length]
    second s sec = 1 [time]
    radian rad = 1 [angle]
    degree deg ° = 0.0174532925199432957692369076848861271 radian
    turn rev = 6.28318530717958647692528676655900577 radian
    minute min = 60 second
    hour h = 3600 second
    hertz Hz = 1 turn/second
    rpm = 1 turn/minute
    newton N = 1000 gram meter/second2
    newton_meter Nm = 1 newton meter
    pascal Pa = 1 newton/meter2
    hectopascal hPa = 100 pascal
    bar = 1e5 pascal
    psi = 6894.757293168361 pascal
    millimeter_of_mercury mmHg torr = 133.322387415 pascal
    centimeter_of_water cmHHO = 98.0665 pascal
    millimeter_of_water mmHHO = 9.80665 pascal
    atmosphere atm = 101325 pascal
    joule J = 1 newton meter
    watt W = 1 joule/second
    liter L l = 1e-3 meter3
    inch in = 0.0254 meter
    foot ft = 0.3048 meter
    pound lb = 453.59237 gram
    gram_force gf = 9.80665e-3 newton
    pound_force lbf = 4.4482216152605 newton
    ounce_force ozf = 0.27801385095378125 newton
    tonne t = 1e6 gram
    percent = 0.01
    permille = 0.001
    ppm = 1e-6
    strain = 1
    microstrain = 1e-6
    day = 86400 second
    knot = 1852 meter/hour
    standard_gravity gn = 9.80665 meter/second2
    pixel px = 1 [pixel]
    count = 1 [count]
    body_length BL = 1 [body_length]
    ampere A = 1 [current]
    volt V = 1 watt/ampere
    ohm = 1 volt/ampere
    ampere_hour Ah = 1 ampere hour
    watt_hour Wh = 1 watt hour
    kelvin K = 1 [temperature]
    newton_second Ns = 1 newton second
    newton_meter_second Nms = 1 newton meter second
    newton_centimeter Ncm = 0.01 newton meter
    newton_millimeter Nmm = 0.001 newton meter
    pascal_second Pas = 1 pascal second
    volt_second Vs = 1 volt second
    ampere_second As = 1 ampere second
    watt_second Ws = 1 watt second
"""
_NAME = r"[A-Za-zµμ°]+"
_FACTOR = rf"{_NAME}(?:(?:\*\*|\^)?-?[1-9])?"
_BETWEEN = r"(?:\s*[*·/]\s*|\s+)"
_ATOM = rf"(?:{_FACTOR}|1|\({_FACTOR}(?:{_BETWEEN}{_FACTOR})*\))"
_PRODUCT = re.compile(rf"(?:{_ATOM}(?:{_BETWEEN}{_ATOM})*)?")
_PART = re.compile(rf"[/1]|\([^)]*\)|({_NAME})(?:\*\*|\^)?(-?[1-9])?")
_WORDS = (  # of people, and what stands for them
    (re.compile(r"\s+per\s+"), "/"),
    (re.compile(rf"\b(?:sq|square) ({_NAME})"), r"\g<1>2"),
    (re.compile(rf"\bcubic ({_NAME})"), r"\g<1>3"),
    (re.compile(rf"({_NAME}) squared\b"), r"\g<1>2"),
    (re.compile(rf"({_NAME}) cubed\b"), r"\g<1>3"),
)


class UnknownUnitError(ValueError):
    """Says a name that no unit has."""


@dataclass(frozen=True)
class Unit:
    """A product of powers of units, which may be multiplied, divided and raised to powers."""

    powers: Mapping[str, float]  # by the names of units

    def __mul__(self, other: "Unit") -> "Unit":
        both = {name: self.powers.get(name, 0) + other.powers.get(name, 0) for name in (*self.powers, *other.powers)}
        return Unit({name: power for name, power in both.items() if power})

    def __truediv__(self, other: "Unit") -> "Unit":
        return self * other**-1

    def __pow__(self, power: float) -> "Unit":
        return Unit({name: own * power for name, own in self.powers.items() if power})

    @property
    def value(self) -> Fraction:
        """Its value in grams, metres, seconds and radians; its powers are whole numbers."""
        return prod((_table()[name].value ** int(power) for name, power in self.powers.items()), start=Fraction(1))

    @property
    def dimension(self) -> dict[str, float]:
        """Powers of `[mass]`, `[length]` and the like."""
        powers = dict[str, float]()
        for name, power in self.powers.items():
            for kind, own in _table()[name].dimension.items():
                powers[kind] = powers.get(kind, 0) + own * power
        return {kind: power for kind, power in powers.items() if power}

    @property
    def symbols(self) -> dict[str, float]:
        """Powers by the symbols of its units."""
        return {_table()[name].symbol: power for name, power in self.powers.items()}


def read_unit(text: str) -> Unit:
    """The unit that a text such as `N m/rad` names, from left to right; of "" it is 1.

    Raises UnknownUnitError for a name of no unit, ValueError for what is no product of powers.
    """
    text = text.replace("²", "2").replace("³", "3")
    if not _PRODUCT.fullmatch(text):
        raise ValueError(text)
    for pattern, instead in _WORDS:
        text = pattern.sub(instead, text)
    return _product(text)


def _product(text: str) -> Unit:
    product, below = Unit({}), False
    for part in _PART.finditer(text):
        if part[0] in "/1":
            below = part[0] == "/"
            continue
        factor = Unit({_named(part[1]): int(part[2] or 1)}) if part[1] else _product(part[0][1:-1])
        product, below = product / factor if below else product * factor, False
    return product


def _named(spelling: str) -> str:
    try:
        return _table()[spelling].name
    except KeyError:
        raise UnknownUnitError(spelling) from None


class _Known(NamedTuple):
    name: str
    symbol: str
    number: Fraction
    of: str  # the product of which it is the number, or the dimension whose unit it is

    @property
    def value(self) -> Fraction:
        return self.number if self.of.startswith("[") else self.number * _product(self.of).value

    @property
    def dimension(self) -> dict[str, float]:
        return {self.of: 1} if self.of.startswith("[") else _product(self.of).dimension


@cache
def _table() -> dict[str, _Known]:
    """All units by all of their spellings: without and with a prefix, then in the plural; the first one counts."""
    own = dict[str, _Known]()
    for line in _DEFINITIONS.strip().splitlines():
        spellings, _, definition = line.partition(" = ")
        number, _, of = definition.partition(" ")
        name, *short = spellings.split()
        own |= dict.fromkeys((name, *short), _Known(name, short[0] if short else name, Fraction(number), of))
    table = dict(own)
    for plural in ("", "s"):
        for prefix, *short, factor in (("", "", "1"), *_PREFIXES):
            for spelling, unit in own.items():
                if not plural or len(spelling) > 1:
                    number = Fraction(factor) * unit.number
                    known = _Known(prefix + unit.name, short[0] + unit.symbol, number, unit.of)
                    for before in (prefix, *short):
                        table.setdefault(before + spelling + plural, known)
    return table
