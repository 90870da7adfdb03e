"""Rows of two scorecards that are not the same: `python -m benchmarks.same_rows before.json after.json [TOLERANCE]`.

Numbers may differ by a relative tolerance, 1e-9 without another. Seconds of computing are left out. Exit code 1 where
rows differ, or where one scorecard lacks rows of a study that both have.
"""

import json
import math
import sys
from pathlib import Path
from typing import Any

TIMED = ("/seconds", "/wall-time")  # ends of rows that no two runs have alike


def read(path: str) -> dict[str, dict[str, Any]]:
    return {row["id"]: row for row in json.loads(Path(path).read_text(encoding="utf-8"))["rows"]}


def off(one: Any, other: Any) -> float:
    """Relative difference of two numbers, or lists of them; 0 where both are alike, inf where one is no number."""
    if isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        return max(map(off, one, other), default=0.0)
    if one == other:
        return 0.0
    if isinstance(one, float | int) and isinstance(other, float | int):
        return abs(one - other) / max(abs(one), abs(other))
    return math.inf


def differences(before: dict[str, dict[str, Any]], after: dict[str, dict[str, Any]], tolerance: float) -> list[str]:
    """A line for each row that differs, or that only one has, of the studies that both have."""
    both = {row.partition("/")[0] for row in before} & {row.partition("/")[0] for row in after}
    lines = []
    for row in sorted(before | after):
        if row.partition("/")[0] not in both or row.endswith(TIMED):
            continue
        if row not in before or row not in after:
            lines.append(f"{row}: only in the {'first' if row in before else 'second'}")
            continue
        for field, value in before[row].items():
            other = after[row].get(field)
            if value != other and not (isinstance(value, float | list) and off(value, other) <= tolerance):
                lines.append(f"{row}, {field}: {value!r}, {other!r} (relative {off(value, other):.2g})")
    return lines


def main(before: str, after: str, tolerance: str = "1e-9") -> int:
    """Print the differences."""
    first, second = read(before), read(after)
    lines = differences(first, second, float(tolerance))
    print("\n".join(lines) or f"{len(first.keys() & second.keys())} rows are the same.")
    return bool(lines)


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
