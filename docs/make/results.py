"""What studies and validation cases gave: the scorecard, the gallery, RExEel's tables, foils, closed forms."""

import csv
import json
import sys
from collections.abc import Callable
from html import escape
from importlib import import_module
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from nectosome.description import dump_robot
from nectosome.designs.prediction_intervals import widened
from nectosome.io import load_dataset
from nectosome.view.scorecard import shown, summary
from nectosome_studies import STUDIES
from nectosome_studies.claims import HEADS, judgement
from nectosome_studies.findings import findings
from nectosome_studies.gallery.entries import ENTRIES
from nectosome_studies.rexeel.tables import TextTable, by_piece, compared, errors_beside, verdict
from nectosome_studies.study import KINDS
from nectosome_studies.trust import met

ROOT = Path(__file__).parents[2]
OUT = ROOT / "out"


def there(name: str, argument: str) -> bool:
    """Whether the last full studies left what this part of a page is made of."""
    if name == "gallery":
        run = OUT / "gallery" / f"{argument}.nc"
        return run.exists() and not json.loads(load_dataset(run).attrs["provenance"])["settings"]["quick"]
    if name in ("attacks", "faults"):
        return _printed({"attacks": "attack"}.get(name, name)).exists()
    if name == "rexeel":
        return (_rexeel() / "swims.nc").exists()
    if name == "limb":
        return (_softlimb() / "limb-loose.nc").exists()
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
    """The ten findings, failures among them."""
    heads = ("", "printed or measured", "ours", "")
    found = findings([*_rows().values()])
    return _text_table(TextTable(heads, [(_cell(f.what), f.printed, f.ours, _cell(f.word)) for f in found]))


def scorecard() -> str:
    """Study by study: what its paper claims, what we think of it, then, folded, all numbers."""
    parts = []
    for name, rows in _by_study(lambda row: True):
        parts.append(f"## {_title(name)}")
        judged = judgement(name, rows)
        if judged is not None:
            claims = [tuple(_cell(part) for part in claim) for claim in judged.claims]
            parts += [_cell(judged.reference), _text_table(TextTable(HEADS, claims)), _cell(" ".join(judged.sentences))]
        head = f"<details markdown>\n<summary>All numbers. {escape(summary(rows))}</summary>"
        parts.append(f"{head}\n\n{_all_numbers(rows)}\n\n</details>")
    return "\n\n".join(parts)


def checks() -> str:
    """Checks of methods on synthetic data, study by study."""
    return _of_kind("method", ("", "made with", "found", ""))


def misprints() -> str:
    """Printed numbers that do not follow from the others of their paper, study by study."""
    return _of_kind("misprint", ("", "printed", "what follows", "proof"))


def kinds() -> str:
    """What the kinds of rows are."""
    return _text_table(TextTable(("kind", "meaning"), [*KINDS.items()]))


def trust() -> str:
    """Errors met on measured things, by kind of robot and quantity."""
    heads = ("robot or animal", "quantity", "numbers", "typical error", "from", "to", "")
    lines = []
    for one in met([*_rows().values()]):
        errors = (f"{one.typical:.0f} %", f"{one.lowest:+.0f} %", f"{one.highest:+.0f} %")
        lines.append((_cell(one.robot), one.quantity, str(one.rows), *errors, _cell(one.note)))
    return _text_table(TextTable(heads, lines))


def held() -> str:
    """How many 80 % intervals hold the measured number, as `python -m benchmarks.intervals` wrote them last."""
    heads = ("robot or animal", "quantity", "numbers", "held", "width of the interval", "median error")
    with (ROOT / "docs" / "evidence" / "intervals.csv").open(encoding="utf-8") as file:
        rows = [*csv.DictReader(file)]
    groups: dict[tuple[str, str], list[dict[str, str]]] = {}
    for row in rows:
        groups.setdefault((row["robot"], row["quantity"]), []).append(row)
    lines = [(_cell(robot), quantity, *_of_intervals(own)) for (robot, quantity), own in groups.items()]
    within = [row for row in rows if not row["beyond"]]
    totals = [("all", "", *_of_intervals(rows)), ("without what is beyond the models", "", *_of_intervals(within))]
    why: dict[str, dict[str, None]] = {}
    for row in rows:
        why.setdefault(row["beyond"], {})[f"{row['robot']}, {row['at']}"] = None
    said = "\n".join(f"- {'; '.join(of)}: {reason}." for reason, of in why.items() if reason)
    return (
        f"{_text_table(TextTable(heads, [*lines, *totals]))}\n\nBeyond the models, by what was known before:\n\n{said}"
    )


