"""`nectosome track`: videos as joint angles, or as the places of markers and the pose of a body."""

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
from nectosome.units import InputError, read_quantity

if TYPE_CHECKING:
    import xarray as xr


def track(
    *videos: Annotated[Path, Parameter(help="Video of segments; or those of markers, in the order of the cameras.")],
    config: Annotated[Path | None, Parameter(help="What is to be tracked (.yaml).")] = None,
    save: Annotated[Path | None, Parameter(help="Write what was tracked as netCDF (.nc).")] = None,
    table: Annotated[Path | None, Parameter(help="Write it as a table for other programs (.csv).")] = None,
    overlay: Annotated[Path | None, Parameter(help="Write the video with the segments drawn over it (.mp4).")] = None,
    plot: Annotated[Path | None, Parameter(help="Write a page with figures (.html).")] = None,
    propose: Annotated[
        bool, Parameter(help="Say which colours stand out of a frame, as a start for --config.")
    ] = False,
    at: Annotated[str, Parameter(help="Which frame that is, such as 1.5s.", allow_leading_hyphen=True)] = "0s",
) -> int:
    """Track coloured segments in a video, or markers in the videos of several cameras.

    What is not seen well is a gap with its reason.
    """
    for path, option, suffix in (
        (save, "--save", ".nc"),
        (table, "--table", ".csv"),
        (overlay, "--overlay", ".mp4"),
        (plot, "--plot", ".html"),
    ):
        if path is not None:
            check_target(path, option, suffix)
    first = next(iter(videos), None)
    if first is None:
        raise InputError("name a video.", field="track")
    if propose:
        if len(videos) > 1 or any(other is not None for other in (save, table, overlay, plot, config)):
            raise InputError("looks at a single video, and writes nothing: leave the rest out.", field="--propose")
        return _propose(first, at)
    if config is None:
        raise InputError(
            "a file is needed that says what to track; --propose shows how to begin one.", field="--config"
        )

    from nectosome.vision.video import MarkerSheet, draw_over, load_sheet, track_markers, track_segments

    sheet = load_sheet(config)
    with progress_bar("tracking") as update:
        if isinstance(sheet, MarkerSheet):
            if overlay is not None:
                raise InputError("is drawn for segments only.", field="--overlay")
            tracked = track_markers(videos, sheet, update)
        else:
            if len(videos) > 1:
                raise InputError(f"segments are tracked in one video, not {len(videos)}.", field="track")
            tracked = track_segments(first, sheet, update)
            if overlay is not None:
                draw_over(first, sheet, tracked, overlay, update)
    if save is not None:
        save_dataset(tracked, save)
    if table is not None:
        from nectosome.vision.video import write_table

        write_table(tracked, table)
    if plot is not None:
        from nectosome.view import show_track

        show_track(tracked, plot)
    write(_understood(tracked))
    for path in (save, table, overlay, plot):
        if path is not None:
            write(f"written: {path}")
    return 0


def _propose(video: Path, at: str) -> int:
    """Print colours as they stand in a sheet."""
    moment = read_quantity(at, "time", "--at")
    from nectosome.vision.video import Clip, proposal_text, propose

    clip = Clip(video)
    frame = None
    for frame in clip.frames():
        if frame.time >= moment:
            break
    if frame is None or frame.time < moment:
        last = 0.0 if frame is None else frame.time
        raise InputError(f"the video ends at {last:.4g} s.", field="--at")
    write(proposal_text(propose(frame.image), clip, frame.time), wrap=False)
    return 0


def _understood(tracked: "xr.Dataset") -> Group:
    """What was tracked, in a few lines and a table."""
    import numpy as np

    about = json.loads(tracked.attrs["provenance"])
    time = tracked["time"].values
    lines = [f"{about['file']}: {about['reader']}", f"  {time.size} frames, {time[0]:.6g} to {time[-1]:.6g} s"]
    for what in ("found", "warnings"):
        lines += [f"  {what}: {said}" for said in about[what]]
    table = Table(box=None, header_style="bold")
    markers = "marker" in tracked
    heads = (
        ("marker", "seen (%)", "off (px)", "error (mm)") if markers else ("segment", "seen (%)", "length", "quality")
    )
    for k, name in enumerate(heads):
        table.add_column(name, justify="right" if k else "left")
    dim = "name" if markers else "segment"
    for k, name in enumerate(tracked[dim].values):
        good = tracked["reason"].values[:, k] == 0
        row = [str(name), f"{100 * np.mean(good):.1f}"]
        if not good.any():
            row += ["", ""]
        elif markers:
            error = np.sqrt(np.sum(tracked["marker_se"].values[good, k] ** 2, axis=1))
            row += [f"{np.median(tracked['residual'].values[good, k]):.2f}", f"{1e3 * np.median(error):.2f}"]
        else:
            unit = tracked["length"].attrs["units"]
            factor, unit = (1e3, "mm") if unit == "m" else (1.0, unit)
            length = factor * np.median(tracked["length"].values[good, k])
            row += [f"{length:.1f} {unit}", f"{np.median(tracked['quality'].values[good, k]):.2f}"]
        table.add_row(*row)
    return Group(Text("\n".join(lines)), table)
