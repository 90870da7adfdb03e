"""Write what the pages take from the code and from the last `make reproduce`: tables, help texts, numbers, the picture.

Everything goes to docs/generated, except the pictures, the robots of the gallery and the table of the README, which are
renewed in place when the full studies have been run.
"""

import ast
import json
import os
import subprocess
import sys
from collections.abc import Iterator, Mapping
from importlib import import_module
from itertools import groupby
from pathlib import Path
from types import UnionType
from typing import Any, Literal, Union, get_args, get_origin

import numpy as np
from pydantic import BaseModel
from xarray import Dataset

from nectosome.description import RobotDescription
from nectosome.designs import QUANTITIES
from nectosome.io import load_dataset
from nectosome.io.schema.plain import to_plain
from nectosome.io.schema.structure import Slot, slot
from nectosome.papers.gallery.entries import ENTRIES, GalleryEntry
from nectosome.units import DIMENSIONS
from nectosome.view import write_still

ROOT = Path(__file__).parents[1]
OUT = ROOT / "out"
GENERATED = ROOT / "docs" / "generated"
COMMANDS = (
    "simulate",
    "static",
    "steady",
    "periodic",
    "sweep",
    "design",
    "measure",
    "track",
    "identify",
    "identify surge",
    "identify hysteresis",
    "identify gait",
    "correct",
    "control",
    "control rig",
    "new",
    "tutorial",
    "show",
    "render",
    "studio",
    "check",
    "schema",
    "reproduce",
)
PERIODS = 3  # of a robot of the gallery, along which its path is drawn
NOT_RUN = "Nothing has been computed here yet: `make reproduce` fills this page.\n"
NOT_TIMED = "Nothing has been timed here yet: `make bench` fills this section.\n"


def main() -> None:
    """Write all generated pages."""
    GENERATED.mkdir(exist_ok=True)
    rows = scorecard_rows()
    pages = {
        "robot_fields": robot_fields(),
        "units": units(),
        "quantities": quantities(),
        "commands": commands(),
        "validation": validation(),
        "scorecard": scorecard(rows) if rows else NOT_RUN,
        "benchmarks": benchmarks() or NOT_TIMED,
    }
    for name, text in pages.items():
        (GENERATED / f"{name}.md").write_text(text, encoding="utf-8")
    renew_gallery(rows)
    if rows and studied_in_full():
        renew_readme(rows)
        renew_picture()


# --- robot files -----------------------------------------------------------------------------------------------------


def models() -> list[type[BaseModel]]:
    """Every model a robot file may hold, found from the robot itself."""
    found: list[type[BaseModel]] = []
    waiting: list[Any] = [slot(RobotDescription)]
    while waiting:
        here = waiting.pop(0)
        if isinstance(here.hint, type) and issubclass(here.hint, BaseModel):
            if here.hint not in found:
                found.append(here.hint)
                waiting += [slot(f.annotation, tuple(f.metadata)) for f in here.hint.model_fields.values()]
        else:
            waiting += [slot(a) for a in get_args(here.hint)]
    return found


def robot_fields() -> str:
    """A section for each kind of thing, a table for each model."""
    parts = []
    homes = {m.__module__: None for m in models()}
    for home in homes:
        about = (import_module(home).__doc__ or "").splitlines()[0]
        title, _, rest = about.partition(": ")
        parts += [f"## {title.rstrip('.')}", f"{rest[:1].upper()}{rest[1:]}"]
        for model in models():
            if model.__module__ == home:
                parts += [f"### {words(model)} {{ #{anchor(model)} }}", prose(model.__doc__ or ""), _table(model)]
    return "\n\n".join(parts) + "\n"


def words(model: type[BaseModel]) -> str:
    """Name of a model for people: LumpedDragLoad is a lumped drag load."""
    name = "".join(f" {c.lower()}" if c.isupper() else c for c in model.__name__).strip()
    return name[:1].upper() + name[1:]


def anchor(model: type[BaseModel]) -> str:
    """Name of its section."""
    return words(model).lower().replace(" ", "-")


def prose(text: str) -> str:
    """Docstring without its indent."""
    return "\n".join(line.strip() for line in text.strip().splitlines())


