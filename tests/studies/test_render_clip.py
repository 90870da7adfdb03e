"""Video files: colours that come back, by the book and by PyAV, times, and files that are whole or absent."""

import numpy as np
import pytest

from nectosome_studies.track.render import write_clip

av = pytest.importorskip("av")

COLOURS = [(230, 20, 25), (20, 200, 40), (30, 40, 220), (220, 210, 30), (210, 30, 200), (128, 128, 128), (4, 4, 4)]
RED_LUMA, BLUE_LUMA = 0.299, 0.114  # of BT.601


def flat(colour, height=48, width=64):
    return np.tile(np.array(colour, np.uint8), (height, width, 1))


def textured(count: int):
    chance = np.random.default_rng(0)
    return [chance.integers(0, 256, (48, 64, 3), dtype=np.uint8) for _ in range(count)]


def decoded(path):
    with av.open(str(path)) as file:
        return [(float(frame.time), frame) for frame in file.decode(video=0)]


def by_the_book(frame) -> np.ndarray:
    """Red, green and blue of the middle by the formula of BT.601, from the luma and chroma that were decoded."""
    planes = [np.frombuffer(p, np.uint8).reshape(p.height, p.line_size)[:, : p.width] for p in frame.planes]
    y, cb, cr = (float(p[p.shape[0] // 2, p.shape[1] // 2]) for p in planes)
    full = frame.format.name == "yuvj420p" or frame.color_range == 2
    y, cb, cr = (y, cb - 128, cr - 128) if full else ((y - 16) * 255 / 219, *((c - 128) * 255 / 224 for c in (cb, cr)))
    r, b = y + 2 * (1 - RED_LUMA) * cr, y + 2 * (1 - BLUE_LUMA) * cb
    return np.array([r, (y - RED_LUMA * r - BLUE_LUMA * b) / (1 - RED_LUMA - BLUE_LUMA), b])


@pytest.mark.parametrize(("codec", "suffix", "quality"), [("libx264", ".mp4", 12), ("mjpeg", ".avi", 2)])
def test_colours_come_back(tmp_path, codec, suffix, quality):
    """Within 3 counts by PyAV and by the formula of the matrix that the file names."""
    frames = [flat(colour) for colour in COLOURS]
    path = write_clip(tmp_path / f"flat{suffix}", frames, 25.0, codec, quality)
    for (_, frame), colour in zip(decoded(path), COLOURS, strict=True):
        np.testing.assert_allclose(frame.to_ndarray(format="rgb24")[24, 32].astype(int), colour, atol=3)
        np.testing.assert_allclose(by_the_book(frame), colour, atol=3)
        if codec == "libx264":
            assert (frame.colorspace, frame.color_range) == (6, 1)


def test_ffv1_loses_nothing(tmp_path):
    frames = textured(4)
    path = write_clip(tmp_path / "exact.mkv", iter(frames), 30.0, "ffv1")
    for (time, frame), (k, wanted) in zip(decoded(path), enumerate(frames), strict=True):
        np.testing.assert_array_equal(frame.to_ndarray(format="rgb24"), wanted)
        assert time == pytest.approx(k / 30, abs=6e-4)  # Matroska counts milliseconds


@pytest.mark.parametrize("rate", [60.0, 30000 / 1001, 240.0])
def test_frames_come_at_their_rate(tmp_path, rate):
    path = write_clip(tmp_path / "even.mp4", textured(9), rate)
    np.testing.assert_allclose([t for t, _ in decoded(path)], np.arange(9) / rate, atol=1e-9)
    with av.open(str(path)) as file:
        assert float(file.streams.video[0].average_rate) == pytest.approx(rate, rel=1e-9)


@pytest.mark.parametrize(
    ("codec", "suffix", "tick"),
    [("libx264", ".mp4", 60000), ("mjpeg", ".mov", 60000), ("ffv1", ".mkv", 1000)],
)
def test_frames_keep_their_own_times(tmp_path, codec, suffix, tick):
    """Jitter, a dropped frame and a late start, as fine as the file has it; each frame stays with its time."""
    times = np.array([0.0, 0.0171, 0.0329, 0.0834, 0.1, 0.117]) + 0.05
    frames = [flat((20 * k + 30,) * 3) for k in range(6)]
    path = write_clip(tmp_path / f"own{suffix}", frames, 60.0, codec, times=times)
    found = decoded(path)
    np.testing.assert_allclose([t for t, _ in found], times, atol=1 / tick)
    grey = [frame.to_ndarray(format="rgb24").mean() for _, frame in found]
    np.testing.assert_allclose(grey, 20 * np.arange(6) + 30, atol=3)


def test_the_file_is_whole_or_not_there(tmp_path):
    def broken():
        yield flat((1, 2, 3))
        raise RuntimeError("out of light")

    with pytest.raises(RuntimeError, match="out of light"):
        write_clip(tmp_path / "half.mp4", broken(), 25.0)
    assert not list(tmp_path.iterdir())


def test_mistakes_are_told(tmp_path):
    path = tmp_path / "none.mp4"
    with pytest.raises(ValueError, match='no codec "h263"'):
        write_clip(path, [], 25.0, "h263")
    with pytest.raises(ValueError, match="rise"):
        write_clip(path, textured(2), 25.0, times=np.array([0.1, 0.1]))
    with pytest.raises(ValueError, match="shorter"):
        write_clip(path, textured(3), 25.0, times=np.array([0.1, 0.2]))
    with pytest.raises(ValueError, match="longer"):
        write_clip(path, textured(2), 25.0, times=np.array([0.1, 0.2, 0.3]))
    with pytest.raises(ValueError, match="even sides"):
        write_clip(path, [flat((1, 2, 3), 47)], 25.0)
    with pytest.raises(ValueError, match="no frames"):
        write_clip(path, [], 25.0)
    assert not list(tmp_path.iterdir())
