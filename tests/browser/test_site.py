"""The site: built without a warning, version and commit on each page, a search that works from a folder."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import catheter_sim as cs

ROOT = Path(__file__).resolve().parents[2]
TUTORIALS = sorted((ROOT / "docs" / "tutorials").glob("*.md"))


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The site, built with warnings as errors."""
    for needed in ("material", "mkdocstrings", "jupytext"):
        pytest.importorskip(needed, reason=f"{needed}, of the extra docs, builds the site")
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "-d", str(folder)]
    variables = os.environ | {"NO_MKDOCS_2_WARNING": "1"}
    ran = subprocess.run(command, cwd=ROOT, env=variables, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    assert "WARNING" not in ran.stdout + ran.stderr
    return folder


@pytest.mark.slow
def test_each_page_says_version_and_commit_and_leads_on(site: Path) -> None:
    """Below it; with the pages before and after it; a page that moved leads to where it is."""
    found = [path for path in site.rglob("*.html") if path.name not in ("404.html", "faq.html")]
    assert len(found) > 100
    for path in found:
        text = path.read_text(encoding="utf-8")
        assert f"catheter_sim {cs.__version__}, " in text, path
        assert "md-footer__link" in text, path
    assert "when_it_goes_wrong.html" in (site / "faq.html").read_text(encoding="utf-8")
    assert {path.name for path in site.rglob("*.ipynb")} == {f"{path.stem}.ipynb" for path in TUTORIALS}


@pytest.mark.slow
@pytest.mark.parametrize("word", ["Windows", "FAQ", "backlash", "cs.simulate"])
def test_a_word_is_found_from_a_folder(site: Path, word: str, page: Any) -> None:
    """The page lies on the disk: no server, and no request to a network."""
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    page.goto((site / "index.html").as_uri())
    page.click("input.md-search__input")
    page.keyboard.type(word, delay=20)
    page.wait_for_selector(".md-search-result__item", timeout=30_000)
    assert word.lower() in page.locator(".md-search-result__item").first.inner_text().lower()
    assert all(url.startswith("file:") for url in asked)


@pytest.mark.slow
def test_the_rows_of_a_long_page_are_filtered(site: Path, page: Any) -> None:
    """By words of the row or of the heading above it; without words all rows are there."""
    page.goto((site / "truth" / "validation.html").as_uri())
    rows = page.locator("tbody tr")
    count = rows.count()
    page.fill(".rows-filter", "chest_tube_section refuted")
    left = [row.inner_text() for row in rows.all() if row.is_visible()]
    assert 0 < len(left) < count
    assert all("refuted" in row for row in left)
    page.fill(".rows-filter", "")
    assert all(row.is_visible() for row in rows.all())
