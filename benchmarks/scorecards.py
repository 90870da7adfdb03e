"""Two scorecards side by side: `python -m benchmarks.scorecards before.json after.json` lists the rows that differ.

A row differs where its number has changed by more than 1e-9 of itself, or where its text has. Exit code 1 if any does.
"""

import json
import sys
from pathlib import Path
from typing import Any

TOLERANCE = 1e-9  # relative
_TEXTS = ("quantity", "unit", "printed", "tolerance", "verdict", "kind")


def rows(path: str) -> dict[str, dict[str, Any]]:
    """Rows of a scorecard by id."""
    return {row["id"]: row for row in json.loads(Path(path).read_text(encoding="utf-8"))["rows"]}


def change(before: float | None, after: float | None) -> float:
    """Relative change of a number; infinite where only one of the two is there."""
    if before is None or after is None:
        return 0.0 if before is after else float("inf")
    return abs(after - before) / max(abs(before), abs(after)) if before != after else 0.0


def main(before: str, after: str) -> int:
    """Print what differs, and how many rows of each study agree."""
    old, new = rows(before), rows(after)
    found = [f"{key}: only in {before if key in old else after}" for key in sorted(old.keys() ^ new.keys())]
    largest: dict[str, float] = {}
    for key in sorted(old.keys() & new.keys()):
        far = change(old[key]["ours"], new[key]["ours"])
        study = key.partition("/")[0]
        largest[study] = max(largest.get(study, 0.0), far)
        if far > TOLERANCE:
            found.append(f"{key}: {old[key]['ours']} -> {new[key]['ours']} ({far:.1e})")
        texts = [name for name in _TEXTS if old[key][name] != new[key][name]]
        found += [f"{key}, {name}: {old[key][name]!r} -> {new[key][name]!r}" for name in texts]
    print("\n".join(found) if found else "no row differs")
    for study, far in largest.items():
        count = sum(key.startswith(f"{study}/") for key in old.keys() & new.keys())
        print(f"| {study} | {count} rows | largest relative change {far:.1e} |")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
