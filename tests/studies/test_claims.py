"""Claims, findings and errors met: texts from files, all numbers and verdicts from rows."""

import pytest

from nectosome_studies import STUDIES, study
from nectosome_studies.claims import judgement, word
from nectosome_studies.findings import findings
from nectosome_studies.study import printed, score
from nectosome_studies.trust import met

ENTRY = {"quantity": "speed", "unit": "m/s", "kind": "prediction", "source": "measured", "printed": 2.0}


def row(name="eel/a/speed", ours=2.01, **entry):
    return score(name, ENTRY | {"tolerance": 5.0} | entry, ours)


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        ([row(), row(ours=1.975)], "predicted within 1.3 %"),
        ([row(ours=2.0)], "predicted within the printed digits"),
        ([row(ours=1.0), row()], "predicted, differs"),
        ([row(ours=3.0, source="computed", better="high")], "predicted, better than printed"),
        ([row(ours=3.0, source="computed", better="high"), row()], "predicted, as good as printed or better"),
        ([row(kind="identification")], "identified within 0.5 %"),
        ([score("a", {key: ENTRY[key] for key in ("quantity", "unit", "kind")}, 1.0)], "predicted"),
        (
            [row(printed=0.0, within=0.1, ours=0.03), row(printed=0.0, within=0.1, ours=-0.05)],
            "predicted within 0.05 m/s",
        ),
        ([row(printed=[1.5, 2.5])], "predicted within the printed range"),
        ([row(printed=[1.5, 2.0])], "predicted, differs"),
        ([row(printed=0.0, within=0.1, ours=-0.05, shown="cm/s")], "predicted within 5 cm/s"),
        ([row(kind="calibration")], "calibrated"),
        ([row(kind="misprint", ours=3.0)], "misprint in the paper"),
        ([row(kind="missing", ours=None)], "needs your data"),
    ],
)
def test_the_word_is_that_of_the_rows(rows, said):
    assert word(rows) == said


@pytest.fixture
def book(monkeypatch, tmp_path):
    """Claims of a made-up paper."""

    def write(text):
        (tmp_path / "eel").mkdir(exist_ok=True)
        (tmp_path / "eel" / "claims.toml").write_text(text)

    monkeypatch.setattr(study, "FOLDER", tmp_path)
    return write


HEAD = 'reference = "A. Eel, 2020"\njudgement = ["Good."]\npictures = []\n'


def test_a_claim_has_the_range_of_its_rows_and_a_reason_only_where_they_differ(book):
    book(HEAD + '[[claims]]\nclaim = "it swims"\nrows = ["*/speed"]\nbecause = "it is tired"\n')
    rows = [row(), row("eel/b/speed", 2.5, printed=2.4), row("eel/force", 1.0)]
    assert judgement("eel", rows).claims == [("it swims", "2 to 2.4 m/s", "2.01 to 2.5 m/s", "predicted within 4.2 %")]
    rows[0] = row(ours=1.0)
    assert judgement("eel", rows).claims[0].word == "predicted, differs: it is tired"


def test_claims_have_the_units_in_which_people_read_rows(book):
    book(HEAD + '[[claims]]\nclaim = "it swims"\nrows = ["*/speed"]\n')
    rows = [row(shown="cm/s"), row("eel/b/speed", 2.5, shown="cm/s", printed=2.4)]
    assert judgement("eel", rows).claims[0][1:3] == ("200 to 240 cm/s", "201 to 250 cm/s")
    assert judgement("eel", [row(printed=[1.5, 2.5])]).claims[0][1:3] == ("1.5 to 2.5 m/s", "2.01 m/s")
    assert judgement("eel", [*rows, row("eel/c/speed")]).claims[0][1:3] == ("", "")  # of two units there is no range


@pytest.mark.parametrize("rows", [[row("eel/force")], [row(), row("eel/b/speed", kind="calibration")]])
def test_a_claim_without_rows_or_of_several_kinds_is_none(book, rows):
    book(HEAD + '[[claims]]\nclaim = "it swims"\nrows = ["*/speed"]\n')
    with pytest.raises(RuntimeError, match="it swims"):
        judgement("eel", rows)


def test_a_study_of_no_paper_has_no_claims():
    assert judgement("gallery", []) is None


def test_findings_name_rows_that_there_are():
    """Rows that a study makes itself are looked for by their study's name only."""
    assert len(findings([])) == 0
    entries = study.read_book("findings.toml")["findings"]
    assert len(entries) == 10
    for entry in entries:
        name = entry["row"].partition("/")[0]
        assert name in STUDIES
        own = {"rexeel": "/distance", "catshark": "/speed/", "vortex": "", "gallery": ""}  # of rows not in the book
        if not (name in own and own[name] in entry["row"]):
            assert entry["row"] in printed(name)


def test_errors_met_are_of_all_measured_predictions():
    rows = [row(f"rexeel/{k}deg/distance", ours) for k, ours in ((10, 1.6), (20, 2.1), (30, 2.2))]
    rows += [row("rexeel/10deg/rmse-yaw", 1.0, source="computed"), row("rexeel/20deg/speed", 2.0, kind="calibration")]
    (found,) = met(rows)
    assert (found.rows, found.lowest, found.highest) == (3, pytest.approx(-20), pytest.approx(10))
    assert found.typical == pytest.approx(10)
    with pytest.raises(RuntimeError, match="octopus/speed is in 0 groups"):
        met([row("octopus/speed")])
