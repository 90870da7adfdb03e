"""The hull of the examples that coasts down: its drag comes out, by the commands that the documentation gives."""

import re
import shlex
import shutil
from pathlib import Path

import numpy as np
import pytest

from nectosome.io import load_dataset

from .answers import check_made

ROOT = Path(__file__).parents[2]
EXAMPLE = ROOT / "examples" / "coast_down"


def commands():
    """Commands of the section, as they are typed."""
    (section,) = re.findall(
        r"## Drag from coast-down\n(.*?)\n## ", (ROOT / "docs/how-to/identify.md").read_text(), re.S
    )
    lines = section.replace("\\\n", " ").splitlines()
    return [shlex.split(line.removeprefix("$ nectosome ")) for line in lines if line.startswith("$ nectosome ")]


@pytest.fixture
def lab(tmp_path):
    shutil.copytree(EXAMPLE, tmp_path, dirs_exist_ok=True)


@pytest.mark.slow
@pytest.mark.usefixtures("lab")
def test_the_commands_of_the_documentation_find_drag_and_starts_and_what_one_mass_does_not_tell(nectosome):
    both, alone = commands()
    answer = nectosome(*both, "--starts", "1", "--save", "both.nc")
    assert (answer.code, answer.err) == (0, "")
    found = load_dataset("both.nc")
    truth = np.array([32e-4, 0.6, 1.4, 1.1, 0.9])  # as make.py has them
    assert found["parameter"].values.tolist()[3:] == [f"body.joint.velocity of {name}" for name in ("bare", "leaded")]
    assert np.all((found["low"] < truth) & (truth < found["high"]) & found["identifiable"])
    answer = nectosome(*alone, "--starts", "1", "--save", "alone.nc")
    assert answer.code == 0
    found = load_dataset("alone.nc")
    assert not (found["low_known"] | found["high_known"])[:3].any() and answer.out.count("any value of the") == 3
    area, linear, added, speed = found["value"].values
    ratios = np.array([area, linear]) / (16.8 + added)
    np.testing.assert_allclose([*ratios, speed], [32e-4 / 18.2, 0.6 / 18.2, 1.1], rtol=0.02)


@pytest.mark.slow
def test_the_recordings_of_the_example_are_what_its_script_makes(tmp_path, monkeypatch):
    check_made(EXAMPLE, tmp_path, monkeypatch, lambda _: 1e-4)
