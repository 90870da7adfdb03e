"""What files say is text in the studio: no markup of theirs is on its page, and none would run or ask for anything."""

import json
import socket
import time
from html.parser import HTMLParser

import plotly.graph_objects as go
import pytest
from tests.studio_page import NEEDS_CHROMIUM, PATIENCE, Visitor, chromium, said, wait_until

from nectosome.studio import session
from nectosome.studio.server import Studio
from nectosome.units import InputError

RUN = "<script>parent.document.title='PWNED'</script>"
EVIL = f'<iframe srcdoc="{RUN}"></iframe>'
FETCH = "![](http://127.0.0.1:9/x)"
LINK = '<a href="http://127.0.0.1:9/x">name</a>'
ROBOT = """
name: NAME
water: {gravity: 0 m/s2}
body:
  {kind: rigid, shape: box, length: 200 mm, width: 30 mm, height: 60 mm, mass: 1 kg, inertia: [1e-3 kg m2, 1e-3 kg m2,
  1e-3 kg m2], joint: {kind: revolute, axis: z, stiffness: 0.03 N m/rad, damping: 0.02 N m s/rad}}
aliases: {k: body.joint.stiffness}
"""
ROW = {"id": f"{EVIL}/x", "quantity": EVIL, "unit": EVIL, "verdict": EVIL, "kind": EVIL, "note": f"{EVIL} {FETCH}"}
OURS = {"div", "table", "tr", "td", "span", "b", "br", "p", "svg", "polyline", "circle"}
OUR_ATTRIBUTES = {"style", "id", "title", "data-count", "hidden", "data-of", "data-example"}
SHAPES = {"width", "height", "points", "fill", "stroke", "stroke-width", "cx", "cy", "r"}


class NoAnswer(session.AnswerSolver):
    """Says what a file may make a message say."""

    def __call__(self, description):
        raise InputError(f"no motion of {EVIL} {FETCH}", field=EVIL, file=f"{EVIL}.yaml")


class Tags(HTMLParser):
    def __init__(self):
        super().__init__()
        self.found = set()

    def handle_starttag(self, tag, attrs):
        self.found |= {tag, *(name for name, _ in attrs)}


@pytest.fixture
def studio(tmp_path, monkeypatch):
    monkeypatch.setattr(session, "AnswerSolver", NoAnswer)
    (tmp_path / "robot.yaml").write_text(ROBOT.replace("NAME", json.dumps(f"{EVIL}{FETCH}")))
    (tmp_path / "<img src=x onerror=alert(1)>.nc").write_text(EVIL)
    numbers = dict.fromkeys(("printed", "ours", "error", "tolerance"), 1.0)
    (tmp_path / "scorecard.json").write_text(json.dumps({"rows": [ROW | numbers]}))
    column = f"{EVIL}{FETCH}".replace('"', '""')
    (tmp_path / "slow.csv").write_text(f'time (s),"{column}"\n0,1\n1,2\n2,3\n')
    made = Studio(str(tmp_path / "robot.yaml"), tmp_path, "127.0.0.1", 18_800)
    yield made
    made.close()


def task(tab, kind):
    return next(task for task in tab._tasks if type(task).__name__ == kind)


def fill(studio, folder):
    """Show in the tab what files say, wherever it is shown; returns the tab."""
    end = time.monotonic() + 60
    while not studio._sessions:  # its first words come while it is made
        assert time.monotonic() < end
        time.sleep(0.01)
    (tab,) = studio._sessions.values()
    tab.tell(f"{EVIL} {FETCH} {LINK}", True)
    identify = task(tab, "Identify")
    identify._try(lambda: identify._take(folder / "slow.csv", f"{EVIL}.csv"))
    tab.work._show(EVIL, 0.5)
    return tab


def test_no_markup_of_files_is_sent_to_the_page(studio, tmp_path):
    with Visitor(studio) as page:
        page.wait(lambda: "no motion of" in page.text)
        fill(studio, tmp_path)
        page.wait(lambda: "3 samples" in page.text)
    assert page.text.count("PWNED") >= 8  # in the name, messages, the scorecard, a column, a line of work
    tags = Tags()
    tags.feed(page.text)
    assert tags.found <= OURS | OUR_ATTRIBUTES | SHAPES
    assert not page.kinds & {"GuiMarkdownMessage", "RunJavascriptMessage"}


@NEEDS_CHROMIUM
def test_nothing_of_a_file_runs_or_is_fetched_in_a_browser(studio, tmp_path):
    """Nor what would come to the page as markup: its policy is a second wall."""
    with socket.create_server(("127.0.0.1", 0)) as elsewhere, chromium() as browser:
        elsewhere.settimeout(0)
        page = browser.new_page(viewport={"width": 1280, "height": 900})
        page.set_default_timeout(PATIENCE)
        page.goto(studio.address)
        said(page, "no motion of <iframe")
        tab = fill(studio, tmp_path)
        plot = task(tab, "Map")._plot
        plot.folder.visible = True
        line = go.Scatter(x=[1, 2], y=[1, 2], name=EVIL, showlegend=True)
        plot.show(go.Figure(line, {"title": f"{LINK}{EVIL}"}), 0.8)
        for name in (
            "View",
            "Files",
            "Robot",
            "Identify",
            "Correct",
            "Control",
            "Scorecard",
            "Design",
            "Map",
            "Intervals",
        ):
            page.get_by_role("tab", name=name, exact=True).first.click()
        wait_until(page, "document.querySelectorAll('.main-svg').length > 0")  # plots come, without eval
        assert page.locator(".main-svg a").count() == 0
        assert LINK in page.locator(".gtitle").first.text_content()
        assert page.locator("iframe").count() == 0 and page.title() == "Viser"
        url = f"http://127.0.0.1:{elsewhere.getsockname()[1]}/x"
        tab.gui.add_markdown(f'{EVIL} ![]({url}) <img src="{url}" onerror="document.title=1">')
        tab.gui.add_html(f'{EVIL}<img src="{url}" onerror="document.title=1"><link rel="stylesheet" href="{url}">')
        wait_until(page, "document.querySelectorAll('iframe').length === 2")
        time.sleep(1.0)
        assert page.title() == "Viser"
        with pytest.raises(BlockingIOError):  # nobody has come
            elsewhere.accept()
