"""Claims about the site: keys stand as code, and no page asks another host for anything."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest

from tests.scripts_as_modules import script_module

ROOT = Path(__file__).resolve().parents[2]
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


def test_a_bare_key_of_a_docstring_is_put_as_code(hooks: ModuleType) -> None:
    """On the pages of names, which Markdown has made already; tags and code stay as they are."""
    page = SimpleNamespace(file=SimpleNamespace(src_uri="reference/python/Run.md"))
    html = '<h2 id="to_table">to_table</h2><p>a tip_mm of <code>tip_mm</code> in catheter_sim</p>'
    made = hooks.on_page_content(html, page=page)
    assert made == html.replace(">to_table<", "><code>to_table</code><").replace(
        "a tip_mm", "a <code>tip_mm</code>"
    )
    assert hooks.on_page_content(html, page=PAGE) == html


def test_a_page_fetches_nothing_from_elsewhere(hooks: ModuleType) -> None:
    """A link to another site is none; anything else is refused."""
    page = '<link rel="stylesheet" href="assets/a.css"><a href="https://host.example">there</a>'
    assert hooks.on_post_page(page, PAGE, {}) == page
    for fetched in (
        '<script src="https://host.example/a.js"></script>',
        '<img alt="a" src="//host.example/a.png">',
        '<link rel="stylesheet" href="https://host.example/a.css">',
    ):
        with pytest.raises(ValueError, match=r"start\.md: asks another host"):
            hooks.on_post_page(page + fetched, PAGE, {})


def test_an_address_that_moved_leads_on(hooks: ModuleType, tmp_path: Path) -> None:
    """From its own folder; not to a page that is missing, not over one that is there."""
    (tmp_path / "new.html").write_text("here")
    hooks.lead_on(tmp_path, "old/page.html", "new.html#part")
    assert "url=../new.html#part" in (tmp_path / "old" / "page.html").read_text()
    for old, new in (("x.html", "missing.html"), ("new.html", "new.html")):
        with pytest.raises(ValueError, match="moved"):
            hooks.lead_on(tmp_path, old, new)


def test_the_search_from_a_folder_is_vendored_with_its_licence() -> None:
    """The theme would else load it from a network."""
    folder = ROOT / "docs" / "vendor" / "iframe-worker"
    assert "vendor/iframe-worker/shim.js" in (ROOT / "mkdocs.yml").read_text(encoding="utf-8")
    assert (folder / "shim.js").stat().st_size < 2000
    assert "Permission is hereby granted" in (folder / "LICENSE").read_text(encoding="utf-8")
