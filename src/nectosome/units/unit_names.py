"""Units: the SI unit of each dimension and its display units, and other spellings of units: "Kg f" is "kgf"."""

import re
import unicodedata
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

MeshUnit = Literal["m", "cm", "mm", "in", "ft"]  # of a file of a mesh, which does not tell it
# one word, in lower case; these have one meaning whatever their case
_WORDS = {
    **dict.fromkeys(("amp", "amps"), "A"),
    **dict.fromkeys(("milliamp", "milliamps"), "mA"),
    **dict.fromkeys(("inches", "inchs"), "in"),
    **dict.fromkeys(("feet", "foot"), "ft"),
    **dict.fromkeys(("hr", "hrs"), "h"),
    **dict.fromkeys(("millis", "millisec", "millisecs"), "ms"),
    **dict.fromkeys(("micros", "microsec", "microsecs"), "us"),
    **dict.fromkeys(("nanos", "nanosec", "nanosecs"), "ns"),
    **dict.fromkeys(("msec", "msecs"), "ms"),
    **dict.fromkeys(("usec", "usecs"), "us"),
    **dict.fromkeys(("nsec", "nsecs"), "ns"),
    **dict.fromkeys(("sec", "secs"), "s"),
    **dict.fromkeys(("mins",), "min"),
    **dict.fromkeys(("psi", "psig", "psia"), "psi"),
    **dict.fromkeys(("bar", "barg", "bara"), "bar"),
    **dict.fromkeys(("lpm", "slpm"), "L/min"),
    **dict.fromkeys(("count", "counts", "cts", "ticks", "lsb", "frame", "frames"), "count"),
    **dict.fromkeys(("pixel", "pixels", "px", "pix"), "px"),
    **dict.fromkeys(("bl", "bodylength", "bodylengths"), "BL"),
    **dict.fromkeys(("micron", "microns"), "um"),
    **dict.fromkeys(("ustrain", "microstrain"), "microstrain"),
    **dict.fromkeys(("knot", "knots", "kts"), "knot"),
    **dict.fromkeys(("kph", "kmh"), "km/h"),
    **dict.fromkeys(("degs", "deg"), "deg"),
    "dps": "deg/s",
    "mdps": "mdeg/s",
    "sccm": "cm3/min",
    "mbar": "mbar",
    "hpa": "hPa",
    "kpa": "kPa",
    "hz": "Hz",
    "khz": "kHz",
    "rpm": "rpm",
    "kg": "kg",
    "kgf": "kgf",
    "lbf": "lbf",
    "cm": "cm",
    "mm": "mm",
}
_EXACT = {"Mpa": "MPa", "MPA": "MPa", "L": "L", "l": "L"}  # "mpa" may be either prefix
_PHRASES = [
    (re.compile(pattern, re.IGNORECASE), unit)
    for pattern, unit in (
        (r"\b(?:kg[\s._-]*f|kilogram[\s_-]*force|kp)\b", "kgf"),
        (r"\b(?:g[\s._-]*f|gram[\s_-]*force)\b", "gf"),
        (r"\blbs?[\s._-]*f\b|\bpounds?[\s_-]*force\b", "lbf"),
        (r"\boz[\s._-]*f\b", "ozf"),
        (r"\bmm[\s_]*Hg\b", "mmHg"),
        (r"\bcm[\s_]*H2O\b", "cmHHO"),
        (r"\bmm[\s_]*H2O\b", "mmHHO"),
        (r"\br/min\b", "rpm"),
        (r"\bmicro[\s_-]*strain\b", "microstrain"),
        # a torque, as on servos and wrenches; an inertia has a square
        (r"\bkgf?[\s.*-]*cm\b(?![\s]*[\d^*²])", "kgf cm"),
        (r"\b(?:ft|foot)[\s.*-]*lbs?\b|\blbs?[\s.*-]*ft\b", "ft lbf"),
        (r"\b(?:in|inch)[\s.*-]*lbs?\b|\blbs?[\s.*-]*in(?:ch)?\b", "in lbf"),
        (r"\b(?:in|inch)[\s.*-]*oz\b|\boz[\s.*-]*in(?:ch)?\b", "in ozf"),
    )
]
_CELSIUS = r"(?:°\s*|deg(?:rees?)?\.?[\s_]*)C(?:elsius)?|celsius"
_FAHRENHEIT = r"(?:°\s*|deg(?:rees?)?\.?[\s_]*)F(?:ahrenheit)?|fahrenheit"
_TEMPERATURES = {
    "degC": re.compile(_CELSIUS, re.IGNORECASE),
    "degF": re.compile(_FAHRENHEIT, re.IGNORECASE),
}
# fmt: off
_SIGNS = str.maketrans({"º": "°", "˚": "°", "⋅": "*", "•": "*", "∙": "*", "·": "*", "×": "*", "−": "-", "–": "-"})  # noqa: RUF001
# fmt: on
_WORD = re.compile(r"[A-Za-zµμ°]+")
_POINT = re.compile(r"(?<=[A-Za-zμ°\d)])\s*\.\s*(?=[A-Za-zμ°(])|(?<=[A-Za-zμ])-(?=[A-Za-zμ])")


