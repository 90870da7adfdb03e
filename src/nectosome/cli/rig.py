"""`nectosome rig`, its `check`: readings of a rig, which is not moved, and `run`: runs by a plan, as a campaign."""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import App, Parameter

from nectosome.cli.command_list import command
from nectosome.cli.control_on_rig import CODES
from nectosome.cli.options import value
from nectosome.cli.output import Force, Json, report, tell, write
from nectosome.cli.progress import clock_text, progress_bar
from nectosome.io.summary import Summary
from nectosome.io.tables import Number, Table
from nectosome.units import InputError, count, read_positive

if TYPE_CHECKING:
    from nectosome.rigs.readings import Readings
    from nectosome.rigs.run_plan import RunPlan
    from nectosome.rigs.run_series import Series


rig = command(App(name="rig", help="Check a rig, set the zeros of its sensors, and take runs by a plan as a campaign."))
RigConfig = Annotated[Path, Parameter("--config", help="Rig file (.yaml): devices, sample time, limits.")]


@rig.command(name="check")
def rig_check(
    *,
    config: RigConfig,
    time: Annotated[str, value("Time for which channels are read.")] = "1s",
    as_json: Json = False,
) -> int:
    """Read every channel of a rig, which is not moved, and print noise, gaps, and what looks wrong."""
    seconds = read_positive(time, "time", "--time")

    from nectosome.rigs import RigError
    from nectosome.rigs.readings import read_channels
    from nectosome.rigs.rig_file import load_rig

    file = load_rig(config)
    with progress_bar("reading") as update:
        try:
            readings = read_channels(file, seconds, lambda share: update("", share))
        except RigError as error:
            tell(f"failed: {error}")
            return 1
    write(summary(readings))
    return 1 if readings.wrong() else 0


def summary(readings: "Readings") -> Summary:
    """A row for each channel, and what looks wrong."""
    limits = readings.file.limits.measurements
    heads = {"channel": "channel", "mean": "mean", "deviation": "deviation", "least": "from", "most": "to"}
    heads |= {"noise": "% of limits", "missing": "% missing"}
    rows = list[tuple[str | Number, ...]]()
    for one in readings.channels():
        within = limits.get(one.name)
        noise = one.deviation / (within.most - within.least) if within is not None else math.nan
        shown = f"{100 * noise:.2g}" if math.isfinite(noise) else "-"
        rows.append(
            (
                one.name,
                *(Number(x, one.unit) for x in (one.mean, one.deviation, one.least, one.most)),
                Number(noise, shown=shown),
                Number(one.missing, shown=f"{100 * one.missing:.3g}"),
            )
        )
    rate = f"{readings.rate:.4g} samples/s" if math.isfinite(readings.rate) else "a single sample"
    title = f"{readings.file.rig.name}: {count(len(rows), 'channel')}, {rate}, nothing was commanded"
    return Summary(
        title,
        [Table("channels", heads, rows)],
        warnings=readings.wrong(),
        values={"rate": Number(readings.rate, "Hz"), "samples": Number(len(readings.values))},
    )


@rig.command(name="run")
def rig_run(
    plan: Annotated[Path, Parameter(help="Plan of runs (.yaml): signals of commands, conditions, repeats.")],
    /,
    *,
    config: RigConfig,
    out: Annotated[
        Path | None,
        Parameter(help="Folder of all runs, a campaign; the same command again continues there, --force starts anew."),
    ] = None,
    dry_run: Annotated[
        bool, Parameter(help="Check all signals and print the runs and their time; move nothing.")
    ] = False,
    force: Force = False,
    as_json: Json = False,
) -> int:
    """Play signals on a rig in open loop, condition by condition, and record every channel as a campaign.

    Guards are on; the rig is vented at the end of every run. A run that a guard ends is repeated, then left out.
    """
    if (out is None) == (not dry_run):
        raise InputError("give a folder, or --dry-run.", field="--out")

    from nectosome.rigs.rig_file import load_rig
    from nectosome.rigs.run_plan import load_plan
    from nectosome.rigs.run_series import CAMPAIGN, run_series

    planned = load_plan(plan, load_rig(config))
    if out is None:
        write(_plan_summary(planned))
        return 0
    with progress_bar("running") as update:
        series = run_series(planned, out, update, tell, anew=force)
    write(_series_summary(planned, series))
    if series.status != "finished":
        tell(f"{series.status}: {series.reason} The same command goes on from there.")
    for name, why in series.left_out.items():
        tell(f"left out: {name}: {why}")
    report(*[out / CAMPAIGN] if series.finished else [])
    return CODES[series.status] or int(bool(series.left_out))


def _plan_summary(plan: "RunPlan") -> Summary:
    """All runs with their conditions and lengths."""
    names = [*(plan.runs[0].conditions if plan.runs else ())]
    heads = {"run": "run", **{name: name for name in names}, "time": "time"}
    rows = [(run.name, *run.conditions.values(), Number(plan.seconds(run), "s")) for run in plan.runs]
    given = plan.description
    notes = [f"{name}: {value}" for name, value in plan.constants.items()]
    notes.append(
        f"each run: {given.settle:g} s at rest, signals that grow within {given.ramp:g} s and fall "
        f"within {given.ramp:g} s behind; {given.rest:g} s without power between runs"
    )
    title = f"{count(len(rows), 'run')}, {clock_text(plan.total)} in all"
    return Summary(title, [Table("runs", heads, rows)], notes=notes, values={"seconds": Number(plan.total, "s")})


def _series_summary(plan: "RunPlan", series: "Series") -> Summary:
    """How many runs are there, and which were repeated or left out."""
    conditions = {run.name: run.words for run in plan.runs}
    rows = [
        (name, conditions[name], Number(number), "left out" if name in series.left_out else "taken")
        for name, number in series.repeated.items()
    ]
    heads = {"run": "run", "conditions": "conditions", "set_aside": "set aside", "end": ""}
    title = f"{len(series.finished)} of {count(len(plan.runs), 'run')} finished"
    attributes = {"status": series.status, "status_reason": series.reason}
    tables = [Table("repeated", heads, rows, listed=True)] if rows else []
    return Summary(title, tables, attributes=attributes)
