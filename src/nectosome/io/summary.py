"""What a result says, as lines of text and as JSON: a title, tables, notes, warnings, status and settings."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from rich.text import Text

from nectosome.io.tables import Branch, Number, Table, with_error, wrapped
from nectosome.units import count

_COLUMNS = 80
_COUNTS = ("steps", "rejected", "jacobians", "residuals", "cycles", "corrections", "equal_limbs")
_MULTIPLIER = ("multiplier", "multiplier_error")
_TIMES = {"seconds": "s", "period": "s", "growth": "1/s"}
_UNITS = dict.fromkeys((*_COUNTS, *_MULTIPLIER), "") | _TIMES  # of a solver's numbers


@dataclass(frozen=True)
class Summary:
    """What a result says; `print` shows it in 80 columns.

    - above: sentences before the tables; notes: those after them; warnings: with `warning: ` before them.
    - cautions: warnings of what the models leave out, which do not make the command fail.
    - attributes: those of a result: its status, the solver's counts, and its provenance with the settings.
    - values, facts: numbers and tables for JSON only, whose text is in notes or in `after`, which is text only.
    - parts: summaries of one kind, such as of recordings.
    """

    title: str = ""
    tables: Sequence[Table] = ()
    above: Sequence[str] = ()
    notes: Sequence[str] = ()
    warnings: Sequence[str] = ()
    cautions: Sequence[str] = ()
    attributes: Mapping[str, Any] = field(default_factory=dict)
    values: Mapping[str, Number] = field(default_factory=dict)
    facts: Sequence[Table] = ()
    after: Sequence[Table | Branch] = ()
    parts: Sequence["Summary"] = ()

    def __str__(self) -> str:
        return "\n".join(line.plain for line in self.lines(_COLUMNS))

    def to_json(self) -> dict[str, Any]:
        """All of it, with the keys that the option's help and the page on the command line name."""
        given = self.attributes
        made = json.loads(given.get("provenance") or "{}")
        numbers = {key: Number(float(given[key]), unit) for key, unit in _UNITS.items() if key in given} | {
            **self.values
        }
        return {
            "title": self.title,
            "status": given.get("status"),
            "status_reason": given.get("status_reason"),
            "settings": made.pop("settings", {}),
            "made_with": made,
            "values": {key: value.to_json() for key, value in numbers.items()},
            "tables": {table.key: table.to_json() for table in (*self.tables, *self.facts)},
            "notes": [*self.above, *self.notes],
            "warnings": [*self.warnings, *self.cautions],
            **({"parts": [part.to_json() for part in self.parts]} if self.parts else {}),
        }

    def lines(self, width: int) -> Iterator[Text]:
        """Lines of text, each part of the page after an empty one."""
        parts = [
            [Text(line, "bold") for line in wrapped(self.title, width)] if self.title else [],
            [Text(text) for line in self.above for text in wrapped(line, width, _deeper(line))],
            *([*table.lines(width)] for table in self.tables),
            [Text(text) for line in self._sentences() for text in wrapped(line, width)],
            *([*thing.lines(width)] for thing in (*self.after, *self.parts)),
        ]
        for k, part in enumerate(filter(None, parts)):
            yield from [Text()] if k else []
            yield from part

    def _sentences(self) -> Iterator[str]:
        """Notes, warnings, and the status with steps, iterations and time of the computation."""
        yield from self.notes
        yield from (f"warning: {words}" for words in (*self.warnings, *self.cautions))
        if words := [str(self.attributes[key]) for key in ("status", "status_reason") if self.attributes.get(key)]:
            yield f"status: {', '.join(words)}{_effort(self.attributes)}"


def _deeper(line: str) -> str:
    """What later lines begin with: nothing in a paragraph, twice the blanks of a line that is indented."""
    return 2 * line[: len(line) - len(line.lstrip())]


def _effort(attributes: Mapping[str, Any]) -> str:
    """Steps, iterations and time, as far as they are known."""
    parts = []
    if "steps" in attributes:
        method = "implicit" if "jacobians" in attributes else "explicit"
        parts.append(f"{attributes['steps']} {method} steps, {attributes.get('rejected', '?')} rejected")
    if {"cycles", "corrections"} <= attributes.keys():
        parts.append(
            f"{count(int(attributes['cycles']), 'cycle')}, {count(int(attributes['corrections']), 'correction')}"
        )
    if "multiplier" in attributes:
        largest, error = (float(attributes.get(key, 0.0)) for key in _MULTIPLIER)
        parts.append(f"largest multiplier {with_error(largest, error)}")
        if abs(largest - 1) <= error:
            parts.append("which leaves it open whether disturbances grow")
    if "jacobians" in attributes and "residuals" in attributes:
        parts.append(f"{attributes['residuals']} residuals, {attributes['jacobians']} Jacobians")
    if "seconds" in attributes:
        parts.append(f"{attributes['seconds']:.1f} s to compute")
    return "".join(f"; {part}" if i == 0 else f", {part}" for i, part in enumerate(parts))
