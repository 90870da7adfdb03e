"""`nectosome simulate --mission`: what it prints, writes and refuses."""

import numpy as np
import pytest

from nectosome.io import load_dataset

MISSION = """modes:
- {name: drop, until: 0.5 s}
- {name: sink, until: [position.z < -0.3 m, 9 s]}
"""


@pytest.fixture
def drop(tmp_path):
    (tmp_path / "drop.yaml").write_text(MISSION)
    return "drop.yaml"


def test_modes_and_events_are_told_and_kept(nectosome, ball, drop, tmp_path):
    answer = nectosome(
        "simulate", str(ball), "--mission", drop, "--save", "run.nc", "--plot", "run.html", "--step", "10ms"
    )
    assert (answer.code, answer.err) == (0, "")
    assert "sink  position.z < -0.3 m  1.047" in answer.out
    assert "every mode came to its end" in answer.out
    ds = load_dataset("run.nc")
    assert list(ds["event_mode"].values) == ["drop", "sink"]
    assert ds["event_time"].values[0] == 0.5
    assert ds["position"].sel(axis="z").values[-1] == pytest.approx(-0.3, abs=1e-8)
    assert np.all(np.diff(ds["time"].values) >= 0)
    assert "Course of a mission" in (tmp_path / "run.html").read_text()


def test_a_mission_that_does_not_come_to_its_end_says_why(nectosome, ball, drop, tmp_path):
    (tmp_path / drop).write_text("modes: [{name: fly, until: position.z > 1 m, longest: 1 s}]")
    answer = nectosome("simulate", str(ball), "--mission", drop, "--step", "10ms")
    assert (answer.code, answer.err) == (1, "ball: fly took longer than 1 s without coming to position.z > 1 m.\n")


@pytest.mark.parametrize(
    ("argv", "message"),
    [
        (("--mission", "none.yaml"), "none.yaml: cannot be read: No such file or directory."),
        (("--mission", "bad.yaml"), 'bad.yaml, line 1, modes.0.until: "then" is nothing that a mode can end with.'),
        (("--mission", "drop.yaml", "--step", "1 s"), "--step: 1 s is out of range: it must be at most 0.1 s."),
        (("--mission", "drop.yaml", "--plot", "a.png"), '--plot: "a.png" does not end in .html'),
        (
            ("--mission", "drop.yaml", "--time", "3 s"),
            "--time: is not for a mission, whose modes say when it ends. Leave it out.",
        ),
        (("--mission", "drop.yaml", "--time", "2.5s"), "--time: is not for a mission"),
        (("--mission", "drop.yaml", "--samples", "9"), "--samples: is not for a mission"),
        (("--mission", "drop.yaml", "--rtol", "2"), '--rtol: "2" is out of range'),
        (("--step", "1ms"), "--step: is for a --mission; without one, --rtol sets the steps."),
    ],
)
def test_a_mistake_is_told_in_a_sentence_and_nothing_is_written(nectosome, ball, drop, tmp_path, argv, message):
    (tmp_path / "bad.yaml").write_text("modes: [{name: a, until: then}]")
    before = sorted(tmp_path.iterdir())
    answer = nectosome("simulate", "ball.yaml", *argv, "--save", "run.nc")
    assert answer.code == 2
    assert answer.err.startswith(message)
    assert answer.err.count("\n") == 1
    assert sorted(tmp_path.iterdir()) == before
