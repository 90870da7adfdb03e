"""What the studio adds to the page of viser: arrow keys that move a slider or a tab do not turn the camera as well."""

import gzip
from functools import cache

from websockets.http11 import Response

_SCRIPT = b"""<script>
document.documentElement.addEventListener("keydown", (event) => {
  if (event.key.startsWith("Arrow") && event.target.closest("[role=slider], [role=tab]")) event.stopPropagation();
});
</script>"""


def with_keys(page: Response) -> Response:
    """The page with a script that keeps such keys from the listener of the camera, which is the document's."""
    body = bytes(page.body)
    body = _packed(body) if page.headers.get("Content-Encoding") == "gzip" else _added(body)
    headers = page.headers.copy()
    del headers["Content-Length"]
    headers["Content-Length"] = str(len(body))
    return Response(page.status_code, page.reason_phrase, headers, body)


def _added(page: bytes) -> bytes:
    return page.replace(b"</head>", _SCRIPT + b"</head>", 1)


@cache
def _packed(page: bytes) -> bytes:
    """The same, compressed, which takes too long to be done again for each visit."""
    return gzip.compress(_added(gzip.decompress(page)), mtime=0)
