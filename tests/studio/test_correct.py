"""The studio's tab that corrects a simulated grid: near the truth, with the next experiments; nothing from outside."""

import numpy as np
import pytest
from tests.studio_page import NEEDS_CHROMIUM, PATIENCE, beside, chromium, said, wait_until
from tests.synthetic_campaign import PLAN, mean, write_campaign, write_grid

from nectosome.io import load_dataset
from nectosome.studio.folder import WorkFolder
from nectosome.studio.server import Studio
from nectosome.studio.tasks.left_panel import spelled
from nectosome.units import InputError

ROCK = "{name: rock, water: {gravity: 0 m/s2}, body: {kind: rigid, shape: point, mass: 1 kg}}"


def test_what_a_campaign_names_must_lie_in_the_folder(tmp_path):
    outside, inside = tmp_path / "outside.csv", tmp_path / "lab"
    inside.mkdir()
    outside.write_text("secret")
    (inside / "run.csv").write_text("mine")
    (inside / "own.csv").symlink_to(inside / "run.csv")
    (inside / "link.csv").symlink_to(outside)
    folder = WorkFolder(inside)
    assert folder.listed(inside / "own.csv") == (inside / "run.csv").resolve()
    for path in (inside / "link.csv", outside, inside / ".." / "outside.csv"):
        with pytest.raises(InputError, match="leads out of the working folder") as told:
            folder.listed(path)
        assert str(tmp_path) not in str(told.value)
    with pytest.raises(InputError, match="is a folder"):
        folder.listed(inside)


def test_a_wide_table_is_told_row_by_row():
    told = spelled([[("error", "mean", "95 %"), ("before", "3", ""), ("<after>", "", "")]], "studio-words", ["done"])
    for words in ("<b>error</b>", ">before: mean 3<", ">&lt;after&gt;<", ">done<"):
        assert words in told


@NEEDS_CHROMIUM
def test_a_grid_is_corrected_and_saved(tmp_path, capfd):
    """Half of the grid is measured, with a scatter of 2 %: within 5 %, and 1 % on the mean, as by the command."""
    (tmp_path / "rock.yaml").write_text(ROCK)
    write_grid(tmp_path / "grid.nc")
    (tmp_path / "out.csv").write_text("t,F\n0,1\n")
    root = tmp_path / "lab"
    text = write_campaign(root, PLAN).read_text()
    (tmp_path / "grid.nc").rename(root / "grid.nc")
    (root / "link.csv").symlink_to(tmp_path / "out.csv")
    (root / "linked.yaml").write_text(text.replace("run_0_0_0.csv", "link.csv"))
    studio = Studio(str(tmp_path / "rock.yaml"), root, "127.0.0.1", 18_600)

    def press(name: str) -> None:
        page.get_by_role("button", name=name, exact=True).click()

    def choose(label: str, option: str) -> None:
        beside(page, label).click()
        page.get_by_role("option", name=option, exact=True).click()

    try:
        with chromium() as browser:
            page = browser.new_page(viewport={"width": 1280, "height": 1400})
            page.set_default_timeout(PATIENCE)
            page.goto(studio.address)
            page.wait_for_selector("#studio-words")
            page.get_by_role("tab", name="Correct").click()
            choose("Campaign", "linked.yaml")
            press("Correct")
            said(page, "link.csv: is a link that leads out of the working folder")
            choose("Campaign", "campaign.yaml")
            press("Correct")
            said(page, "Write force.x or force.y")
            beside(page, "Low pass").fill("0 Hz")
            press("Correct")
            said(page, "it must be more than 0")
            beside(page, "Low pass").fill("")
            beside(page, "Quantity").fill("-force.y")
            beside(page, "Parameter").fill("Cn=1")
            press("Correct")
            page.wait_for_selector("#studio-correction")
            words = page.inner_text("#studio-correction")
            for part in ("simulator as it was: mean 1", "next experiment", "where measured, estimated from peaks"):
                assert part in words
            assert words.count("expected") == 3
            wait_until(page, "document.querySelectorAll('.js-plotly-plot .heatmaplayer image').length === 1")
            choose("Show", "predictions")
            wait_until(page, "document.querySelectorAll('.js-plotly-plot .heatmaplayer image').length === 0")
            page.screenshot(path=str(tmp_path / "correct.png"))
            press("Save corrected grid (.nc)")
            said(page, "saved corrected.nc")
            found = load_dataset(root / "corrected.nc")
            off = abs(found["force"] / mean(found["A"], found["f"]) - 1)
            assert float(off.mean()) < 0.01
            assert float(off.max()) < 0.05
            assert np.isfinite(found["force_error"]).all()
            assert "Traceback" not in capfd.readouterr().err
    finally:
        studio.close()
