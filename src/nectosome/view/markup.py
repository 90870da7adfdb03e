"""What keeps files from writing pages: their words are text there, and a page runs and fetches nothing but its own.

Two walls, each enough alone. What comes from a file goes through `plain`, or, in a figure, through `plain_figure`. And
each page has a Content-Security-Policy: a script needs the page's nonce, which no file knows, and nothing is asked
of another machine.
"""

import re
import secrets
from collections.abc import Callable
from hashlib import sha256
from html import escape
from typing import Any

import numpy as np

_OUR_TAGS = re.compile(r"<(?!/?(?:br|b|i|sub|sup|extra)>)")  # `<` of anything but these, which have no attributes
_POLICY = (
    "default-src 'none'",
    "script-src 'nonce-{}' 'wasm-unsafe-eval'",  # viser unpacks itself by WebAssembly
    "style-src 'unsafe-inline'",
    "img-src data: blob:",
    "font-src data:",
    "connect-src 'self' data: blob:",
    "worker-src blob:",
    "base-uri 'none'",
    "form-action 'none'",
)
# viser unpacks its program into one more script, which is given the nonce of this one.
_HAND_ON = """<script>{
  const nonce = document.currentScript.nonce, make = document.createElement;
  document.createElement = function (name, ...more) {
    const made = make.call(this, name, ...more);
    if (name !== "script") return made;
    document.createElement = make;
    made.nonce = nonce;
    return made;
  };
}</script>"""


def plain(text: Any) -> str:
    """What came from a file, as text that HTML, SVG and plotly show letter by letter; what cannot be seen as U+FFFD."""
    seen = "".join(c if c.isprintable() or c in "\n\t" else "\ufffd" for c in str(text))
    return escape(seen).replace("&quot;", "&#34;")  # plotly knows it by its number only


def plain_figure(shown: Any) -> Any:
    """A figure (`to_dict`) whose texts have no tags but those that break lines and set type: no links above all."""
    if isinstance(shown, str):
        return _OUR_TAGS.sub("&lt;", shown)
    if isinstance(shown, dict):
        return {key: plain_figure(value) for key, value in shown.items()}
    if isinstance(shown, np.ndarray):
        return plain_figure(shown.tolist()) if shown.dtype.kind in "OUS" else shown
    return [plain_figure(value) for value in shown] if isinstance(shown, list | tuple) else shown


def policy(nonce: str) -> str:
    """The Content-Security-Policy of a page whose own scripts have this nonce."""
    return "; ".join(_POLICY).format(nonce)


def guarded(viser_page: str) -> str:
    """A page of viser whose program is run under a policy, once all its scripts have a nonce (`with_nonce`)."""
    return viser_page.replace("<head>", f"<head>{_HAND_ON}", 1)


def with_nonce(scripts: str, nonce: str) -> str:
    """HTML, all of whose scripts are ours, with the nonce."""
    return scripts.replace("<script", f'<script nonce="{nonce}"')


def sealed(page: Callable[[str], str]) -> str:
    """The page that `page(nonce)` writes, with its policy.

    The nonce follows from all that is on the page: the same page is the same file, and nothing in it can know it.
    """
    mark = secrets.token_hex(16)
    text = page(mark)
    nonce = sha256(text.replace(mark, "").encode()).hexdigest()[:32]
    meta = f'<meta http-equiv="Content-Security-Policy" content="{policy(nonce)}">'
    return text.replace(mark, nonce).replace("<head>", f"<head>{meta}", 1)