@dataclass(frozen=True)
class Dimension:
    """A dimension: its `name` for users, its SI `unit`, an `example`, and other display units."""

    name: str
    unit: str
    example: str
    display: tuple[str, ...] = ()

    def with_article(self) -> str:
        """Return the name with its article: `a length`, `an angle`."""
        return f"{'an' if self.name[0] in 'aeiou' else 'a'} {self.name}"


DIMENSIONS = {
    "number": Dimension("number", "", '"0.5"'),
    "length": Dimension("length", "m", '"85 mm" or "0.085 m"', ("mm", "um", "km")),
    "area": Dimension("area", "m2", '"0.0125 m2" or "125 cm2"', ("cm2", "mm2")),
    "volume": Dimension("volume", "m3", '"0.4 L" or "4e-4 m3"', ("L", "mL")),
    "mass": Dimension("mass", "kg", '"0.427 kg" or "427 g"', ("g",)),
    "density": Dimension("density", "kg/m3", '"1062 kg/m3" or "1.062 g/cm3"'),
    "inertia": Dimension("moment of inertia", "kg m2", '"1.2e-4 kg m2"', ("g mm2",)),
    "pressure": Dimension("pressure", "Pa", '"7.4 MPa" or "7.4e6 Pa"', ("kPa", "MPa", "GPa")),
    "elastance": Dimension("elastance", "Pa/m3", '"1e7 Pa/m3" or "10 kPa/L"', ("kPa/L",)),
    "viscosity": Dimension("viscosity", "Pa s", '"3000 Pa s" or "3 kPa s"'),
    "angle": Dimension("angle", "rad", '"45 deg" or "0.785 rad"', ("deg",)),
    "curvature": Dimension("curvature", "rad/m", '"2.5 rad/m" or "2.5 1/m"'),
    "time": Dimension("time", "s", '"0.5 s" or "500 ms"', ("ms",)),
    "frequency": Dimension("frequency", "Hz", '"2.3 Hz" or "2.3 1/s"', ("kHz",)),
    "angular_speed": Dimension("angular speed", "rad/s", '"14.4 rad/s" or "137 rpm"', ("deg/s", "rpm")),
    "speed": Dimension("speed", "m/s", '"0.2 m/s" or "20 cm/s"', ("mm/s",)),
    "acceleration": Dimension("acceleration", "m/s2", '"9.81 m/s2"'),
    "force": Dimension("force", "N", '"1.5 N" or "1500 mN"', ("mN", "kN")),
    "torque": Dimension("torque", "N m", '"0.5 N m" or "5 kgf cm"', ("mN m",)),
    "power": Dimension("power", "W", '"5 W" or "500 mW"', ("mW", "kW")),
    "line_force": Dimension("force per length", "N/m", '"2.5 N/m"', ("mN/m",)),
    "angular_stiffness": Dimension("angular stiffness", "N m/rad", '"0.5 N m/rad"', ("mN m/rad",)),
    "angular_damping": Dimension("angular damping", "N m s/rad", '"0.01 N m s/rad"', ("mN m s/rad",)),
    "stiffness": Dimension("stiffness", "N/m", '"200 N/m"', ("kN/m",)),
    "quadratic_drag": Dimension("drag by squared speed", "kg/m", '"0.03 kg/m"'),
    "voltage": Dimension("voltage", "V", '"2.5 V" or "2500 mV"', ("mV",)),
    "current": Dimension("current", "A", '"0.3 A" or "300 mA"', ("mA",)),
    "resistance": Dimension("resistance", "ohm", '"0.05 ohm" or "50 mohm"', ("mohm",)),
    "torque_constant": Dimension("torque per current", "N m/A", '"1.42 N m/A" or "12 mN m/A"', ("mN m/A",)),
    "charge": Dimension("charge", "A s", '"7 Ah" or "7000 mAh"', ("Ah", "mAh")),
    "energy": Dimension("energy", "J", '"52 Wh" or "187 kJ"', ("Wh", "mJ", "kJ")),
    "energy_per_length": Dimension("energy per length", "J/m", '"2.5 J/m" or "0.7 Wh/km"', ("Wh/km",)),
    "temperature": Dimension("temperature", "K", '"293.15 K"'),
    "damping": Dimension("damping", "N s/m", '"3 N s/m"'),
    "pressure_rate": Dimension("pressure rate", "Pa/s", '"3.8 bar/s" or "380 kPa/s"', ("kPa/s",)),
    "force_rate": Dimension("force rate", "N/s", '"2.5 N/s"'),
    "torque_rate": Dimension("torque rate", "N m/s", '"0.5 N m/s"', ("mN m/s",)),
    "voltage_rate": Dimension("voltage rate", "V/s", '"0.5 V/s"', ("mV/s",)),
    "angular_acceleration": Dimension("angular acceleration", "rad/s2", '"20 rad/s2"'),
    "pressure_per_volt": Dimension("pressure per volt", "Pa/V", '"0.2 bar/V" or "20 kPa/V"', ("kPa/V",)),
    "length_per_pressure": Dimension("length per pressure", "m/Pa", '"25 mm/bar"', ("mm/kPa",)),
    "curvature_rate": Dimension("curvature rate", "rad/m/s", '"2.5 rad/m/s" or "2.5 1/m/s"'),
    "strain_rate": Dimension("strain rate", "1/s", '"0.1 1/s"'),
    "length_per_volt": Dimension("length per volt", "m/V", '"8 mm/V"', ("mm/V",)),
}


