"""Text with a unit to SI and back, exactly: `parse_quantity(format_quantity(x)) == x` for every finite x."""

import math
import re
from fractions import Fraction
from functools import cache
from typing import Any, SupportsFloat

from .errors import InputError, shorten
from .unit_names import DIMENSIONS, Dimension, spelled


def read_quantity(given: str | SupportsFloat, dimension: str, field: str) -> float:
    """Return the SI value of text with a unit, or of a number in SI units. Raises InputError, which names the field."""
    try:
        if isinstance(given, str):
            return parse_quantity(given, dimension)
        value = math.nan if isinstance(given, bool) else float(given)
        if not math.isfinite(value):
            raise ValueError(f'"{shorten(given)}" is NaN or infinite. {expected(dimension)}')
        return value
    except TypeError:
        raise InputError(f'"{shorten(given)}" is no quantity. {expected(dimension)}', field=field) from None
    except ValueError as error:
        raise InputError(str(error), field=field) from None


def read_positive(given: str | SupportsFloat, dimension: str, field: str) -> float:
    """Return the SI value, more than 0, likewise. Raises InputError, which names the field."""
    value = read_quantity(given, dimension, field)
    if value <= 0:
        raise InputError(f'"{given}" is out of range: it must be more than 0.', field=field)
    return value


_NUMBER = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*)\s*", re.DOTALL)
_NOT_FINITE = re.compile(r"\s*[-+]?\.?(nan|inf|infinity)\b", re.IGNORECASE)
_FACTOR = r"[A-Za-zµμ°]+(?:(?:\*\*|\^)?-?[1-9])?"
_BETWEEN = r"(?:\s*[*·/]\s*|\s+)"
_ATOM = rf"(?:{_FACTOR}|1|\({_FACTOR}(?:{_BETWEEN}{_FACTOR})*\))"
_UNIT = re.compile(rf"(?:{_ATOM}(?:{_BETWEEN}{_ATOM})*)?")

# Own unit list: pint's contains a megapoise, which would accept the typing error "7.4 MP" as a viscosity.
_DEFINITIONS = """
    nano- = 1e-9 = n-
    micro- = 1e-6 = u- = µ- = μ-
    milli- = 1e-3 = m-
    centi- = 1e-2 = c-
    kilo- = 1e3 = k-
    mega- = 1e6 = M-
    giga- = 1e9 = G-
    gram = [mass] = g
    meter = [length] = m
    second = [time] = s = sec
    radian = [angle] = rad
    degree = 0.0174532925199432957692369076848861271 * radian = deg = °
    turn = 6.28318530717958647692528676655900577 * radian = rev
    minute = 60 * second = min
    hour = 3600 * second = h
    hertz = turn / second = Hz
    rpm = turn / minute
    newton = 1000 * gram * meter / second ** 2 = N
    newton_meter = newton * meter = Nm
    pascal = newton / meter ** 2 = Pa
    hectopascal = 100 * pascal = hPa
    bar = 1e5 * pascal
    psi = 6894.757293168361 * pascal
    millimeter_of_mercury = 133.322387415 * pascal = mmHg = torr
    centimeter_of_water = 98.0665 * pascal = cmHHO
    millimeter_of_water = 9.80665 * pascal = mmHHO
    atmosphere = 101325 * pascal = atm
    joule = newton * meter = J
    watt = joule / second = W
    liter = 1e-3 * meter ** 3 = L = l
    inch = 0.0254 * meter = in
    foot = 12 * inch = ft
    pound = 453.59237 * gram = lb
    gram_force = 9.80665e-3 * newton = gf
    pound_force = 4.4482216152605 * newton = lbf
    ounce_force = 0.27801385095378125 * newton = ozf
    tonne = 1e6 * gram = t
    percent = 0.01
    permille = 0.001
    ppm = 1e-6
    strain = 1
    microstrain = 1e-6
    day = 24 * hour
    knot = 1852 * meter / hour
    standard_gravity = 9.80665 * meter / second ** 2 = gn
    pixel = [pixel] = px
    count = [count]
    body_length = [body_length] = BL
    ampere = [current] = A
    volt = watt / ampere = V
    ohm = volt / ampere
    ampere_hour = ampere * hour = Ah
    watt_hour = watt * hour = Wh
    kelvin = [temperature] = K
    newton_second = newton * second = Ns
    newton_meter_second = newton * meter * second = Nms
    newton_centimeter = newton * meter / 100 = Ncm
    newton_millimeter = newton * meter / 1000 = Nmm
    pascal_second = pascal * second = Pas
    volt_second = volt * second = Vs
    ampere_second = ampere * second = As
    watt_second = watt * second = Ws
"""


