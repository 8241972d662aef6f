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

from jinja2 import DictLoader, Environment, StrictUndefined
from markupsafe import Markup

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


def page_script(name: str) -> Markup:
    """Return a script of this folder, to stand within `<script>`, so that the page needs no other file."""
    return Markup(resources.files("catheter_sim.page").joinpath(name).read_text(encoding="utf-8"))


def page_json(value: Any) -> Markup:
    """Return a value as JSON to stand within `<script>`: no text in it can end that or begin another one."""
    text = json.dumps(value, separators=(",", ":"), allow_nan=False)
    return Markup(text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026"))
