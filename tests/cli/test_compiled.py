"""What commands compile: each program once, none for single operations; and they say so while it takes long."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest
from tests.small_robots import BALL

from nectosome.cli import progress
from nectosome.cli.progress import progress_bar
from nectosome.core.programs import remember
from nectosome.search.executors.processes import processors

ROOT = Path(__file__).parents[2]
# run by every process of a command: which programs it compiles
WATCH = """
import os
from jax import monitoring

loaded = []

def listen(event, seconds, **of):
    if event.endswith("cache_retrieval_time_sec"):
        loaded.append(True)
    elif event.endswith("backend_compile_duration"):
        with open(os.environ["PROGRAMS"], "a") as file:
            file.write(f"{os.getpid()} {of['fun_name']} {'loaded' if loaded else 'compiled'}\\n")
        loaded.clear()

monitoring.register_event_duration_secs_listener(listen)
"""


@pytest.mark.parametrize(
    ("words", "code", "warning"),  # the paddle's servo is beyond its limits
    [
        pytest.param(("periodic", "paddle"), 1, "joint.flexure.as_printed:", marks=pytest.mark.slow),
        (("steady", "ball.yaml"), 0, ""),
        (("simulate", "ball.yaml"), 0, ""),
    ],
)
def test_a_command_compiles_each_program_once_and_none_of_one_operation(tmp_path, words, code, warning):
    (tmp_path / "ball.yaml").write_text(BALL)
    command = [sys.executable, str(ROOT / "benchmarks" / "watched.py"), "programs.json", *words]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr.count("\n")) == (code, bool(warning))
    assert warning in done.stderr
    programs = json.loads((tmp_path / "programs.json").read_text())
    names = [row["program"] for row in programs]
    assert len(names) == len({*names}) >= 3
    assert min(row["operations"] for row in programs) > 9


@pytest.mark.slow  # `core/test_remember.py` has the processes that load
def test_workers_of_a_search_load_what_another_process_compiled(tmp_path):
    (tmp_path / "ball.yaml").write_text(BALL)
    (tmp_path / "sitecustomize.py").write_text(WATCH)
    words = ["design", "ball.yaml", "--vary", "body.density=1100..1300 kg/m3", "--forward", "-z", "--starts", "4"]
    own = {"PROGRAMS": "programs.txt", "PYTHONPATH": str(tmp_path), "NECTOSOME_CACHE": str(tmp_path / "cache")}
    command = [sys.executable, "-m", "nectosome", *words]
    done = subprocess.run(
        command, cwd=tmp_path, env=os.environ | own, capture_output=True, text=True, timeout=300, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
    rows = [line.split() for line in (tmp_path / "programs.txt").read_text().splitlines()]
    assert len({process for process, *_ in rows}) >= min(3, 1 + processors())
    compiled = [program for _, program, how in rows if how == "compiled"]
    assert len(compiled) == len({*compiled}) >= 3


def test_progress_says_what_a_first_answer_waits_for(monkeypatch, capsys):
    monkeypatch.setattr(progress, "_DELAY", 0.0)
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("COLUMNS", "80")
    with progress_bar("eel"), remember._told("integrate"):
        time.sleep(0.3)
    assert "compiling equations" in capsys.readouterr().err
    with progress_bar("eel"):
        time.sleep(0.3)
    shown = capsys.readouterr().err
    assert "eel" in shown and "compiling" not in shown
