"""Frames a second of the tracker at 1280 x 720, beside the paper's way by OpenCV alone; memory over ten minutes.

The video: a rendered paddle of four colours, H.264, repeated to ten minutes at 30 frames a second for the memory.
"""

import resource
import tempfile
import time
from pathlib import Path

import av
import cv2
import numpy as np

from nectosome.vision.video import Clip, SegmentSheet, track_segments
from nectosome_studies.track.render import Film, Floor, Paddle, PaddleScene, RenderCamera, RenderLens, write_clip

_SIZE, _RATE, _FRAMES, _REPEATS, _MINUTES = (1280, 720), 30, 120, 5, 10
_COLOURS = ((45.0, 75.0, 200.0), (200.0, 45.0, 40.0), (40.0, 170.0, 60.0), (220.0, 200.0, 40.0))
_HUES = {"arm": (205, 245), "first": (345, 15), "second": (110, 150), "third": (40, 65)}  # deg
_LENGTHS = np.array([0.105, 0.035, 0.035, 0.035])  # m


def ends(t):
    phase = 2 * np.pi * 0.6 * np.asarray(t)
    direction = np.stack([1.3 * np.sin(phase) + a * np.sin(phase - 1.3) for a in (0.0, 0.4, 0.7, 0.9)], axis=-1)
    unit = np.stack([np.cos(direction), np.sin(direction)], axis=-1)
    joints = np.cumsum(_LENGTHS[:, None] * unit, axis=1)
    return np.stack([joints - (_LENGTHS[:, None] - 0.003) * unit, joints - 0.003 * unit], axis=2)


def sheet(fit):
    colour = {"saturation": (0.45, 1.0), "value": (0.2, 1.0)}
    segments = {name: {"hue": tuple(np.deg2rad(hue)), **colour} for name, hue in _HUES.items()}
    return SegmentSheet.model_validate({"pixel": 0.001, "segments": segments, "fit": fit})


def by_opencv(path):
    """HSV, one range a segment (two for red), contours, minAreaRect; no check of anything."""
    turn = 180 / 360
    found = []
    for frame in Clip(path).frames():
        hsv = cv2.cvtColor(frame.image, cv2.COLOR_BGR2HSV)
        row = []
        for low, high in _HUES.values():
            parts = [(low, high)] if low < high else [(low, 360), (0, high)]
            masks = [cv2.inRange(hsv, (int(a * turn), 115, 51), (int(b * turn), 255, 255)) for a, b in parts]
            mask = masks[0] if len(masks) == 1 else cv2.bitwise_or(*masks)
            outlines, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
            row.append(cv2.minAreaRect(max(outlines, key=cv2.contourArea))[2] if outlines else np.nan)
        found.append(row)
    return found


def repeated(path, longer, times):
    """The same packets again and again."""
    with av.open(str(path)) as source, av.open(str(longer), "w") as target:
        stream = target.add_stream_from_template(source.streams.video[0])
        packets = [p for p in source.demux(source.streams.video[0]) if p.dts is not None]
        length = sum(p.duration for p in packets)
        for k in range(times):
            source.seek(0)
            for packet in source.demux(source.streams.video[0]):
                if packet.dts is None:
                    continue
                packet.pts += k * length
                packet.dts += k * length
                packet.stream = stream
                target.mux(packet)


def main() -> None:
    camera = RenderCamera(_SIZE, RenderLens(1000.0), (0.0, 0.0, 1.0), (0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0))
    film = Film(_RATE, defocus=0.6, grain=2.0)
    scene = PaddleScene(camera, film, ends, Paddle(_COLOURS, 0.006), Floor(-0.3))
    with tempfile.TemporaryDirectory() as folder:
        path = write_clip(Path(folder) / "row.mp4", (scene.frame(k / _RATE) for k in range(_FRAMES)), _RATE)
        readers = {
            "only read": lambda: sum(1 for _ in Clip(path).frames()),
            "minAreaRect by OpenCV alone": lambda: by_opencv(path),
            "nectosome, rectangle": lambda: track_segments(path, sheet("rectangle")),
            "nectosome, moments": lambda: track_segments(path, sheet("moments")),
        }
        spent = {name: [] for name in readers}
        for read in readers.values():
            read()
        for _ in range(_REPEATS):  # in turns
            for name, read in readers.items():
                began = time.process_time()
                read()
                spent[name].append(time.process_time() - began)
        print(f"\n{_FRAMES} frames of {_SIZE[0]} x {_SIZE[1]}, H.264, four segments: frames a second of one core")
        for name, seconds in spent.items():
            print(f"  {name}: {_FRAMES / np.median(seconds):.0f}")
        longer = Path(folder) / "long.mp4"
        repeated(path, longer, _MINUTES * 60 * _RATE // _FRAMES)
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        tracked = track_segments(longer, sheet("moments"))
        after = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        minutes = float(tracked["time"][-1]) / 60
        print(
            f"  {minutes:.1f} minutes, {tracked.sizes['time']} frames: {after:.0f} MB at most, {before:.0f} MB before"
        )


if __name__ == "__main__":
    main()
