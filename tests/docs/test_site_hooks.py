"""Claims about the site: keys stand as code, and no page asks another host for anything."""

from __future__ import annotations

from types import ModuleType, SimpleNamespace

import pytest

from tests.scripts_as_modules import script_module

PAGE = SimpleNamespace(file=SimpleNamespace(src_uri="start.md"))


@pytest.fixture(scope="module")
def hooks() -> ModuleType:
    return script_module("site_hooks")


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("| spacer_disk: tip | 1 |", "| `spacer_disk`: tip | 1 |"),
        ("## tendon_friction", "## `tendon_friction`"),
        ("`spacer_disk` and catheter_sim", "`spacer_disk` and catheter_sim"),
        ("[a key](reference/robot_toml.md#tip_x_mm)", "[a key](reference/robot_toml.md#tip_x_mm)"),
        (
            "```python\nrobot = load_robot('spacer_disk')\n```",
            "```python\nrobot = load_robot('spacer_disk')\n```",
        ),
        ("models/spacer_disk.toml", "models/spacer_disk.toml"),
        ('<img alt="spacer_disk">', '<img alt="spacer_disk">'),
    ],
)
def test_a_bare_key_is_put_as_code(hooks: ModuleType, text: str, shown: str) -> None:
    """Code, addresses, paths and the package's name stay as they are."""
    assert hooks.on_page_markdown(text, page=PAGE) == shown


def test_a_page_fetches_nothing_from_elsewhere(hooks: ModuleType) -> None:
    """The theme's script for searching goes; a link to another site is none; anything else is refused."""
    shim = '<script src="https://host.example/iframe-worker/shim"></script>'
    page = '<link rel="stylesheet" href="assets/a.css"><a href="https://host.example">there</a>'
    assert hooks.on_post_page(f"{page}{shim}", PAGE, {}) == page
    for fetched in (
        '<script src="https://host.example/a.js"></script>',
        '<img alt="a" src="//host.example/a.png">',
        '<link rel="stylesheet" href="https://host.example/a.css">',
    ):
        with pytest.raises(ValueError, match=r"start\.md: asks another host"):
            hooks.on_post_page(page + fetched, PAGE, {})