def _of_intervals(rows: list[dict[str, str]]) -> tuple[str, ...]:
    """Of some rows: how many, how many hold, and medians of width and error over the value of the file."""
    measured, value, *ends = (
        np.array([float(row[key]) for row in rows]) for key in ("measured", "value", "low", "high")
    )
    low, high = np.where([row["water"] == "yes" for row in rows], widened(np.array(ends)), ends)
    holds = int(((low <= measured) & (measured <= high)).sum())
    width, error = (float(np.median(np.abs(x))) for x in ((high - low) / value, value / measured - 1))
    return str(len(rows)), f"{holds} ({100 * holds / len(rows):.0f} %)", f"{100 * width:.0f} %", f"{100 * error:.0f} %"


def numbers(beginnings: str) -> str:
    """Rows whose ids begin so, one beginning after the other, parted by commas."""
    rows = [row for start in beginnings.split(",") for name, row in _rows().items() if name.startswith(start)]
    lines = [
        (_cell(r["quantity"]), _shown(r, "printed"), r["source"], _shown(r, "ours"), _off(r), r["verdict"] or r["kind"])
        for r in rows
    ]
    return _text_table(TextTable(("", "printed", "", "ours", "off by", ""), lines))


def attacks() -> str:
    """Attacks by class, tried and survived, as `python -m benchmarks attack` printed them last."""
    return _printed_table("attack")


def faults() -> str:
    """Faults of rigs by class, and how runs ended, as `python -m benchmarks faults` printed them last."""
    return _printed_table("faults")


def _printed_table(name: str) -> str:
    """The date, the seed, and the table after it."""
    first, *lines = _printed(name).read_text(encoding="utf-8").splitlines()
    at = next(k for k, line in enumerate(lines) if line.startswith("seed"))
    table = [line for line in lines[at:] if line.startswith("|")]
    return f"On {first.partition(',')[0]}, {lines[at]}:\n\n" + "\n".join(table)


def _printed(name: str) -> Path:
    return OUT / "benchmarks" / f"{name}.txt"


def _of_kind(kind: str, heads: tuple[str, ...]) -> str:
    parts = []
    for name, rows in _by_study(lambda row: row["kind"] == kind):
        lines = [(_cell(r["quantity"]), _shown(r, "printed"), _shown(r, "ours"), _cell(r["note"])) for r in rows]
        parts += [f"## {_title(name)}", _text_table(TextTable(heads, lines))]
    return "\n\n".join(parts)


def _all_numbers(rows: list[dict[str, Any]]) -> str:
    lines = []
    for r in rows:
        theirs = f"{_shown(r, 'printed')} {r['source']}".strip()
        within = "" if r["tolerance"] is None else f"{r['tolerance']:g} %" if r["tolerance"] else "equal"
        if r.get("within") is not None:
            within = f"{r['within']:g} {r['unit']}"
        word = r["verdict"] or r["kind"]
        lines.append((_cell(r["quantity"]), theirs, _shown(r, "ours"), _off(r), within, word, _cell(r["note"])))
    return _text_table(TextTable(("quantity", "printed", "ours", "off by", "within", "", "note"), lines))


def _by_study(wanted: Callable[[dict[str, Any]], bool]) -> list[tuple[str, list[dict[str, Any]]]]:
    rows = [row for row in _rows().values() if wanted(row)]
    return [(name, [*group]) for name, group in groupby(rows, key=lambda row: row["id"].partition("/")[0])]


def _title(study: str) -> str:
    return STUDIES[study].title


def _shown(row: dict[str, Any], which: str) -> str:
    return "" if row[which] is None else shown(row, which)


def _off(row: dict[str, Any]) -> str:
    return "" if row["error"] is None else f"{row['error']:+.2g} %"


def better_water() -> str:
    """The papers' robots in water by published laws, study by study."""
    lines = ["| | water | computed |", "|---|---|---:|"]
    better = [row for name, row in _rows().items() if "/better-water/" in name]
    for head, group in groupby(better, key=lambda row: row["quantity"].split(": ")[0]):
        for i, row in enumerate(group):
            what = _cell(head.removeprefix("better water, ")) if i == 0 else ""
            water = _cell(row["quantity"].split(": ")[1])
            lines.append(f"| {what} | {water} | {shown(row, 'ours')} |")
    return "\n".join(lines)


