"""The studio in a browser: from a press on a slider to the picture that answers it, and from the command to a picture.

The browser draws by software here, 1280 x 720; with a graphics processor pictures take a small part of that. A press
counts until the second picture after the numbers have changed. The browser's share is the time where answers
are there already (known), 30 ms of it by the page's own pause. Keys are pressed half a second after the last picture,
as by someone who looks at it (single), or as soon as it has come (in a row), while the page still draws it over and
over. Needs a Chromium; times are wall times.

Before that, how long the first answer of each robot of the gallery takes in a process of its own, without the page,
with an empty cache and with the one that this filled, and processor seconds of answers to its sliders, each three times
3 % of its range further: `python -m benchmarks.studio first [robots]` does this only.
"""

import os
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any
from unittest.mock import patch

from playwright.sync_api import Page, sync_playwright
from tests.studio_page import CHROMIUM, FLAGS, wait_until

from nectosome.description import RobotDescription
from nectosome.studio.answers import Answer, AnswerSolver
from nectosome.studio.server import Studio
from nectosome_studies.gallery.entries import ENTRIES

APART = 0.5  # s
PRESSES, WARM = 40, 20  # the page's own programs are compiled as they are used: the first presses do not count
SLIDERS = {"flagellum": ("omega", 100, 300), "paddle": ("f", 300, 800)}  # and the aims: median, 95th percentile [ms]
COUNT = "+(document.querySelector('#studio-answer')?.dataset.count ?? 0)"
WATCH = """() => {
  window.taken = []; window.told = []; window.seen = +document.querySelector('#studio-answer').dataset.count;
  document.addEventListener('keydown', () => { window.pressed = performance.now() }, true);
  new MutationObserver(() => {
    const count = +(document.querySelector('#studio-answer')?.dataset.count ?? window.seen);
    if (count === window.seen) return;
    window.seen = count;
    const began = window.pressed;
    window.told.push(performance.now() - began);
    requestAnimationFrame(() => requestAnimationFrame(() => window.taken.push(performance.now() - began)));
  }).observe(document.body, { subtree: true, childList: true, attributes: true });
}"""

LABELS = """[...document.querySelectorAll('[role=slider]')].map(slider => {
  let place = slider;
  while (!place.querySelector('label')) place = place.parentElement;
  return place.querySelector('label').innerText;
})"""


FIRST = """
import resource, statistics, sys, time
began = time.perf_counter()
from nectosome_studies.gallery.entries import ENTRIES
from nectosome.description import get_value, with_values
from nectosome.model import build
from nectosome.studio.answers import AnswerSolver
from nectosome.studio.sliders import scales_of
entry = next(entry for entry in ENTRIES if entry.name == sys.argv[1])
robot, solve = entry.make(), AnswerSolver()
spent = time.process_time()
answer = solve(robot)
print(time.perf_counter() - began)
words = f"{time.process_time() - spent:.1f} s of the processor"
times = []
for slider in scales_of(robot, {}):
    value, ends = float(get_value(robot, slider.name)), (slider.low * slider.factor, slider.high * slider.factor)
    step = 0.03 * (ends[1] - ends[0]) * (1 if value < sum(ends) / 2 else -1)
    for k in (1, 2, 3):
        changed, spent = with_values(robot, {slider.name: value + k * step}), time.process_time()
        solve(changed)
        times.append(time.process_time() - spent)
words += f", {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6:.2f} GB; {answer.kind}; "
words += f"{build(robot).tree.free_v.size} unknowns"
print(words + (f", sliders {statistics.median(times):.2f} s, at most {max(times):.2f} s" if times else ""))
"""


def first_answers(names: list[str]) -> None:
    """Print a line for each robot of the gallery, or each of those named."""
    print("\nfirst answers in the studio: with an empty cache, and with the one that this filled (aim 20 s)")
    for name in names or [entry.name for entry in ENTRIES]:
        with tempfile.TemporaryDirectory() as cache:
            environment, found = {**os.environ, "NECTOSOME_CACHE": cache}, []
            for _ in range(2):
                command = [sys.executable, "-c", FIRST, name]
                said = subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout
                found.append(said.splitlines())
        print(f"  {name:12s} {float(found[0][0]):5.1f} s, {float(found[1][0]):5.1f} s; {found[0][1]}", flush=True)