@cache
def _registry() -> Any:
    import pint

    make: Any = pint.UnitRegistry
    registry = make(None, non_int_type=Fraction)  # fractions: "12.5 mm" is the float 0.0125, exactly
    for line in _DEFINITIONS.strip().splitlines():
        registry.define(line.strip())
    return registry


@cache
def _unit(text: str) -> tuple[Fraction, dict[str, int]]:
    """Return the scale to (gram, metre, second, radian) and the exponents of a unit; ValueError with the reason."""
    import pint

    if len(text) > 40 or not _UNIT.fullmatch(text.replace("²", "2").replace("³", "3")):
        raise ValueError(f"has no readable unit ({shorten(text, 40)})")
    try:
        registry = _registry()
        unit = named_unit(text)
        scale, _ = registry.get_base_units(unit)
        exponents = {str(k): int(v) for k, v in dict(registry.get_dimensionality(unit)).items() if v}
    except pint.UndefinedUnitError as error:
        missing = error.unit_names if isinstance(error.unit_names, str) else sorted(error.unit_names)[0]
        raise ValueError(f"has no unit called {missing}") from None
    except Exception:  # pint passes on any exception of its tokenizer
        raise ValueError(f"has no readable unit ({text})") from None
    return Fraction(scale), exponents


def named_unit(text: str) -> Any:
    """Unit of pint that a text such as `N m/rad` names; it may be multiplied, divided and raised to powers."""
    text = text.replace("²", "2").replace("³", "3").replace("·", "*").replace("^", "**")
    return _registry().parse_units(re.sub(r"(?<=[A-Za-zµμ°])(-?\d)", r"**\1", text))


def written_unit(unit: Any) -> str:
    """A product of SI units as text: that of `DIMENSIONS` where there is one, else such as `m/s/W`; "" of a number."""
    powers = {_registry().get_symbol(name): float(n) for name, n in unit._units.items()}  # no public name gives them
    above = [f"{name}{power:g}" if power != 1 else name for name, power in powers.items() if power > 0]
    below = [f"/{name}{-power:g}" if power != -1 else f"/{name}" for name, power in powers.items() if power < 0]
    text = (" ".join(above) or "1" * bool(below)) + "".join(below)
    units = [dimension.unit for dimension in DIMENSIONS.values()]
    if text in units or any(power % 1 for power in powers.values()):
        return text
    return next((known for known in units if _unit(known) == _unit(text)), text)


@cache
def _scale(text: str, dimension: Dimension) -> Fraction:
    """Return the factor from the unit `text` to the SI unit of `dimension`; ValueError for another dimension."""
    scale, exponents = _unit(text)
    for candidate in (dimension, *DIMENSIONS.values()):
        si, expected = _unit(candidate.unit)
        if exponents == expected:
            if candidate is not dimension:
                work = candidate is DIMENSIONS["torque"] and _is_work(text)
                raise ValueError(f"is {(DIMENSIONS['energy'] if work else candidate).with_article()}")
            return scale / si
        if candidate is dimension and exponents == {k: n for k, n in expected.items() if k != "[angle]"}:
            return scale if dimension.unit == "Hz" else scale / si  # 1/s is one turn a second, and rad is 1
    raise ValueError(f"is not {dimension.with_article()}")


def _is_work(text: str) -> bool:
    """Whether a unit is one of energy, which has the base units of a torque."""
    return re.search("J|W", text) is not None


