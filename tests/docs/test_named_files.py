"""Every file that a page names is there."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"), *ROOT.glob("assets/**/*.md")])
_PATH = re.compile(r"[\w/<>-]+\.py\b|(?:catheter_sim|tests|scripts)/[\w/<>.-]+")
_ROOTS = (ROOT, ROOT / "catheter_sim", ROOT / "tests")
_NAMES = {path.name for path in (ROOT / "catheter_sim").rglob("*.py")}
# A user's own file, and environments' ids.
_NO_FILES = ("my_", "catheter_sim/Neuroendoscope", "catheter_sim/<Robot><Task>")


def missing_in(text: str) -> list[str]:
    """Return what stands in code marks, reads as a path of this repository and is none."""
    marked = " ".join(re.findall(r"`([^`\n]+)`", text))
    named = [path.rstrip(".") for path in _PATH.findall(marked)]
    return [path for path in named if not path.startswith(_NO_FILES) and not _is_there(path)]


def _is_there(path: str) -> bool:
    if "<" in path:
        pattern = re.sub(r"<\w+>", "*", path.rstrip("/"))
        return any(next(root.glob(pattern), None) for root in _ROOTS)
    return path in _NAMES or any((root / path).exists() for root in _ROOTS)


@pytest.mark.parametrize("page", PAGES, ids=lambda path: str(path.relative_to(ROOT)))
def test_files_that_a_page_names_are_there(page: Path) -> None:
    """With `<kind>` for any folder."""
    assert missing_in(page.read_text(encoding="utf-8")) == []


def test_a_file_that_moved_is_noticed() -> None:
    """A path, one with a placeholder, and a file's name alone; what is there is not told."""
    text = "`robots/<kind>/gone.py`, `nowhere.py`, `catheter_sim/gone/`, `robots/<kind>/twin.py`"
    assert missing_in(text) == ["robots/<kind>/gone.py", "nowhere.py", "catheter_sim/gone/"]
