"""Video files of rendered frames, with times of their own and colours that come back."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float, UInt8

if TYPE_CHECKING:
    from av.video.frame import VideoFrame

_MATRICES = {"bt601": (5, 6), "bt709": (1, 1)}  # swscale's number and that in files (H.273, table 4)
_BT709 = 1  # primaries and transfer characteristics in files
_TICK = Fraction(1, 60000)  # [s] of frames with their own times


@dataclass(frozen=True)
class _Coded:
    """What frames become in a file."""

    pixels: str  # FFmpeg's name of the layout
    full: bool = True  # counts 0 to 255, or 16 to 235
    quality: str | None = None  # how the codec takes it
    options: dict[str, str] = field(default_factory=dict)


_CODECS = {
    "libx264": _Coded("yuv420p", False, "crf", {"preset": "veryfast"}),
    "libx265": _Coded("yuv420p", False, "crf", {"preset": "veryfast", "x265-params": "log-level=error"}),
    "mpeg4": _Coded("yuv420p", False, "scale"),
    "mjpeg": _Coded("yuvj420p", True, "scale"),
    "ffv1": _Coded("bgr0"),
}


def write_clip(
    path: str | Path,
    frames: Iterable[UInt8[np.ndarray, "h w 3"]],
    rate: float,
    codec: str = "libx264",
    quality: int | None = None,
    times: Float[np.ndarray, "n"] | None = None,
    matrix: str = "bt601",
) -> Path:
    """Write frames, red, green and blue, as a video; the file is there when it is whole.

    `rate` in frames a second. `quality` is x264's and x265's crf (18 is good), or the quantiser of mpeg4 and mjpeg from
    2 on; the smaller the better; ffv1 loses nothing. `times` [s] are frames' own, rising, kept to a 60000th of a
    second, but in Matroska (.mkv, for ffv1) to a thousandth, and in AVI not at all. Colours are coded by the matrix of
    BT.601, or of BT.709, and the file says so: BT.601 is what most take that do not look, so that by default all
    agree. Sides must be even but for ffv1, since colour has half the resolution.
    """
    import av
    from av.video.stream import VideoStream

    path = Path(path)
    if codec not in _CODECS:
        raise ValueError(f'write_clip: there is no codec "{codec}" here; there are {", ".join(_CODECS)}.')
    if matrix not in _MATRICES:
        raise ValueError(f'write_clip: there is no matrix "{matrix}"; there are {", ".join(_MATRICES)}.')
    if times is not None and not np.all(np.diff(times) > _TICK):
        raise ValueError("write_clip: times must rise, by more than a 60000th of a second.")
    coded = _CODECS[codec]
    options = dict(coded.options)
    if coded.quality == "crf" and quality is not None:
        options["crf"] = str(quality)
    exact = Fraction(rate).limit_denominator(1001)
    if abs(float(exact) - rate) > 1e-9 * rate:
        exact = Fraction(rate).limit_denominator(100_000)
    part = path.with_name(f".{path.stem}.part{path.suffix}")
    try:
        with av.open(str(part), "w") as file:
            stream = file.add_stream(codec, rate=exact, options=options)
            assert isinstance(stream, VideoStream)
            tick = 1 / exact if times is None else _TICK
            context = stream.codec_context
            context.time_base = stream.time_base = tick
            context.pix_fmt = coded.pixels
            if coded.quality == "scale" and quality is not None:
                context.qmin = context.qmax = quality
            if coded.pixels.startswith("yuv"):
                context.colorspace = _MATRICES[matrix][1]
                context.color_range = 2 if coded.full else 1
                context.color_primaries = context.color_trc = _BT709
            count = 0
            for k, frame in enumerate(_coded(frames, coded, matrix)):
                count = k + 1
                if k == 0:
                    context.width, context.height = frame.width, frame.height
                if times is not None and k >= len(times):
                    raise ValueError(f"write_clip: there are more frames than the {len(times)} times.")
                frame.time_base = tick
                frame.pts = k if times is None else round(Fraction(float(times[k])) / tick)
                file.mux(stream.encode(frame))
            if count == 0:
                raise ValueError("write_clip: there are no frames.")
            if times is not None and count < len(times):
                raise ValueError(f"write_clip: there are {len(times)} times, but {count} frames.")
            file.mux(stream.encode(None))
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)
    return path


def _coded(frames: Iterable[UInt8[np.ndarray, "h w 3"]], coded: _Coded, matrix: str) -> Iterator["VideoFrame"]:
    """Frames in the codec's layout."""
    from av.video.frame import VideoFrame
    from av.video.reformatter import ColorRange, Interpolation, VideoReformatter

    converter = VideoReformatter()
    # colour is the mean over four pixels, and all is rounded, not cut off
    manner = Interpolation.AREA | Interpolation.ACCURATE_RND | Interpolation.FULL_CHR_H_INP
    for picture in frames:
        picture = np.ascontiguousarray(picture)
        height, width = picture.shape[:2]
        if coded.pixels.startswith("yuv") and (height % 2 or width % 2):
            raise ValueError(f"write_clip: frames of {width} x {height} px need even sides, or the codec ffv1.")
        frame = VideoFrame.from_ndarray(picture, format="rgb24")
        if not coded.pixels.startswith("yuv"):
            yield converter.reformat(frame, format=coded.pixels)
            continue
        yield converter.reformat(
            frame,
            format=coded.pixels,
            src_color_range=ColorRange.JPEG,
            dst_color_range=ColorRange.JPEG if coded.full else ColorRange.MPEG,
            dst_colorspace=_MATRICES[matrix][0],
            interpolation=manner,
            threads=1,
        )
