"""Video files of rendered frames, with times of their own and colours that come back."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from fractions import Fraction
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float, UInt8

if TYPE_CHECKING:
    from av.video.frame import VideoFrame

_SWSCALE_BT601 = 5  # swscale's number of the matrix
_BT601, _BT709 = 6, 1  # in files (H.273): of the matrix; of primaries and transfer characteristics
_TICK = Fraction(1, 60000)  # [s] of frames with their own times


@dataclass(frozen=True)
class _Codec:
    """What frames become in a file."""

    pixels: str  # FFmpeg's name of the layout
    full: bool = True  # counts 0 to 255, or 16 to 235
    options: dict[str, str] = field(default_factory=dict)


_CODECS = {
    "libx264": _Codec("yuv420p", False, {"preset": "veryfast"}),
    "mjpeg": _Codec("yuvj420p"),
    "ffv1": _Codec("bgr0"),
}


def write_clip(
    path: str | Path,
    frames: Iterable[UInt8[np.ndarray, "h w 3"]],
    rate: float,
    codec: str = "libx264",
    quality: int | None = None,
    times: Float[np.ndarray, "n"] | None = None,
) -> Path:
    """Write frames, red, green and blue, as a video; the file is there when it is whole.

    `rate` in frames a second. `quality` is x264's crf (18 is good), or the quantiser of mjpeg from 2 on; the smaller
    the better; ffv1 loses nothing. `times` [s] are frames' own, rising, kept to a 60000th of a second, but in Matroska
    (.mkv, for ffv1) to a thousandth, and in AVI not at all. Colours are coded by the matrix of BT.601, which readers
    assume that do not look, and the file says so. Sides must be even but for ffv1, since colour has half the
    resolution.
    """
    import av
    from av.video.stream import VideoStream

    path = Path(path)
    if codec not in _CODECS:
        raise ValueError(f'write_clip: there is no codec "{codec}" here; there are {", ".join(_CODECS)}.')
    if times is not None and not np.all(np.diff(times) > _TICK):
        raise ValueError("write_clip: times must rise, by more than a 60000th of a second.")
    coded = _CODECS[codec]
    options = coded.options | ({"crf": str(quality)} if codec == "libx264" and quality is not None else {})
    exact = Fraction(rate).limit_denominator(1001)
    if abs(float(exact) - rate) > 1e-9 * rate:
        exact = Fraction(rate).limit_denominator(100_000)
    tick = 1 / exact if times is None else _TICK
    ticks = count() if times is None else [round(Fraction(float(t)) / tick) for t in times]
    part = path.with_name(f".{path.stem}.part{path.suffix}")
    try:
        with av.open(str(part), "w") as file:
            stream = file.add_stream(codec, rate=exact, options=options)
            assert isinstance(stream, VideoStream)
            context = stream.codec_context
            context.time_base = stream.time_base = tick
            context.pix_fmt = coded.pixels
            if codec == "mjpeg" and quality is not None:
                context.qmin = context.qmax = quality
            if codec != "ffv1":
                context.colorspace = _BT601
                context.color_range = 2 if coded.full else 1
                context.color_primaries = context.color_trc = _BT709
            frame = None
            for frame, at in zip(_coded(frames, coded), ticks, strict=times is not None):
                if not context.is_open:
                    context.width, context.height = frame.width, frame.height
                frame.time_base, frame.pts = tick, at
                file.mux(stream.encode(frame))
            if frame is None:
                raise ValueError("write_clip: there are no frames.")
            file.mux(stream.encode(None))
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)
    return path


def _coded(frames: Iterable[UInt8[np.ndarray, "h w 3"]], coded: _Codec) -> Iterator["VideoFrame"]:
    """Frames in the codec's layout."""
    from av.video.frame import VideoFrame
    from av.video.reformatter import ColorRange, Interpolation, VideoReformatter

    converter = VideoReformatter()
    # colour is the mean over four pixels, and all is rounded, not cut off
    manner = Interpolation.AREA | Interpolation.ACCURATE_RND | Interpolation.FULL_CHR_H_INP
    for picture in frames:
        height, width = picture.shape[:2]
        frame = VideoFrame.from_ndarray(np.ascontiguousarray(picture), format="rgb24")
        if not coded.pixels.startswith("yuv"):
            yield converter.reformat(frame, format=coded.pixels)
            continue
        if height % 2 or width % 2:
            raise ValueError(f"write_clip: frames of {width} x {height} px need even sides, or the codec ffv1.")
        yield converter.reformat(
            frame,
            format=coded.pixels,
            src_color_range=ColorRange.JPEG,
            dst_color_range=ColorRange.JPEG if coded.full else ColorRange.MPEG,
            dst_colorspace=_SWSCALE_BT601,
            interpolation=manner,
            threads=1,
        )
