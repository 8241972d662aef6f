"""A PyMJCF tree as text: what its own `to_xml_string` writes, in a fraction of the time.

PyMJCF formats every number through `numpy.savetxt` and looks up every element's class of defaults. The
trees here have no attachments and no classes of defaults, so that a plain walk does.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any
from xml.sax.saxutils import escape

import numpy as np

from catheter_sim.mjcf._backend import mjcf

GLOBAL_DEFAULTS = "/"  # PyMJCF's name for the class of a model's own defaults
DEEPEST = 60  # columns: lines are indented no further, as libxml2 has it
_ESCAPED = {'"': "&quot;", "\n": "&#10;", "\r": "&#13;", "\t": "&#9;"}


def mjcf_text(root: mjcf.RootElement, precision: int = 9) -> str:
    """Return a tree without attachments or classes of defaults as MJCF, numbers to `precision` digits."""
    lines = "\n".join(_lines(root, f"%.{precision}g", ""))
    return f"{lines}\n".encode("ascii", "xmlcharrefreplace").decode()


def _lines(element: Any, number: str, indent: str) -> Iterator[str]:
    """Yield an element's lines, its children's further in; nothing where it says nothing."""
    head, further = element.tag, indent + "  " * (len(indent) < DEEPEST)
    for name, value in _attributes(element, number):
        head += f' {name}="{escape(value, _ESCAPED)}"'
    if element.tag == "default":  # PyMJCF keeps a model's own defaults in a class of their own
        yield from (f"{indent}<default>", f"{indent}  <{head}/>", f"{indent}</default>")
        return
    below = [line for child in element.all_children() for line in _lines(child, number, further)]
    if below:
        yield f"{indent}<{head}>"
        yield from below
        yield f"{indent}</{element.tag}>"
    elif head != element.tag or element.spec.repeated or element.spec.on_demand:
        yield f"{indent}<{head}/>"


def _attributes(element: Any, number: str) -> Iterator[tuple[str, str]]:
    """Yield an element's attributes as text, in the schema's order; `number` formats a number."""
    values = element.get_attributes()
    for name in element.spec.attributes:
        if name == "class":
            yield name, GLOBAL_DEFAULTS
        elif name == element.spec.identifier:
            yield name, element.full_identifier
        elif name in values:
            yield name, _text(values[name], number)


def _text(value: Any, number: str) -> str:
    """Return an attribute's value as text."""
    if isinstance(value, float):
        return number % value
    if isinstance(value, np.ndarray):
        return " ".join([number % item for item in value.tolist()])
    if isinstance(value, mjcf.Element):
        return str(value.full_identifier)
    return str(value)
