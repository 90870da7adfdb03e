"""Renew what the pages take from the code and from the last `make reproduce`: tables, help texts, files, numbers.

It stands in the pages themselves, between `<!-- generated: NAME -->` and `<!-- end -->`, so that they can be read
without building anything. `python docs/make/generate.py` renews all of it; `--check` names the pages that are out of
date and ends with exit code 1. Long lists that the source itself has (names of Python, messages) are empty in the
clone; the site is built with them.
"""

import re
import sys
from collections.abc import Callable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "studies"))  # of this clone, installed or not

import commands
import fields
import messages
import python_pages
import results
import sources

ROOT = Path(__file__).parents[2]
_MARKED = re.compile(r"(<!-- generated: ([\w-]+) ?([^ ]*) -->\n).*?(<!-- end -->)", re.DOTALL)
ON_SITE: dict[str, Callable[..., str]] = {"api": python_pages.room, "messages": messages.messages}
_IN_CLONE = "*The list is made of the code: `make docs` builds the site with it.*"
FROM_CODE: dict[str, Callable[..., str]] = {
    "face": python_pages.face,
    "commands": commands.help_texts,
    "fields": fields.tables,
    "file-kinds": fields.file_kinds,
    "held": results.held,
    "file": lambda path: code_block(ROOT / path),
    "measurements": sources.measurements,
    "kinds": results.kinds,
    "quantities": fields.quantities,
    "ranges": fields.ranges,
    "robot": results.robot_file,
    "signals": fields.signals,
    "spreads": fields.spreads,
    "statuses": messages.statuses,
    "units": fields.units,
    "validation": results.validation,
    "which-load": fields.which_load,
}
FROM_RESULTS: dict[str, Callable[..., str]] = {
    "attacks": results.attacks,
    "faults": results.faults,
    "better-water": results.better_water,
    "checks": results.checks,
    "evidence": results.evidence,
    "gallery": results.gallery,
    "limb": results.limb,
    "misprints": results.misprints,
    "numbers": results.numbers,
    "rexeel": results.rexeel,
    "scorecard": results.scorecard,
    "trust": results.trust,
    "vortex": results.vortex,
}


def code_block(file: Path) -> str:
    """A file as it stands in the clone."""
    text = file.read_text(encoding="utf-8").rstrip()
    return f"```{file.suffix.removeprefix('.')}\n{text}\n```"


def pages() -> list[Path]:
    """All pages, the README among them."""
    return [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


def renewed(text: str, on_site: bool = False) -> str:
    """A page with everything in it that comes from the code, and from results where there are any."""

    def anew(found: re.Match[str]) -> str:
        begin, name, argument, end = found.groups()
        if name in ON_SITE:
            made = ON_SITE[name](*[argument] if argument else []) if on_site else _IN_CLONE
            return f"{begin}\n{made.strip()}\n\n{end}"
        if name not in FROM_CODE and not results.there(name, argument):
            return found[0]
        made = (FROM_CODE | FROM_RESULTS)[name](*[argument] if argument else [])
        return f"{begin}\n{made.strip()}\n\n{end}"

    return _MARKED.sub(anew, text)


def main() -> int:
    """Renew all pages, or name those that are out of date."""
    late = []
    for page in pages():
        text = page.read_text(encoding="utf-8")
        if (new := renewed(text)) != text:
            late.append(str(page.relative_to(ROOT)))
            if "--check" not in sys.argv:
                page.write_text(new, encoding="utf-8")
    print("\n".join(late) or "nothing has changed")
    return int("--check" in sys.argv and bool(late))


if __name__ == "__main__":
    sys.exit(main())
