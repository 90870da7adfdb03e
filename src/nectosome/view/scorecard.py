"""The scorecard as a table: what was printed, what was computed here, and how they compare."""

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from nectosome.units import count, unit_to_si

from .markup import plain

Row = Mapping[str, Any]

VERDICTS = {"match": ("✓", "#0072B2"), "better": ("▲", "#00714f"), "differs": ("✗", "#b34700")}  # symbols and colours
_HEADS = ("id", "quantity", "printed", "source", "ours", "error", "tolerance", "verdict", "kind")
_NONE = "-"
_SHORT = 24  # characters, of a range with its unit
_NUMBERS = ("printed", "ours", "error", "tolerance")


def number(value: float | None, unit: str = "", figures: int = 4) -> str:
    """Number with so many digits, those before the point always, and its unit; a dash where there is none."""
    unit = {"percent": "%"}.get(unit, unit)
    if value is None or value != value:
        return _NONE
    if value != 0 and not 1e-3 <= abs(value) < 1e6:
        digits = f"{value:.{figures - 1}e}".replace("e-0", "e-").replace("e+0", "e").replace("e+", "e")
    else:
        digits = f"{value:.{figures}g}" if abs(value) < 10**figures - 0.5 else f"{value:.0f}"
    return f"{digits} {unit}" if unit not in ("", "1", "-") else digits


def ends(printed: float | Sequence[float]) -> tuple[float, float]:
    """Lowest and highest of what is printed: a number, or a range (low, high)."""
    low, high = printed if isinstance(printed, Sequence) else (printed, printed)
    return low, high


def in_shown_unit(row: Row, which: str) -> tuple[list[float], str]:
    """Numbers of a row, `printed` or `ours`, and the unit in which people read them: none, one, or both of a range."""
    unit = row.get("shown", row["unit"])
    factor = 1.0 if unit == row["unit"] else unit_to_si(row["unit"])[0] / unit_to_si(unit)[0]
    return ([] if row[which] is None else [factor * x for x in dict.fromkeys(ends(row[which]))]), unit


def shown(row: Row, which: str) -> str:
    """A row's `printed` or `ours` as text, in the unit in which people read it; a dash where there is none."""
    values, unit = in_shown_unit(row, which)
    return " to ".join([*(number(x) for x in values[:-1]), number(values[-1] if values else None, unit)])


def percent(value: float | None) -> str:
    """Percentage with two digits that count."""
    if value is None or value != value:
        return _NONE
    return f"{value:.2f} %" if abs(value) >= 0.1 or value == 0 else f"{value:.1g} %"


def table(rows: Sequence[Row]) -> str:
    """HTML table of scorecard rows."""
    heads = "".join(f'<th class="{"number" if h in _NUMBERS else ""}">{h}</th>' for h in _HEADS)
    body = "\n".join(_row(row) for row in rows)
    return f'<div class="wide"><table>\n<thead><tr>{heads}</tr></thead>\n<tbody>\n{body}\n</tbody></table></div>'


def plain_table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """HTML table of texts; short ones that begin with a number stay on one line."""
    head = "".join(f"<th>{plain(h)}</th>" for h in heads)
    body = "\n".join(f"<tr>{''.join(map(_text_cell, row))}</tr>" for row in rows)
    return f'<div class="wide"><table>\n<thead><tr>{head}</tr></thead>\n<tbody>\n{body}\n</tbody></table></div>'


def _text_cell(text: str) -> str:
    short = ' class="short"' if len(text) <= _SHORT and text.lstrip("-")[:1].isdigit() else ""
    return f"<td{short}>{plain(text)}</td>"


def summary(rows: Sequence[Row]) -> str:
    """How many rows there are of each verdict, and of each kind that has none, in a sentence."""
    verdicts = Counter(row["verdict"] for row in rows if row["verdict"])
    others = Counter(row["kind"] for row in rows if not row["verdict"])
    plural = {"differs": "differ"}
    words = (f"{n} {word if n == 1 else plural.get(word, word)}" for word, n in verdicts.most_common())
    judged, unjudged = ", ".join(words), ", ".join(f"{n} {kind}" for kind, n in others.most_common())
    told = "; without a verdict: ".join(part for part in (judged, unjudged) if part)
    told = told if judged else f"without a verdict: {told}"
    return f"{count(len(rows), 'row')}: {told}." if rows else "No rows."


def _within(row: Row) -> str:
    """The tolerance: of a printed zero in its unit."""
    if row.get("within") is not None:
        return plain(number(row["within"], row["unit"]))
    return "equal" if row["tolerance"] == 0 else percent(row["tolerance"])


def _row(row: Row) -> str:
    symbol, style = (VERDICTS[row["verdict"]][0], row["verdict"]) if row["verdict"] else (_NONE, "no")
    note = f'<div class="small">{plain(row["note"])}</div>' if row["note"] else ""
    return (
        f"<tr><td><code>{plain(row['id']).replace('/', '/<wbr>')}</code></td>"
        f'<td class="quantity">{plain(row["quantity"])}{note}</td>'
        f'<td class="number">{plain(shown(row, "printed"))}</td>'
        f"<td>{plain(row['source'])}</td>"
        f'<td class="number">{plain(shown(row, "ours"))}</td>'
        f'<td class="number">{percent(row["error"])}</td><td class="number">{_within(row)}</td>'
        f'<td class="verdict {style}">{symbol} {plain(row["verdict"])}</td><td>{plain(row["kind"])}</td></tr>'
    )
