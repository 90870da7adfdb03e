"""Video files: frames with their own times, read one at a time; gaps between frames; writing."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, UInt8

from nectosome.io.extras import package
from nectosome.io.file_system import is_file, is_folder, reason
from nectosome.units import InputError, shorten

Progress = Callable[[str, float], None]  # step, and the fraction done from 0 to 1
_LATE = 1.5  # [median frame interval]: above, a frame is missing
_UNEVEN = 0.2  # [median frame interval] accepted range of the other intervals
_BASE = Fraction(1, 90_000)  # [s] resolution of time stamps


@dataclass(frozen=True)
class Frame:
    """One picture; `time` [s] since the first one, by the camera's clock."""

    time: float
    image: UInt8[np.ndarray, "height width 3"]  # blue, green, red, as in OpenCV


@dataclass
class Clip:
    """A video file.

    `rate` [Hz] is that of the camera, for a file in slow or fast motion; None: the times of the file are right.
    `damaged` is the number of packets that could not be decoded, after `frames` has ended.
    """

    path: Path
    rate: float | None = None
    size: tuple[int, int] = field(init=False)  # width, height [px], as shown
    stored_rate: float = field(init=False)  # mean rate of the file [Hz]
    expected: int = field(init=False)  # frames by the file; 0: unknown
    codec: str = field(init=False)
    damaged: int = field(init=False, default=0)

    def __post_init__(self) -> None:
        """Open the file. Raises InputError if it is not a readable video."""
        if not is_file(self.path):
            what = "is a folder" if is_folder(self.path) else "does not exist, or its folder may not be entered"
            raise InputError(f"{what}.", file=str(self.path))
        first = next(self._pictures(), None)
        if first is None:
            raise self._wrong("it contains no readable frame.")
        height, width = _upright(first).shape[:2]
        self.size = (width, height)

    @property
    def description(self) -> str:
        """Codec, size and rate in words."""
        return f"{self.codec}, {_by(self.size)}, {self.stored_rate:g} frames a second"

    def frames(self, progress: Progress = lambda what, share: None) -> Iterator[Frame]:
        """Yield all frames in order. Raises InputError if the times do not increase or the size changes."""
        self.damaged = 0
        begin: float | None = None
        last = -1.0
        slower = self.stored_rate / self.rate if self.rate else 1.0
        for k, picture in enumerate(self._pictures()):
            if k % 16 == 0:
                share = min(k / self.expected, 1.0) if self.expected else 0.0
                progress(f"frame {k} of {self.expected or '?'}", share)
            stamp = float(picture.pts * picture.time_base) if picture.pts is not None else k / self.stored_rate
            begin = stamp if begin is None else begin
            time = (stamp - begin) * slower
            if time <= last:
                raise self._wrong(
                    f"the times of its frames do not increase: frame {k + 1} is at {time:.6g} s, the one before at "
                    f"{last:.6g} s. Convert it with ffmpeg, which writes new times."
                )
            image = _upright(picture)
            if image.shape[1::-1] != self.size:
                sizes = f"{_by(self.size)} to {_by(image.shape[1::-1])}"
                raise self._wrong(f"its frames change their size, from {sizes} at frame {k + 1}.")
            last = time
            yield Frame(time, image)

    def _pictures(self) -> Iterator[Any]:
        """Decoded frames; packets that cannot be decoded are counted."""
        av = package("av", "video")
        try:
            container = av.open(str(self.path))
        except (av.error.FFmpegError, ValueError, OSError) as error:
            raise self._wrong(f"it is not a readable video ({shorten(reason(error))}).") from None
        with container:
            if not container.streams.video:
                raise self._wrong("it contains no pictures, only sound or text.")
            stream = container.streams.video[0]
            if stream.codec_context is None:
                raise self._wrong("its codec is unknown. Convert it, for instance to H.264.")
            stream.thread_type = "AUTO"
            self.codec = str(stream.codec_context.name)
            self.stored_rate = float(stream.average_rate or stream.guessed_rate or 25)
            self.expected = stream.frames or round((container.duration or 0) / av.time_base * self.stored_rate)
            yield from self._decoded(container, stream, av.error.FFmpegError)

    def _decoded(self, container: Any, stream: Any, failure: type[Exception]) -> Iterator[Any]:
        packets = container.demux(stream)
        while True:
            try:
                packet = next(packets, None)
                if packet is None:
                    return
                pictures = packet.decode()
            except failure:
                self.damaged += 1
                if self.damaged > 10_000:
                    raise self._wrong("it cannot be decoded: 10000 packets failed.") from None
                continue
            yield from pictures

    def _wrong(self, message: str) -> InputError:
        return InputError(message, file=str(self.path))


def clip_of(video: str | Path, rate: float | None, size: tuple[int, int] | None, whose: str, advice: str) -> Clip:
    """Open a video whose pictures have `size` [px], if given. Raises InputError, with `advice`, if `whose` differs."""
    clip = Clip(Path(video), rate)
    if size is not None and size != clip.size:
        message = f"its pictures are {_by(clip.size)} pixels, and {whose} {_by(size)}. {advice}"
        raise InputError(message, file=str(video))
    return clip


def _upright(picture: Any) -> UInt8[np.ndarray, "height width 3"]:
    """Pixels rotated as a player shows them, by the rotation stored in the file."""
    image = picture.to_ndarray(format="bgr24")
    turns = round(picture.rotation / 90) % 4
    return np.ascontiguousarray(np.rot90(image, turns)) if turns else image


def _by(size: tuple[int, ...]) -> str:
    return f"{size[0]} x {size[1]}"


def intervals(time: Float[np.ndarray, "t"], clip: Clip) -> tuple[list[list[float]], list[str]]:
    """Gaps as [start, end, row after it (from 1)], and warnings."""
    warnings = [f"{clip.damaged} packets could not be decoded: their frames are missing"] if clip.damaged else []
    if len(time) < 3:
        return [], warnings
    steps = np.diff(time)
    usual = float(np.median(steps))
    late = np.flatnonzero(steps > _LATE * usual)
    regular = np.delete(steps, late)
    if np.ptp(regular) > _UNEVEN * usual:
        warnings.append(
            f"the rate of frames varies: {1e3 * steps.min():.3g} to {1e3 * steps.max():.3g} ms between frames"
        )
    if late.size:
        missing = int(np.sum(np.round(steps[late] / usual) - 1))
        warnings.append(f"about {missing} frames are missing, the first after {time[late[0]]:.4g} s")
    return [[float(time[k]), float(time[k + 1]), int(k) + 2] for k in late], warnings


def write_video(
    path: Path, frames: Iterable[tuple[float, UInt8[np.ndarray, "h w 3"]]], rate: Fraction | None = None
) -> None:
    """Write frames (blue, green, red) with their times [s], which increase; odd sizes lose their last row or column.

    `rate` [1/s], for even frames, sets the duration of the last one.
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
