"""The notebooks run from top to bottom, and say what they promise."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.docs.calls import wrong_in

FOLDER = Path(__file__).parents[2] / "docs" / "notebooks"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))


def code_of(path: Path) -> list[dict[str, Any]]:
    """The cells of code."""
    return [cell for cell in json.loads(path.read_text(encoding="utf-8"))["cells"] if cell["cell_type"] == "code"]


def run(name: str) -> dict[str, Any]:
    """The names of a notebook after all its cells but the first, which installs."""
    names: dict[str, Any] = {"__name__": "notebook"}
    for k, cell in enumerate(code_of(FOLDER / f"{name}.ipynb")[1:], start=1):
        exec(compile("".join(cell["source"]), f"{name}, cell {k}", "exec"), names)
    return names


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder to work in."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_every_notebook_is_run_here():
    assert [path.stem for path in NOTEBOOKS] == ["design", "first_swim", "identify_from_a_recording"]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_installs_once_and_keeps_no_output(path: Path):
    book = json.loads(path.read_text(encoding="utf-8"))
    assert (book["nbformat"], book["metadata"]["kernelspec"]["name"]) == (4, "python3")
    assert len({cell["id"] for cell in book["cells"]}) == len(book["cells"])
    install, *others = ("".join(cell["source"]) for cell in code_of(path))
    assert install.startswith("%pip install -q nectosome\n# ")  # what to do where that fails
    assert not any(cell.startswith(("%", "!")) for cell in others)
    assert all(cell["outputs"] == [] and cell["execution_count"] is None for cell in code_of(path))


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_calls_what_there_is(path: Path):
    assert wrong_in("\n".join("".join(cell["source"]) for cell in code_of(path)[1:])) == []


@pytest.mark.slow
def test_a_first_swim(folder: Path, capsys: pytest.CaptureFixture[str]):
    names = run("first_swim")
    settled = float(names["means"].forward_speed)
    assert names["surge"][-50:].mean() == pytest.approx(settled, rel=0.005)  # after 30 s
    assert 0 < float(names["slower"].means().forward_speed) < settled
    assert (folder / "swim.nc").exists() and (folder / "swim.html").stat().st_size > 100_000
    assert "SOLVED" in capsys.readouterr().out


@pytest.mark.slow
def test_a_design_keeps_its_limit(folder: Path):
    names = run("design")
    outputs = names["found"].best.outputs
    assert outputs["power"] <= 4.0 * (1 + 1e-6) and outputs["torque"] <= 0.5 * (1 + 1e-6)
    assert outputs["speed"] > 0.5
    assert names["ns"].load_robot("best.yaml").limbs["filament"].length > 0.3


@pytest.mark.slow
def test_a_recording_tells_the_numbers_that_made_it():
    """Within four standard errors, of which the intervals are two."""
    names = run("identify_from_a_recording")
    table = names["table"]
    for k, true in enumerate(names["truth"].values()):
        half = 0.5 * float(table["high"][k] - table["low"][k])
        assert abs(float(table["value"][k]) - true) < 2 * half < 0.1 * true
    assert np.ptp(names["fitted"] - names["exact"]) < 0.1 * np.ptp(names["guessed"] - names["exact"])