def _table(model: type[BaseModel]) -> str:
    rows = ["| field | what | unit | range | if left out |", "|---|---|---|---|---|"]
    for name, field in model.model_fields.items():
        here = slot(field.annotation, tuple(field.metadata))
        what, unit, allowed = meaning(here)
        default = "**needed**" if field.is_required() else _default(field.get_default(call_default_factory=True), here)
        rows.append(f"| `{name}` | {what} | {unit} | {allowed} | {default} |")
    return "\n".join(rows)


def _default(value: Any, here: Slot) -> str:
    if value is None or (not isinstance(value, BaseModel) and not isinstance(value, float | int) and not value):
        return "none"
    plain = to_plain(value, here)
    if isinstance(plain, list):
        return f"`[{', '.join(map(str, plain))}]`"
    if isinstance(plain, dict):
        inner = ", ".join(f"{k}: {v}" for k, v in plain.items())
        return f"`{{{inner}}}`" if inner else "its own defaults"
    return f"`{plain}`"


def meaning(here: Slot) -> tuple[str, str, str]:
    """What belongs into a field, its SI unit, its range."""
    q = here.quantity
    if q is not None:
        kind = DIMENSIONS[q.dimension]
        bounded = q.minimum is not None or q.maximum is not None
        return kind.name, kind.unit, q.allowed() if bounded else "any"
    if any(type(m).__name__ == "_PlaceField" for m in here.metadata):
        return "`tip`, `root`, or one of the rod's marks", "", ""
    hint, args = here.hint, get_args(here.hint)
    origin = get_origin(hint)
    if isinstance(hint, type) and issubclass(hint, BaseModel):
        return f"[{words(hint).lower()}](#{anchor(hint)})", "", ""
    if origin in (Union, UnionType):
        links = [meaning(slot(a))[0] for a in args]
        return f"{', '.join(links[:-1])} or {links[-1]}", "", ""
    if origin is Literal:
        return " or ".join(f"`{a}`" for a in args), "", ""
    if origin is dict:
        what, unit, allowed = meaning(slot(args[1]))
        keys = meaning(slot(args[0]))[0] if get_origin(slot(args[0]).hint) is Literal else "name"
        return f"{keys}: {what}", unit, allowed
    if origin is tuple:
        what, unit, allowed = meaning(slot(args[0]))
        if any(type(m).__name__ == "NamedAxis" for m in here.metadata):
            return "`x`, `y`, `z` or three numbers", "", "not all zero"
        if args[-1] is Ellipsis:
            short = any(type(m).__name__ == "OneOrMany" for m in here.metadata)
            return f"{'one or ' if short else ''}several: {what}", unit, allowed
        return f"{len(args)} x {what}", unit, allowed
    names = {int: "whole number", float: "number", str: "text", bool: "yes or no"}
    return names[hint], "", _limits(here)


def _limits(here: Slot) -> str:
    words = {"ge": "at least", "gt": "more than", "le": "at most", "lt": "less than"}
    found = [f"{text} {getattr(m, key)}" for m in here.metadata for key, text in words.items() if hasattr(m, key)]
    return ", ".join(found)


def units() -> str:
    """Kinds of quantity, their SI units, and how they may be written."""
    rows = ["| quantity | SI unit | as in |", "|---|---|---|"]
    for kind in DIMENSIONS.values():
        example = kind.example.replace('"', "`")
        rows.append(f"| {kind.name} | {kind.unit or '1'} | {example} |")
    return "\n".join(rows) + "\n"


# --- design ---------------------------------------------------------------------------------------------------------


def quantities() -> str:
    """What a design may want or limit."""
    rows = ["| quantity | what | unit | wanted |", "|---|---|---|---|"]
    for q in QUANTITIES.values():
        rows.append(f"| `{q.name}` | {q.about} | {q.unit} | {q.best} |")
    return "\n".join(rows) + "\n"


# --- commands --------------------------------------------------------------------------------------------------------


def commands() -> str:
    """Help of every command, as the command line prints it."""
    environment = {**os.environ, "COLUMNS": "88", "NO_COLOR": "1", "TERM": "dumb"}
    parts = []
    for name in COMMANDS:
        argv = [sys.executable, "-m", "nectosome", *name.split(), "--help"]
        done = subprocess.run(argv, capture_output=True, text=True, check=True, env=environment)
        text = "\n".join(line.rstrip() for line in done.stdout.strip().splitlines())
        parts.append(f"## {name}\n\n```text\n{text}\n```")
    return "\n\n".join(parts) + "\n"


