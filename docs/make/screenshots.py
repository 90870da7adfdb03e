"""Pictures of the studio and of a page: `python docs/make/screenshots.py` renews them where there is a Chromium."""

import shutil
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path

from PIL import Image
from playwright.sync_api import Browser, Page, ViewportSize, sync_playwright

from nectosome.controllers import compare
from nectosome.io import save_dataset
from nectosome.measure import load_campaign
from nectosome.measure.condition_means import condition_means
from nectosome.studio.server import Studio
from nectosome.view import show_side_by_side

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))  # the studio's tests know the way about its page

from tests.studio_page import CHROMIUM, FLAGS, answered, beside, count, said, wait_until  # noqa: E402
from tests.synthetic_campaign import write_campaign  # noqa: E402

PICTURES = ROOT / "docs" / "img"
RECORDINGS = ROOT / "examples" / "fin_recordings"
USUAL, WIDE = ViewportSize(width=1280, height=720), ViewportSize(width=1920, height=1080)
COLOURS = 256  # of a picture: each is smaller than 150 KB


def main() -> None:
    """Write all pictures."""
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as p:
        browser = p.chromium.launch(executable_path=CHROMIUM, args=FLAGS, slow_mo=80)
        for name in ("fin.yaml", "slow.csv"):
            shutil.copy(RECORDINGS / name, folder)
        means = condition_means(load_campaign(write_campaign(Path(folder) / "lab")).recordings(), "force")
        save_dataset(means.assign_attrs(title="force by conditions"), f"{folder}/means.nc")
        with opened(browser, "flagellum", folder, WIDE) as page:
            stage_and_design(page)
            map_of_speed(page)
        with opened(browser, f"{folder}/fin.yaml", folder) as page:
            identify(page, Path(folder) / "slow.csv")
            measured(page)
        with opened(browser, "eel", folder) as page:
            control(page)
        with opened(browser, "flagellum", folder) as page:
            rig(page)
        controllers_compared(browser, Path(folder) / "compared.html")
        browser.close()


def stage_and_design(page: Page) -> None:
    """Arrows, colours by the load of the water, histories, and a search that ended."""
    tab(page, "View")
    beside(page, "Colour").click()
    page.get_by_role("option", name="load of the water").click()
    page.get_by_text("Forces by load").click()
    tab(page, "Robot")
    field = page.locator("input[type=text]:visible").all()[-3]  # beside the slider of the angle of the hook
    for alpha in (40, 36, 33, 31, 34, 39):
        before = count(page)
        field.fill(str(alpha))
        field.press("Enter")
        answered(page, before + 1)
    press(page, "Start search")
    page.get_by_text("evaluations, ended").wait_for()
    shoot(page, "studio")


def map_of_speed(page: Page) -> None:
    """Speed over length and stiffness, computed and drawn."""
    tab(page, "Map")
    page.locator("input[value^='L=']").fill("L=300..700:50 mm")
    page.locator("input[value^='tip_radius=']").fill("E=3..10:1 MPa")
    press(page, "Compute map")
    page.locator(".js-plotly-plot .heatmaplayer image").first.wait_for(state="attached")
    shoot(page, "studio_map")


def identify(page: Page, recording: Path) -> None:
    """A recording that was sent, and what it tells."""
    tab(page, "Identify")
    with page.expect_file_chooser() as chooser:
        page.get_by_role("button", name="Send a recording").click()
    chooser.value.set_files(str(recording))
    page.get_by_text(f"{recording.name}: ").wait_for()
    beside(page, "Starts").fill("16")
    press(page, "Identify")
    page.locator("#studio-work").get_by_text("best so far").wait_for()
    shoot(page, "studio_fit_so_far")
    page.wait_for_selector("#studio-fit")
    page.wait_for_timeout(1000)
    page.get_by_role("button", name="Apply what was found").scroll_into_view_if_needed()
    shoot(page, "studio_identify")


def measured(page: Page) -> None:
    """Means of a synthetic campaign by its conditions."""
    tab(page, "Measured")
    beside(page, "File").click()
    page.get_by_role("option", name="means.nc").click()
    press(page, "Open")
    said(page, "opened means.nc")
    page.wait_for_timeout(1000)
    shoot(page, "studio_measured")


def control(page: Page) -> None:
    """An eel on its way to a heading, in real time."""
    tab(page, "Control")
    beside(page, "Command").click()
    page.get_by_role("option", name="bias").click()
    beside(page, "Range").fill("-8..8 mN m")
    beside(page, "Value").fill("30 deg")
    beside(page, "Gains").fill("-1.0e-2, -4.7e-3, -1.6e-3")
    press(page, "Start")
    wait_until(page, "+document.querySelector('#studio-work')?.innerText.match(/([0-9.]+) s,/)?.[1] > 12")
    shoot(page, "studio_control")
    press(page, "Stop")


def rig(page: Page) -> None:
    """A simulated rig of two muscles that plays a sine and a chirp; what else is drawn would take time from it."""
    press(page, "Pause")
    tab(page, "Rig")
    press(page, "Check: measure, move nothing")
    page.get_by_text("every channel was read").wait_for()
    field = page.locator("input:visible:below(:text-is('right.pressure'))")
    field.first.click()
    page.get_by_role("option", name="chirp").click()
    page.locator("input:visible[value='5 Hz']").fill("2 Hz")
    beside(page, "Time").fill("20 s")
    press(page, "Start")
    wait_until(page, "+document.querySelector('#studio-work')?.innerText.match(/([0-9.]+) of/)?.[1] > 9")
    shoot(page, "studio_rig")
    page.keyboard.press("Escape")


def controllers_compared(browser: Browser, file: Path) -> None:
    """An eel along a sine, under four controllers."""
    given = {"command": "bias=-8..8mN m", "measure": "heading", "mean": True}
    along = {"reference": "sine", "amplitude": "20deg", "frequency": "0.1Hz"}
    show_side_by_side(compare("eel", controllers="pid,ff-pid,ilc,mpc", **given, **along).to_dataset(), file)
    page = browser.new_page(viewport={"width": 960, "height": 900})
    page.goto(file.as_uri())
    page.wait_for_timeout(1500)
    page.locator(".plotly-graph-div").screenshot(path=PICTURES / "control_compared.png")
    page.close()


@contextmanager
def opened(browser: Browser, robot: str, folder: str, size: ViewportSize = USUAL) -> Iterator[Page]:
    """The page of a robot that moves, without viser's word on browsers that draw by software."""
    studio = Studio(robot, Path(folder), "127.0.0.1", 18_900)
    page = browser.new_page(viewport=size)
    page.set_default_timeout(600_000)
    page.goto(studio.address)
    answered(page, 1)
    page.locator(".mantine-Notification-closeButton").first.click()
    yield page
    page.close()
    studio.close()


def tab(page: Page, name: str) -> None:
    """Open a tab."""
    page.get_by_role("tab", name=name).click()


def press(page: Page, name: str) -> None:
    """Press a button."""
    page.get_by_role("button", name=name, exact=True).click()


def shoot(page: Page, name: str) -> None:
    """Write what is seen."""
    page.mouse.move(650, 700)  # away from tooltips
    page.wait_for_timeout(500)
    seen = Image.open(BytesIO(page.screenshot())).convert("RGB")
    seen.quantize(COLOURS, dither=Image.Dither.NONE).save(PICTURES / f"{name}.png", optimize=True)


if __name__ == "__main__":
    main()
