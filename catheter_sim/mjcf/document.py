"""A model as a tree of MJCF elements, and its text.

What elements there are, what they may have and that no name is there twice, MuJoCo checks when it compiles
the text. Trees are walked in loops: a robot has hundreds of links, one inside another, more than Python lets
functions call themselves.
"""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from io import StringIO
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np

DIGITS, ALL_DIGITS = ".12g", ""  # how numbers are written: in files, and where nothing may be lost
_DEEPEST_INDENT = 30


class Element:
    """An element of a model; the one without a parent is the model.

    Attributes:
        tag: what it is: "body", "site".
        attributes: numbers, sequences of numbers, truth values and texts; rounded where they are written.
        children: in their order; `add` and `append` put them there.
        parent: the element that holds it.
    """

    def __init__(self, tag: str, /, **attributes: Any) -> None:
        self.tag = tag
        self.attributes: dict[str, Any] = {}
        self.children: list[Element] = []
        self.parent: Any = None
        self.set(**attributes)

    def set(self, **attributes: Any) -> None:
        """Set attributes; one that is None is taken out."""
        self.attributes |= attributes
        for name in [name for name in attributes if attributes[name] is None]:
            del self.attributes[name]

    def get(self, name: str, default: Any = None) -> Any:
        """Return an attribute as it was set; one that was read is a text."""
        return self.attributes.get(name, default)

    def numbers(self, name: str, default: Any = ()) -> list[float]:
        """Return the numbers of an attribute."""
        value = self.attributes.get(name, default)
        return [float(item) for item in (value.split() if isinstance(value, str) else np.ravel(value))]

    def add(self, tag: str, /, **attributes: Any) -> Element:
        """Add an element after the others, and return it; attributes that are None it has not."""
        added = Element(tag, **attributes)
        self.append(added)
        return added

    def append(self, child: Element) -> None:
        """Move an element here, after the others."""
        if child.parent is not None:
            child.remove()
        child.parent = self
        self.children.append(child)

    def remove(self) -> None:
        """Take this element out of its parent."""
        self.parent.children.remove(self)
        self.parent = None

    def part(self, tag: str) -> Element:
        """Return the first child with a tag, which is added where there is none: "worldbody", "option"."""
        return next((child for child in self.children if child.tag == tag), None) or self.add(tag)

    def every(self, *tags: str) -> Iterator[Element]:
        """Yield this element and all below it that have one of the tags, in the order of the text."""
        waiting = [self]
        while waiting:
            item = waiting.pop()
            if item.tag in tags:
                yield item
            waiting += reversed(item.children)

    def find(self, tag: str, name: str) -> Element:
        """Return the element with a tag and a name.

        Raises:
            KeyError: there is none.
        """
        for item in self.every(tag):
            if item.get("name") == name:
                return item
        raise KeyError(f"no {tag} {name!r}")

    def text(self, digits: str = DIGITS) -> str:
        """Return this element with all below it as XML; `digits`: of its numbers, or `ALL_DIGITS`."""
        lines: list[str] = []
        waiting: list[tuple[Element, int, bool]] = [(self, 0, False)]
        while waiting:
            item, depth, done = waiting.pop()
            indent = "  " * min(depth, _DEEPEST_INDENT)
            if done:
                lines.append(f"{indent}</{item.tag}>\n")
                continue
            own = [f" {key}={quoteattr(_written(value, digits))}" for key, value in item.attributes.items()]
            lines.append(f"{indent}<{item.tag}{''.join(own)}{'' if item.children else '/'}>\n")
            if item.children:
                waiting.append((item, depth, True))
                waiting += [(child, depth + 1, False) for child in reversed(item.children)]
        return "".join(lines)


def read(text: str) -> Element:
    """Return the model that a text describes, without its comments.

    Raises:
        ElementTree.ParseError: it is no XML.
    """
    above = here = Element("")
    for event, node in ElementTree.iterparse(StringIO(text), ("start", "end")):
        here = here.add(node.tag, **node.attrib) if event == "start" else here.parent
    root = above.children[0]
    root.remove()
    return root


def _written(value: Any, digits: str) -> str:
    if isinstance(value, str):
        return value
    if isinstance(value, bool):
        return str(value).lower()
    return " ".join(f"{number:{digits}}" for number in np.ravel(value).tolist())
