"""What MkDocs calls while it builds the site.

Keys stand as code, pages are made from the code (`site_pages.py`), each page says version and commit,
addresses that moved lead on (`extra.moved` in mkdocs.yml), and a page asks no other host for anything.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parent))  # where site_pages lies

import site_pages

import catheter_sim

_FROM_ELSEWHERE = re.compile(
    r'<(?:script|img|iframe|video|source)\b[^>]*\bsrc="(?:https?:)?//[^"]*"'
    r'|<link\b[^>]*\brel="(?:stylesheet|preload|preconnect)"[^>]*\bhref="(?:https?:)?//[^"]*"'
)
_MOVED = (
    '<!doctype html><meta charset="utf-8"><title>Moved</title>'
    '<meta http-equiv="refresh" content="0; url={0}"><link rel="canonical" href="{0}">'
    '<p>This page is now <a href="{0}">here</a>.</p>\n'
)
_NAMES = "<!-- names -->"

# What stays as it is, code and addresses, or else a key.
_KEY = re.compile(
    r"(?P<kept>^(?P<fence>```+|~~~+).*?^(?P=fence)|(?P<ticks>`+).*?(?P=ticks)|\]\([^)]*\)|<[^>]*>|https?://\S+)"
    r"|(?<![\w/.-])(?P<key>[a-z][a-z0-9]*(?:_[a-z0-9]+)+)(?![\w/-])",
    re.DOTALL | re.MULTILINE,
)
_NO_KEY = "catheter_sim"
_BARE_KEY = re.compile(rf"\b(?!{_NO_KEY}\b)[a-z][a-z0-9]*(?:_[a-z0-9]+)+\b")


def on_config(config: Any) -> Any:
    """Return the configuration with version and commit below each page, and the made pages in the menu."""
    config.copyright = f"catheter_sim {catheter_sim.__version__}, {commit()}. {config.copyright}"
    (reference,) = [item["Reference"] for item in config.nav if "Reference" in item]
    pages = sorted(f"{site_pages.ENVIRONMENTS}/{item.name}.md" for item in site_pages.environments())
    reference.append({"Environments": [f"{site_pages.ENVIRONMENTS}/index.md", *pages]})
    (index,) = [item for item in reference if f"{site_pages.NAMES}.md" in item.values()]
    (title,) = index
    index[title] = [f"{site_pages.NAMES}.md", *site_pages.name_pages()]
    return config


def commit() -> str:
    """Return the commit from which the site is built, with a plus where files differ from it."""
    root = Path(__file__).resolve().parent.parent
    words = ["git", "-C", str(root), "describe", "--always", "--abbrev=10", "--dirty=+", "--exclude=*"]
    ran = subprocess.run(words, capture_output=True, text=True)
    return f"commit {ran.stdout.strip()}" if ran.returncode == 0 else "no commit"


def on_files(files: Any, config: Any) -> Any:
    """Return the files with the pages and notebooks that are made now."""
    from mkdocs.structure.files import File

    made = site_pages.name_pages() | site_pages.environment_pages() | site_pages.notebooks()
    made |= site_pages.live_scripts()
    for address, text in made.items():
        files.append(File.generated(config, address, content=text))
    return files


def on_page_markdown(markdown: str, page: Any = None, **_: Any) -> str:
    """Return the page's text with every key that stands bare, as in a table of robots, put as code.

    The list of Python names gets its table, a tutorial its notebook.
    """
    address = page.file.src_uri
    if address == f"{site_pages.NAMES}.md":
        markdown = markdown.replace(_NAMES, "\n".join(site_pages.table_of_names()))
    if address == site_pages.SPLIT:
        markdown = site_pages.by_robot(markdown)
    if address.startswith(f"{site_pages.TUTORIALS}/"):
        name = f"{Path(address).stem}.ipynb"
        title, _, rest = markdown.partition("\n")
        markdown = f"{title}\n\n[Download this page as a notebook]({name}){{ download }}\n{rest}"
    return _KEY.sub(_as_code, markdown)


def on_page_content(html: str, page: Any, **_: Any) -> str:
    """Return a page of docstrings, or of changes, with every key that stands bare in its text put as code."""
    if not page.file.src_uri.startswith((f"{site_pages.NAMES}/", "changes.md")):
        return html
    depth, parts = 0, []
    for part in re.split(r"(<[^>]*>)", html):
        if part.startswith(("<code", "<pre")):
            depth += 1
        elif part.startswith(("</code", "</pre")):
            depth -= 1
        elif not part.startswith("<") and not depth:
            part = _BARE_KEY.sub(r"<code>\g<0></code>", part)
        parts.append(part)
    return "".join(parts)


def _as_code(found: re.Match[str]) -> str:
    key = found["key"]
    return found[0] if key in (None, _NO_KEY) else f"`{key}`"


def on_post_page(output: str, page: Any, config: Any) -> str:
    """Return the page as it is.

    Raises:
        ValueError: it would fetch something from another host.
    """
    fetched = _FROM_ELSEWHERE.search(output)
    if fetched:
        raise ValueError(f"{page.file.src_uri}: asks another host: {fetched.group()[:120]}")
    return output


def on_post_build(config: Any) -> None:
    """Write a page that leads on at each address that moved."""
    site = Path(config.site_dir)
    for old, new in config.extra.get("moved", {}).items():
        lead_on(site, old, new)


def lead_on(site: Path, old: str, new: str) -> None:
    """Write a page at `old` that leads to `new`, both relative to the site's folder.

    Raises:
        ValueError: there is no page at `new`, or one at `old`.
    """
    if not (site / new.partition("#")[0]).is_file() or (site / old).exists():
        raise ValueError(f"moved: {old} to {new}: no page there, or one at the old address")
    (site / old).parent.mkdir(parents=True, exist_ok=True)
    target = os.path.relpath(site / new, (site / old).parent).replace(os.sep, "/")
    (site / old).write_text(_MOVED.format(target), encoding="utf-8")