def gallery(name: str) -> str:
    """A robot with its picture, the numbers of its run, and what holds it against published numbers."""
    entry = next(entry for entry in ENTRIES if entry.name == name)
    run = load_dataset(OUT / "gallery" / f"{name}.nc").attrs
    heads = "| speed (m/s) | power (W) | cost of transport | frequency (Hz) | swam (s) | computed in (s) |"
    row = [run[key] for key in ("speed", "power", "cost-of-transport", "frequency")]
    row += [run["period"] * json.loads(run["provenance"])["settings"]["periods"], run["seconds"]]
    parts = [
        f"![{entry.title}](../img/gallery_{name}.png)",
        f"{entry.what} {entry.drive}",
        f"{heads}\n|{'---:|' * len(row)}\n| {' | '.join(f'{x:.3g}' for x in row)} |",
    ]
    if entry.held:
        rows = _rows()
        parts.append("Held against numbers of others, with nothing fitted:")
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


def limb(table: str) -> str:
    """The foam limb: `parameters` of both fits, `errors` beside the measured spread, those with a `slack`."""
    return _text_table({"parameters": _limb_parameters, "errors": _limb_errors, "slack": _limb_slack}[table]())


def _limb_parameters() -> TextTable:
    fits = [load_dataset(_softlimb() / f"limb-{name}.nc") for name in ("asked", "held", "loose")]
    names = {
        "E": ("Young's modulus", "kPa", 1e-3),
        "eta": ("viscosity", "kPa s", 1e-3),
        "gain": ("gain of the tendon: moment by contraction", "N", 1e3),
        "drag": ("drag coefficient", "", 1.0),
    }
    rows = []
    for symbol, (what, unit, factor) in names.items():
        cells = [f"{what} ({unit})" if unit else what]
        for fit in fits:
            if symbol not in fit["parameter"]:
                cells.append("500 (known)")
                continue
            one = fit.sel(parameter=symbol)
            value, low, high = (factor * float(one[key]) for key in ("value", "low", "high"))
            found = f"{value:.3g} (95 %: {low:.3g} to {high:.3g})"
            cells.append(found if bool(one["identifiable"]) else "not identifiable")
        rows.append(tuple(cells))
    heads = ("", "`water_1` and `air`, slack, all unknown", "`water_1`, modulus known", "the same, slack")
    return TextTable(heads, rows)


def _limb_errors() -> TextTable:
    errors = load_dataset(_softlimb() / "limb-errors.nc")
    size = errors["range"]
    predicted = {
        "held": "modulus known, fitted to `water_1`",
        "loose": "the same with the slack of `water_2`",
        "asked": "that slack, all unknown, fitted to `water_1` and `air`",
        "rest": "a limb at rest",
        "linear": "in proportion to the contraction, as in `water_1`",
    }
    parts = [(what, errors["error"].sel(predictor=key)) for key, what in predicted.items()]
    parts += [("the two limbs from each other, measured", errors["limbs"])]
    parts += [("what does not repeat itself with the command, measured", errors["unrepeated"])]
    rows = [("range of the angle", *(f"{x:.1f} mm" for x in size.values))]
    rows += [
        (what, *(f"{x:.2f} mm ({100 * x / y:.0f} %)" for x, y in zip(part.values, size.values, strict=True)))
        for what, part in parts
    ]
    for key, which in (("held", "without slack"), ("loose", "with slack")):
        values = errors[f"{key}_correlation"].values
        rows += [(f"correlation of the prediction {which} with the angle", *(f"{x:.2f}" for x in values))]
    rows += [("share of the variance that repeats itself", *(f"{100 * x:.0f} %" for x in errors["repeats"].values))]
    rows += [("frequency of the command", *(f"{x:.3f} Hz" for x in errors["frequency"].values))]
    return TextTable(("rms", *_limb_heads(errors)), rows)


def _limb_slack() -> TextTable:
    errors = load_dataset(_softlimb() / "limb-errors.nc")
    rows = [
        (f"{slack:g} mm", *(f"{x:.2f} mm" for x in one))
        for slack, one in zip(errors["slack"].values, errors["slack_error"].values, strict=True)
    ]
    return TextTable(("slack", *_limb_heads(errors)), rows)


def _limb_heads(errors: xr.Dataset) -> list[str]:
    return [f"`{name}`" for name in errors["recording"].values]


def _softlimb() -> Path:
    return OUT / "softlimb" / "data"


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
    theirs = "published" if row["source"] == "computed" else row["source"]
    inside = isinstance(row["printed"], list) and row["error"] == 0
    off = "within this range" if inside else f"error {row['error']:+.1f} %"
    return f"{_cell(row['quantity'])}: {theirs} {shown(row, 'printed')}, ours {shown(row, 'ours')}, {off}"


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("*", "\\*").replace("_", "\\_")
