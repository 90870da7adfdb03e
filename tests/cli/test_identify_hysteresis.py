"""`identify hysteresis` on the synthetic recordings of the examples: what it prints and writes, and what it refuses."""

import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from nectosome.io import load_dataset
from nectosome_studies.fishtail.plant import DAMPING, FREQUENCY, LIMIT

from .answers import check_made, check_wrong

EXAMPLE = Path(__file__).parents[2] / "examples" / "fishtail_recordings"
ASKED = ("identify", "hysteresis", "--campaign", "lab/campaign.yaml")


def shifted(rows):
    """Rows of a file whose displacement has its zero elsewhere, by 30 mm."""
    parts = [row.split(",") for row in rows[1:]]
    return "\n".join([rows[0], *(f"{t},{p},{float(y) + 30}" for t, p, y in parts)])


@pytest.fixture
def lab(tmp_path):
    shutil.copytree(EXAMPLE, tmp_path / "lab")
    return tmp_path / "lab"


def test_the_example_finds_the_truth_and_predicts_the_other_recording(nectosome, lab, tmp_path):
    answer = nectosome(*ASKED, "--slew", "--test", "waves_0.8.csv", "--save", "tail.nc", "--plot", "tail.html")
    assert (answer.code, answer.err) == (0, "")
    found = load_dataset(tmp_path / "tail.nc")
    three = found.sel(parameter=["frequency", "damping", "slew"])
    np.testing.assert_allclose(three["value"], [FREQUENCY, DAMPING, LIMIT], rtol=5e-3)
    assert np.all((three["low"] < three["value"]) & (three["value"] < three["high"]))
    assert found["used"].values.tolist() == ["train"] * 3 + ["test"]
    assert np.all(found["e_rmsp"] < 0.17)
    assert found.attrs["noise"] == pytest.approx(5e-5, rel=0.05)
    assert json.loads(found.attrs["provenance"])["settings"]["test"] == "waves_0.8.csv"
    for words in ("3 recordings fitted, 1 held out", "mm/bar", "held out", "residuals: 0.05"):
        assert words in answer.out
    page = (tmp_path / "tail.html").read_text()
    for words in ("Displacement, waves_1", "that was not fitted", "bar/s (95 %: 3.7", "mm"):
        assert words in page


def test_a_valve_that_is_left_out_is_told_to_be_missing(nectosome, lab):
    answer = nectosome(*ASKED, "--order", "2")
    assert (answer.code, answer.err) == (0, "")
    assert "warning: residuals are correlated" in answer.out


def test_a_dead_time_is_asked_for_printed_and_saved(nectosome, lab, tmp_path):
    """The displacements of one recording, three samples later than they were."""
    rows = (lab / "waves_1.csv").read_text().splitlines()
    parts = [row.split(",") for row in rows[1:]]
    late = [parts[0][2]] * 3 + [y for *_, y in parts[:-3]]
    text = "\n".join([rows[0], *(f"{t},{p},{y}" for (t, p, _), y in zip(parts, late, strict=True))])
    step = float(parts[1][0]) - float(parts[0][0])
    (lab / "late.csv").write_text(text)
    campaign = (lab / "campaign.yaml").read_text()
    head = campaign[: campaign.index("recordings:")]
    (lab / "late.yaml").write_text(f"{head}recordings:\n  - {{file: late.csv}}\n")
    asked = ("identify", "hysteresis", "--campaign", "lab/late.yaml", "--slew", "--dead-time", "--save", "late.nc")
    answer = nectosome(*asked)
    assert (answer.code, answer.err) == (0, "")
    assert "dead_time" in answer.out
    found = load_dataset(tmp_path / "late.nc").sel(parameter="dead_time")
    assert float(found["low"]) < 3 * step < float(found["high"]) < 4 * step


def test_uneven_times_and_gaps_are_dealt_with_and_told(nectosome, lab):
    one, fast = (lab / name for name in ("waves_1.csv", "waves_1.5.csv"))
    lines = one.read_text().splitlines()
    one.write_text("\n".join([*lines[:300], *lines[340:]]))
    fast.write_text("\n".join(line for k, line in enumerate(fast.read_text().splitlines()) if k % 7 != 3))
    answer = nectosome(*ASKED, "--slew")
    assert (answer.code, answer.err) == (0, "")
    assert "waves_1: 62 of 361 samples left out, from the first gap on" in answer.out
    assert "waves_1.5: put on even steps of 0.01 s" in answer.out


def test_the_files_of_the_example_are_those_that_its_script_makes(tmp_path, monkeypatch):
    check_made(EXAMPLE, tmp_path, monkeypatch, lambda name: 1.1e-3)


def test_wrong_identifications_are_answered_in_a_sentence(nectosome, lab, tmp_path):
    text = (lab / "campaign.yaml").read_text()
    swapped = "columns: {pressure: {column: displacement}, displacement: {column: pressure}}"
    changed = {
        "missing": ("waves_1.csv", "waves_9.csv"),
        "swapped": ("file: waves_1.csv", f"{swapped}, file: waves_1.csv"),
        "unit": ("file: waves_1.csv", "columns: {pressure: {unit: m}, displacement: {}}, file: waves_1.csv"),
        "column": ("file: waves_1.csv", "columns: {bend: {column: displacement}}, file: waves_1.csv"),
        "no_time": ("file: waves_1.csv", "time: none, file: waves_1.csv"),
        "cut": ("waves_1.csv", "cut.csv"),
        "still": ("waves_1.csv", "still.csv"),
        "off": ("waves_1.csv", "off.csv"),
        "broken": ("waves_1.csv", "broken.csv"),
    }
    rows = (lab / "waves_1.csv").read_text().splitlines()
    (lab / "cut.csv").write_text("\n".join(rows[:10]))
    (lab / "still.csv").write_text(re.sub(r"(?m)^([\d.]+),[-\d.]+,", r"\1,0.1,", "\n".join(rows)))
    (lab / "off.csv").write_text(shifted(rows))
    (lab / "broken.csv").write_text("\n".join([*rows[:20], *rows[60:]]))
    for name, (old, new) in changed.items():
        assert old in text
        (lab / f"{name}.yaml").write_text(text.replace(old, new))
    cases = [("identify", "hysteresis", "--campaign", f"lab/{name}.yaml") for name in (*changed, "nothing")]
    cases += [(*ASKED, "--method", name) for name in ("varpo", "")]
    cases += [(*ASKED, "--order", x) for x in ("0", "7", "-1", "two", "1.5", "")]
    cases += [(*ASKED, "--zeros", x) for x in ("2", "6", "-1", "one")]
    cases += [(*ASKED, "--test", x) for x in ("waves_9.csv", "")]
    cases += [(*ASKED, "--test", *(f"waves_{f}.csv" for f in ("0.5", "1", "1.5", "0.8")))]
    cases += [(*ASKED, "--save", x) for x in ("tail.txt", "nowhere/tail.nc")]
    cases += [(*ASKED, "--plot", x) for x in ("tail.nc", "nowhere/tail.html")]
    cases += [ASKED[:2], (*ASKED, "--mass", "1kg"), (*ASKED, "more")]
    check_wrong(nectosome, cases, tmp_path)


def test_mistakes_name_the_file_and_the_column(nectosome, lab):
    rows = (lab / "waves_1.csv").read_text().splitlines()
    (lab / "waves_1.csv").write_text(shifted(rows))
    answer = nectosome(*ASKED)
    assert answer.code == 2
    assert answer.err.startswith("waves_1.csv, displacement: begins at 0.03")
    assert "give its zero in the campaign" in answer.err
