"""`nectosome track`: joint angles, or positions of markers and the pose of a body, from videos."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from nectosome import view
from nectosome.cli.options import command, value
from nectosome.cli.output import Outputs, check_target, write, write_text
from nectosome.cli.progress import progress_bar
from nectosome.units import InputError, read_quantity
from nectosome.view.recording_words import track_summary


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
    write(track_summary(tracked))
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
