"""Text with a unit to SI and back, exactly: `parse_quantity(format_quantity(x)) == x` for every finite x."""

import math
import re
from fractions import Fraction
from functools import cache
from typing import SupportsFloat

from .dimensions import DIMENSIONS, Dimension
from .errors import InputError, shorten
from .spellings import spelled
from .unit_list import Unit, UnknownUnitError, read_unit


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


@cache
def _unit(text: str) -> tuple[Fraction, dict[str, float]]:
    """Return the scale to (gram, metre, second, radian) and the exponents of a unit; ValueError with the reason."""
    try:
        if len(text) > 40:
            raise ValueError(text)
        unit = read_unit(text)
        return unit.value, unit.dimension
    except UnknownUnitError as error:
        raise ValueError(f"has no unit called {error}") from None
    except ValueError:
        raise ValueError(f"has no readable unit ({shorten(text, 40)})") from None


def written_unit(unit: Unit) -> str:
    """A product of SI units as text: that of `DIMENSIONS` where there is one, else such as `m/s/W`; "" of a number."""
    powers = unit.symbols
    above = [f"{name}{power:g}" if power != 1 else name for name, power in powers.items() if power > 0]
    below = [f"/{name}{-power:g}" if power != -1 else f"/{name}" for name, power in powers.items() if power < 0]
    text = (" ".join(above) or "1" * bool(below)) + "".join(below)
    units = [dimension.unit for dimension in DIMENSIONS.values()]
    if text in units or any(power % 1 for power in powers.values()):
        return text
    return next((known for known in units if _unit(known) == (unit.value, unit.dimension)), text)


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
