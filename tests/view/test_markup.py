"""Words of files are text on every page, and a page runs nothing but its own and asks no other machine."""

import ast
import re
import socket
from pathlib import Path

import numpy as np
import plotly.graph_objects as go
import pytest
from tests.made_up_runs import made_up_run
from tests.studio_page import NEEDS_CHROMIUM, PATIENCE, chromium

from nectosome.description import dump_robot
from nectosome.robots import describe
from nectosome.view.display.offline import page_of, recording
from nectosome.view.display.scene_graph import Look
from nectosome.view.markup import plain, plain_figure, sealed
from nectosome.view.page import write_page
from nectosome.view.style import Panel, Scenes

SOURCES = Path(__file__).parents[2] / "src/nectosome"
EVIL = """<iframe srcdoc="<script>top.document.title='PWNED'</script>"></iframe>"""
FETCH = """<img src="http://127.0.0.1:9/x" onerror="document.title='PWNED'"><script>document.title='PWNED'</script>"""
SHEET = '<link rel="stylesheet" href="http://127.0.0.1:9/x"><p style="background: url(http://127.0.0.1:9/x)">a</p>'
LINK = '<a href="http://127.0.0.1:9/x">name</a>'


def test_words_are_shown_letter_by_letter():
    assert plain("""<b a='1'>&amp;"</b>""") == "&lt;b a=&#x27;1&#x27;&gt;&amp;amp;&#34;&lt;/b&gt;"
    assert plain("Kármán, 日本\n\tµ²") == "Kármán, 日本\n\tµ²"
    assert plain("a\x1b[2J\u202eb\0") == "a\ufffd[2J\ufffdb\ufffd"  # an escape, a turn of the line, nothing
    assert plain(3) == "3"


def test_a_figure_has_no_tags_but_those_that_set_type():
    figure = go.Figure(go.Scatter(x=[1], y=[2], name=LINK, text=np.array([LINK, "a<br>b"], dtype=object)))
    figure.update_layout(title=f"x<sub>1</sub> < 2 {LINK}", xaxis_ticktext=[LINK], xaxis_tickvals=[1])
    shown = plain_figure(figure.to_dict())
    quiet = '&lt;a href="http://127.0.0.1:9/x">name&lt;/a>'
    assert shown["data"][0]["name"] == quiet and shown["data"][0]["text"] == [quiet, "a<br>b"]
    assert shown["layout"]["title"]["text"] == f"x<sub>1</sub> &lt; 2 {quiet}"
    assert [*shown["layout"]["xaxis"]["ticktext"]] == [quiet]
    assert plain_figure('<b onclick="x">') == '&lt;b onclick="x">'
    assert [*shown["data"][0]["x"]] == [1]


def test_there_is_one_way_from_words_to_markup():
    """Nobody but `plain` escapes, and nobody writes markdown, where words and markup cannot be told apart."""
    for folder in ("view", "studio"):
        for file in (SOURCES / folder).rglob("*.py"):
            for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
                if isinstance(node, ast.ImportFrom) and node.module == "html":
                    assert file.name == "markup.py", file
                assert not (isinstance(node, ast.Attribute) and node.attr == "add_markdown"), file


def test_the_nonce_follows_from_the_page_and_cannot_be_known_before():
    def page(nonce, words="a"):
        return f'<html><head></head><script nonce="{nonce}">1</script>{words}</html>'

    first = sealed(page)
    assert sealed(page) == first
    (nonce,) = set(re.findall(r"nonce[-=]\"?(\w{32})\b", first))
    again = sealed(lambda mark: page(mark, f'<script nonce="{nonce}">2</script>'))
    assert f"'nonce-{nonce}'" not in again  # what was written for the nonce of another page


def watched(browser, file):
    """A page, once it is loaded, and what it was not allowed."""
    page = browser.new_page(viewport={"width": 900, "height": 800})
    page.set_default_timeout(PATIENCE)
    refused = []
    page.on("console", lambda message: refused.append(message.text) if "Content Security" in message.text else None)
    page.goto(file.as_uri())
    return page, refused


@NEEDS_CHROMIUM
def test_a_saved_page_runs_its_own_scripts_and_no_others(tmp_path):
    """Even where words came into it as they are; its plots, its scenes and what viser writes work under the policy."""
    run = made_up_run(robot=dump_robot(describe("flagellum")))
    figure = go.Figure(go.Scatter(x=[1, 2], y=[2, 3], name=f"{EVIL}{LINK}", showlegend=True))
    figure.update_layout(title=LINK, height=300)
    scene = recording(lambda stage: stage.load(run, describe("flagellum"), 0.0, Look()))
    panels = [
        Panel(EVIL, EVIL, figure),
        Panel(EVIL, "", f"{EVIL}{FETCH}"),
        Panel("", "", Scenes({EVIL: scene, "b": scene})),
    ]
    write_page(tmp_path / "clean.html", EVIL, [panels[0], panels[2]])
    (tmp_path / "plays.html").write_text(page_of(run, describe("flagellum"), 0.0, Look()))
    with socket.create_server(("127.0.0.1", 0)) as elsewhere, chromium() as browser:
        elsewhere.settimeout(0)
        fetch = f"{FETCH}{SHEET}".replace(":9/", f":{elsewhere.getsockname()[1]}/")
        write_page(tmp_path / "report.html", EVIL, [EVIL, fetch, *panels])
        page, refused = watched(browser, tmp_path / "report.html")
        page.locator(".main-svg").first.wait_for()
        page.get_by_role("button", name="<iframe").click()
        page.frame_locator(".scenes iframe").locator("canvas").first.wait_for()
        page.wait_for_timeout(500)
        assert page.title() == EVIL and refused  # all that was put in
        with pytest.raises(BlockingIOError):  # nobody has come
            elsewhere.accept()
        assert page.locator("svg a").count() == 0 and LINK in page.locator(".gtitle").first.text_content()
        page, refused = watched(browser, tmp_path / "clean.html")
        page.locator(".main-svg").first.wait_for()
        page.locator(".scenes").scroll_into_view_if_needed()
        page.frame_locator(".scenes iframe").locator("canvas").first.wait_for()
        assert page.title() == EVIL and not refused
        page, refused = watched(browser, tmp_path / "plays.html")
        page.locator("canvas").first.wait_for()
        assert not refused
