"""What a page of this package must be to be read on a telephone, found in its HTML without a browser."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from html.parser import HTMLParser

NARROW_PX = 390  # a telephone's width
_VOID = {"meta", "link", "img", "br", "hr", "input", "source", "wbr", "col"}
_INLINE = {"a", "code", "em", "span", "strong"}
_KEY = re.compile(r"\w*[A-Za-z]\w*_\w+|\w+_\w*[A-Za-z]\w*|\b[a-z]\w+\.[a-z]\w+\b")
_WIDTH = re.compile(r"(?<![-\w])(?:min-)?width\s*:\s*([0-9.]+)px")


@dataclass
class Page(HTMLParser):
    """A page, read: what a person sees of it, and what is wrong with it."""

    text: list[str] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)
    style: str = ""
    metas: list[dict[str, str]] = field(default_factory=list)
    open: list[tuple[str, dict[str, str]]] = field(default_factory=list)

    def __post_init__(self) -> None:
        super().__init__(convert_charrefs=True)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = {name: value or "" for name, value in attrs}
        if tag == "meta":
            self.metas.append(given)
        if tag == "table" and "scroll" not in self.open[-1][1].get("class", "").split():
            self.problems.append("a table without a scrolling box of its own")
        if tag == "img":
            if len(given.get("alt", "").split()) < 2:
                self.problems.append(f"a picture with the words {given.get('alt')!r}")
            if _KEY.search(_without_files(given.get("alt", ""))):
                self.problems.append(f"a raw key in a picture's words: {given['alt']}")
        if tag in ("link", "iframe") or (tag == "script" and "src" in given):
            self.problems.append(f"<{tag}>")
        wide = [float(size) for size in _WIDTH.findall(given.get("style", ""))]
        wide += [float(size) for size in [given.get("width", "")] if size.isdigit()]
        self.problems += [f"<{tag}> is {size:g} px wide" for size in wide if size > NARROW_PX]
        if tag not in _VOID:
            self.open.append((tag, given))

    def handle_endtag(self, tag: str) -> None:
        if not self.open or self.open[-1][0] != tag:
            self.problems.append(f"</{tag}> closes <{self.open[-1][0] if self.open else ''}>")
        else:
            self.open.pop()
        if tag not in _INLINE:
            self.text.append(" ")

    def handle_data(self, data: str) -> None:
        tags = {tag for tag, _ in self.open}
        if "style" in tags:
            self.style += data
        elif not tags & {
            "code",
            "pre",
            "title",
            "script",
        }:  # names of files, commands and keys, shown as such
            self.text.append(data)

    @property
    def seen(self) -> str:
        """What a person reads, keys and files in `<code>` left out."""
        return " ".join("".join(self.text).split())


def _without_files(text: str) -> str:
    return re.sub(r"\S+\.(?:csv|json|toml|xml|html|png)\b", "", text)


def read_page(html: str) -> Page:
    """Return a page with all that is wrong with it for a reader at a telephone."""
    page = Page()
    page.feed(html)
    page.close()
    if page.open:
        page.problems.append(f"<{page.open[-1][0]}> is never closed")
    views = [meta["content"] for meta in page.metas if meta.get("name") == "viewport"]
    if views != ["width=device-width, initial-scale=1"]:
        page.problems.append(f"viewport: {views}")
    if not re.search(r"img\s*{[^}]*max-width:\s*100%", page.style):
        page.problems.append("pictures may be wider than the screen")
    if not re.search(r"\.scroll\s*{[^}]*overflow-x:\s*auto", page.style):
        page.problems.append("the boxes of tables do not scroll")
    page.problems += [
        f"a style of {size} px" for size in _WIDTH.findall(page.style) if float(size) > NARROW_PX
    ]
    page.problems += [f"a raw key: {key}" for key in _KEY.findall(page.seen)]
    if re.search(r"(?:src|href)\s*=\s*[\"']?(?:https?:|//)|@import|url\(", html):
        page.problems.append("something from another machine")
    return page