def dimension_of(unit: str) -> str:
    """Return the key of `DIMENSIONS` whose SI unit is `unit`, the first of several; `number` where there is none."""
    return next((name for name, kind in DIMENSIONS.items() if kind.unit == unit), "number")


def spelled(text: str, known: Callable[[str], bool]) -> str:
    """Return a unit in the spelling of `conversion`; words that are not `known` there, nor here, stay as they are.

    Temperatures on a scale with a zero of its own become `degC` and `degF`. A point or a hyphen between two units is a
    product; case is ignored only where no other unit differs by it.
    """
    if len(text) > 40:
        return text
    text = text.translate(_SIGNS)  # before NFKC, which makes a letter of º and a blank and a ring of ˚
    text = unicodedata.normalize("NFKC", text).translate(_SIGNS).strip()
    text = text.replace("Ω", "ohm").replace("ε", "strain").replace("µstrain", "microstrain")
    text = text.replace("μstrain", "microstrain").replace("‰", "permille").replace("%", "percent")
    for unit, pattern in _TEMPERATURES.items():
        if pattern.fullmatch(text):
            return unit
    text = _TEMPERATURES["degC"].sub("K", text) if "/" in text else text  # a difference of temperatures
    for pattern, unit in _PHRASES:
        text = pattern.sub(unit, text)
    return _POINT.sub(" ", _WORD.sub(lambda word: _word(word[0], known), text)).removesuffix(".")


def _word(word: str, known: Callable[[str], bool]) -> str:
    if known(word):
        return word
    lower = word.lower()
    spelling = _EXACT.get(word) or _WORDS.get(lower)
    return spelling or (lower if len(lower) > 3 and known(lower) else word)
