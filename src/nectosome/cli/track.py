"""`nectosome track`: joint angles, or positions of markers and the pose of a body, from videos."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter
from rich.console import Group
from rich.table import Table
from rich.text import Text

from nectosome.cli.options import value
from nectosome.cli.output import Outputs, check_target, progress_bar, write
from nectosome.units import InputError, read_quantity

if TYPE_CHECKING:
    import xarray as xr


def track(
    *videos: Annotated[Path, Parameter(help="Video of segments; or videos of markers, in the order of the cameras.")],
    config: Annotated[
        Path | None, Parameter(help="Sheet (.yaml): colours of segments or markers, scale, cameras.")
    ] = None,
    outputs: Outputs = Outputs(),
    overlay: Annotated[Path | None, Parameter(help="Write the video with the segments drawn over it (.mp4).")] = None,
    propose: Annotated[
        bool, Parameter(help="Print the colours that stand out in a frame, as a start for --config.")
    ] = False,
    at: Annotated[str, value("Time of that frame, such as 1.5s.")] = "0s",
) -> int:
    """Track coloured segments in a video, or markers in the videos of several cameras.

    Frames in which a segment or marker is not seen well are gaps, each with its reason.
    """
    outputs.check()
    check_target(overlay, "--overlay", ".mp4", outputs.force)
    first = next(iter(videos), None)
    if first is None:
        raise InputError("name a video.", field="track")
    if propose:
        if len(videos) > 1 or (outputs.given or overlay or config):
            raise InputError("takes a single video and writes nothing: leave the other options out.", field="--propose")
        return _propose(first, at)
    if config is None:
        raise InputError("is missing: name a sheet (.yaml); --propose prints a start of one.", field="--config")

    from nectosome.vision.video import MarkerSheet, draw_over, load_sheet, track_markers, track_segments

    sheet = load_sheet(config)
    with progress_bar("tracking") as update:
        if isinstance(sheet, MarkerSheet):
            if overlay is not None:
                raise InputError("is for segments only.", field="--overlay")
            tracked = track_markers(videos, sheet, update)
        else:
            if len(videos) > 1:
                raise InputError(f"segments are tracked in one video, not {len(videos)}.", field="track")
            tracked = track_segments(first, sheet, update)
            if overlay is not None:
                draw_over(first, sheet, tracked, overlay, update)
    write(_page(tracked))
    if outputs.given or overlay:
        from nectosome.view import show_track

        outputs.write(tracked, show_track, overlay)
    return 0


def _propose(video: Path, at: str) -> int:
    """Print colours as a sheet has them."""
    instant = read_quantity(at, "time", "--at")
    from nectosome.vision.video import Clip, proposal_text, propose

    clip = Clip(video)
    frame = None
    for frame in clip.frames():
        if frame.time >= instant:
            break
    if frame is None or frame.time < instant:
        last = 0.0 if frame is None else frame.time
        raise InputError(f"the video ends at {last:.4g} s.", field="--at")
    write(proposal_text(propose(frame.image), clip, frame.time), wrap=False)
    return 0


def _page(tracked: "xr.Dataset") -> Group:
    """Lines and a table about the tracked segments or markers."""
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
