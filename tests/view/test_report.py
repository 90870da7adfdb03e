import re
import subprocess
import sys

import pytest

from nectosome.papers.report import write_report
from nectosome.units import InputError
from nectosome.view import show_run
from nectosome.view.scorecard import number, percent, summary, table


def own_text(page):
    """The page without the plotting library."""
    return page[page.index("</script>\n</head>") :]


def assert_self_contained(page):
    assert not re.search(r"<script[^>]+src=|<link|<img|@import|url\(", own_text(page))
    assert "cdn" not in own_text(page)
    assert page.count("plotly.js v") == 1


def test_the_report_stands_alone_and_has_every_row_and_figure(study, tmp_path):
    write_report([study], tmp_path / "report.html")
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert_self_contained(page)
    assert len(page) < 12e6
    for row in study.rows:
        assert f"<code>{row['id']}</code>" in page
    assert page.count("<figure>") == page.count("<figcaption>") == 7
    assert "did not succeed" not in page
    assert [f.name for f in tmp_path.iterdir()] == ["report.html"]


def test_text_is_escaped(study, tmp_path):
    write_report([study], tmp_path / "report.html")
    page = own_text((tmp_path / "report.html").read_text(encoding="utf-8"))
    assert "a &lt; b &amp; &lt;script&gt;x&lt;/script&gt;" in page
    assert "<script>x" not in page and "A <soft>" not in page and "Design <1>" not in page


def test_figures_whose_runs_are_missing_are_left_out(study, tmp_path):
    del study.runs["row3"], study.runs["old_soft"]
    write_report([study], tmp_path / "report.html")
    assert (tmp_path / "report.html").read_text(encoding="utf-8").count("<figure>") == 4
    study.runs.clear()
    write_report([study], tmp_path / "report.html")
    assert "<figure>" not in (tmp_path / "report.html").read_text(encoding="utf-8")


def test_a_run_that_failed_is_named(study, tmp_path):
    study.runs["row2"].attrs |= {"status": "STEP_TOO_SMALL", "status_reason": "the step became too small"}
    write_report([study], tmp_path / "report.html")
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "Run row2 did not succeed</b>: the step became too small." in page


def test_any_study_gets_its_speeds(study, tmp_path):
    study.figures = None
    write_report([study], tmp_path / "report.html")
    assert (tmp_path / "report.html").read_text(encoding="utf-8").count("<figure>") == 1


def test_what_cannot_be_written_leaves_nothing(study, tmp_path):
    with pytest.raises(InputError, match="cannot write"):
        write_report([study], tmp_path / "absent" / "report.html")
    (tmp_path / "report.html").mkdir()
    with pytest.raises(InputError, match="folder"):
        write_report([study], tmp_path / "report.html")
    assert [f.name for f in tmp_path.iterdir()] == ["report.html"]


def test_a_single_run_gets_a_page(run, tmp_path):
    show_run(run, tmp_path / "run.html")
    page = (tmp_path / "run.html").read_text(encoding="utf-8")
    assert_self_contained(page)
    assert page.count("<figure>") == 4 and "<h1>made up</h1>" in page and "(-0.5, 0, 0) m/s" in page


def test_a_run_without_drive_or_provenance_gets_a_page(run, tmp_path):
    show_run(run.isel(prescribed=slice(0)).drop_attrs(), tmp_path / "run.html")
    assert (tmp_path / "run.html").exists()


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (0.68567, "m/s", "0.6857 m/s"),
        (7.4e6, "Pa", "7.400e6 Pa"),
        (2.5e-5, "1", "2.500e-5"),
        (12345.6, "N", "12346 N"),
        (0.0, "", "0"),
        (None, "m", "-"),
        (float("nan"), "m", "-"),
    ],
)
def test_numbers_have_sensible_digits(value, unit, text):
    assert number(value, unit) == text


@pytest.mark.parametrize(("value", "text"), [(0.4, "0.40 %"), (0.0123, "0.01 %"), (None, "-"), (-15.968, "-15.97 %")])
def test_percentages(value, text):
    assert percent(value) == text


def test_verdicts_have_a_symbol_as_well_as_a_colour(study):
    text = table(study.rows)
    assert '<td class="verdict match">✓ match</td>' in text and '<td class="verdict no">- not reproducible' in text
    assert summary(study.rows) == "2 rows: 1 match, 1 not reproducible."
    assert summary([]) == "No rows."


def test_importing_the_room_loads_no_plotting():
    code = "import sys, nectosome.view; sys.exit('plotly' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
