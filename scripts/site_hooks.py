"""What MkDocs calls while it builds the site: a page asks no other host for anything.

The theme's offline mode asks one for a script with which searching works in pages opened from a folder.
Searching
works all the same where the site is served (`python -m http.server -d results/site`).
"""

from __future__ import annotations

import re
from typing import Any

from mkdocs.exceptions import PluginError

_SEARCH_FROM_A_FOLDER = re.compile(r'<script src="https://[^"]*/iframe-worker/shim"></script>')
_FROM_ELSEWHERE = re.compile(
    r'<(?:script|img|iframe|video|source)\b[^>]*\bsrc="(?:https?:)?//[^"]*"'
    r'|<link\b[^>]*\brel="(?:stylesheet|preload|preconnect)"[^>]*\bhref="(?:https?:)?//[^"]*"'
)


def on_post_page(output: str, page: Any, config: Any) -> str:
    """Return the page without what would be fetched from another host.

    Raises:
        PluginError: something else would be.
    """
    output = _SEARCH_FROM_A_FOLDER.sub("", output)
    fetched = _FROM_ELSEWHERE.search(output)
    if fetched:
        raise PluginError(f"{page.file.src_uri}: asks another host: {fetched.group()[:120]}")
    return output
