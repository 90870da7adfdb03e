import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import pytest
from tests.small_robots import BALL

from nectosome.cli import main
from nectosome.search import multistart


@dataclass
class Answer:
    code: int
    out: str
    err: str


@pytest.fixture
def nectosome(capsys, monkeypatch, tmp_path):
    """Run a command in an empty folder."""
    monkeypatch.chdir(tmp_path)

    def run(*argv: str) -> Answer:
        code = main(list(argv))
        captured = capsys.readouterr()
        return Answer(code, captured.out, captured.err)

    return run


@pytest.fixture
def one_process(monkeypatch):
    """Designs are searched in this process, whose programs are compiled once."""
    here = ThreadPoolExecutor(1)

    def searched(*args, **options):
        return multistart(*args, **{**options, "executor": here})

    monkeypatch.setattr(sys.modules["nectosome.designs.design"], "multistart", searched)


@pytest.fixture(scope="session")
def ball_run(tmp_path_factory) -> Path:
    """A saved run of a sinking ball."""
    folder = tmp_path_factory.mktemp("ball")
    (folder / "ball.yaml").write_text(BALL)
    saved = folder / "ball.nc"
    assert main(["simulate", str(folder / "ball.yaml"), "--time", "2s", "--samples", "21", "--save", str(saved)]) == 0
    return saved


@pytest.fixture
def ball(tmp_path) -> Path:
    """The robot file of a ball that slides down."""
    file = tmp_path / "ball.yaml"
    file.write_text(BALL)
    return file
