"""`identify surge` on the synthetic recordings of the examples: what it prints and writes, and what it refuses."""

import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from nectosome.io import load_dataset
from nectosome_studies.poseidrone.recordings import body

from .answers import check_made, check_wrong

EXAMPLE = Path(__file__).parents[2] / "examples" / "swim_recordings"
MASS, *TRUTH = body()
GIVEN = ("identify", "surge", "--campaign", "lab/campaign.yaml")
ASKED = (*GIVEN, "--mass", "0.755kg")


@pytest.fixture
def lab(tmp_path):
    shutil.copytree(EXAMPLE, tmp_path / "lab")
    return tmp_path / "lab"


def test_the_example_finds_the_truth_and_predicts_the_other_recording(nectosome, lab, tmp_path):
    answer = nectosome(*ASKED, "--test", "speed_11.76.csv", "--save", "swim.nc", "--plot", "swim.html")
    assert (answer.code, answer.err) == (0, "")
    found = load_dataset(tmp_path / "swim.nc")
    both = found.sel(parameter=["added_mass", "drag"])
    assert np.all((both["low"] <= TRUTH) & (both["high"] >= TRUTH))
    np.testing.assert_allclose(both["value"], TRUTH, rtol=0.1)
    assert found["used"].values.tolist() == ["train", "test"]
    assert np.all(abs(found["deviation_mean"]) < 1)
    assert json.loads(found.attrs["provenance"])["settings"]["test"] == "speed_11.76.csv"
    for words in (
        "1 recording fitted, 1 held out",
        "put by the crank angle",
        "kg/m",
        "held out",
        "warning: the thrust",
    ):
        assert words in answer.out
    page = (tmp_path / "swim.html").read_text()
    for words in ("Speed, speed_11.47", "that was not fitted", "Beware", "added mass"):
        assert words in page


def test_a_bare_mass_is_in_kg_and_all_recordings_are_fitted(nectosome, lab):
    answer = nectosome(*GIVEN, "--mass", "0.755", "--method", "integral_windows", "--smooth", "0.14s")
    assert (answer.code, answer.err) == (0, "")
    assert "2 recordings fitted, 0 held out; M = 0.755 kg" in answer.out
    low, high = map(float, re.search(r"drag Lambda +\S+ +(\S+) +(\S+)", answer.out).groups())  # type: ignore[union-attr]
    assert low < TRUTH[1] < high


def test_finite_differences_are_told_to_be_biased(nectosome, lab):
    answer = nectosome(*ASKED, "--method", "finite_differences", "--smooth", "220ms")
    assert answer.code == 0
    assert "warning: bias expected" in answer.out


def test_the_files_of_the_example_are_those_that_its_script_makes(tmp_path, monkeypatch):
    check_made(EXAMPLE, tmp_path, monkeypatch, lambda name: 2e-4 if "speed" in name else 0.11)


def test_columns_may_be_told_file_by_file(nectosome, lab):
    """A thrust without a head, in another column, with a rate and a sign of its own."""
    rows = np.loadtxt(lab / "thrust_11.47.csv", delimiter=",", skiprows=1)
    np.savetxt(
        lab / "cell.csv", np.column_stack([rows[:, 2], -rows[:, 1]]), delimiter=",", header="angle,F", comments=""
    )
    own = (
        "time: {rate: 200 Hz}, columns: {thrust: {column: F, unit: mN, sign: -1}, crank: {column: angle, unit: rad}}, "
        "conditions: {omega: 11.47 rad/s}"
    )
    lines = (lab / "campaign.yaml").read_text().splitlines()[:4]
    (lab / "campaign.yaml").write_text("\n".join([*lines, f"  - {{file: cell.csv, {own}}}"]))
    answer = nectosome(*ASKED)
    assert (answer.code, answer.err) == (0, "")
    assert "put by the crank angle" in answer.out


def test_wrong_identifications_are_answered_in_a_sentence(nectosome, lab, tmp_path):
    text = (lab / "campaign.yaml").read_text()
    changed = {
        "missing": ("thrust_11.47.csv", "thrust_9.csv"),
        "unpaired": ("thrust_11.47.csv, conditions: {omega: 11.47", "thrust_11.47.csv, conditions: {omega: 11.4"),
        "twice": ("thrust_11.76.csv, conditions: {omega: 11.76", "thrust_11.76.csv, conditions: {omega: 11.47"),
        "shift": ("thrust_11.47.csv, conditions: {", "thrust_11.47.csv, conditions: {shift: 1 N, "),
        "unit": ("file: speed_11.47.csv", "columns: {speed: {column: speed, unit: N}}, file: speed_11.47.csv"),
        "column": ("file: speed_11.47.csv", "columns: {velocity: {column: speed}}, file: speed_11.47.csv"),
        "sign": ("file: thrust_11.47.csv", "columns: {thrust: {sign: -1}, crank: {}}, file: thrust_11.47.csv"),
        "no_time": ("file: speed_11.47.csv", "time: none, file: speed_11.47.csv"),
        "cut": ("speed_11.47.csv", "cut.csv"),
        "still": ("speed_11.47.csv", "still.csv"),
        "late": ("speed_11.47.csv", "late.csv"),
    }
    speed = (lab / "speed_11.47.csv").read_text()
    (lab / "cut.csv").write_text("\n".join(speed.splitlines()[:10]))
    (lab / "still.csv").write_text(re.sub(r"(?m)^([\d.]+),[\d.]+", r"\1,0.08", speed))
    late = "\n".join(f"{100 + k},0.{k}" for k in range(30))
    (lab / "late.csv").write_text(f"time (s),speed (m/s)\n{late}")
    for name, (old, new) in changed.items():
        assert old in text
        (lab / f"{name}.yaml").write_text(text.replace(old, new))
    cases = [(*GIVEN[:3], f"lab/{name}.yaml", *ASKED[4:]) for name in (*changed, "nothing")]
    cases += [(*GIVEN, "--mass", mass) for mass in ("0", "-1", "0kg", "1N", "one", "", "nan", "inf")]
    cases += [(*ASKED, "--test", name) for name in ("speed_9.csv", "thrust_11.47.csv", "")]
    cases += [(*ASKED, "--test", "speed_11.47.csv", "speed_11.76.csv")]
    cases += [(*ASKED, "--method", name) for name in ("output", "gp", "")]
    cases += [(*ASKED, "--smooth", "0.2s"), (*ASKED, "--method", "instrumental_variables", "--smooth", "0.2s")]
    cases += [(*ASKED, "--method", "integral_windows", "--smooth", x) for x in ("0.2", "-1s", "20s", "1ms", "1N")]
    cases += [(*ASKED, "--save", x) for x in ("swim.txt", "nowhere/swim.nc")]
    cases += [(*ASKED, "--plot", x) for x in ("swim.nc", "nowhere/swim.html")]
    cases += [GIVEN, GIVEN[:2], ("identify", "swim"), (*ASKED, "--weight", "1kg"), (*ASKED, "more")]
    check_wrong(nectosome, cases, tmp_path)


def test_mistakes_name_the_file_and_the_column(nectosome, lab):
    text = (lab / "campaign.yaml").read_text()
    (lab / "campaign.yaml").write_text(
        text.replace("file: speed_11.47.csv", "columns: {thrust: {column: speed}}, file: speed_11.47.csv")
    )
    answer = nectosome(*ASKED)
    assert answer.err == (
        "speed_11.47.csv, thrust: is in m/s; N or a multiple is needed. Give its unit in the campaign.\n"
    )
