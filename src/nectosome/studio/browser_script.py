"""What the studio adds to the page of viser, which knows of no slider that is answered by a computation.

Arrow keys that move a slider or a tab do not turn the camera as well. And when a slider is moved the next picture waits
for as long as most answers take: where no graphics processor draws it, it would take the cores that the answer needs.

Space and Escape stop a rig that runs, wherever the user types: without that they are keys of a field.

Fields of text that are empty show an example, of which viser knows nothing either. How wide the page is, is typed into
a field that is not seen.

The program that draws plots comes from here when the first one is drawn: viser would send it as text to be evaluated,
which the page's policy forbids. A click on a map is typed into the next field, since viser does not tell of it.
"""

from collections.abc import Callable
from typing import Any

import viser
from websockets.http11 import Response

from nectosome.view.markup import guarded, with_nonce

PLOTLY = "/plotly.min.js"
_LOOKS = 300  # ms between looks for empty fields, and how wide the page is
RIG_RUNS = "The rig runs"  # title of the notice while one of this page does
_SCRIPT = (
    """<script>
{
  const nonce = document.currentScript.nonce;
  const PAUSE = 30;  // ms
  const draw = window.requestAnimationFrame.bind(window), cancel = window.cancelAnimationFrame.bind(window);
  const later = new Map();  // of calls that wait: what cancels them, by what their caller knows
  let until = 0, drawn = true, dragging = false;
  const pause = () => {  // once for each picture, or there would be none while a slider is dragged
    if (drawn) until = performance.now() + PAUSE;
    drawn = false;
  };
  window.requestAnimationFrame = (call) => {
    const turn = (time) => {
      if (performance.now() < until) return void later.set(id, draw(turn));
      later.delete(id);
      drawn = true;
      call(time);
    };
    const id = draw(turn);
    return id;
  };
  window.cancelAnimationFrame = (id) => {
    cancel(later.get(id) ?? id);
    later.delete(id);
  };
  document.addEventListener("pointerdown", (event) => {
    dragging = event.target.closest(".mantine-Slider-root") !== null;
    if (dragging) pause();
  }, true);
  document.addEventListener("pointermove", (event) => { if (dragging && event.buttons) pause(); }, true);
  document.documentElement.addEventListener("keydown", (event) => {
    if (!event.key.startsWith("Arrow")) return;
    if (event.target.closest("[role=slider]")) pause();
    if (event.target.closest("[role=slider], [role=tab]")) event.stopPropagation();
  });
  window.addEventListener("keydown", (event) => {
    if (!event.isTrusted || ![" ", "Escape"].includes(event.key)) return;
    const titles = [...document.querySelectorAll(".mantine-Notification-title")];
    if (!titles.some((title) => title.textContent === "RUNS")) return;
    event.preventDefault();
    event.stopImmediatePropagation();
    const { key, code } = event;
    document.documentElement.dispatchEvent(new KeyboardEvent("keydown", { key, code, bubbles: true }));
  }, true);
  const fieldOf = (mark) => {
    const label = document.querySelector(`label[for="${mark.dataset.of}"]`);
    return label && label.closest(".mantine-Flex-root").querySelector("input, textarea");
  };
  setInterval(() => {
    for (const mark of document.querySelectorAll("[data-example]")) {
      const field = fieldOf(mark);
      if (field && !field.placeholder) field.placeholder = mark.dataset.example;
    }
    const mark = document.getElementById("studio-width"), width = mark && fieldOf(mark);
    if (width && +width.value !== window.innerWidth) write(width, window.innerWidth);
  }, LOOKS);
  const write = (field, value) => {  // as if it was typed
    Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, "value").set.call(field, value);
    field.dispatchEvent(new Event("input", { bubbles: true }));
  };
  let plots;
  window.Plotly = {
    purge: () => {},
    react: (...plot) => {
      plots ??= new Promise((done) => {
        const program = document.createElement("script");
        Object.assign(program, { nonce, src: "PLOTLY", onload: done });
        document.head.append(program);
      });
      return plots.then(() => window.Plotly.react(...plot));
    },
  };
  document.addEventListener("pointerover", (event) => {
    const plot = event.target.closest && event.target.closest(".js-plotly-plot");
    if (!plot || plot.heard || !plot.layout || !/^studio-map/.test(plot.layout.meta)) return;
    plot.heard = true;
    plot.on("plotly_click", (data) => {
      const mark = document.getElementById("studio-map"), point = data.points[0];
      const after = (field) => mark.compareDocumentPosition(field) & Node.DOCUMENT_POSITION_FOLLOWING;
      const field = [...document.querySelectorAll("input")].find(after);
      const short = (value) => +value.toPrecision(6);
      write(field, plot.layout.meta === "studio-map-2" ? short(point.x) + ", " + short(point.y) : short(point.x));
    });
  });
}
</script>""".replace("PLOTLY", PLOTLY)
    .replace("RUNS", RIG_RUNS)
    .replace("LOOKS", str(_LOOKS))
)


_STYLE = "<style>.mantine-Slider-markLabel { margin-top: 4px }</style>"  # the ends of a slider, off its line


def with_scripts(page: Response, nonce: str) -> Response:
    """viser's page with the script before all others, and the nonce for all."""
    text = guarded(bytes(page.body).decode()).replace("<head>", f"<head>{_SCRIPT}{_STYLE}", 1)
    body = with_nonce(text, nonce).encode()
    headers = page.headers.copy()
    del headers["Content-Length"]
    headers["Content-Length"] = str(len(body))
    return Response(page.status_code, page.reason_phrase, headers, body)


def on_page_width(gui: viser.GuiApi, take: Callable[[float], None]) -> None:
    """Call `take` with the width of the page [px], and again when it is another one."""
    field = gui.add_text("Width of the page", "")
    label = f'label[for="{field._impl.uuid}"]'
    unseen = f"<style>div:has(> .mantine-Flex-root {label}) {{ display: none }}</style>"
    gui.add_html(f'{unseen}<span hidden id="studio-width" data-of="{field._impl.uuid}"></span>')

    def changed(event: viser.GuiEvent[Any]) -> None:
        if event.target.value.isdecimal():
            take(float(event.target.value))

    field.on_update(changed)


def plots_are_here(gui: viser.GuiApi) -> None:
    """Tell viser that the program that draws plots is on the page already."""
    gui._setup_plotly_js = True
