"""Products of unit texts in `attrs["units"]`: symbols and their powers, without conversion."""

import re

_FACTOR = re.compile(r"([^\W\d_]+|%)(-?\d+)?")


def product(*factors: tuple[str, int]) -> str:
    """Unit of a product of powers: `product(("m/s", 2), ("Hz", -1))` is `m2/(s2 Hz)`; "1" if all cancel.

    A text with anything but symbols, powers, one slash and blanks counts as one symbol, in parentheses.
    """
    powers: dict[str, int] = {}
    for text, power in factors:
        for symbol, exponent in _read(text).items():
            powers[symbol] = powers.get(symbol, 0) + exponent * power
    above = " ".join(_write(symbol, n) for symbol, n in powers.items() if n > 0)
    below = [_write(symbol, -n) for symbol, n in powers.items() if n < 0]
    if not below:
        return above or "1"
    return f"{above or '1'}/{below[0] if len(below) == 1 else '(' + ' '.join(below) + ')'}"


def _read(text: str) -> dict[str, int]:
    above, _, below = re.sub(r"[*·]", " ", text.replace("**", "").replace("^", "")).partition("/")
    if below.startswith("(") and below.endswith(")"):
        below = below[1:-1]
    elif " " in below:
        return {f"({text})": 1}  # "N/m s" is ambiguous
    powers: dict[str, int] = {}
    for part, sign in ((above, 1), (below, -1)):
        for factor in part.split():
            if factor == "1":
                continue
            match = _FACTOR.fullmatch(factor)
            if match is None or factor == "or":
                return {f"({text})": 1}
            powers[match[1]] = powers.get(match[1], 0) + sign * int(match[2] or 1)
    return powers


def _write(symbol: str, power: int) -> str:
    return symbol if power == 1 else f"{symbol}{power}"
