"""What MkDocs calls while it builds the site: keys stand as code, and a page asks no other host for anything.

The theme's offline mode asks one for a script with which searching works in pages opened from a folder.
Searching works all the same where the site is served (`python -m http.server -d results/site`).
"""

from __future__ import annotations

import re
from typing import Any

_SEARCH_FROM_A_FOLDER = re.compile(r'<script src="https://[^"]*/iframe-worker/shim"></script>')
_FROM_ELSEWHERE = re.compile(
    r'<(?:script|img|iframe|video|source)\b[^>]*\bsrc="(?:https?:)?//[^"]*"'
    r'|<link\b[^>]*\brel="(?:stylesheet|preload|preconnect)"[^>]*\bhref="(?:https?:)?//[^"]*"'
)

# What stays as it is, code and addresses, or else a key.
_KEY = re.compile(
    r"(?P<kept>^(?P<fence>```+|~~~+).*?^(?P=fence)|(?P<ticks>`+).*?(?P=ticks)|\]\([^)]*\)|<[^>]*>|https?://\S+)"
    r"|(?<![\w/.-])(?P<key>[a-z][a-z0-9]*(?:_[a-z0-9]+)+)(?![\w/-])",
    re.DOTALL | re.MULTILINE,
)
_NO_KEY = "catheter_sim"


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Return the page's text with every key that stands bare, as in a table of robots, put as code."""
    return _KEY.sub(_as_code, markdown)


def _as_code(found: re.Match[str]) -> str:
    key = found["key"]
    return found[0] if key in (None, _NO_KEY) else f"`{key}`"


def on_post_page(output: str, page: Any, config: Any) -> str:
    """Return the page without what would be fetched from another host.

    Raises:
        ValueError: something else would be.
    """
    output = _SEARCH_FROM_A_FOLDER.sub("", output)
    fetched = _FROM_ELSEWHERE.search(output)
    if fetched:
        raise ValueError(f"{page.file.src_uri}: asks another host: {fetched.group()[:120]}")
    return output
