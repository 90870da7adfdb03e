"""The studio's tab that identifies: a recording is sent, what is unknown found and applied; bad ones are refused."""

import re

import numpy as np
import pytest
from tests.small_robots import DRIVEN, SLIDE
from tests.studio_page import (
    NEEDS_CHROMIUM,
    PATIENCE,
    answered,
    beside,
    chromium,
    count,
    nothing_left,
    said,
    wait_until,
)

from nectosome.description import dump_robot, parse_robot, with_values
from nectosome.studio.server import Studio
from nectosome.studio.tasks.identify import _signals

K, C, TORQUE = 0.03, 0.004, 0.02  # N m/rad, N m s/rad, N m
INERTIA = 2e-3  # kg m2, about the joint
ROBOT = with_values(parse_robot(DRIVEN), {"I": INERTIA, "k": 0.05, "c": 0.006, "M": TORQUE, "f": 1.0})
OSCILLATOR = dump_robot(ROBOT).partition("aliases")[0] + "aliases: {k: body.joint.stiffness, c: body.joint.damping}\n"


def recording() -> str:
    """From rest, under a sine; synthetic, by the closed form of I q'' + C q' + K q = T sin(w t)."""
    t, w = np.arange(0, 4, 0.01), 2 * np.pi * 1.3
    kept = TORQUE / (K - INERTIA * w**2 + 1j * C * w)  # complex amplitude of what lasts
    own = complex(np.roots([INERTIA, C, K])[0])
    # what dies away makes angle and rate 0 at first: q = Im(kept e^iwt) + Re(a e^(own t))
    start, rate = -kept.imag, -(1j * w * kept).imag
    a = start - 1j * (rate - own.real * start) / own.imag
    q = (kept * np.exp(1j * w * t)).imag + (a * np.exp(own * t)).real
    assert abs(q[0]) < 1e-12
    q += 1e-2 * np.random.default_rng(1).normal(size=t.size)
    lines = ["time (s),torque (mN m),angle (deg)"]
    lines += [f"{x:.2f},{1e3 * TORQUE * np.sin(w * x):.6f},{np.degrees(y):.6f}" for x, y in zip(t, q, strict=True)]
    return "\n".join(lines)


def test_signals_are_those_that_can_be_driven():
    assert _signals(parse_robot(OSCILLATOR)) == {"body.joint.torque": "N m"}
    assert _signals(parse_robot(SLIDE)) == {"body.joint.force": "N"}


@pytest.mark.slow
@NEEDS_CHROMIUM
def test_a_recording_is_sent_and_what_it_tells_applied(tmp_path, capfd):
    (tmp_path / "driven.yaml").write_text(OSCILLATOR)
    (tmp_path / "good.csv").write_text(recording())
    (tmp_path / "bad.csv").write_text("time (s),angle (deg)\n0,1\n1,x\n")
    (tmp_path / "bare.csv").write_text("time (s),channel 1\n0,90\n1,180\n")
    (tmp_path / "bench.yaml").write_text("columns:\n  angle: {column: channel 1, unit: deg}\n")
    studio = Studio(str(tmp_path / "driven.yaml"), tmp_path, "127.0.0.1", 18_600)

    def press(name: str) -> None:
        page.get_by_role("button", name=name, exact=True).click()

    def send(name: str) -> None:
        with page.expect_file_chooser() as chooser:
            page.get_by_role("button", name="Send a recording").click()
        chooser.value.set_files(str(tmp_path / name))

    try:
        with chromium() as browser:
            page = browser.new_page(viewport={"width": 1280, "height": 1000})
            page.set_default_timeout(PATIENCE)
            page.goto(studio.address)
            answered(page, 1)
            before = count(page)
            page.get_by_role("tab", name="Identify").click()
            press("Identify")
            said(page, "there is no recording yet")
            send("bad.csv")
            said(page, 'bad.csv, line 3, angle: "x" is not a number')
            beside(page, "Sheet").click()
            page.get_by_role("option", name="bench.yaml").click()
            send("bare.csv")
            page.get_by_text("bare.csv: 2 samples, 1 s; angle (rad)").wait_for()
            send("good.csv")
            said(page, "channel 1")  # it has none
            beside(page, "Sheet").click()
            page.get_by_role("option", name="none").click()
            send("good.csv")
            page.get_by_text("good.csv: 400 samples, 3.99 s; torque (N m), angle (rad)").wait_for()
            fields = page.locator("textarea:visible")
            compare, drive, unknown = (fields.nth(k).input_value() for k in range(3))
            assert (compare, drive) == ("angle=body.angle", "torque=body.joint.torque")
            assert unknown.splitlines() == ["k = 25 mN m/rad..0.1 N m/rad", "c = 3 mN m s/rad..12 mN m s/rad"]
            fields.nth(0).fill("angle=body.heigth")
            press("Identify")
            said(page, "body.heigth")
            fields.nth(0).fill(compare)
            fields.nth(3).fill("body.joint.speed = -1..1rad/s")
            press("Identify")
            said(page, "there is no quantity called")
            fields.nth(3).fill("body.joint.velocity = -1..1rad/s")
            late = beside(page, "Readings late by")
            late.fill("1..2m")
            press("Identify")
            said(page, "Readings late by")
            late.fill("-50..50ms")
            press("Identify")
            page.wait_for_selector("#studio-fit")
            wait_until(page, "document.querySelectorAll('.js-plotly-plot .scatterlayer path.js-line').length > 2")
            rows = {
                row[0]: [float(x) for x in row[1:4]]
                for row in (line.split("\t") for line in page.inner_text("#studio-fit").splitlines())
                if len(row) > 3 and row[0]
            }
            own = (("body.joint.velocity of good", 0.0, 0.1), ("shift", 0.0, 5e-3))
            for name, truth, near in (("k", K, 0.01 * K), ("c", C, 0.02 * C), *own):
                value, low, high = rows[name]
                assert value == pytest.approx(truth, abs=near)
                assert low <= truth <= high
            page.screenshot(path=str(tmp_path / "identify.png"))
            press("Apply what was found")
            answered(page, before + 1)
            shown = [float(box.input_value()) for box in page.locator("input[type=text]:visible").all()[-2:]]
            assert shown == pytest.approx([1e3 * rows["k"][0], 1e3 * rows["c"][0]], rel=1e-3)
            beside(page, "Starts").fill("64")  # long enough to be stopped, however slow the page is
            press("Identify")
            page.locator("#studio-work").get_by_text("; best so far k = ").wait_for()
            words = page.inner_text("#studio-work")
            assert re.search(r"identifying: start \d+ of 64, evaluation \d+ of about \d+; best so far", words)
            assert re.search(r"\d:\d\d(, about \d+:\d\d left)?$", words)
            press("Stop, keep the best so far")
            said(page, "stopped, best so far")
            so_far = page.inner_text("#studio-so-far")
            assert "nothing says how sure these values are" in so_far
            assert "95 %" not in so_far
            page.get_by_role("button", name="Apply the best so far").wait_for()
            assert page.locator("#studio-fit").count() == 0
            assert nothing_left()
            assert "Traceback" not in capfd.readouterr().err
    finally:
        studio.close()
