"""A hook of mkdocs: formulas become MathML, which browsers show by themselves; two pages come from the clone's root.

Lists that are empty in the clone are made of the code (`generate.py`).
"""

import html
import re
import sys
from pathlib import Path
from typing import Any

from latex2mathml.converter import convert
from mkdocs.structure.files import File, Files

sys.path.insert(0, str(Path(__file__).parent))
from generate import renewed

ROOT = Path(__file__).parents[2]
_AT_ROOT = {"CHANGELOG.md": "develop/changelog.md", "CONTRIBUTING.md": "develop/contributing.md"}
_FORMULA = re.compile(r'<(span|div) class="arithmatex">\\[(\[](.*?)\\[)\]]</\1>', re.DOTALL)


def on_files(files: Files, config: Any, **_: Any) -> Files:
    """Add the pages that lie beside `docs/`."""
    for name, page in _AT_ROOT.items():
        text = (ROOT / name).read_text(encoding="utf-8").replace("](docs/", "](../")
        files.append(File.generated(config, page, content=text))
    return files


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Fill the lists of names and messages."""
    return renewed(markdown, on_site=True)


def on_page_content(content: str, **_: Any) -> str:
    """Replace the formulas that pymdownx.arithmatex found."""

    def mathml(found: re.Match[str]) -> str:
        return convert(html.unescape(found[2]), display="block" if found[1] == "div" else "inline")

    return _FORMULA.sub(mathml, content)
