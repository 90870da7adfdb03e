"""The scorecard as a table: what was printed, what was computed here, and how they compare."""

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from nectosome.units import count

from .markup import plain

Row = Mapping[str, Any]

VERDICTS = {"match": ("✓", "#0072B2"), "better": ("▲", "#00714f"), "differs": ("✗", "#b34700")}  # symbols and colours
_HEADS = ("id", "quantity", "printed", "source", "ours", "error", "tolerance", "verdict", "kind")
_NONE = "-"
_NUMBERS = ("printed", "ours", "error", "tolerance")


def number(value: float | None, unit: str = "") -> str:
    """Number with four digits and its unit; a dash where there is none."""
    unit = {"percent": "%"}.get(unit, unit)
    if value is None or value != value:
        return _NONE
    if value != 0 and not 1e-3 <= abs(value) < 1e6:
        digits = f"{value:.3e}".replace("e-0", "e-").replace("e+0", "e").replace("e+", "e")
    else:
        digits = f"{value:.4g}" if abs(value) < 1e4 else f"{value:.0f}"
    return f"{digits} {unit}" if unit not in ("", "1", "-") else digits


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
    """HTML table of texts."""
    head = "".join(f"<th>{plain(h)}</th>" for h in heads)
    body = "\n".join(f"<tr>{''.join(f'<td>{plain(cell)}</td>' for cell in row)}</tr>" for row in rows)
    return f'<div class="wide"><table>\n<thead><tr>{head}</tr></thead>\n<tbody>\n{body}\n</tbody></table></div>'


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


def _row(row: Row) -> str:
    symbol, style = (VERDICTS[row["verdict"]][0], row["verdict"]) if row["verdict"] else (_NONE, "no")
    unit = row["unit"] or ""
    note = f'<div class="small">{plain(row["note"])}</div>' if row["note"] else ""
    return (
        f"<tr><td><code>{plain(row['id']).replace('/', '/<wbr>')}</code></td>"
        f'<td class="quantity">{plain(row["quantity"])}{note}</td>'
        f'<td class="number">{plain(number(row["printed"], unit))}</td>'
        f"<td>{plain(row['source'])}</td>"
        f'<td class="number">{plain(number(row["ours"], unit))}</td>'
        f'<td class="number">{percent(row["error"])}</td><td class="number">{percent(row["tolerance"])}</td>'
        f'<td class="verdict {style}">{symbol} {plain(row["verdict"])}</td><td>{plain(row["kind"])}</td></tr>'
    )
