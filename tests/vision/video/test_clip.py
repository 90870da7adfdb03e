"""Video files as they come: their times, and what is no video or is damaged."""

import sys

import av
import numpy as np
import pytest

from nectosome.io.extras import package
from nectosome.units import InputError
from nectosome.vision.video import Clip, track_segments
from nectosome_studies.track.render import write_clip

from . import scenes
from .conftest import RATE, sheet_of


def frames(count, size=(64, 48), seed=0):
    """Noise: every frame another."""
    chance = np.random.default_rng(seed)
    return [chance.integers(0, 256, (size[1], size[0], 3), np.uint8) for _ in range(count)]


def test_frames_come_back_as_they_are(tmp_path):
    made = frames(5)
    clip = Clip(write_clip(tmp_path / "a.mkv", made, 25, "ffv1"))
    read = list(clip.frames())
    assert clip.size == (64, 48)
    assert clip.codec == "ffv1"
    for frame, rgb in zip(read, made, strict=True):
        np.testing.assert_array_equal(frame.image, rgb[..., ::-1])
    np.testing.assert_allclose([frame.time for frame in read], np.arange(5) / 25, atol=1e-3)


def test_frames_have_their_own_times(tmp_path):
    """A camera whose rate varies, and which drops frames."""
    times = np.array([0.0, 0.03, 0.071, 0.1, 0.2, 0.233, 0.27])
    clip = Clip(write_clip(tmp_path / "v.mp4", frames(7), 30, times=times))
    np.testing.assert_allclose([frame.time for frame in clip.frames()], times, atol=1e-4)


@pytest.mark.parametrize("codec", ["libx264", "mjpeg"])
def test_slow_motion_is_put_on_the_cameras_clock(tmp_path, codec):
    """Filmed at 240 Hz and played at 30."""
    path = write_clip(tmp_path / "slow.mp4", frames(9), 30, codec)
    np.testing.assert_allclose([f.time for f in Clip(path, 240.0).frames()], np.arange(9) / 240, atol=1e-6)


def test_missing_frames_are_told_and_leave_a_gap(tmp_path):
    kept = np.delete(np.arange(50), [20, 21, 22, 40])
    scene = scenes.paddle()
    path = write_clip(tmp_path / "gap.mp4", (scene.frame(k / RATE) for k in kept), RATE, quality=8, times=kept / RATE)
    tracked = track_segments(path, sheet_of())
    np.testing.assert_allclose(tracked["time"], kept / RATE, atol=1e-4)
    assert "about 4 frames are missing, the first after 0.6333 s" in tracked.attrs["provenance"]
    assert tracked.attrs["gaps"] == f"[[{19 / RATE}, {23 / RATE}, 21], [{39 / RATE}, {41 / RATE}, 38]]"


def test_a_rate_that_varies_is_told(tmp_path):
    time = np.cumsum(np.random.default_rng(0).uniform(0.02, 0.05, 20))
    scene = scenes.paddle()
    path = write_clip(tmp_path / "vary.mp4", (scene.frame(t) for t in time), 30, quality=8, times=time)
    tracked = track_segments(path, sheet_of())
    assert "the rate of frames varies" in tracked.attrs["provenance"]
    np.testing.assert_allclose(tracked["time"], time - time[0], atol=1e-4)


def test_a_phone_on_its_side_is_turned_upright(tmp_path):
    path = tmp_path / "phone.mp4"
    rgb = np.zeros((48, 64, 3), np.uint8)
    rgb[:24, :, 0] = 255  # red above
    with av.open(str(path), "w") as file:
        stream = file.add_stream("mjpeg", rate=10)
        stream.width, stream.height, stream.pix_fmt = 64, 48, "yuvj444p"
        frame = av.VideoFrame.from_ndarray(rgb, format="rgb24")
        file.mux(stream.encode(frame))
        file.mux(stream.encode(None))
    data = bytearray(path.read_bytes())
    at = data.index(b"tkhd") + 4 + 40  # the matrix of the track's header, in fixed point
    turn = [0, 1 << 16, 0, -(1 << 16) & 0xFFFFFFFF, 0, 0, 0, 0, 1 << 30]
    data[at : at + 36] = b"".join(x.to_bytes(4, "big") for x in turn)
    path.write_bytes(data)
    clip = Clip(path)
    assert clip.size == (48, 64)
    image = next(clip.frames()).image
    assert image[:, -10:, 2].mean() > 200  # turned by 90 deg clockwise: above goes to the right
    assert image[:, :10, 2].mean() < 50


def test_a_damaged_file_is_read_as_far_as_it_goes(tmp_path):
    path = write_clip(tmp_path / "d.mkv", frames(40, (128, 96)), 25, "ffv1")
    data = bytearray(path.read_bytes())
    data[len(data) // 2 : len(data) // 2 + 3000] = bytes(3000)
    path.write_bytes(data)
    clip = Clip(path)
    count = sum(1 for _ in clip.frames())
    assert 0 < count < 41
    assert count < 40 or clip.damaged


def test_a_file_cut_off_in_the_middle_gives_what_is_there(tmp_path):
    path = write_clip(tmp_path / "c.mkv", frames(40, (128, 96)), 25, "ffv1")
    data = path.read_bytes()
    path.write_bytes(data[: len(data) // 2])
    assert 5 < sum(1 for _ in Clip(path).frames()) < 40


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (b"", "it is not a readable video"),
        (b"time,angle\n0,1\n", "it is not a readable video"),
        (bytes(range(256)) * 50, "it is not a readable video"),
    ],
)
def test_what_is_no_video_is_refused(tmp_path, content, told):
    path = tmp_path / "no.mp4"
    path.write_bytes(content)
    with pytest.raises(InputError, match=told):
        Clip(path)


def test_a_file_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(InputError, match="does not exist"):
        Clip(tmp_path / "none.mp4")
    with pytest.raises(InputError, match="is a folder"):
        Clip(tmp_path)


def test_sound_without_a_picture_is_refused(tmp_path):
    path = tmp_path / "sound.wav"
    with av.open(str(path), "w") as file:
        stream = file.add_stream("pcm_s16le", rate=8000)
        frame = av.AudioFrame.from_ndarray(np.zeros((1, 800), np.int16), format="s16", layout="mono")
        frame.sample_rate = 8000
        file.mux(stream.encode(frame))
        file.mux(stream.encode(None))
    with pytest.raises(InputError, match="only sound"):
        Clip(path)


def test_a_codec_that_is_not_known_is_refused(tmp_path):
    path = write_clip(tmp_path / "m.avi", frames(3), 25, "mjpeg")
    path.write_bytes(path.read_bytes().replace(b"MJPG", b"Q9Z8"))
    with pytest.raises(InputError, match=r"its codec is unknown|contains no readable frame"):
        Clip(path)


def test_without_opencv_the_way_to_install_it_is_told(monkeypatch):
    monkeypatch.setitem(sys.modules, "cv2", None)
    with pytest.raises(InputError, match=r"the package cv2 is missing: pip install 'nectosome\[video\]'"):
        package("cv2", "video")
