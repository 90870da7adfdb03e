"""Units as instruments, loggers and people write them, in the spelling that `conversion` reads: "Kg f" is "kgf"."""

import re
import unicodedata
from collections.abc import Callable

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
