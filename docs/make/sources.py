"""Measurements that ship with the studies: a table of studies/nectosome_studies/sources.toml."""

import tomllib
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
PAPERS = ROOT / "studies" / "nectosome_studies"
_HEADS = ("measured", "by", "from", "licence", "study", "file", "kB", "SHA-256")


def measurements() -> str:
    """A row a file, with what is told of its set in the first one; then the files that were computed."""
    declared = tomllib.loads((PAPERS / "sources.toml").read_text(encoding="utf-8"))
    lines = [f"| {' | '.join(_HEADS)} |", "|---|---|---|---|---|---|---:|---|"]
    for one in declared["measured"].values():
        told = _told(one)
        for file, digest in one["files"].items():
            size = (PAPERS / file).stat().st_size / 1000
            lines.append(f"| {' | '.join([*told, f'`{file}`', f'{size:.3g}', f'`{digest}`'])} |")
            told = [""] * len(told)
    computed = [
        f"Computed by us with `{script}`, not measured: {', '.join(f'`{file}`' for file in files)}."
        for script, files in declared["computed"].items()
    ]
    return "\n\n".join(["\n".join(lines), *computed])


def _told(one: dict[str, Any]) -> list[str]:
    """First cells of a set."""
    name = one["repository"].rsplit("/", 1)[1]
    changed = "as it is there" if one["changes"] == "none" else f"changed: {one['changes']}"
    origin = f"[{name}]({one['repository']}), {changed}; {one['paper']}"
    return [one["what"], one["by"], origin, one["licence"], ", ".join(f"`{study}`" for study in one["studies"])]
