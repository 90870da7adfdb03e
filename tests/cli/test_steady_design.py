"""`steady` and `design` on a ball that slides down: good runs, runs that are stopped, and what is left of them."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from nectosome.cli.design import _show
from nectosome.description import get_value, load_robot
from nectosome.description.variables import read_variable
from nectosome.designs import MotionDesign
from nectosome.designs.design import DesignResult
from nectosome.io import load_dataset
from nectosome.io.journal import has_records
from nectosome.search import Evaluation, Result, Start

SPEED = np.sqrt(4 / 3 * np.pi * 0.02**3 * 200 * 9.80665 / (0.5 * 1000 * 1.2e-3))  # where drag carries the weight [m/s]
AREA = "body.loads.drag.drag_area.2"
PROBLEM = f"""
about: the fastest ball
vary:
  body.density: 1100..1300 kg/m3
  {AREA}: 1e-3 m2 .. 4e-3 m2 log
forward: -z
keep:
  - speed <= 0.4 m/s
"""
RUN = ("design", "ball.yaml", "--starts", "2", "--out", "run")


def rows(page: str) -> dict[str, list[str]]:
    """The columns of each row of a page, by the row's name."""
    return {line.split("  ")[0]: line.split() for line in page.splitlines() if line}


@pytest.fixture
def problem(ball) -> Path:
    """The problem file beside the ball."""
    file = ball.with_name("ball.design.yaml")
    file.write_text(PROBLEM)
    return file


def test_steady_prints_the_speed_and_saves_what_show_shows(nectosome, ball):
    done = nectosome("steady", "ball.yaml", "--save", "ball.nc")
    assert (done.code, done.err) == (0, "")
    page = rows(done.out)
    assert float(page["velocity"][-3]) == pytest.approx(-SPEED, rel=1e-3)
    assert "ball: steady motion" in done.out
    shown = nectosome("show", "ball.nc")
    assert (shown.code, shown.err) == (0, "")
    assert shown.out.startswith(done.out.removesuffix("written: ball.nc\n"))
    assert float(load_dataset("ball.nc")["velocity"].sel(axis="z").item()) == pytest.approx(-SPEED, rel=1e-9)


def test_a_ball_that_meets_no_water_has_no_steady_motion_and_it_is_told_what_it_does(nectosome, ball):
    done = nectosome("steady", "ball.yaml", "--set", f"{AREA}=0 m2", "--save", "ball.nc")
    assert done.code == 1
    assert re.fullmatch(r"ball: .*\. Simulated from rest for 10 s, it .*\.\n", done.err)
    assert not Path("ball.nc").exists()


@pytest.fixture
def whole(nectosome, problem, one_process):
    """A design that came to its end, in the folder `run`."""
    done = nectosome(*RUN)
    assert (done.code, done.err) == (0, "")
    return done


def best_of(folder: str) -> list[float]:
    robot = load_robot(Path(folder) / "best.yaml")
    return [float(get_value(robot, name)) for name in ("body.density", AREA)]


def test_a_design_is_found_kept_and_not_computed_again(nectosome, whole, monkeypatch):
    """The limit of 0.4 m/s binds; what is told, kept and handed to other commands is one design."""
    assert "at its limit: speed <= 0.4 m/s\nwritten" in whole.out  # inside its ranges
    assert "written: run/evaluations.nc, run/best.yaml\n" in whole.out
    density, area = best_of("run")
    weight = 4 / 3 * np.pi * 0.02**3 * (density - 1000) * 9.80665
    assert np.sqrt(2 * weight / (1000 * area)) == pytest.approx(0.4, rel=1e-4)
    data = load_dataset("run/evaluations.nc")
    assert data["variable"].values.tolist() == ["body.density", AREA]
    assert data.sizes["start"] == 2
    assert nectosome("check", "run/best.yaml").code == 0
    steady = nectosome("steady", "run/best.yaml")
    assert float(rows(steady.out)["velocity"][-3]) == pytest.approx(-0.4, rel=1e-3)

    journals = {file: file.read_bytes() for file in Path("run").glob("*.jsonl")}
    again = nectosome(*RUN)
    assert (again.code, again.err) == (0, "")
    assert re.sub(r"[\d.]+ s;", "", again.out) == re.sub(r"[\d.]+ s;", "", whole.out)
    assert {file: file.read_bytes() for file in Path("run").glob("*.jsonl")} == journals

    other = nectosome(*RUN, "--seed", "2")
    assert (other.code, other.out) == (2, "")
    assert "holds another seed" in other.err
    kept, own = Path("run/other/best.yaml"), Path("run/choice_a/best.yaml")  # of another search, and of this command
    for file in (kept, own):
        file.parent.mkdir()
        file.write_text("name: a")
    anew = nectosome(*RUN, "--seed", "2", "--force")
    assert (anew.code, anew.err) == (0, "")
    assert kept.exists() and not own.exists()
    assert json.loads(Path("run/search.json").read_text())["seed"] == 2
    assert best_of("run") == pytest.approx([density, area], rel=0.5)


