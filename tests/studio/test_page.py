"""The studio in a browser: it opens, answers to sliders, saves and opens again, reads what is sent, lets go of tabs."""

import threading
import time
from io import BytesIO

import av
import imageio.v3 as imageio
import numpy as np
import pytest
from tests.studio_page import NEEDS_CHROMIUM, PATIENCE, answered, chromium, count, said, wait_until

from nectosome.description import get_value, load_robot
from nectosome.io import load_dataset
from nectosome.studio.server import Studio

ARM = """
name: arm
water: {gravity: 0 m/s2}
body:
  kind: rigid
  shape: box
  length: 200 mm
  width: 30 mm
  height: 60 mm
  mass: 1 kg
  inertia: [1e-3 kg m2, 1e-3 kg m2, 1e-3 kg m2]
  joint:
    kind: revolute
    axis: z
    stiffness: 0.03 N m/rad
    damping: 0.02 N m s/rad
    torque: {kind: sine, amplitude: 0.02 N m, frequency: 2 Hz}
  loads: {drag: {kind: lumped_drag, drag_area: [1 cm2, 1 cm2, 1 cm2]}}
limbs:
  tail:
    on: body
    kind: rod
    section: circle
    length: 100 mm
    radius: 10 mm
    young: 1 MPa
    density: 1000 kg/m3
    strains: {bending_z: 0}
    points: 4
    joint: {kind: fixed}
    loads: {water: {kind: drag, normal: 1.1, tangential: 0}}
aliases:
  M: [body.joint.torque.amplitude]
  c: [body.joint.damping]
"""

pytestmark = NEEDS_CHROMIUM


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    root = tmp_path_factory.mktemp("studio")
    (root / "arm.yaml").write_text(ARM)
    return root


@pytest.fixture(scope="module")
def studio(folder):
    made = Studio(str(folder / "arm.yaml"), folder, "127.0.0.1", 18_500)
    yield made
    made.close()


@pytest.fixture(scope="module")
def browser():
    with chromium() as made:
        yield made


@pytest.fixture
def page(studio, browser):
    made = browser.new_page(viewport={"width": 1000, "height": 700})
    made.set_default_timeout(PATIENCE)
    made.goto(studio.address)
    answered(made, 1)
    yield made
    made.close()


def field(page, label: str):
    """The field with a label."""
    return page.locator("label:visible").get_by_text(label, exact=True).locator("xpath=following::input[1]")


def turn(page, places: int, which: int = 1) -> None:
    """Move a slider of the robot by so many places, after that of the time."""
    before, handle = count(page), page.get_by_role("slider").nth(which)
    handle.focus()
    for _ in range(places):
        handle.press("ArrowRight")
    answered(page, before + 1)


def test_the_robot_is_seen_and_answers_to_a_slider(page, folder):
    pixels = imageio.imread(BytesIO(page.screenshot()), extension=".png")[..., :3].astype(int)
    scene = pixels[:, :600].reshape(-1, 3)
    assert np.mean(scene.max(axis=1) < 190) > 0.002  # the grey box; the ground is lighter
    power = page.inner_text("#studio-power")
    turn(page, 1)
    wait_until(page, f"document.querySelector('#studio-power').innerText !== {power!r}")
    page.screenshot(path=str(folder / "page.png"))


def test_the_picture_of_an_old_answer_is_pale(page, studio):
    board = [*studio._sessions.values()][-1]._board
    for old, opacity in ((True, 0.4), (False, 1.0)):
        board.show_motion("", old=old)
        wait_until(page, f"+getComputedStyle(document.querySelector('canvas')).opacity === {opacity}")


@pytest.mark.slow
def test_the_camera_stands_off_as_the_page_is_narrow_until_the_user_turns_it(page, studio):
    camera = [*studio._sessions.values()][-1]._client.camera

    def away() -> float:
        time.sleep(2.0)
        return float(np.linalg.norm(camera.position - camera.look_at))

    far = away()
    page.set_viewport_size({"width": 1600, "height": 700})
    near = away()
    page.set_viewport_size({"width": 1000, "height": 700})
    assert away() == pytest.approx(far, rel=1e-3)
    assert near < 0.6 * far
    page.mouse.move(450, 300)
    page.mouse.down()
    page.mouse.move(480, 310, steps=3)
    page.mouse.up()
    turned = np.array(camera.position)
    page.set_viewport_size({"width": 1600, "height": 700})
    away()
    assert np.linalg.norm(camera.position - turned) < 0.05 * far