def unit_to_si(text: str) -> tuple[float, str]:
    """Return the factor from a unit to SI and the SI unit, as in (1e-3, "m") for "mm"; ValueError with the reason.

    Spellings of instruments and loggers are read, too ("Volts", "Kg f", "N.m", "usec"). Cycles per time stay cycles
    (Hz), all other angles are in radians; % is a number; pixels, counts and body lengths stay what they are.
    """
    plain = spelled(text, _is_known) if text not in ("", "-") else ""
    if plain in _TEMPERATURES:
        raise ValueError(f"counts from a zero of its own ({plain}); K is expected")
    scale, exponents = _unit(plain)
    for name, dimension in DIMENSIONS.items():
        si, kind = _unit(dimension.unit)
        if name == "torque" and _is_work(plain):
            continue
        if exponents == kind and (name not in ("frequency", "strain_rate") or "Hz" in plain):
            return float(scale / si), dimension.unit
    scale /= Fraction(1000) ** exponents.get("[mass]", 0)
    parts = [(_BASE[name], n) for name, n in sorted(exponents.items(), key=lambda item: (item[1] < 0, item[0]))]
    return float(scale), " ".join(unit if n == 1 else f"{unit}{n}" for unit, n in parts)


def scale_to_si(text: str) -> tuple[float, float, str]:
    """Return factor, shift and SI unit of a unit of readings: SI = factor * reading + shift; ValueError likewise.

    The shift is 0 but for temperatures in °C and °F: (1.0, 273.15, "K").
    """
    if not text:
        return 1.0, 0.0, ""
    plain = spelled(text, _is_known)
    if plain in _TEMPERATURES:
        return *_TEMPERATURES[plain], "K"
    factor, si = unit_to_si(text)
    return factor, 0.0, si


def _is_known(word: str) -> bool:
    try:
        _unit(word)
    except ValueError:
        return False
    return True


def read_any(text: str) -> tuple[float, str]:
    """Read text such as `20 deg` or `20 °C` as an SI number and its SI unit; ValueError with a sentence for users."""
    number, unit = _split(text, "is not a number with a unit")
    try:
        factor, shift, si = scale_to_si(unit)
    except ValueError as error:
        raise ValueError(f'"{shorten(text)}" {error}.') from None
    number = float(number) * factor + shift
    if not math.isfinite(number):
        raise ValueError(f'"{shorten(text)}" must be finite.')
    return number, si


def split_unit(text: str) -> tuple[float, str]:
    """Split text such as `20 deg` into its number and its unit, as written; ValueError with a sentence for people."""
    number, unit = _split(text, "is not a number with a unit")
    return float(number), unit


def _split(text: str, otherwise: str) -> tuple[str, str]:
    """Number and unit as texts; ValueError where there is no number, which says what it is `otherwise`."""
    match = _NUMBER.fullmatch(text)
    if match is None or len(text) > 100:
        raise ValueError(f'"{shorten(text)}" {"must be finite" if _NOT_FINITE.match(text) else otherwise}.')
    return match[1], match[2].strip()


_BASE = {
    "[mass]": "kg",
    "[length]": "m",
    "[time]": "s",
    "[angle]": "rad",
    "[current]": "A",
    "[temperature]": "K",
    "[pixel]": "px",
    "[count]": "count",
    "[body_length]": "BL",
}
_TEMPERATURES = {"degC": (1.0, 273.15), "degF": (5 / 9, 459.67 * 5 / 9)}  # factor and shift to K


def expected(dimension: str) -> str:
    """Return the expected input: `Pressure expected, as in "7.4 MPa" or "7.4e6 Pa".`."""
    kind = DIMENSIONS[dimension]
    return f"{kind.name.capitalize()} expected, as in {kind.example}."


