import re

import pytest
from tests.made_up_runs import made_up_run
from tests.pages import assert_self_contained, own_text

from nectosome.description import dump_robot
from nectosome.robots import describe
from nectosome.units import InputError
from nectosome_studies.report import pages, write_figures, write_report


def test_the_report_stands_alone_and_has_every_row_and_figure(study, tmp_path):
    write_report([study], tmp_path)
    page = (tmp_path / "worm.html").read_text(encoding="utf-8")
    assert_self_contained(page)
    assert len(page) < 12e6
    for row in study.rows:
        assert f"<code>{row['id']}</code>" in page
    assert page.count("<figure>") == page.count("<figcaption>") == 7
    assert "did not succeed" not in page
    assert sorted(f.name for f in tmp_path.iterdir()) == sorted(pages(["worm"]))


def test_text_is_escaped(study, tmp_path):
    write_report([study], tmp_path)
    page = own_text((tmp_path / "worm.html").read_text(encoding="utf-8"))
    assert "a &lt; b &amp; &lt;script&gt;x&lt;/script&gt;" in page
    assert "<script>x" not in page and "A <soft>" not in page and "Design <1>" not in page


def test_figures_whose_runs_are_missing_are_left_out(study, tmp_path):
    del study.runs["row3"], study.runs["old_soft"]
    write_report([study], tmp_path)
    assert (tmp_path / "worm.html").read_text(encoding="utf-8").count("<figure>") == 4
    study.runs.clear()
    write_report([study], tmp_path)
    assert "<figure>" not in (tmp_path / "worm.html").read_text(encoding="utf-8")


def test_a_run_that_failed_is_named(study, tmp_path):
    study.runs["row2"].attrs |= {"status": "STEP_TOO_SMALL", "status_reason": "the step became too small"}
    write_report([study], tmp_path)
    page = (tmp_path / "worm.html").read_text(encoding="utf-8")
    assert "Run row2 did not succeed</b>: the step became too small." in page


def test_any_study_gets_its_speeds(study, tmp_path):
    study.figures = None
    write_report([study], tmp_path)
    assert (tmp_path / "worm.html").read_text(encoding="utf-8").count("<figure>") == 1


def test_what_cannot_be_written_leaves_nothing(study, tmp_path):
    with pytest.raises(InputError, match="cannot write"):
        write_report([study], tmp_path / "absent")
    (tmp_path / "worm.html").mkdir()
    with pytest.raises(InputError, match="folder"):
        write_report([study], tmp_path)
    assert [f.name for f in tmp_path.iterdir()] == ["worm.html"]


def test_the_report_holds_its_programs_once_and_a_scene_of_each_run(study, tmp_path):
    robot = dump_robot(describe("flagellum"))
    study.runs.update({name: made_up_run(robot=robot) for name in study.runs})
    write_report([study], tmp_path)
    page = (tmp_path / "worm.html").read_text(encoding="utf-8")
    assert page.count("const scenePage") == page.count("plotly.js v") == 1
    assert page.count("window.__VISER_EMBED_DATA__") == 1
    assert page.count('<div class="scenes"') == 3
    assert re.findall(r"<button value=[^>]*>([^<]*)<", page) == [name.replace("_", " ") for name in study.runs]


def test_pages_of_single_figures_share_their_programs(study, tmp_path):
    write_figures([study], tmp_path)
    pages = {path.name: path.read_text(encoding="utf-8") for path in tmp_path.glob("*.html")}
    assert len(pages) == 7
    for page in pages.values():
        program = re.search('<script nonce="\\w+" src="([^"]*)"></script>\n</head>', page)
        assert program is not None and (tmp_path / program[1]).exists()
        assert ('class="scenes"' in page) == (program[1] == "scenes.js")