def test_a_key_held_on_a_slider_does_not_turn_the_camera(page, studio):
    camera = [*studio._sessions.values()][-1]._client.camera
    time.sleep(2.0)  # until the panels are laid out
    before, turned = np.array(camera.position), count(page)
    page.get_by_role("slider").nth(1).focus()
    page.keyboard.down("ArrowRight")
    time.sleep(1.0)
    page.keyboard.up("ArrowRight")
    answered(page, turned + 1)
    np.testing.assert_allclose(camera.position, before, atol=1e-6)
    page.get_by_text("nectosome studio").first.click()  # elsewhere keys are the camera's
    page.keyboard.down("ArrowRight")
    time.sleep(1.0)
    page.keyboard.up("ArrowRight")
    assert np.abs(np.array(camera.position) - before).max() > 0.01


@pytest.mark.slow
def test_pictures_wait_a_moment_for_an_answer_and_go_on(page):
    page.get_by_role("button", name="Pause").click()
    slider = page.get_by_role("slider").nth(1)
    slider.focus()
    waited = """key => new Promise(done => {
      const began = performance.now();
      document.activeElement.dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true }));
      requestAnimationFrame(() => done(performance.now() - began));
    })"""
    assert page.evaluate(waited, "ArrowRight") >= 30
    box = slider.bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    pictures, dropped = page.evaluate("""() => new Promise(done => {
      let pictures = 0, drawn = false;
      const next = () => { pictures += 1; requestAnimationFrame(next) };
      requestAnimationFrame(() => {
        next();
        const move = () => document.dispatchEvent(new PointerEvent("pointermove", { buttons: 1 }));
        move();
        const dropped = requestAnimationFrame(() => { drawn = true });
        setTimeout(() => cancelAnimationFrame(dropped), 25);
        setInterval(move, 5);
        setTimeout(() => done([pictures, drawn]), 1000);
      });
    })""")
    page.mouse.up()
    assert pictures >= 5  # with moves every 5 ms
    assert not dropped


def test_it_is_looked_at_in_other_ways(page, capfd):
    page.get_by_role("tab", name="View").click()
    page.get_by_text("Forces by load").click()
    page.get_by_text("drag", exact=False).first.wait_for()
    for way in ("curvature", "load of the water"):
        page.locator("input[value='material'], input[value='curvature']").first.click()
        page.get_by_role("option", name=way).click()
        page.get_by_text(f"{way}: dark 0").wait_for()
    for camera in ("side", "top", "front", "three-quarter"):
        page.get_by_role("button", name=camera, exact=True).click()
    page.get_by_role("button", name="Pause").click()
    page.get_by_role("button", name="Play").wait_for()
    page.get_by_role("slider").first.focus()
    page.get_by_role("slider").first.press("Home")
    time.sleep(0.5)
    assert "Traceback" not in capfd.readouterr().err


def test_what_came_of_a_deed_stands_until_the_next_whatever_answers_come(page, studio):
    page.get_by_role("tab", name="Files").click()
    field(page, "Name").fill("../out")
    page.get_by_role("button", name="Save robot").click()
    said(page, "cannot be used as a file name")
    session, before = [*studio._sessions.values()][-1], count(page)
    session.become(session.description)
    answered(page, before + 1)
    words = page.inner_text("#studio-words")
    assert "periodic" in words and "cannot be used as a file name" in words
    page.get_by_role("tab", name="Robot").click()
    turn(page, 1)
    assert "cannot be used" not in page.inner_text("#studio-words")


def test_what_is_typed_beyond_a_range_is_told_and_refused_also_as_the_field_is_left(page):
    """By itself a page would put it to the end of the range then: the robot would be another one."""
    before, power = count(page), page.inner_text("#studio-power")
    beside_slider = page.get_by_role("slider").nth(1).locator("xpath=following::input[not(@type='hidden')][1]")
    beside_slider.fill("900")
    said(page, "M: 900 mN m is refused, from 10 to 40 mN m is allowed; 20 mN m stays.")
    beside_slider.blur()
    wait_until(page, "[...document.querySelectorAll('input')].filter((x) => x.value === '20').length >= 2")  # c is 20
    assert "900 mN m is refused" in page.inner_text("#studio-words")
    assert (count(page), page.inner_text("#studio-power")) == (before, power)
    beside_slider.fill("25")
    answered(page, before + 1)
    assert "refused" not in page.inner_text("#studio-words")
    page.get_by_role("tab", name="Files").click()
    video = field(page, "Video (s)")
    video.fill("0.1")
    said(page, "Video: 0.1 s is refused, from 0.5 to 60 s is allowed; 5 s stays.")
    video.fill("2")
    wait_until(page, "!document.querySelector('#studio-words').innerText.includes('refused')")