@pytest.mark.slow
def test_a_limit_that_holds_with_a_probability_is_told_with_its_draws_and_resumed(nectosome, problem):
    """The drag of the ball is off by the range of its kind: it sinks at less than 0.4 m/s by its file."""
    robust = (*RUN, "--keep", "speed <= 0.4 m/s @ 90 %", "--quantile", "10%", "--optimiser", "pattern")
    done = nectosome(*robust)
    assert done.code == 0
    assert "at its limit: speed <= 0.4 m/s @ 90 %\n" in done.out
    told = " ".join(done.out.split())
    assert "quantiles and limits with @ are over 16 draws of what is not known exactly (seed 1)" in told
    assert "unsure, by one standard error: 10 % may be 3 to 17 %, 90 % may be 83 to 97 %; more --draws" in told
    assert re.search(r"standard error of the 10 % quantile: 0\.\d+ m/s", told)
    outputs = load_dataset("run/evaluations.nc")["outputs"]
    own, low = (float(outputs.sel(output=name).max()) for name in ("speed", "speed, 10 % quantile"))
    assert low < own
    steady = nectosome("steady", "run/best.yaml")
    assert 0.3 < -float(rows(steady.out)["velocity"][-3]) < 0.39
    again = nectosome(*robust)
    assert re.sub(r"[\d.]+ s;", "", again.out) == re.sub(r"[\d.]+ s;", "", done.out)
    other = nectosome(*robust, "--draws", "20")
    assert (other.code, other.out) == (2, "")


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (("--quantile", "110%"), 'quantile: "1.1" is out of range: it must be more than 0 and less than 1.'),
        (("--quantile", "1%"), "draws: 16 are too few for 1 %: it takes 67 or more."),
        (("--draws", "20"), "draws: they go with a quantile, or with a limit such as torque <= 0.5 N m @ 90 %."),
        (("--draws", "7"), '--draws: "7" must be a whole number from 8 to 10000.'),
        (("--keep", "speed <= 1 m/s @ 0"), 'constraint: "0.0" is out of range'),
    ],
)
def test_draws_that_make_no_sense_get_a_sentence(nectosome, problem, given, said):
    done = nectosome("design", "ball.yaml", *given)
    assert (done.code, done.out) == (2, "")
    assert said in done.err


@pytest.mark.parametrize(
    ("stopped", "said"),
    [
        (2, "1 of 2 starts stopped before an optimum was reached: 200 evaluations made. The best design is of such a"),
        (3, "1 of 2 starts stopped before an optimum was reached: 200 evaluations made. The best design is of a start"),
    ],
)
def test_a_start_that_stops_early_is_told_with_its_reason_and_whether_it_matters(ball, capsys, stopped, said):
    """Of starts that find 2 and 3, in the sense of the search, the one with 2 is the best."""
    robot = load_robot(ball)
    task = MotionDesign(robot, (read_variable("body.density", "1100..1300 kg/m3", robot),), "speed", (), "-z")
    outputs = dict.fromkeys(("speed", "torque", "power"), 0.0)
    starts = []
    for k, objective in enumerate((2, 3)):
        found = Evaluation(np.array([0.2 + 0.5 * k]), objective, np.zeros(0), outputs=outputs)
        ended = (False, "200 evaluations made") if objective == stopped else (True, "the optimality conditions are met")
        starts.append(Start(k, (found,), (1,), *ended, tolerance=1e-6, draws=1))
    assert _show(DesignResult(task, Result(tuple(starts), task.names, ())), 1.0) == 0
    assert capsys.readouterr().err.startswith(said)