def parse_quantity(text: str, dimension: str) -> float:
    """Read `text` such as `7.4 MPa` as an SI number of the given dimension (a key of `DIMENSIONS`).

    `rad` may be left out of derived units (`N m` for `N m/rad`); a bare number is allowed only for a dimension without
    a unit, or as 0. Raises ValueError with a sentence for users: unknown or wrong unit, no unit, not finite.
    """
    try:
        number, unit = _split(text, "is not a number")
    except ValueError as error:
        raise ValueError(f"{error} {expected(dimension)}") from None
    return _in_si(number, unit, dimension, text)


def in_dimension(value: float, unit: str, dimension: str) -> float:
    """Return a number with its unit in the SI unit of a dimension. Raises ValueError as `parse_quantity` does."""
    return _in_si(value, unit, dimension, f"{value:g} {unit}".strip())


def _in_si(number: str | float, unit: str, dimension: str, written: str) -> float:
    shown, kind = f'"{shorten(written)}"', DIMENSIONS[dimension]
    if not unit and kind.unit and float(number) != 0:
        raise ValueError(f"{shown} has no unit. {expected(dimension)}")
    try:
        scale = _scale(unit, kind) if unit or kind.unit == "" else Fraction(1)
    except ValueError as error:
        raise ValueError(f"{shown} {error}. {expected(dimension)}") from None
    value = float(number)
    if value and math.isfinite(value):  # only a limited exponent is converted to a fraction
        value = _nearest(Fraction(number) * scale)
    if math.isinf(value):
        raise ValueError(f"{shown} must be finite. {expected(dimension)}")
    return value


def format_quantity(value: float, dimension: str) -> str:
    """Write an SI `value` as the shortest text that is read back as the same float, such as `7.4 MPa`."""
    kind = DIMENSIONS[dimension]
    if not kind.unit:
        return _plain(value)
    best = f"{_plain(value)} {kind.unit}"
    if value == 0:
        return best
    for unit in kind.display:
        scale = _scale(unit, kind)
        shown = _nearest(Fraction(value) / scale)
        for number in [float(f"{shown:.{digits}g}") for digits in (12, 15)]:
            exact = math.isfinite(number) and _nearest(Fraction(_plain(number)) * scale) == value
            if exact and len(_plain(number)) < len(best.split(" ")[0]):
                best = f"{_plain(number)} {unit}"
    return best


def show_quantity(value: float, dimension: str) -> str:
    """Write an SI `value` with four digits in a convenient unit, such as `5.83 mm`; not exact."""
    kind = DIMENSIONS[dimension]
    units = ("deg",) if dimension == "angle" else (kind.unit, *kind.display)
    best = min(units, key=lambda unit: _digits_before(value / float(_scale(unit, kind))))
    return f"{value / float(_scale(best, kind)):.4g} {best}".strip()


def shown_unit(unit: str) -> tuple[float, str]:
    """Return the factor from an SI unit to the display unit of an axis, and that unit."""
    return (180 / math.pi, "deg") if unit == "rad" else (1.0, unit)


def show_value(value: float, unit: str, *, per: str = "", digits: int = 6) -> str:
    """Write a value in its SI unit, rotations in degrees, as in `60 deg`, or `400 deg/s` with per="/s"."""
    factor, name = shown_unit(unit)
    return f"{value * factor:.{digits}g} {name}{per}".strip()


def show_span(low: float, high: float, unit: str, *, digits: int = 6) -> str:
    """Write two ends in their SI unit, rotations in degrees, as in `-60 to 60 deg`."""
    factor, name = shown_unit(unit)
    return f"{low * factor:.{digits}g} to {high * factor:.{digits}g} {name}".strip()


def _digits_before(number: float) -> float:
    """Distance of a number from the range 1 to 1000, in decades."""
    decades = math.log10(abs(number)) if number else 0.0
    return max(0.0, -decades, decades - 3)


def _nearest(number: Fraction) -> float:
    """Return the float nearest to `number`, infinite if it is too large."""
    try:
        return float(number)
    except OverflowError:
        return math.inf if number > 0 else -math.inf


def _plain(value: float) -> str:
    """Return the shortest exact text of a float, without a trailing `.0`."""
    return repr(float(value)).removesuffix(".0")
