"""`nectosome render`: what it writes, and what it says to mistakes."""

import functools
import sys
from pathlib import Path

import av
import cv2
import pytest

from nectosome import solve
from nectosome.io import load_dataset

QUICK = ("--size", "160x128", "--fps", "10")


def test_a_robot_becomes_a_video(nectosome, ball):
    answer = nectosome("render", str(ball), "--time", "2s", "--save", "ball.mp4", *QUICK)
    assert (answer.code, answer.out, answer.err) == (0, "20 frames, 2 s\nwritten: ball.mp4\n", "")
    with av.open("ball.mp4") as video:
        assert sum(1 for _ in video.decode(video=0)) == 20


def test_a_setting_changes_what_is_seen(nectosome, ball):
    for name, radius in (("thin.png", "8mm"), ("thick.png", "20mm")):
        options = ("--set", f"body.radius={radius}", "--time", "2s", "--at", "0s", "--size", "160x128", "--save", name)
        assert nectosome("render", str(ball), *options).code == 0
    assert cv2.imread("thin.png").shape == (128, 160, 3)
    assert (cv2.imread("thin.png") != cv2.imread("thick.png")).any(axis=-1).sum() > 500


def test_a_saved_run_is_seen_as_long_as_it_is(nectosome, ball_run):
    answer = nectosome("render", str(ball_run), "--save", "run.mp4", "--speed", "4", "--camera", "side", *QUICK)
    assert answer.out == "5 frames, 0.5 s\nwritten: run.mp4\n"


def test_a_run_that_gave_up_is_shown_only_as_far_as_asked(nectosome, ball_run):
    run = load_dataset(ball_run)
    run.attrs |= {"status": "STEP_LIMIT", "status_reason": "gave up"}
    run.to_netcdf("part.nc", engine="h5netcdf")
    answer = nectosome("render", "part.nc", "--save", "a.png", "--size", "160x128")
    assert (answer.code, answer.err) == (1, "part.nc: gave up, at 2 s. Say by --time how much of it to show.\n")
    assert not Path("a.png").exists()
    assert nectosome("render", "part.nc", "--save", "a.png", "--size", "160x128", "--time", "1s").code == 0


def test_a_simulation_that_gives_up_is_not_shown(nectosome, ball, monkeypatch):
    monkeypatch.setattr(solve, "simulate", functools.partial(solve.simulate, max_steps=2))
    answer = nectosome("render", str(ball), "--time", "2s", "--save", "a.mp4", *QUICK)
    assert answer.code == 1
    assert answer.err.startswith("ball: failed: more time steps than allowed, at ")
    assert "nothing is written" in answer.err
    assert not Path("a.mp4").exists()


def test_ctrl_c_leaves_nothing(nectosome, ball_run, monkeypatch):
    def pressed(path, frames, rate):
        next(frames)
        path.touch()
        raise KeyboardInterrupt

    monkeypatch.setattr("nectosome.view.film.write_video", pressed)
    answer = nectosome("render", str(ball_run), "--save", "a.mp4", *QUICK)
    assert (answer.code, answer.err) == (130, "cancelled.\n")
    assert not list(Path.cwd().iterdir())


MISTAKES = {
    "none --save a.mp4": "none",
    "{run}": "render: --save needs a value",
    "{run} --save a.gif": '--save: "a.gif" does not end in .mp4, .png or .svg.',
    "{run} --save none/a.mp4": "--save: cannot write into none",
    "{run} --save a.mp4 --size 1280": '--size: "1280" is no width and height',
    "{run} --save a.mp4 --size 641x480": "even numbers from 128 to 4096",
    "{run} --save a.mp4 --size 100000x2": "even numbers from 128 to 4096",
    "{run} --save a.mp4 --fps 0": '--fps: "0" must be a whole number from 1 to 120',
    "{run} --save a.mp4 --speed 0": '--speed: "0" is out of range: 0.01 to 100 are allowed',
    "{run} --save a.mp4 --time 0s": '--time: "0s" is out of range',
    "{run} --save a.mp4 --time 2m": "--time",
    "{run} --save a.mp4 --time 3s": "--time: {run} ends at 2 s",
    "{run} --save a.mp4 --speed 0.01 --fps 120": "--time: 2 s make more than 20000 frames",
    "{run} --save a.mp4 --at 1s": "--at: is for a picture",
    "{run} --save a.mp4 --camera below": "--camera",
    "{run} --save a.mp4 --set body.radius=1mm": "--set: is for a robot",
    "{run} --save a.png --at 3s": "--at: 3 s is not from 0 to 2 s",
    "{run} --save a.png --speed 2": "--speed: is for a video",
    "{run} --save a.png --fps 30": "--fps: is for a video",
    "{ball} --save a.mp4 --time 1e9s": "--time: 1e+09 s take more than 100000 samples",
    "{ball} --save a.mp4 --time 2": '--time: "2" has no unit',
    "{ball} --save a.png --at 1": '--at: "1" has no unit',
    "{ball} --save a.mp4 --set body.colour=1": "body.colour",
    "none.nc --save a.mp4": "none.nc",
}


@pytest.mark.parametrize("words", MISTAKES)
def test_mistakes_are_told(nectosome, ball, ball_run, words):
    known = {"run": str(ball_run), "ball": str(ball)}
    answer = nectosome("render", *(word.format(**known) for word in words.split()))
    assert answer.code == 2
    assert MISTAKES[words].format(**known) in answer.err
    assert "Traceback" not in answer.err


def test_a_run_that_cannot_be_drawn_is_refused(nectosome, ball_run):
    run = load_dataset(ball_run)
    for broken, why in (
        (run.drop_vars("rotation"), "this is not a simulation: it has no rotation over time, station, row, axis."),
        (run.assign(position=run["position"] * float("nan")), "its position is not finite everywhere"),
        (run.isel(time=slice(None, None, -1)), "its times do not go on"),
    ):
        broken.to_netcdf("a.nc", engine="h5netcdf")
        answer = nectosome("render", "a.nc", "--save", "a.png")
        assert answer.code == 2
        assert answer.err.startswith(f"a.nc: {why}")


def test_a_package_that_is_missing_is_told(nectosome, ball_run, monkeypatch):
    monkeypatch.setitem(sys.modules, "av", None)
    answer = nectosome("render", str(ball_run), "--save", "a.mp4")
    assert (answer.code, answer.err) == (2, "the package av is missing: pip install 'nectosome[video]'.\n")
