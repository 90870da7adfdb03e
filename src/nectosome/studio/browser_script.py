"""What the studio adds to the page of viser, which knows of no slider that is answered by a computation.

Arrow keys that move a slider or a tab do not turn the camera as well. And when a slider is moved the next picture waits
for as long as most answers take: where no graphics processor draws it, it would take the cores that the answer needs.
"""

import gzip
from functools import cache

from websockets.http11 import Response

_SCRIPT = b"""<script>
{
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
}
</script>"""


def with_script(page: Response) -> Response:
    """The page with the script, before all others."""
    body = (_packed if page.headers.get("Content-Encoding") == "gzip" else _added)(bytes(page.body))
    headers = page.headers.copy()
    del headers["Content-Length"]
    headers["Content-Length"] = str(len(body))
    return Response(page.status_code, page.reason_phrase, headers, body)


def _added(page: bytes) -> bytes:
    return page.replace(b"<head>", b"<head>" + _SCRIPT, 1)


@cache
def _packed(page: bytes) -> bytes:
    """The same, compressed, which takes too long to be done again for each visit."""
    return gzip.compress(_added(gzip.decompress(page)), mtime=0)
