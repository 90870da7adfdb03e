"""The tab with scorecards: rows are read as data, shown with their reasons, and chosen by study and verdict."""

import json
from types import SimpleNamespace

import pytest

from nectosome.studio.folder import WorkFolder
from nectosome.studio.tasks.scorecard import Scorecard, read_rows, rows_html
from nectosome.units import InputError

ROW = {
    "id": "eel/speed",
    "quantity": "speed <b>",
    "unit": "m/s",
    "printed": 0.5,
    "ours": 0.51,
    "error": 2.0,
    "tolerance": 5.0,
    "source": "measured",
    "verdict": "match",
    "kind": "prediction",
    "note": "",
}
REFUSED = {**ROW, "id": "paddle/torque", "unit": "<i>", "ours": None, "error": None, "tolerance": None}
REFUSED |= {"verdict": "", "kind": "missing", "note": "not <printed>"}


class Gui:
    """What the tab needs of a page; `set` is what a user does."""

    def __init__(self):
        self.made = {}

    def add_dropdown(self, label, options):
        handle = SimpleNamespace(value=options[0], options=options)
        handle.on_update = lambda work: setattr(handle, "work", work)
        self.made[label] = handle
        return handle

    def add_button(self, label):
        return SimpleNamespace(on_click=lambda work: None)

    def add_html(self, content):
        self.made["page"] = SimpleNamespace(content=content)
        return self.made["page"]

    def set(self, label, value):
        self.made[label].value = value
        self.made[label].work(None)


@pytest.fixture
def session(tmp_path):
    said = []
    return SimpleNamespace(
        gui=Gui(), folder=WorkFolder(tmp_path), said=said, tell=lambda words, bad: said.append(words)
    )


def test_rows_are_chosen_by_study_and_verdict(session, tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "scorecard.json").write_text(json.dumps({"rows": [ROW, REFUSED]}))
    tab = Scorecard(session)
    session.gui.made["File"].value = session.gui.made["File"].options[0]
    tab.renew()
    page = session.gui.made["page"]
    assert session.gui.made["File"].options == ["out/scorecard.json"]
    assert session.gui.made["Study"].options == ["all", "eel", "paddle"]
    assert page.content.startswith("<div") and "2 rows: 1 match; without a verdict: 1 missing." in page.content
    session.gui.set("Study", "eel")
    assert "eel/speed" in page.content and "paddle/torque" not in page.content
    session.gui.set("Study", "all")
    session.gui.set("Rows", "others")
    assert "eel/speed" not in page.content and "paddle/torque" in page.content


def test_where_there_is_none_the_way_to_one_is_told(session):
    Scorecard(session)
    assert session.gui.made["File"].options == ["none yet: nectosome reproduce makes one"]
    assert session.gui.made["page"].content == ""
    assert session.said == []


def test_a_file_that_is_none_is_told_in_the_tab_and_no_longer_once_it_is_mended(session, tmp_path):
    path = tmp_path / "scorecard.json"
    path.write_text("{}")
    tab = Scorecard(session)
    session.gui.made["File"].value = "scorecard.json"
    tab.renew()
    page = session.gui.made["page"]
    assert "this is not a scorecard" in page.content
    assert session.said == []
    path.write_text(json.dumps({"rows": [ROW]}))
    tab.renew()
    assert "not a scorecard" not in page.content and "1 row" in page.content


def test_what_a_row_says_is_escaped():
    shown = rows_html([ROW, REFUSED])
    assert "speed &lt;b&gt;" in shown and "not &lt;printed&gt;" in shown and "&lt;i&gt;" in shown
    assert "<i>" not in shown and "off by 2.00 % (5.00 % allowed)" in shown


def test_a_printed_range_and_the_unit_to_read_it_in_are_shown(tmp_path):
    path = tmp_path / "scorecard.json"
    path.write_text(json.dumps({"rows": [ROW | {"printed": [0.26, 0.5], "shown": "cm/s"}]}))
    assert "26 to 50 cm/s, ours <b>51 cm/s</b>" in rows_html(read_rows(path))


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        "{}",
        '{"rows": 1}',
        '{"rows": [1]}',
        "[" * 100_000,
        *(
            json.dumps({"rows": [ROW | changed]})
            for changed in (
                {"printed": "x"},
                {"printed": [0.1]},
                {"printed": [0.1, "x"]},
                {"printed": {}},
                {"shown": 1},
                {"shown": "parsecs a fortnight"},
            )
        ),
    ],
)
def test_what_is_no_scorecard_is_refused(tmp_path, text):
    path = tmp_path / "scorecard.json"
    path.write_text(text)
    with pytest.raises(InputError, match="scorecard"):
        read_rows(path)
