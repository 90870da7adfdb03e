"""What reaches a terminal: no character that it would obey, few lines, and the right exit code where it is closed."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from tests.small_robots import BALL

from .answers import obeyed

ESCAPE = "\x1b]0;owned\x07\x1b[2J\x9b31m\u202e"
BODY = BALL.replace("name: ball", f"name: {json.dumps('ball ' + ESCAPE)}", 1)
SHELL = [sys.executable, "-m", "nectosome"]


@pytest.mark.parametrize(
    "argv",
    [
        ("show", f"a{ESCAPE}.yaml"),
        ("simulate", f"a{ESCAPE}.yaml", "--time", "0.1s"),
        ("show", "run.nc"),
        ("show", f"gone{ESCAPE}.yaml"),
        ("show", ESCAPE),
        ("check", f"a{ESCAPE}.yaml"),
        ("simulate", f"a{ESCAPE}.yaml", "--set", f"{ESCAPE}=3"),
        ("measure", f"a{ESCAPE}.csv"),
        ("new", "flagellum", f"b{ESCAPE}.yaml"),
        (f"command{ESCAPE}",),
        ("show", f"a{ESCAPE}.yaml", "--json"),
        ("show", ESCAPE, "--json"),
    ],
)
def test_names_give_a_terminal_no_orders(nectosome, tmp_path, ball_run, argv):
    from nectosome.io import load_dataset, save_dataset

    (tmp_path / f"a{ESCAPE}.yaml").write_text(BODY)
    (tmp_path / f"a{ESCAPE}.csv").write_text(f"time (s),{ESCAPE} (N),force {ESCAPE}\n0,1,2\n1,2,3\n")
    save_dataset(load_dataset(ball_run).assign_attrs(title=ESCAPE, status_reason=ESCAPE), tmp_path / "run.nc")
    answer = nectosome(*argv)
    assert obeyed(answer.out + answer.err) == []
    assert answer.out + answer.err


@pytest.mark.parametrize("name", ["n" * 10_000, "n " * 5_000, "a/" * 5_000 + "x.yaml"])
@pytest.mark.parametrize("argv", [("show",), ("new", "flagellum"), ("simulate",), ("reproduce",), ()])
def test_a_message_about_a_long_name_is_short(nectosome, argv, name):
    answer = nectosome(*argv, name)
    assert answer.code == 2
    assert len(answer.err) <= 1001 and answer.err.count("\n") == 1
    told = json.loads(nectosome(*argv, name, "--json").out) if argv else {"error": {"message": ""}}
    assert len(told["error"]["message"]) <= 1000


def test_a_long_name_is_cut_on_stdout_and_whole_in_json(nectosome, tmp_path, ball_run):
    from nectosome.io import load_dataset, save_dataset

    long, run = "n" * 10_000, load_dataset(ball_run)
    save_dataset(run.assign_attrs(title=long, status_reason=long), tmp_path / "run.nc")
    (tmp_path / "long.yaml").write_text(BALL.replace("name: ball", f"name: ball\nabout: {long}", 1))
    for argv in (("show", "run.nc"), ("show", "long.yaml")):
        answer = nectosome(*argv)
        assert (answer.code, answer.err) == (0, "") and "nnn...nnn" in answer.out
        assert max(map(len, answer.out.splitlines())) < 400
    assert json.loads(nectosome("show", "run.nc", "--json").out)["title"].startswith(long)


def test_the_words_of_a_progress_bar_are_printable_and_short():
    from nectosome.io.work_clock import WorkClock

    work = WorkClock(f"a{ESCAPE}{'n' * 10_000}")
    assert obeyed(work.words) == [] and len(work.words) <= 200
    work.update(f"{ESCAPE}{'n' * 10_000}", 0.5)
    assert obeyed(work.words) == [] and len(work.words) <= 402


def ended(redirection: str, *argv: str) -> tuple[int, str]:
    """Exit code and stderr of a command behind a redirection of a shell."""
    line = f'exec "$@" {redirection}'
    done = subprocess.run(
        ["sh", "-c", line, "sh", *SHELL, *argv], capture_output=True, text=True, timeout=100, check=False,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2] / "src")},
    )  # fmt: skip
    return done.returncode, done.stderr


@pytest.mark.parametrize(
    ("redirection", "done", "wrong"),
    [
        ("1>&-", 2, 2),
        pytest.param("2>&-", 0, 2, marks=pytest.mark.slow),
        pytest.param("1>&- 2>&-", 2, 2, marks=pytest.mark.slow),
        ("0<&- 1>&- 2>&-", 2, 2),
        ("1>/dev/full", 2, 2),
        ("2>/dev/full", 0, 2),
    ],
)
def test_closed_and_full_streams_end_with_the_code_of_what_happened(redirection, done, wrong, tmp_path):
    (tmp_path / "ball.yaml").write_text(BALL)
    code, err = ended(redirection, "show", str(tmp_path / "ball.yaml"))
    assert (code, "Traceback" in err) == (done, False)
    assert "cannot write the output" in err if "1>" in redirection and "2>" not in redirection else not err
    assert ended(redirection, "show", "gone.yaml")[0] == wrong


@pytest.mark.parametrize(
    "asked",
    [
        ("--help",),
        pytest.param(("show", "--help"), marks=pytest.mark.slow),
        pytest.param(("--version",), marks=pytest.mark.slow),
    ],
)
def test_help_is_written_as_results_are(asked):
    assert ended("1>/dev/full", *asked) == (2, "cannot write the output: No space left on device.\n")
    assert ended("1>&- 2>&-", *asked)[0] == 2


@pytest.mark.parametrize("as_json", [(), pytest.param(("--json",), marks=pytest.mark.slow)])
def test_a_reader_that_has_gone_is_no_mistake(as_json):
    """As `| head -1` goes, with the code of a process that SIGPIPE ends."""
    read, write = os.pipe()
    os.close(read)
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2] / "src")}
    done = subprocess.run(
        [*SHELL, "show", "flagellum", *as_json], stdout=write, stderr=subprocess.PIPE, env=environment,
        timeout=100, check=False,
    )  # fmt: skip
    os.close(write)
    assert (done.returncode, done.stderr) == (141, b"")