# --- validation ------------------------------------------------------------------------------------------------------


def validation() -> str:
    """Table of the validation cases, and what was left out and why."""
    sys.path.insert(0, str(ROOT))
    cases = import_module("tests.validation.cases")
    rows = ["| case | quantity | unit | expected | within | source |", "|---|---|---|---|---|---|"]
    for (name, source), group in groupby(cases.CASES, key=lambda case: (case.name, case.source)):
        for i, case in enumerate(group):
            first = (name, source) if i == 0 else ("", "")
            numbers = f"{case.expected:.6g} | {case.tolerance:.2g}"
            rows.append(f"| {_cell(first[0])} | {_cell(case.quantity)} | {case.unit} | {numbers} | {_cell(first[1])} |")
    text = f"{len(cases.CASES)} numbers are checked.\n\n" + "\n".join(rows) + "\n"
    if cases.OMITTED:
        text += "\n## Left out\n\n" + "\n".join(f"- {case.name}: {case.why}." for case in cases.OMITTED) + "\n"
    return text


# --- scorecard -------------------------------------------------------------------------------------------------------


def scorecard_rows() -> list[dict[str, Any]]:
    """Rows of the last run, none if there was none."""
    file = OUT / "scorecard.json"
    return json.loads(file.read_text(encoding="utf-8"))["rows"] if file.exists() else []


def studied_in_full() -> bool:
    """Whether the last run was the full study, not the quick one."""
    file = OUT / "flagellum" / "row1.nc"
    return file.exists() and json.loads(load_dataset(file).attrs["provenance"])["settings"].get("rtol", 1) <= 1e-5


def scorecard(rows: list[dict[str, Any]]) -> str:
    """All rows, then the notes of those that do not simply match."""
    lines = [
        "| quantity | unit | printed | ours | error (%) | within (%) | verdict | kind |",
        "|---|---|---:|---:|---:|---:|---|---|",
    ]
    for row in rows:
        numbers = " | ".join(_number(row[key]) for key in ("printed", "ours", "error", "tolerance"))
        verdict = row["verdict"]
        lines.append(f"| {_cell(row['quantity'])} | {row['unit']} | {numbers} | {verdict} | {row['kind']} |")
    notes = [f"- {row['quantity']}: {row['note']}" for row in rows if row["note"] and row["verdict"] != "match"]
    return "\n".join(lines) + "\n" + ("\n## Notes\n\n" + "\n".join(notes) + "\n" if notes else "")


# --- benchmarks ------------------------------------------------------------------------------------------------------


def benchmarks() -> str:
    """What each benchmark printed when it last ran, under what it is."""
    parts = []
    for file in sorted((OUT / "benchmarks").glob("*.txt")):
        script = ROOT / "benchmarks" / f"{file.stem}.py"
        about = (ast.get_docstring(ast.parse(script.read_text(encoding="utf-8"))) or "").splitlines()[0]
        parts += [f"### {file.stem}", about, f"```text\n{file.read_text(encoding='utf-8').rstrip()}\n```"]
    return "\n\n".join(parts) + "\n" if parts else ""


# --- gallery ---------------------------------------------------------------------------------------------------------


def renew_gallery(rows: list[dict[str, Any]]) -> None:
    """Draw the robots of the gallery, and write a section for each, where their last runs were full ones."""
    files = {entry.name: OUT / "gallery" / f"{entry.name}.nc" for entry in ENTRIES}
    runs = {name: load_dataset(file) for name, file in files.items() if file.exists()}
    by_id = {row["id"]: row for row in rows}
    there = len(runs) == len(ENTRIES) and all(name in by_id for entry in ENTRIES for name in entry.held)
    if not there or any(json.loads(run.attrs["provenance"])["settings"]["quick"] for run in runs.values()):
        return
    for entry in ENTRIES:
        portrait(runs[entry.name], entry.seen, ROOT / "docs/img" / f"gallery_{entry.name}.png")
    sections = "\n\n".join(section(entry, runs[entry.name].attrs, by_id) for entry in ENTRIES)
    (ROOT / "docs" / "gallery_robots.md").write_text(f"{sections}\n", encoding="utf-8")