@pytest.mark.parametrize(("name", "best", "said"), [("net_weight", -8.7e-15, "0 N"), ("trim", 0.1, "5.73 deg")])
def test_rounding_is_0_and_angles_are_in_degrees(ball, capsys, name, best, said):
    """Beside 20 N, which was evaluated as well."""
    robot = load_robot(ball)
    task = MotionDesign(robot, (read_variable("body.density", "1100..1300 kg/m3", robot),), name, (), "-z")
    found = [Evaluation(np.array([0.2]), x, np.zeros(0), outputs=dict.fromkeys(task.units, x)) for x in (20.0, best)]
    start = Start(0, tuple(found), (2,), True, "the optimality conditions are met", tolerance=1e-6, draws=1)
    assert _show(DesignResult(task, Result((start,), task.names, ())), 1.0) == 0
    assert re.search(rf"^1 .* {said}$", capsys.readouterr().out, re.MULTILINE)


def test_limits_that_were_added_are_told(ball, capsys):
    """As `voltage_demand <= 1` of servos is, in text and JSON, and where no design keeps them."""
    robot = load_robot(ball)
    task = MotionDesign(robot, (read_variable("body.density", "1100..1300 kg/m3", robot),), "speed", (), "-z")
    for objective in (1.0, np.nan):
        found = Evaluation(np.array([0.2]), objective, np.zeros(0), outputs=dict.fromkeys(task.units, 1.0))
        found = found if np.isfinite(objective) else Evaluation.unsolved(found.u, 0, "cannot follow")
        start = Start(0, (found,), (1,), True, "cannot follow", tolerance=1e-6, draws=1)
        result = DesignResult(task, Result((start,), task.names, ()), added=("voltage_demand <= 1",))
        assert _show(result, 1.0) == (0 if found.solved else 1)
        told = capsys.readouterr()
        said = "Kept besides, since the robot has servos: voltage_demand <= 1 (--keep changes it)."
        assert said in " ".join((told.out + told.err).split())


@pytest.mark.usefixtures("one_process")
def test_limits_that_no_design_keeps_are_told(nectosome, problem):
    done = nectosome("design", "ball.yaml", "--starts", "1", "--out", "run", "--keep", "speed >= 9 m/s")
    assert (done.code, done.out) == (1, "written: run/evaluations.nc\n")
    assert done.err.startswith("ball: no design keeps all limits: none of 200 drawn designs was accepted")
    assert "speed >= 9 m/s is not kept" in done.err
    assert not Path("run/best.yaml").exists()


@pytest.mark.usefixtures("one_process")
def test_a_robot_without_drives_or_limits_is_designed_too_and_has_no_efficiency(nectosome, ball):
    """The heaviest ball sinks fastest: V = sqrt(2 * 0.3 * 1000 kg/m3 * 4/3 pi r^3 g / (rho A))."""
    argv = ("design", "ball.yaml", "--vary", "body.density=1100..1300kg/m3", "--forward=-z", "--starts", "1")
    before = sorted(Path().iterdir())
    done = nectosome(*argv)
    assert (done.code, done.err) == (0, "")
    assert sorted(Path().iterdir()) == before  # nothing unasked
    again = nectosome(*argv, "--write", "free.yaml", "--save", "free.csv")
    assert again.out.endswith("written: free.csv, free.yaml\n")
    assert nectosome(*argv, "--write", "free.yaml").err.startswith("--write: free.yaml exists.")
    assert "at its limit: nothing\nat an end of its range: body.density (1300 kg/m3): widen it if the robot" in done.out
    assert float(get_value(load_robot("free.yaml"), "body.density")) == pytest.approx(1300, rel=1e-6)
    undefined = nectosome(*argv, "--maximise", "efficiency")
    assert undefined.code == 1
    assert undefined.err.endswith("mostly because efficiency is not defined for this motion.\n")
    undefined = nectosome(*argv, "--maximise", "speed / power")
    assert undefined.code == 1
    assert undefined.err.endswith("speed / power is NaN or infinite for this motion, as power is 0.\n")


@pytest.mark.usefixtures("one_process")
def test_an_interrupted_design_prints_and_writes_the_best_so_far(nectosome, ball, monkeypatch):
    """As after Ctrl-C or a request to end, once evaluations are made; how many until that is seen differs."""

    def interrupted(compute, update):
        return compute(
            lambda what, share: update(what, share) or not any(map(has_records, Path("run").glob("*.jsonl")))
        )

    monkeypatch.setattr("nectosome.cli.design.cancellable", interrupted)
    monkeypatch.setattr(sys.modules["nectosome.search.multistart"], "_PULSE", 1e-3)
    vary = ("--vary", "body.density=1100..1300kg/m3", "--forward=-z", "--starts", "1")
    argv = ("design", "ball.yaml", *vary, "--optimiser", "cmaes", "--out", "run", "--write", "now.yaml")
    done = nectosome(*argv)
    assert done.code == 130
    assert done.err == "cancelled. The same command goes on from what is in run.\n"
    assert done.out.startswith("ball: best designs so far\n")
    assert "written: run/evaluations.nc, run/best.yaml, now.yaml\n" in done.out
    density = float(get_value(load_robot("now.yaml"), "body.density"))
    assert density == float(get_value(load_robot("run/best.yaml"), "body.density"))
    speeds = load_dataset("run/evaluations.nc")["outputs"].sel(output="speed").values
    assert 1100 < density < 1300
    assert max(speeds) == pytest.approx(
        np.sqrt(2 * 4 / 3 * np.pi * 0.02**3 * (density - 1000) * 9.80665 / (1000 * 1.2e-3)), rel=1e-4
    )


