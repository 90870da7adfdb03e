"""`nectosome rig`, and its `check`: readings of every channel of a rig, which is not moved."""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import App, Parameter

from nectosome.cli.command_list import command
from nectosome.cli.options import value
from nectosome.cli.output import Json, tell, write
from nectosome.cli.progress import progress_bar
from nectosome.io.summary import Summary
from nectosome.io.tables import Number, Table
from nectosome.units import count, read_positive

if TYPE_CHECKING:
    from nectosome.rigs.readings import Readings

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