def portrait(run: Dataset, seen: tuple[float, float], path: Path) -> None:
    """Draw a robot at the end of its run, `seen` from that azimuth and height over the horizon [deg]."""
    (azimuth, height), end = np.radians(seen), float(run["time"][-1])
    viewer = np.cos(height) * np.cos(azimuth), np.cos(height) * np.sin(azimuth), np.sin(height)
    last = run.sel(time=slice(end - PERIODS * run.attrs["period"], None))
    write_still(last, path, at=end, end=end, size=(1280, 720), camera=viewer)


def section(entry: GalleryEntry, run: Mapping[str, Any], rows: Mapping[str, dict[str, Any]]) -> str:
    """A robot with its picture, the numbers of its run, and what holds it against published numbers."""
    heads = "| speed (m/s) | power (W) | cost of transport | frequency (Hz) | swam (s) | computed in (s) |"
    row = [run[key] for key in ("speed", "power", "cost-of-transport", "frequency")]
    row += [run["period"] * json.loads(run["provenance"])["settings"]["periods"], run["seconds"]]
    parts = [
        f"## {entry.title}",
        f"![{entry.title}](img/gallery_{entry.name}.png)",
        f"{entry.what} {entry.drive}",
        f"{heads}\n|{'---:|' * len(row)}\n| {' | '.join(f'{x:.3g}' for x in row)} |",
    ]
    if entry.held:
        parts.append("Held against published numbers, with nothing fitted:")
        parts.append("\n".join(f"- {_held(rows[name])}" for name in entry.held))
    return "\n\n".join([*parts, f"```console\n$ {entry.command}\n```"])


def _held(row: dict[str, Any]) -> str:
    unit = {"1": "", "percent": " %"}.get(row["unit"], f" {row['unit']}")
    printed, ours = (f"{_number(row[key])}{unit}" for key in ("printed", "ours"))
    return f"{_cell(row['quantity'])}: published {printed}, computed {ours}, error {row['error']:+.1f} %"


def _number(value: Any) -> str:
    return "" if value is None else f"{value:.4g}"


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("*", "\\*").replace("_", "\\_")


def renew_readme(rows: list[dict[str, Any]]) -> None:
    """Put the rows that have a printed number into the README, between its marks."""
    file = ROOT / "README.md"
    text = file.read_text(encoding="utf-8")
    begin, end = "<!-- scorecard: begin -->", "<!-- scorecard: end -->"
    head, _, rest = text.partition(begin)
    _, _, tail = rest.partition(end)
    table = "\n".join(readme_table(rows))
    file.write_text(f"{head}{begin}\n{table}\n{end}{tail}", encoding="utf-8")


def readme_table(rows: list[dict[str, Any]]) -> Iterator[str]:
    """Lines of the README's table: what is compared with experiments of ours is no comparison with a paper's."""
    yield "| quantity | printed | computed | error | verdict |"
    yield "|---|---:|---:|---:|---|"
    for row in rows:
        quantity, printed, ours, verdict = row["quantity"], row["printed"], row["ours"], row["verdict"]
        if row["kind"] == "synthetic" or ours is None:
            continue
        if printed is not None and row["unit"] == "m/s":
            error = "" if row["error"] is None else f"{row['error']:+.1f} %"
            told = max(f"{printed:.3f}", f"{printed:.4g}", key=len)  # three decimals, or all that are printed
            yield f"| {quantity} | {told} m/s | {ours:.4f} m/s | {error} | {verdict} |"
        if printed is not None and row["unit"] == "percent":
            yield f"| {quantity} | {printed:+g} % | {ours:+#.3g} % | {ours - printed:+.2f} points | {verdict} |"


def renew_picture() -> None:
    """Draw the five designs from their runs."""
    from picture import DESIGNS, draw

    draw({name: load_dataset(OUT / "flagellum" / f"{name}.nc") for name in DESIGNS}, ROOT / "docs/img/flagellum.png")


if __name__ == "__main__":
    main()
