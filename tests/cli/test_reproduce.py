"""`nectosome reproduce` with studies made up for the test."""

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from nectosome.io import load_dataset
from nectosome_studies import reproduce
from nectosome_studies.study import Study


def row(name: str, **values: Any) -> dict[str, Any]:
    usual = {
        "quantity": "speed",
        "unit": "m/s",
        "shown": "m/s",
        "printed": 0.5,
        "source": "measured",
        "ours": 0.51,
        "error": 2.0,
        "tolerance": 5.0,
        "within": None,
    }
    return {"id": name, **usual, "verdict": "match", "kind": "prediction", "note": "", **values}


class NotInstalled:
    """Finds no studies, installed or not."""

    @staticmethod
    def find_spec(name: str, *_: Any) -> None:
        if name == "nectosome_studies":
            raise ModuleNotFoundError(name=name)


def titles(done: list[Study], out: Path) -> None:
    Path(out, "report.html").write_text(", ".join(study.title for study in done))


class MadeUp:
    """A study that a function computes."""

    minutes = 1.0

    def __init__(self, run: Callable[[bool, Callable[[str, float], None]], Study]) -> None:
        self.run = run


@pytest.fixture
def studies(monkeypatch) -> dict[str, MadeUp]:
    """Two studies in place of the real ones; the report is the list of their names."""

    def worm(quick: bool, progress: Callable[[str, float], None]) -> Study:
        progress("crawling", 0.5)
        rows = [row("worm.speed"), row("worm.force", verdict="differs", note="the paper leaves friction out")]
        run = xr.Dataset({"x": ("time", np.arange(3.0))})
        return Study("worm", "Worm", "", rows, {"quick" if quick else "long": run}, 3.0, {"map": run})

    def eel(quick: bool, progress: Callable[[str, float], None]) -> Study:
        missing = row("eel.cost", verdict="", kind="missing", source="", printed=None, ours=float("nan"), error=None)
        return Study("eel", "Eel", "", [row("eel.speed", ours=np.float64(0.5)), missing], {}, 1.0)

    made_up = {"worm": MadeUp(worm), "eel": MadeUp(eel)}
    monkeypatch.setattr(reproduce, "STUDIES", made_up)
    monkeypatch.setattr(reproduce, "write_report", titles)
    monkeypatch.setattr(reproduce, "pages", lambda studies: ["report.html", *(f"{study}.html" for study in studies)])
    monkeypatch.setattr(reproduce, "write_figures", lambda done, folder: Path(folder, "figure.html").write_text(""))
    return made_up


def test_without_the_studies_a_sentence_says_how_to_get_them(nectosome, monkeypatch, tmp_path):
    for name in ("nectosome_studies", "nectosome_studies.reproduce"):
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setattr(sys, "meta_path", [NotInstalled(), *sys.meta_path])
    answer = nectosome("reproduce", "eel", "--out", "out")
    assert (answer.code, answer.out) == (2, "")
    assert answer.err.endswith("pip install ./nectosome/studies\n") and answer.err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_all_studies_are_run_and_written(nectosome, studies):
    answer = nectosome("reproduce", "--out", "out")
    assert (answer.code, answer.err) == (0, "")
    card = json.loads(Path("out/scorecard.json").read_text())
    assert [r["id"] for r in card["rows"]] == ["worm.speed", "worm.force", "eel.speed", "eel.cost"]
    assert list(card["rows"][0]) == list(row(""))
    assert card["rows"][3]["ours"] is None
    assert Path("out/report.html").read_text() == "Worm, Eel"
    assert Path("out/figures/figure.html").exists()
    assert load_dataset("out/worm/long.nc")["x"].values.tolist() == [0, 1, 2]
    assert load_dataset("out/worm/data/map.nc").equals(load_dataset("out/worm/long.nc"))
    assert "worm.force: the paper leaves friction out" in answer.out
    shares = {line.split()[0]: line.split()[-2] for line in answer.out.splitlines() if line.rstrip().endswith("%")}
    assert shares == {"worm": "75", "eel": "25"}


def test_people_read_numbers_in_the_unit_of_their_row_and_json_has_them_in_si(nectosome, studies):
    rows = [row("eel.speed", printed=[0.26, 0.5]), row("eel.lag", unit="s", shown="ms", printed=None, ours=0.0265)]
    studies["eel"] = MadeUp(lambda quick, progress: Study("eel", "Eel", "", rows, {}, 1.0))
    said = nectosome("reproduce", "eel", "--out", "out").out
    assert "0.26 to 0.5 m/s" in said and "26.5 ms" in said
    card = json.loads(Path("out/scorecard.json").read_text())["rows"]
    assert card[0]["printed"] == [0.26, 0.5] and card[1]["ours"] == 0.0265


def test_studies_are_chosen_by_name_and_kept_in_order(nectosome, studies):
    assert nectosome("reproduce", "eel", "worm", "--quick", "--out", "there/it/is").code == 0
    card = json.loads(Path("there/it/is/scorecard.json").read_text())
    assert card["rows"][0]["id"] == "worm.speed"
    assert Path("there/it/is/worm/quick.nc").exists()
    assert nectosome("reproduce", "eel", "--out", "out").code == 0
    assert len(json.loads(Path("out/scorecard.json").read_text())["rows"]) == 2


def test_an_unknown_study_is_refused(nectosome, studies, tmp_path):
    answer = nectosome("reproduce", "worn")
    assert (answer.code, answer.err) == (2, 'there is no study called "worn". Did you mean "worm"?\n')
    assert list(tmp_path.iterdir()) == []


def test_a_row_that_was_not_computed_fails(nectosome, studies):
    rows = [row("snail.speed", ours=None, verdict="differs"), row("snail.force")]
    studies["snail"] = MadeUp(lambda quick, progress: Study("snail", "Snail", "", rows, {}, 0.0))
    answer = nectosome("reproduce", "snail", "--out", "out")
    assert (answer.code, answer.err) == (1, "not computed: snail.speed.\n")
    assert Path("out/scorecard.json").exists()


def test_ctrl_c_is_no_crash(nectosome, studies):
    def stopped(quick, progress):
        raise KeyboardInterrupt

    studies["worm"] = MadeUp(stopped)
    answer = nectosome("reproduce", "--out", "out")
    assert (answer.code, answer.err) == (130, "cancelled.\n")
    assert not Path("out/scorecard.json").exists()


def test_nothing_is_written_unasked_and_nothing_overwritten_unforced(nectosome, studies, tmp_path):
    answer = nectosome("reproduce", "eel")
    assert (answer.code, list(tmp_path.iterdir())) == (0, [])
    assert "eel.speed" in answer.out
    Path("out").mkdir()
    Path("out/scorecard.json").write_text("{}")
    answer = nectosome("reproduce", "eel", "--out", "out")
    assert answer.code == 2
    assert answer.err == "--out: out/scorecard.json exists. Give another name, or --force to overwrite it.\n"
    assert nectosome("reproduce", "eel", "--out", "out", "--force").code == 0
    assert len(json.loads(Path("out/scorecard.json").read_text())["rows"]) == 2


def test_a_bug_is_not_hidden(nectosome, studies):
    def broken(quick, progress):
        raise ZeroDivisionError

    studies["eel"] = MadeUp(broken)
    with pytest.raises(ZeroDivisionError):
        nectosome("reproduce", "eel")
