"""What studies and validation cases gave: the scorecard, the gallery, RExEel's tables, foils, closed forms."""

import json
import sys
from importlib import import_module
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from nectosome.description import dump_robot
from nectosome.io import load_dataset
from nectosome.papers.gallery.entries import ENTRIES
from nectosome.papers.rexeel.tables import TextTable, by_piece, compared, errors_beside, verdict

ROOT = Path(__file__).parents[2]
OUT = ROOT / "out"


# the README's rows: a study's row, and what is said of it
EVIDENCE = {
    "flagellum/table2/row1/speed": "soft flagellum, first printed design: steady speed (the other four are as near)",
    "flagellum/motor-line/7.4V/speed": "its best design for its motor at 7.4 V (the printed one comes to 0.690 there)",
    "flagellum/fig3/order1/increment": "its gain in speed from constant to linear strains",
    "flagellum/pool/new/speed": "its speed in a pool, hull drag calibrated on another design",
    "paddle/fig9/ratio/0.9Hz": "rowing paddle: gain over loss of thrust on the load cell",
    "paddle/table5/fp1jp/75-1.1/speed": "rowing robot with one joint, calibrated on that with three",
    "paddle/table5/fp1jp/75-1.3/speed": "the same at a faster stroke",
    "catshark/speed/3": "catshark, swum as measured, at 3 body lengths a second (at 0.75 it is near)",
}


def there(name: str, argument: str) -> bool:
    """Whether the last full studies left what this part of a page is made of."""
    if name == "gallery":
        run = OUT / "gallery" / f"{argument}.nc"
        return run.exists() and not json.loads(load_dataset(run).attrs["provenance"])["settings"]["quick"]
    if name == "rexeel":
        return (_rexeel() / "swims.nc").exists()
    if name == "vortex":
        return (_vortex() / "wing.nc").exists()
    return _card().exists()


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


def _card() -> Path:
    return OUT / "scorecard.json"


def _rows() -> dict[str, dict[str, Any]]:
    return {row["id"]: row for row in json.loads(_card().read_text(encoding="utf-8"))["rows"]}


def evidence() -> str:
    """A few rows of the scorecard, failures among them."""
    lines = ["| | published | computed | |", "|---|---:|---:|---|"]
    for name, what in EVIDENCE.items():
        row = _rows()[name]
        unit = {"1": "", "percent": " %"}.get(row["unit"], f" {row['unit']}")
        lines.append(f"| {what} | {row['printed']:.3g}{unit} | {row['ours']:.3g}{unit} | {row['verdict']} |")
    return "\n".join(lines)


def scorecard() -> str:
    """All rows, then the notes of those that do not simply match."""
    rows = _rows().values()
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


def better_water() -> str:
    """The papers' robots in water by published laws, study by study."""
    lines = ["| | water | computed |", "|---|---|---:|"]
    better = [row for name, row in _rows().items() if "/better-water/" in name]
    for head, group in groupby(better, key=lambda row: row["quantity"].split(": ")[0]):
        for i, row in enumerate(group):
            what = _cell(head.removeprefix("better water, ")) if i == 0 else ""
            water = _cell(row["quantity"].split(": ")[1])
            lines.append(f"| {what} | {water} | {_number(row['ours'])} {row['unit']} |")
    return "\n".join(lines)


def gallery(name: str) -> str:
    """A robot with its picture, the numbers of its run, and what holds it against published numbers."""
    entry = next(entry for entry in ENTRIES if entry.name == name)
    run = load_dataset(OUT / "gallery" / f"{name}.nc").attrs
    rows = _rows()
    heads = "| speed (m/s) | power (W) | cost of transport | frequency (Hz) | swam (s) | computed in (s) |"
    row = [run[key] for key in ("speed", "power", "cost-of-transport", "frequency")]
    row += [run["period"] * json.loads(run["provenance"])["settings"]["periods"], run["seconds"]]
    parts = [
        f"![{entry.title}](../img/gallery_{name}.png)",
        f"{entry.what} {entry.drive}",
        f"{heads}\n|{'---:|' * len(row)}\n| {' | '.join(f'{x:.3g}' for x in row)} |",
    ]
    if entry.held:
        parts.append("Held against published numbers, with nothing fitted:")
        parts.append("\n".join(f"- {_held(rows[name])}" for name in entry.held))
    return "\n\n".join([*parts, f"```console\n$ {entry.command}\n```"])


def rexeel(table: str) -> str:
    """A table of the study of RExEel, or its verdict: compared, errors, pieces, verdict."""
    swims = load_dataset(_rexeel() / "swims.nc")
    if table == "verdict":
        return verdict(swims)
    if table == "compared":
        return _text_table(compared(swims))
    if table == "errors":
        return _text_table(errors_beside(swims))
    return _text_table(by_piece(swims, load_dataset(_rexeel() / "pieces.nc")))


def _rexeel() -> Path:
    return OUT / "rexeel" / "data"


def vortex(table: str) -> str:
    """Foils that flap, beside the lattice: `beside`; `made` says how the lattice's forces were made."""
    data = {name: load_dataset(_vortex() / f"{name}.nc") for name in ("wing", "heave-pitch", "tuna")}
    if table == "made":
        return f"{data['wing'].attrs['made']}."
    rows = []
    for one in data.values():
        first = {model: _harmonic(one["lift"].sel(model=model).values) for model in one["model"].values}
        ahead = np.rad2deg(np.angle(first["foil"] / first["lattice"]))
        for quantity, unit, values in (
            ("lift, amplitude", "N", {model: abs(c) for model, c in first.items()}),
            ("thrust, mean", "N", _means(one["thrust"])),
            ("power, mean", "W", _means(one["power"])),
        ):
            off = 100 * (values["foil"] / values["lattice"] - 1)
            cells = [f"{values[model]:.3g}" for model in ("foil", "attached", "lattice")]
            told = f"{off:+.0f} %" + (f", {ahead:+.0f} deg ahead" if quantity.startswith("lift") else "")
            rows.append(
                (one.attrs["title"] if quantity.startswith("lift") else "", f"{quantity} ({unit})", *cells, told)
            )
    heads = ("", "", "`foil`", "without friction and stall", "lattice", "`foil` beside the lattice")
    return _text_table(TextTable(heads, rows))


def _harmonic(values: np.ndarray) -> complex:
    return complex(2 * np.mean(values * np.exp(-2j * np.pi * np.arange(len(values)) / len(values))))


def _means(values: xr.DataArray) -> dict[str, float]:
    return {str(model): float(values.sel(model=model).mean()) for model in values["model"].values}


def _vortex() -> Path:
    return OUT / "vortex" / "data"


def _text_table(table: TextTable) -> str:
    rows = (table.heads, ("---",) * len(table.heads), *table.rows)
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


def robot_file(name: str) -> str:
    """The file of a robot of the gallery that is made by a function."""
    entry = next(entry for entry in ENTRIES if entry.name == name)
    return f"```yaml\n{dump_robot(entry.make()).strip()}\n```"


def _held(row: dict[str, Any]) -> str:
    unit = {"1": "", "percent": " %"}.get(row["unit"], f" {row['unit']}")
    printed, ours = (f"{_number(row[key])}{unit}" for key in ("printed", "ours"))
    return f"{_cell(row['quantity'])}: published {printed}, computed {ours}, error {row['error']:+.1f} %"


def _number(value: Any) -> str:
    return "" if value is None else f"{value:.4g}"


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("*", "\\*").replace("_", "\\_")
