"""Writing a video that browsers play: H.264 in MP4, each frame at its own time."""

from collections.abc import Iterable
from fractions import Fraction
from pathlib import Path

import numpy as np
from jaxtyping import UInt8

from nectosome.io.extras import package

_BASE = Fraction(1, 90_000)  # s, of time stamps


def write_video(
    path: Path, frames: Iterable[tuple[float, UInt8[np.ndarray, "h w 3"]]], rate: Fraction | None = None
) -> None:
    """Write frames (blue, green, red) with their times [s], which increase; odd sizes lose their last row or column.

    `rate` [1/s] of frames that come evenly tells how long the last one is shown.
    """
    av = package("av", "video")
    with av.open(str(path), "w", format="mp4") as container:
        stream = None
        for time, image in frames:
            height, width = (n // 2 * 2 for n in image.shape[:2])
            if stream is None:
                stream = container.add_stream("libx264", rate=rate, options={"crf": "20", "preset": "veryfast"})
                stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
                stream.codec_context.time_base = _BASE
            frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(image[:height, :width]), format="bgr24")
            frame.pts, frame.time_base = round(time / _BASE), _BASE
            container.mux(stream.encode(frame))
        if stream is not None:
            container.mux(stream.encode())