def main() -> None:
    """Print a line for each robot, its equations compiled by an earlier visit, playing and paused."""
    print(f"\nthe studio: medians (95th percentiles) of {PRESSES} presses on a slider")
    with sync_playwright() as p, tempfile.TemporaryDirectory() as folder:
        browser = p.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        for robot, (knob, median, worst) in SLIDERS.items():
            studio = Studio(robot, Path(folder), "127.0.0.1", 18_900)
            _open(browser, studio.address).close()
            page = _open(browser, studio.address)
            _press(page, knob, WARM)
            times = {"playing, single": _press(page, knob, apart=APART), "playing, in a row": _press(page, knob)}
            page.get_by_role("button", name="Pause").click()
            times |= {"paused, single": _press(page, knob, apart=APART), "paused, in a row": _press(page, knob)}
            with patch.object(AnswerSolver, "__call__", _known(AnswerSolver.__call__)):
                _press(page, knob, 2)
                times["known, single"] = _press(page, knob, apart=APART)
            page.close()
            studio.close()
            stands, moves = _start(browser, robot, folder)
            print(f"  {robot}: from the command, seen after {stands:.1f} s, in motion after {moves:.1f} s (aim 10 s)")
            print(f"    aims: picture {median} ({worst}) ms")
            for name, (told, taken) in times.items():
                print(f"    {name:17} numbers {_ms(told)}, picture {_ms(taken)}")
        browser.close()


def _known(
    solve: Callable[[AnswerSolver, RobotDescription], Answer],
) -> Callable[[AnswerSolver, RobotDescription], Answer]:
    """A solver that works out each answer once."""
    kept: dict[str, Answer] = {}

    def known(solver: AnswerSolver, robot: RobotDescription) -> Answer:
        key = robot.model_dump_json()
        if key not in kept:
            kept[key] = solve(solver, robot)
        return kept[key]

    return known


def _open(browser: Any, address: str) -> Page:
    """A page that has its first answer."""
    page = browser.new_page(viewport={"width": 1280, "height": 720})
    page.set_default_timeout(600_000)
    page.goto(address)
    wait_until(page, f"{COUNT} >= 1")
    return page


def _start(browser: Any, robot: str, folder: str) -> tuple[float, float]:
    """From the command, whose programs are there from before: when the robot is seen, and when it moves [s]."""
    command = [sys.executable, "-m", "nectosome", "studio", robot, "--no-browser", "--folder", folder]
    page, began = browser.new_page(viewport={"width": 1280, "height": 720}), time.perf_counter()
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
        line = process.stdout.readline() if process.stdout else ""
        page.goto(line.split()[4])  # the studio is at ...
        page.wait_for_selector("#studio-answer")
        page.evaluate("() => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
        stands = time.perf_counter() - began
        wait_until(page, f"{COUNT} >= 1")
        moves = time.perf_counter() - began
        page.close()
        process.send_signal(signal.SIGINT)
    return stands, moves


def _press(page: Page, knob: str, presses: int = PRESSES, apart: float = 0.0) -> tuple[list[float], list[float]]:
    """Times [ms] from a press to new numbers, and to the picture; `apart` [s] from that to the next press."""
    time.sleep(2.0)
    page.evaluate(WATCH)
    handle = page.get_by_role("slider").nth(_place(page, knob))
    handle.focus()
    for k in range(presses):
        handle.press("ArrowRight" if k % 2 else "ArrowLeft")
        wait_until(page, f"window.taken.length > {k}")
        time.sleep(apart)
    return page.evaluate("window.told"), page.evaluate("window.taken")


def _place(page: Page, knob: str) -> int:
    """Which of the sliders that of a quantity is."""
    return next(k for k, text in enumerate(page.evaluate(LABELS)) if text.split(" ")[0] == knob)


def _ms(times: list[float]) -> str:
    return f"{statistics.median(times):.0f} ({statistics.quantiles(times, n=20)[-1]:.0f}) ms"


if __name__ == "__main__":
    if sys.argv[1:2] == ["first"]:
        first_answers(sys.argv[2:])
    else:
        first_answers([])
        main()
