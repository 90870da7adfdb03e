"""`nectosome measure`: what was understood of recordings."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter
from rich.console import Group
from rich.table import Table
from rich.text import Text

from nectosome.cli.output import check_target, write
from nectosome.cli.progress import progress_bar
from nectosome.io import save_dataset
from nectosome.units import InputError, count

if TYPE_CHECKING:
    import xarray as xr


def measure(
    *files: Annotated[Path, Parameter(help="Recordings: .csv, .txt, .xlsx, .mat, .tdms, .h5, .nc, .npy, .npz.")],
    sheet: Annotated[
        Path | None, Parameter(help="What the columns are (.yaml); or a campaign, which lists the files too.")
    ] = None,
    plot: Annotated[Path | None, Parameter(help="Write a page with a plot of each quantity (.html).")] = None,
    save: Annotated[Path | None, Parameter(help="Write the recording as netCDF (.nc); for a single file.")] = None,
) -> None:
    """Read recordings and show what was understood: quantities, units, repairs, and what is odd."""
    if plot is not None:
        check_target(plot, "--plot", ".html")
    if save is not None:
        check_target(save, "--save", ".nc")

    from nectosome.measure import Campaign, load_campaign, load_sheet, read

    campaign: Campaign | None = None
    if not files:
        if sheet is None:
            raise InputError("name a file, or a campaign with --sheet.", field="measure")
        campaign = load_campaign(sheet)
    known = load_sheet(sheet) if sheet is not None and campaign is None else None
    names = [str(planned.path) for planned in campaign.planned] if campaign else [str(file) for file in files]
    if save is not None and len(names) > 1:
        raise InputError(f"only one recording can be saved, not {len(names)}.", field="--save")

    recordings: list[xr.Dataset] = []
    with progress_bar("reading") as update:
        for k, name in enumerate(names):
            update(Path(name).name, k / len(names))
            recordings.append(campaign.planned[k].read() if campaign else read(name, known))
    if save is not None:
        save_dataset(recordings[0], save)
    if plot is not None:
        from nectosome.view import show_recordings

        show_recordings(recordings, plot)
    for recording in recordings:
        write(understood(recording))


def understood(recording: "xr.Dataset") -> Group:
    """A recording in a few lines and a table."""
    about = json.loads(recording.attrs["provenance"])
    dim = "time" if "time" in recording.dims else "row"
    rows = count(recording.sizes[dim], "row")
    lines = [f"{about['file']}: {about['reader']}, {rows}{_duration(recording) if dim == 'time' else ''}"]
    lines += [
        f"  {name}: {float(value):.6g} {value.attrs.get('units', '')}".rstrip()
        for name, value in recording.coords.items()
        if value.ndim == 0
    ]
    for what in ("found", "conversions", "repairs", "warnings"):
        lines += [f"  {what}: {said}" for said in about[what]]
    table = Table(box=None, header_style="bold")
    for name in ("quantity", "unit", "column", "min", "mean", "max", "missing"):
        left = name in ("quantity", "unit", "column")
        table.add_column(name, justify="left" if left else "right")
    for name, variable in recording.data_vars.items():
        a = variable.attrs
        numbers = [f"{a[key]:.6g}" if key in a else "" for key in ("minimum", "mean", "maximum")]
        table.add_row(str(name), a["units"] or "1", a["column"], *numbers, str(a["missing"]))
    return Group(Text("\n".join(lines)), table, Text(""))


def _duration(recording: "xr.Dataset") -> str:
    import numpy as np

    first, last = (float(recording["time"][k]) for k in (0, -1))
    n = recording.sizes["time"]
    if n == 1:
        return f", at {first:.6g} s"
    usual = float(np.median(np.diff(recording["time"][: min(n, 100_000)].values)))
    return f", {first:.6g} to {last:.6g} s, every {usual:.4g} s"