def test_what_is_set_is_saved_and_opened_again(page, folder):
    turn(page, 5)
    page.get_by_role("tab", name="Files").click()
    field(page, "Name").fill("mine")
    page.get_by_role("button", name="Save robot").click()
    said(page, "saved mine.yaml")
    saved = load_robot(str(folder / "mine.yaml"))
    assert get_value(saved, "M") > 0.02
    page.get_by_role("button", name="Save run").click()
    said(page, "saved mine.nc")
    run = load_dataset(folder / "mine.nc")
    assert get_value(load_robot(str(folder / "arm.yaml")), "M") == 0.02
    assert "saved" not in run.attrs["title"]
    page.get_by_role("button", name="Save robot").click()
    said(page, "is there already")
    field(page, "Name").fill("going on")
    film(page, folder / "going on.mp4")  # of what repeats itself
    field(page, "Name").fill("mine")
    page.get_by_role("button", name="Open run").click()
    said(page, "as it was saved")
    page.get_by_role("button", name="Save picture (.png)").click()
    said(page, "saved mine.png")
    height, width = imageio.imread(folder / "mine.png").shape[:2]
    aspect = page.evaluate("(c => c.clientWidth / c.clientHeight)(document.querySelector('canvas[data-engine]'))")
    assert (height, width) == (1080, pytest.approx(1080 * aspect, abs=1))
    page.get_by_role("button", name="Save picture (.svg)").click()
    said(page, "saved mine.svg")
    assert (folder / "mine.svg").read_text().count("<path") > 100
    film(page, folder / "mine.mp4")  # of a run
    page.get_by_role("button", name="Save page").click()
    said(page, "saved mine.html")
    assert b"<html" in (folder / "mine.html").read_bytes()[:2000].lower()


def film(page, path):
    """Save a video of half a second and look at it."""
    field(page, "Video (s)").fill("0.5")
    page.get_by_role("button", name="Save video").click()
    said(page, f"saved {path.name}")
    with av.open(str(path)) as video:
        assert sum(1 for _ in video.decode(video=0)) == 15


def test_empty_fields_show_an_example_and_the_panel_is_as_wide_as_the_page_allows(page):
    page.get_by_role("tab", name="Identify").click()
    shown = "[...document.querySelectorAll('textarea, input')].map((field) => field.placeholder)"
    for example in ("such as push=-force.y", "such as -0.2..0.2 s"):
        wait_until(page, f"{shown}.includes('{example}')")
    assert page.get_by_text("Width of the page").is_hidden()
    wide = "document.querySelectorAll('canvas')[1].clientWidth"
    for width, stage in ((1280, 450), (1920, 890)):
        page.set_viewport_size({"width": width, "height": 720})
        wait_until(page, f"Math.abs({wide} - {stage}) < 30")


def test_names_that_lead_out_are_refused_on_the_page(page, folder):
    page.get_by_role("tab", name="Files").click()
    for name in ("../out", "/tmp/out", "a/../../out"):
        field(page, "Name").fill(name)
        page.get_by_role("button", name="Save robot").click()
        said(page, "cannot be used as a file name")
    assert not (folder.parent / "out.yaml").exists()


@pytest.mark.slow
def test_what_is_sent_is_read_as_data_and_a_bad_file_gets_a_message(page):
    page.get_by_role("tab", name="Files").click()
    send = page.get_by_role("button", name="Send a robot")
    for name, data, words in (
        ("bad.nc", b"this is no run", "bad.nc"),
        ("bad.yaml", b"!!python/object/apply:os.system ['true']", "bad.yaml"),
        ("bad.exe", b"MZ", "is neither a robot"),
    ):
        with page.expect_file_chooser() as chooser:
            send.click()
        chooser.value.set_files({"name": name, "mimeType": "application/octet-stream", "buffer": data})
        said(page, words)
    before = count(page)
    with page.expect_file_chooser() as chooser:
        send.click()
    good = ARM.replace("name: arm", "name: sent")
    chooser.value.set_files({"name": "sent.yaml", "mimeType": "text/plain", "buffer": good.encode()})
    answered(page, before + 1)
    page.get_by_role("tab", name="Robot").click()
    assert page.get_by_text("sent", exact=True).count() == 1


@pytest.mark.slow
def test_two_tabs_do_not_disturb_each_other_and_leave_nothing_behind(studio, page, browser):
    other = browser.new_page(viewport={"width": 800, "height": 600})
    other.set_default_timeout(PATIENCE)
    other.goto(studio.address)
    answered(other, 1)
    power, seen = page.inner_text("#studio-power"), count(page)
    turn(other, 20)
    assert other.inner_text("#studio-power") != power
    assert (page.inner_text("#studio-power"), count(page)) == (power, seen)
    players = sum(thread.name == "studio-player" for thread in threading.enumerate())
    other.close()
    until = time.monotonic() + 60
    while sum(t.name == "studio-player" for t in threading.enumerate()) >= players and time.monotonic() < until:
        time.sleep(0.1)
    assert sum(t.name == "studio-player" for t in threading.enumerate()) == players - 1
