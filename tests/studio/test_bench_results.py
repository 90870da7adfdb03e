"""The studio's tab of what was measured: recordings, means and tracks open in it, and others are refused."""

import pytest
from tests.measured_files import means, recorded, tracked
from tests.small_robots import DRIVEN
from tests.studio_page import NEEDS_CHROMIUM, PATIENCE, beside, chromium, said, wait_until

from nectosome.io import save_dataset
from nectosome.studio.server import Studio


@pytest.mark.slow
@NEEDS_CHROMIUM
def test_what_measure_and_track_saved_opens(tmp_path, capfd):
    (tmp_path / "driven.yaml").write_text(DRIVEN)
    save_dataset(recorded(tmp_path), tmp_path / "push.nc")
    save_dataset(means(), tmp_path / "means.nc")
    save_dataset(tracked(), tmp_path / "track.nc")
    save_dataset(tracked().drop_vars("quality"), tmp_path / "bad.nc")
    studio = Studio(str(tmp_path / "driven.yaml"), tmp_path, "127.0.0.1", 18_600)

    def opened(name: str) -> str:
        beside(page, "File").click()
        page.get_by_role("option", name=name, exact=True).click()
        page.get_by_role("button", name="Open", exact=True).click()
        said(page, f"opened {name}")
        page.get_by_text(f"{name}: ").wait_for()
        return page.inner_text("#studio-measured")

    lines = "document.querySelectorAll('.js-plotly-plot .scatterlayer .trace').length"
    try:
        with chromium() as browser:
            page = browser.new_page(viewport={"width": 1280, "height": 1000})
            page.set_default_timeout(PATIENCE)
            page.goto(studio.address)
            page.wait_for_selector("#studio-words")
            page.get_by_role("tab", name="Measured").click()
            assert "push: column push, min 1 N, mean 2 N, max 3 N" in opened("push.nc")
            wait_until(page, f"{lines} === 2")
            assert "20 deg, 0.4 Hz: mean" in opened("means.nc")
            beside(page, "Show").click()
            page.get_by_role("option", name="amplitude").click()
            page.locator(".ytitle").get_by_text("amplitude").wait_for()
            assert "tail: seen 80.0 %" in opened("track.nc")
            wait_until(page, f"{lines} === 5")
            page.screenshot(path=str(tmp_path / "measured.png"))
            beside(page, "File").click()
            page.get_by_role("option", name="bad.nc", exact=True).click()
            page.get_by_role("button", name="Open", exact=True).click()
            said(page, "bad.nc: this is not a track of segments: it has no quality over time, segment")
            assert "Traceback" not in capfd.readouterr().err
    finally:
        studio.close()
