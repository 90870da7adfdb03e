"""What the tests of the studio's page share: a browser, a quick robot, and what to wait for."""

import os
import shutil

CHROMIUM = (
    os.environ.get("CHROMIUM")
    or shutil.which("chromium")
    or shutil.which("chromium-browser")
    or shutil.which("google-chrome")
)
FLAGS = ("--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist")
PATIENCE = 120_000  # ms
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


def count(page) -> int:
    return int(page.get_attribute("#studio-answer", "data-count"))


def answered(page, n: int) -> None:
    page.wait_for_function(f"+(document.querySelector('#studio-answer')?.dataset.count ?? 0) >= {n}")


def said(page, words: str) -> None:
    page.wait_for_function(f"document.querySelector('#studio-words')?.innerText.includes({words!r})")


def name_of(page):
    """The field with the name under which things are saved, the last one on the page."""
    return page.locator("input:visible").last


def turn(page, places: int, which: int = 1) -> None:
    """Move a slider of the robot by so many places, after that of the time."""
    before, handle = count(page), page.get_by_role("slider").nth(which)
    handle.focus()
    for _ in range(places):
        handle.press("ArrowRight")
    answered(page, before + 1)
