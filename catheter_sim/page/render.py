"""A page from a template that fills the frame `page.html`: one HTML text that needs no network.

It is read on a telephone as on a screen or on paper: its tables scroll in boxes of their own, its pictures
shrink to the width there is.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Callable, Mapping
from importlib import resources
from typing import Any

import numpy as np
from jinja2 import DictLoader, Environment, StrictUndefined
from markupsafe import Markup

from catheter_sim.arrays import Array

_SHARED = ("page.html", "parts.html")


def rendered(
    package: str,
    template: str,
    context: Mapping[str, Any],
    filters: Mapping[str, Callable[..., Any]] | None = None,
) -> str:
    """Return a page as one HTML text; what is put into it is escaped.

    Args:
        package: in which the template lies ("catheter_sim.validation").
        template: its file; it begins with `{% extends "page.html" %}`, and may import from `parts.html`.
        context: what it names; a name that is missing is a `jinja2.UndefinedError`.
        filters: further ones that it uses.
    """
    places = {**dict.fromkeys(_SHARED, "catheter_sim.page"), template: package}
    texts = {
        name: resources.files(own).joinpath(name).read_text(encoding="utf-8") for name, own in places.items()
    }
    environment = Environment(
        loader=DictLoader(texts),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters.update(filters or {})
    return environment.get_template(template).render(context).strip() + "\n"


def png_source(png: bytes) -> str:
    """Return a picture as the `src` of an image, so that the page needs no other file."""
    return "data:image/png;base64," + base64.b64encode(png).decode("ascii")


def page_script(*names: str) -> Markup:
    """Return scripts of this folder, to stand within `<script>`, so that the page needs no other file."""
    folder = resources.files("catheter_sim.page")
    return Markup("\n".join(folder.joinpath(name).read_text(encoding="utf-8") for name in names))


def page_json(value: Any) -> Markup:
    """Return a value as JSON to stand within `<script>`: no text in it can end that or begin another one."""
    text = json.dumps(value, separators=(",", ":"), allow_nan=False)
    return Markup(text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026"))


def page_numbers(values: Array, per: float) -> str:
    """Return numbers as a short text, to 1 / `per`; `report.js` reads it (`numbersOf`).

    Of each the difference to the one before, in whole parts, twice as large with the sign as the last bit.
    Its digits have five bits, the lowest first, and a sixth bit where more follow; each is a character of
    base 64 (the "variable-length quantity" of source maps). NaN and infinities are "!".
    """
    flat = np.ravel(values)
    known = np.isfinite(flat)
    steps = np.diff(np.round(per * flat[known]).astype(np.int64), prepend=0)
    parts = np.full(len(flat), -1)
    parts[known] = 2 * np.abs(steps) + (steps < 0)
    count = 1 + sum((parts >= 32**place).astype(int) for place in range(1, 12))
    first = np.cumsum(count) - count
    text = np.full(count.sum(), ord("!"), dtype=np.uint8)
    for place in range(count.max(initial=0)):
        here = known & (count > place)
        digit = (parts[here] >> 5 * place & 31) | np.where(count[here] > place + 1, 32, 0)
        text[first[here] + place] = _DIGITS[digit]
    return text.tobytes().decode("ascii")


_DIGITS = np.frombuffer(b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/", dtype=np.uint8)
