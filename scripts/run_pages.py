"""Run the examples of the documentation's pages, and compare or rewrite what stands below them.

    python scripts/run_pages.py [--write] [PAGE.md ...]     default: the README and every page with examples

A page's blocks are run in order in one empty folder. A block `console` has commands, each after `$ `, and
what they print on standard output; a line `...` stands for any lines. A block `python` is run in one
interpreter a page, and prints what the block `text` right below it shows, or nothing. A block `toml` is
read as TOML. A block with a title (```toml title="arm.toml") is a file that the reader saves under this name.
Pages `add_*.md` have a way of their own (`tests/docs/test_guides.py`).
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
DOCS = ROOT / "docs"
_BLOCK = re.compile(r'^```(\w*)(?: title="([^"\n]+)")?\n(.*?)^```$', re.DOTALL | re.MULTILINE)
_BELOW = re.compile(r"\s*^```(?:text)?\n(.*?)^```$", re.DOTALL | re.MULTILINE)
_INCLUDED = re.compile(r'^--8<-- "(.+)"$', re.MULTILINE)
ANY = "..."
LONGEST_S = 600.0  # of a command


@dataclass(frozen=True)
class Example:
    """One example of a page.

    Attributes:
        kind: "console", "python", "toml", or "file", which is saved.
        code: a command, or a block.
        shown: what stands below it.
        span: of what is shown, in the page's text.
        name: of the file, relative to the folder.
    """

    kind: str
    code: str
    shown: str
    span: tuple[int, int]
    name: str = ""

    @property
    def prints(self) -> bool:
        """Whether it prints something that the page shows."""
        return self.kind in ("console", "python")


def pages() -> list[Path]:
    """Return the pages that have examples of their own."""
    found = [DOCS.parent / "README.md", *sorted(DOCS.rglob("*.md"))]
    return [
        path for path in found if not path.name.startswith("add_") and examples_of(path.read_text("utf-8"))
    ]


def examples_of(text: str) -> list[Example]:
    """Return the examples in a page's text, in order."""
    found: list[Example] = []
    for block in _BLOCK.finditer(text):
        kind, name, code = block.groups()
        if name:
            found.append(Example("file", code, "", (block.end(), block.end()), name))
        elif kind == "console":
            found += _commands(code, block.start(3))
        elif kind == "python":
            below = _BELOW.match(text, block.end())
            shown, span = (below[1], below.span(1)) if below else ("", (block.end(), block.end()))
            found.append(Example(kind, code, shown, span))
        elif kind == "toml":
            found.append(Example(kind, code, "", (block.end(), block.end())))
    return found


def _commands(code: str, start: int) -> Iterator[Example]:
    """Yield the commands of a console block, each with what stands below it."""
    parts = re.split(r"^\$ (.*)\n", code, flags=re.MULTILINE)
    at = start + len(parts[0])
    for command, shown in zip(parts[1::2], parts[2::2], strict=True):
        at += len(command) + 3
        yield Example("console", command, shown, (at, at + len(shown)))
        at += len(shown)


def run_page(text: str, folder: Path) -> list[tuple[Example, str]]:
    """Return the examples of a page with what each printed, run in `folder`.

    Raises:
        RuntimeError: an example failed; the message has what it said.
    """
    names: dict[str, object] = {"__name__": "__main__"}
    return [(example, _ran(example, folder, names)) for example in examples_of(text)]


def _ran(example: Example, folder: Path, names: dict[str, object]) -> str:
    if example.kind == "file":
        path = folder / example.name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(example.code, encoding="utf-8")
        return ""
    if example.kind == "toml":
        included = _INCLUDED.findall(example.code)
        tomllib.loads((ROOT / included[0]).read_text(encoding="utf-8") if included else example.code)
        return ""
    if example.kind == "python":
        return _python(example.code, folder, names)
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    ran = subprocess.run(
        ["bash", "-ec", example.code],
        cwd=folder,
        env=os.environ | {"PATH": path},
        capture_output=True,
        text=True,
        timeout=LONGEST_S,
    )
    if ran.returncode:
        raise RuntimeError(f"$ {example.code}\n{ran.stdout}{ran.stderr}")
    return ran.stdout


def _python(code: str, folder: Path, names: dict[str, object]) -> str:
    import contextlib
    import io

    printed, before = io.StringIO(), Path.cwd()
    os.chdir(folder)
    try:
        with contextlib.redirect_stdout(printed):
            exec(compile(code, "<page>", "exec"), names)
    finally:
        os.chdir(before)
    return printed.getvalue()


def agrees(shown: str, printed: str) -> bool:
    """Return whether a block shows what was printed; `...` alone on a line stands for any lines."""
    pattern = "".join(
        r"(?:.*\n)*?" if line == ANY else re.escape(line.rstrip()) + r"[ ]*\n" for line in shown.splitlines()
    )
    return (
        re.fullmatch(pattern, printed if printed.endswith("\n") or not printed else f"{printed}\n")
        is not None
    )


def rewritten(text: str, ran: list[tuple[Example, str]]) -> str:
    """Return a page's text with what its examples print now; what is elided stays so."""
    for example, printed in reversed(ran):
        if example.prints and not agrees(example.shown, printed):
            start, end = example.span
            lines = "".join(f"{line.rstrip()}\n" for line in printed.splitlines())
            if example.kind == "python" and not example.shown:
                lines = f"\n\n```text\n{lines}```"
            text = text[:start] + lines + text[end:]
    return text


def main() -> int:
    """Run the pages; say which differ, or write them anew."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("pages", metavar="PAGE.md", nargs="*", type=Path)
    parser.add_argument("--write", action="store_true", help="put what is printed now into the pages")
    options = parser.parse_args()
    wrong = 0
    for path in options.pages or pages():
        text = path.read_text(encoding="utf-8")
        with tempfile.TemporaryDirectory() as folder:
            ran = run_page(text, Path(folder))
        for example, printed in ran:
            if example.prints and not agrees(example.shown, printed):
                wrong += not options.write
                print(f"{path}: {example.code.strip().splitlines()[0][:80]}: printed otherwise:\n{printed}")
        if options.write:
            path.write_text(rewritten(text, ran), encoding="utf-8")
        print(f"{path}: {len(ran)} examples ran")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
