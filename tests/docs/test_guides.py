"""The guides' code runs as it stands, in one fresh interpreter a guide, and prints what stands below it."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "catheter_sim"
GUIDES = sorted((ROOT / "docs" / "guides").glob("add_*.md"))
_MARK = "-- end of a block --"


def blocks_of(text: str) -> list[tuple[str, str]]:
    """Return the Python blocks of a guide, each with the output that stands below it."""
    found: list[tuple[str, str]] = []
    for kind, content in re.findall(r"^```(\w*)\n(.*?)^```$", text, re.DOTALL | re.MULTILINE):
        if kind == "python":
            found.append((content, ""))
        elif not kind and found and not found[-1][1]:
            found[-1] = (found[-1][0], content)
    return found


def placed(code: str, copy: Path) -> bool:
    """Put a block that names a file of the package into a copy of it; return whether it does."""
    named = re.match(r"# (catheter_sim/\S+\.py)\n", code)
    if named is None:
        return False
    file = copy / named[1]
    if file == copy / "catheter_sim" / "robots" / "__init__.py":
        (kind,) = re.findall(r"import KIND as (\w+)", code)
        text = file.read_text(encoding="utf-8")
        code = text.replace("\nKINDS:", f"\n{code}\nKINDS:").replace(
            "    for kind in (\n", f"    for kind in (\n        {kind},\n"
        )
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(code, encoding="utf-8")
    return True


@pytest.mark.slow
@pytest.mark.parametrize("guide", GUIDES, ids=lambda path: path.stem)
def test_guide_does_what_it_says(guide: Path, tmp_path: Path) -> None:
    """Every block runs after the ones before it, or is a new file; it prints the block below, or nothing."""
    blocks = blocks_of(guide.read_text(encoding="utf-8"))
    assert any(output for _, output in blocks)
    shutil.copytree(PACKAGE, tmp_path / PACKAGE.name, ignore=shutil.ignore_patterns("__pycache__"))
    run = [(code, output) for code, output in blocks if not placed(code, tmp_path)]
    script = tmp_path / "guide.py"
    script.write_text(f"\nprint({_MARK!r})\n".join(code for code, _ in run), encoding="utf-8")
    ran = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, cwd=tmp_path)
    assert ran.returncode == 0, ran.stderr
    assert ran.stdout.split(f"{_MARK}\n") == [output for _, output in run]


def test_every_guide_is_there() -> None:
    """There is a guide for each thing that may be added, and the README leads to it."""
    names = {path.stem for path in GUIDES}
    assert {"add_a_kind", "add_an_effect", "add_a_form", "add_a_static_model"} <= names
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    for guide in GUIDES:
        assert f"docs/guides/{guide.name}" in readme
        assert max(len(line) for line in guide.read_text(encoding="utf-8").splitlines()) <= 120