@pytest.mark.usefixtures("one_process")
def test_a_design_in_steps_begins_with_the_file(nectosome, ball):
    """Values of 1100, 1130, ..., 1280 kg/m3, of which the heaviest is fastest; the file's 1200 goes to 1190."""
    argv = ("design", "ball.yaml", "--vary", "body.density=1100..1300:30kg/m3", "--forward=-z", "--own-first")
    done = nectosome(*argv, "--starts", "1", "--out", "run", "--write", "best.yaml")
    assert (done.code, done.err) == (0, "")
    assert get_value(load_robot("best.yaml"), "body.density") == 1280.0
    places = load_dataset("run/evaluations.nc")["u"].values[:, 0] * 6
    np.testing.assert_allclose(places, [3, 4, 5, 6], atol=1e-9)  # one evaluation a value
    ball.write_text(ball.read_text().replace("1200 kg/m3", "1400 kg/m3"))
    outside = nectosome(*argv, "--starts", "1")
    assert "the file's own value is outside: body.density" in outside.out


@pytest.mark.usefixtures("one_process")
@pytest.mark.parametrize(
    "wrong",
    [
        ("--vary", "body.desnity=1..2kg/m3"),
        ("--vary", "body.density=1300..1100kg/m3"),
        ("--vary", "body.density=1100..1300kg/m3:0kg/m3"),
        ("--vary", "N=1..3"),
        ("--optimiser", "nope"),
        ("--optimiser", "nsga2"),
        ("--starts", "0"),
        ("--keep", "voltage_demand <= 1"),
        ("--maximise", "sped"),
    ],
)
def test_a_refused_design_leaves_nothing_and_takes_nothing(nectosome, ball, wrong):
    """No folder where there was none; with --force, all that was in one."""
    good = ("design", "ball.yaml", "--vary", "body.density=1100..1300kg/m3:100kg/m3", "--forward=-z", "--starts", "1")
    refused = nectosome(*good, *wrong, "--out", "new/run")
    assert (refused.code, refused.out) == (2, "")
    assert not Path("new").exists()
    Path("run").mkdir()
    Path("run/best.yaml").write_text("name: mine")
    assert nectosome(*good, *wrong, "--out", "run", "--force").code == 2
    assert Path("run/best.yaml").read_text() == "name: mine"
    assert [path.name for path in Path("run").iterdir()] == ["best.yaml"]


@pytest.mark.slow  # `search/test_killed.py` kills and interrupts searches of functions
@pytest.mark.skipif(os.name != "posix", reason="processes are killed the POSIX way")
@pytest.mark.parametrize("by", [signal.SIGINT, signal.SIGKILL])
def test_a_design_that_is_stopped_goes_on_to_the_same_best(nectosome, whole, tmp_path, by):
    code = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n"  # in the background it is deaf
    code += "if __name__ == '__main__': from nectosome.cli.app import run; run()"
    argv = [sys.executable, "-c", code, *RUN[:-1], "stopped"]
    process = subprocess.Popen(argv, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    until = time.monotonic() + 120
    journals = tmp_path / "stopped"
    while process.poll() is None and time.monotonic() < until and not _written(journals):
        time.sleep(0.005)
    process.send_signal(by)
    _, err = process.communicate(timeout=60)
    assert process.returncode == (130 if by == signal.SIGINT else -signal.SIGKILL)
    if by == signal.SIGINT:
        assert "\ncancelled. The same command goes on from what is in stopped.\n" in err
    assert json.loads((journals / "search.json").read_text())["starts"] == 2
    done = nectosome(*RUN[:-1], "stopped")
    assert (done.code, done.err) == (0, "")
    assert best_of("stopped") == best_of("run")


def _written(folder: Path) -> bool:
    return any(len(file.read_bytes().splitlines()) > 1 for file in folder.glob("*.jsonl"))
