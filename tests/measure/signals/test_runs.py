import numpy as np
import pytest

from nectosome.measure.signals.events import Window, strokes
from nectosome.measure.signals.metadata import processing
from nectosome.measure.signals.runs import split, split_at_idle, split_at_resets

from .made import recording

T = np.arange(1000) * 0.01


def test_runs_lie_between_idle_times_and_keep_short_pauses():
    moving = ((T >= 1) & (T < 3)) | ((T >= 3.2) & (T < 4)) | ((T >= 7) & (T < 9))
    log = recording(T, speed=moving * 0.5)
    runs = split_at_idle(log, abs(log["speed"]) < 0.1, minimum=0.5)
    ends = [float(t) for run in runs for t in run.time[[0, -1]]]
    assert ends == pytest.approx([1.0, 3.99, 7.0, 8.99])
    assert processing(runs[0])[-1]["function"] == "split"


def test_a_log_without_idle_time_is_one_run():
    log = recording(T, speed=np.ones(1000))
    assert len(split_at_idle(log, log["speed"] < 0.1, 0.5)) == 1


def test_a_log_that_was_started_anew_is_split_there():
    t = np.r_[T[:300], T[:200], T[50:100]]
    parts = split_at_resets(recording(t, force=np.arange(550.0)))
    assert [p.sizes["time"] for p in parts] == [300, 200, 50]
    assert np.concatenate([p["force"] for p in parts]).tolist() == list(range(550))
    assert all(np.all(np.diff(p.time) > 0) for p in parts)


def test_strokes_are_cut_out_with_their_ends():
    log = recording(T, x=np.abs(T % 2 - 1))
    parts = split(log, strokes(log["x"], 0.5))
    assert [float(p["x"][-1] - p["x"][0]) for p in parts[:4]] == pytest.approx([-1, 1, -1, 1])


def test_what_cannot_be_split_is_refused():
    log = recording(T, speed=T)
    with pytest.raises(ValueError, match="window 0, from 20 s to 30 s, has no sample"):
        split(log, [Window(20.0, 30.0)])
    with pytest.raises(ValueError, match=r"time is 0\.01 s and 0\.01 s in samples 1 and 2"):
        split_at_resets(recording([0.0, 0.01, 0.01, 0.02], force=np.zeros(4)))
    with pytest.raises(ValueError, match="10 samples; it needs the 1000"):
        split_at_idle(log, log["speed"][:10] > 0, 1.0)
