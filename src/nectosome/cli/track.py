"""`nectosome track`: joint angles, or positions of markers and the pose of a body, from videos."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from nectosome import view
from nectosome.cli.options import command, value
from nectosome.cli.output import Outputs, check_target, write, write_text
from nectosome.cli.progress import progress_bar
from nectosome.io.summary import Summary
from nectosome.io.tables import Number, Table
from nectosome.units import InputError, read_quantity

if TYPE_CHECKING:
    import xarray as xr


@command
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
    write(_summary(tracked))
    outputs.write(tracked, lambda data, path: view.show_track(data, path), overlay)
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
    write_text(proposal_text(propose(frame.image), clip, frame.time))
    return 0


def _summary(tracked: "xr.Dataset") -> Summary:
    """Lines and a table about the tracked segments or markers."""
    import numpy as np

    about = json.loads(tracked.attrs["provenance"])
    time = tracked["time"].values
    above = [
        f"  {time.size} frames, {time[0]:.6g} to {time[-1]:.6g} s",
        *(f"  found: {said}" for said in about["found"]),
    ]
    markers = "marker" in tracked
    dim, heads = ("name", {"name": "marker"}) if markers else ("segment", {"segment": "segment"})
    heads |= {"seen": "seen"} | ({"residual": "off (px)", "error": "error"} if markers else {})
    heads |= {} if markers else {"length": "length", "quality": "quality"}
    rows = list[tuple[str | Number, ...]]()
    for k, name in enumerate(tracked[dim].values):
        good = tracked["reason"].values[:, k] == 0
        cells = [_rounded(float(np.mean(good)), "", 100.0, "%")]
        if good.any() and markers:
            error = np.sqrt(np.sum(tracked["marker_se"].values[good, k] ** 2, axis=1))
            residual = float(np.median(tracked["residual"].values[good, k]))
            cells += [
                Number(residual, "px", shown=f"{residual:.2f}"),
                _rounded(float(np.median(error)), "m", 1e3, "mm", 2),
            ]
        elif good.any():
            unit = str(tracked["length"].attrs["units"])
            factor, shown = (1e3, "mm") if unit == "m" else (1.0, unit)
            cells.append(_rounded(float(np.median(tracked["length"].values[good, k])), unit, factor, shown))
            quality = float(np.median(tracked["quality"].values[good, k]))
            cells.append(Number(quality, shown=f"{quality:.2f}"))
        rows.append((str(name), *cells))
    return Summary(
        f"{about['file']}: {about['reader']}",
        [Table("markers" if markers else "segments", heads, rows)],
        above=above,
        warnings=about["warnings"],
        values={"frames": Number(time.size), "start": Number(float(time[0]), "s"), "end": Number(float(time[-1]), "s")},
    )


def _rounded(value: float, unit: str, factor: float, shown: str, digits: int = 1) -> Number:
    return Number(value, unit, shown=f"{factor * value:.{digits}f} {shown}")
