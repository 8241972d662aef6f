"""The documentation: examples run and print what stands below them; pages made from code are not stale."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from tests.scripts_as_modules import script_module

ROOT = Path(__file__).resolve().parents[2]


run_pages = script_module("run_pages")
LONG = ("train_a_policy", "lab", "inverse_sense_control", "first_policy")  # pages that run apart


@pytest.mark.slow
@pytest.mark.parametrize(
    "path",
    [
        pytest.param(path, id=path.stem, marks=[pytest.mark.long] if path.stem in LONG else [])
        for path in run_pages.pages()
    ],
)
def test_examples_of_a_page_print_what_it_shows(path: Path, tmp_path: Path) -> None:
    """Each command and block of code, in order, in an empty folder."""
    for example, printed in run_pages.run_page(path.read_text(encoding="utf-8"), tmp_path):
        if example.prints:
            assert run_pages.agrees(example.shown, printed), f"{example.code}\nprinted:\n{printed}"


def test_pages_with_examples_are_found() -> None:
    """A page whose examples were no longer seen would pass without being run."""
    found = {path.stem for path in run_pages.pages()}
    assert {"README", "start", "own_robot", "own_data", "diagnose", "python", "own_scene"} <= found


def test_blocks_are_examples_or_text() -> None:
    """Code in a page is of a kind that is run; what is none says that it is text."""
    for path in sorted((ROOT / "docs").rglob("*.md")):
        if not path.name.startswith("add_"):
            text = path.read_text(encoding="utf-8")
            kinds = {block[1] for block in run_pages._BLOCK.finditer(text) if not block[2]}
            assert kinds <= {"console", "python", "toml", "text"}, path


def test_a_block_with_a_title_is_a_file_that_the_reader_saves(tmp_path: Path) -> None:
    """It lies in the folder when the next command runs, with a folder of its own where it names one."""
    page = '```toml title="in/arm.toml"\nname = 1\n```\n\n```console\n$ cat in/arm.toml\nname = 1\n```\n'
    (_, (shown, printed)) = run_pages.run_page(page, tmp_path)
    assert printed == shown.shown == "name = 1\n"


def test_what_is_shown_must_be_what_is_printed() -> None:
    """Other digits do not agree; a line of dots stands for any lines."""
    assert run_pages.agrees("a 1\nb 2\n", "a 1\nb 2\n")
    assert not run_pages.agrees("a 1\nb 2\n", "a 1\nb 3\n")
    assert not run_pages.agrees("", "a 1\n")
    assert run_pages.agrees("a 1\n...\nd\n", "a 1\nb\nc\nd\n")
    assert not run_pages.agrees("a 1\n...\n", "a 2\nb\n")


def test_pages_made_from_code_are_not_stale() -> None:
    """`python scripts/reference_pages.py` would change nothing."""
    pages = script_module("reference_pages")
    for name, text in pages.texts().items():
        assert (ROOT / "docs" / "reference" / name).read_text(encoding="utf-8") == text, name


def test_every_page_is_in_the_sites_navigation() -> None:
    """No page is out of reach."""
    text = (ROOT / "mkdocs.yml").read_text(encoding="utf-8")
    excluded = ROOT / "docs" / "paper"  # `exclude_docs` of mkdocs.yml
    for path in (ROOT / "docs").rglob("*.md"):
        assert excluded in path.parents or f": {path.relative_to(ROOT / 'docs').as_posix()}" in text


def test_the_site_is_built_by_an_extra() -> None:
    """What builds it is named in pyproject.toml."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extra = project["optional-dependencies"]["docs"]
    for name in ("mkdocs-material", "mkdocstrings", "jupytext"):
        assert any(item.startswith(name) and "<" in item for item in extra), name
