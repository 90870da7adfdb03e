"""What tests of pages share."""

import re


def own_text(page):
    """The page without the programs that plot and play."""
    return page[page.index("</script>\n</head>") :]


def assert_self_contained(page):
    assert not re.search(r"<script[^>]+src=|<link|<img|@import|url\(", own_text(page))
    assert "cdn" not in own_text(page)
    assert page.count("plotly.js v") == page.count("const scenePage") == 1
