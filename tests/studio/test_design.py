"""The studio's tabs for design and maps in a browser: a search ends, is applied, cancelled; a point is loaded."""

import time

import numpy as np
import pytest
import xarray as xr
from tests.small_robots import DRIVEN
from tests.studio_page import NEEDS_CHROMIUM, PATIENCE, answered, chromium, count, nothing_left, said, wait_until

from nectosome.description import dump_robot, parse_robot, with_values
from nectosome.designs.sweep import MEANS
from nectosome.io import load_dataset, save_dataset
from nectosome.studio.server import Studio

PUSH = "  loads: {push: {kind: force, force: [0.1 N, 0 N, 0 N], at: root}}\n"  # at the hinge: it does no work
VALUES = {"I": 0.011, "k": 0.03, "c": 0.02, "M": 0.02, "f": 2.0}
OSCILLATOR = dump_robot(with_values(parse_robot(DRIVEN), VALUES)).partition("aliases")[0] + PUSH
OSCILLATOR += "aliases: {M: body.joint.torque.amplitude, c: body.joint.damping}\n"
PROBLEM = """
vary: {M: 10..30 mN m, c: 10..40 mN m s/rad}
minimise: power
keep: [power >= 0.15 mW]
"""

pytestmark = NEEDS_CHROMIUM


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    root = tmp_path_factory.mktemp("studio")
    (root / "driven.yaml").write_text(OSCILLATOR)
    (root / "driven.design.yaml").write_text(PROBLEM)
    return root


@pytest.fixture(scope="module")
def browser():
    with chromium() as made:
        yield made


@pytest.fixture
def page(folder, browser):
    studio = Studio(str(folder / "driven.yaml"), folder, "127.0.0.1", 18_600)
    made = browser.new_page(viewport={"width": 1000, "height": 1000})
    made.set_default_timeout(PATIENCE)
    made.goto(studio.address)
    answered(made, 1)
    made.get_by_role("button", name="Pause").click()
    yield made
    made.close()
    studio.close()


def power(page) -> float:
    """As the studio shows it [mW]."""
    return float(page.inner_text("#studio-power"))


def press(page, name: str) -> None:
    page.get_by_role("button", name=name).click()


@pytest.mark.slow
def test_a_search_comes_to_its_end_and_its_best_design_is_applied(page, folder):
    before = count(page)
    press(page, "Start search")
    page.get_by_text("evaluations, ended").wait_for()
    page.locator(".js-plotly-plot .scatterlayer path").first.wait_for(state="attached")
    page.screenshot(path=str(folder / "design.png"))
    assert count(page) == before
    assert nothing_left()
    press(page, "Apply best")
    answered(page, before + 1)
    assert power(page) == pytest.approx(0.15, rel=1e-3)  # the limit; the sliders stood at 0.2 mW


@pytest.mark.slow
def test_a_search_is_stopped_and_one_ends_with_its_tab(page):
    box = page.locator("textarea:visible:right-of(:text-is('Limits'))").first
    box.fill("pawer <= 3 W")
    press(page, "Start search")
    said(page, "is no quantity of a motion")
    box.fill("")
    press(page, "Start search")
    page.locator("#studio-work").get_by_text("evaluations").wait_for()
    press(page, "Stop, keep the best so far")
    page.get_by_text("evaluations, stopped, best so far").wait_for()
    assert nothing_left()
    press(page, "Start search")
    page.get_by_text("search: ").wait_for()
    page.close()
    assert nothing_left()


def click(page, field, at, *values: int) -> None:
    """Click at a place of a figure until a point with these values is there: a figure that is drawn anew hears none."""
    until = time.monotonic() + 60
    while not all(page.locator(f"input[value='{value}']:visible").count() for value in values):
        assert time.monotonic() < until
        box = field.bounding_box()
        assert box is not None
        place = box["x"] + at[0] * box["width"], box["y"] + at[1] * box["height"]
        page.mouse.move(*place, steps=5)
        page.wait_for_timeout(300)  # the figure hears of the pointer ten times a second
        page.mouse.click(*place)
        page.wait_for_timeout(1000)


@pytest.mark.slow
def test_a_map_is_computed_and_saved(page, folder):
    page.get_by_role("tab", name="Map").click()
    page.locator("input[value^='M=']").fill("M=10,20 mN m")
    page.locator("input[value^='c=']").fill("c=20..30:10 mN m s/rad")
    press(page, "Compute map")
    page.locator("input[value='force.x']:visible").first.wait_for()
    page.locator(".js-plotly-plot .heatmaplayer image").wait_for(state="attached")
    press(page, "Save map")
    said(page, "saved map.nc")
    found = load_dataset(folder / "map.nc")
    np.testing.assert_allclose(found["power"][0], found["power"][1] / 4, rtol=1e-3)


@pytest.fixture
def made_up(folder):
    """A map that lies in the folder before the page looks, ahead of those that it saves."""
    over, none = ("M", "c"), np.zeros((2, 2, 3))
    means = {name: (over, np.array([[1.0, 2.0], [3.0, 4.0]]), {"units": "W"}) for name in MEANS}
    forces = {name: ((*over, "axis"), none, {"units": "N"}) for name in ("force", "force_peak")}
    found = xr.Dataset(
        means | forces | {"status": (over, [["SOLVED"] * 2] * 2)},
        coords={
            "M": ("M", [0.01, 0.02], {"units": "N m"}),
            "c": ("c", [0.02, 0.03], {"units": "N m s/rad"}),
            "axis": ["x", "y", "z"],
        },
        attrs={"robot": OSCILLATOR, "title": "made up"},
    )
    save_dataset(found, folder / "a.nc")


@pytest.mark.usefixtures("made_up")
def test_a_map_is_opened_and_a_click_on_it_loads_its_point(page):
    """Of an oscillator, whose mean power is c (w M)^2 / 2 |k - I w^2 + i c w|^2."""
    page.get_by_role("tab", name="Map").click()
    press(page, "Open map")
    field = page.locator(".js-plotly-plot .nsewdrag:visible").first
    click(page, field, (0.75, 0.75), 30, 10)
    click(page, field, (0.25, 0.25), 20, 20)
    w, c = 2 * np.pi * VALUES["f"], 0.02
    expected = 1e3 * c * (w * 0.02) ** 2 / 2 / abs(VALUES["k"] - VALUES["I"] * w**2 + 1j * c * w) ** 2
    shown = "+document.querySelector('#studio-power').innerText"
    wait_until(page, f"Math.abs({shown} - {expected}) < {1e-3 * expected}")
