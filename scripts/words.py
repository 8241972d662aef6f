"""Measure the words of the pages, of what a user is shown, and of public docstrings.

    python scripts/words.py                    # README, CONTRIBUTING, docs/, then the package
    python scripts/words.py README.md          # pages by name
    python scripts/words.py --package --all    # every offence of strings and docstrings

A sentence ends at a full stop, a question mark or an exclamation mark, or with its paragraph, list item,
heading or cell of a table. Code counts as one word. A page's mean is that of its running text and lists.
The package has no mean. Its docstrings may have more colons, and the code's own terms. In a line that a user
is shown, a place in front ("robot.toml: tendons.left: ...") is no part of the sentence; choices and defaults
at the end are none either.
The exit status is 1 where a page or the package is over.
"""

from __future__ import annotations

import argparse
import ast
import html
import re
import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "catheter_sim"
MOST_WORDS, MOST_MEAN = 35, 20.0
MOST_JOINTS = 1  # colons and semicolons in a sentence
LEAST_WORDS = 4  # of a string that is a text and not a name
# What writes pages in docs/truth, a file to fill in, or parts of a page: their texts are no sentences alone.
NO_TEXTS = ("validation", "examples.py", "page", "lab/forms")
BANNED = ("anew", "stands open", "are told", "as well as what that", "what never", "weighed", "settled")
ONE_TERM = {"truth": "validation", "verb": "command", "twin": "fast model", "surrogate": "fast model"}
SHOWN = frozenset(
    {"InputError", "print", "warn", "debug", "info", "warning", "error", "exception", "critical", "say"}
)
HELP = frozenset({"help", "description", "epilog"})  # keywords of argparse

_CODE, _DOT = "\x00", "\x01"  # stand for a piece of code and for a full stop that ends nothing
_FENCE = re.compile(r"^[ \t]*(`{3,}|~{3,}).*?^[ \t]*\1[`~]*[ \t]*$", re.DOTALL | re.MULTILINE)
_TICKS = re.compile(r"(`+)(?!`).+?(?<!`)\1(?!`)", re.DOTALL)
_DROPPED = re.compile(r"<!--.*?-->|^---\n.*?\n---\n|</?[a-zA-Z][^<>\n]*>|\{:? ?[.#][^}\n]*\}", re.DOTALL)
_IMAGE = re.compile(r"!\[((?:[^][]|\[[^]]*\])*)\]\([^)]*\)")
_LINK = re.compile(r"\[((?:[^][]|\[[^]]*\])*)\](?:\([^)]*\)|\[[^]]*\])")
_ITEM = re.compile(r"(?:[-*+]|\d+[.)])\s+")
_SHORT = re.compile(
    r"\b(?:e\.g|i\.e|cf|vs|approx|al|Eqs?|Figs?|Tabs?|Secs?|Refs?|Nos?|pp|Dr|Prof|St|(?<!\d )[A-Z])\.(?=\s)"
)
_PLACE = re.compile(r"^(?:(?:[^\s:;]+ ){0,2}[^\s:;]+:\s+)+")
_CHOICES = re.compile(
    r"[;,:.] *(?:(?:[\w\x00']+ ){0,3}choices|default)\b.*$|[;,] *(?:[\w']+ ){0,3}[\w']+: \x00\.?$", re.DOTALL
)
_NUMBERED = re.compile(r"(?<=\d)[.:](?=\d)|(?<=[\w\x00]):(?=[\w\x00])|://")
_END = re.compile(r"(?<=[.!?])[\"'”’)\]]*\s+")


@dataclass(frozen=True)
class Block:
    """A piece of text that ends a sentence where it ends.

    Attributes:
        line: where it begins, from 1.
        kind: "text", "item", "heading", "cell", "picture", "shown" or "docstring".
        text: without marks of Markdown; `_CODE` for each piece of code.
    """

    line: int
    kind: str
    text: str


@dataclass(frozen=True)
class Sentence:
    """A sentence.

    Attributes:
        line: where its block begins, from 1.
        kind: of its block.
        text: as it is shown; code as "`..`".
        words: how many.
        offences: what is wrong with it, a short text each.
    """

    line: int
    kind: str
    text: str
    words: int
    offences: tuple[str, ...]


@dataclass(frozen=True)
class Measured:
    """A page, or the strings of a file, measured.

    Attributes:
        name: of the page or file.
        sentences: of it, in order.
        has_mean: whether the mean counts, as in a page.
    """

    name: str
    sentences: tuple[Sentence, ...]
    has_mean: bool = True

    @property
    def mean(self) -> float:
        """Return the mean number of words of running text and lists."""
        counts = [sentence.words for sentence in self.sentences if sentence.kind in ("text", "item")]
        return sum(counts) / max(len(counts), 1)

    @property
    def longest(self) -> int:
        """Return the number of words of the longest sentence."""
        return max((sentence.words for sentence in self.sentences), default=0)

    @property
    def offending(self) -> list[Sentence]:
        """Return the sentences that break a rule."""
        return [sentence for sentence in self.sentences if sentence.offences]

    @property
    def is_over(self) -> bool:
        """Return whether a rule is broken."""
        return bool(self.offending) or (self.has_mean and self.mean > MOST_MEAN)


def blocks_of(markdown: str) -> Iterator[Block]:
    """Yield the blocks of a page's text; blocks of code are none."""
    blank = _FENCE.sub(_lines_kept, markdown)
    blank = _TICKS.sub(lambda found: _CODE + "\n" * found[0].count("\n"), blank)
    blank = _DROPPED.sub(_lines_kept, blank)
    kind, first, parts = "text", 1, list[str]()
    for number, line in enumerate([*blank.splitlines(), ""], 1):
        bare = line.strip().removeprefix(">").strip()
        item = _ITEM.match(bare)
        if not bare or item or bare.startswith(("#", "|", "!!!", "???", "--8<--")):
            if parts:
                yield from _unmarked(Block(first, kind, " ".join(parts)))
            kind, first, parts = "text", number, []
        if bare.startswith("#"):
            yield from _unmarked(Block(number, "heading", bare.lstrip("# ")))
        elif bare.startswith("|"):
            cells = [] if set(bare) <= set("|-: ") else bare.strip("|").split("|")
            for cell in cells:
                yield from _unmarked(Block(number, "cell", cell))
        elif bare and not bare.startswith(("!!!", "???", "--8<--")):
            if item:
                kind = "item"
                bare = bare[item.end() :]
            parts.append(bare)


def _lines_kept(found: re.Match[str]) -> str:
    """Return what takes the place of something dropped: its line breaks."""
    return "\n" * found[0].count("\n")


def _unmarked(block: Block) -> Iterator[Block]:
    """Yield a block without marks; a picture's text is a block of its own."""
    for alternative in _IMAGE.findall(block.text):
        yield Block(block.line, "picture", alternative)
    text = _LINK.sub(r"\1", _IMAGE.sub(" ", block.text))
    text = re.sub(r"\*+|(?<!\w)_+(?=\w)|(?<=\w)_+(?!\w)", "", text).strip()
    if text:
        yield Block(block.line, block.kind, text)


def sentences_of(block: Block) -> Iterator[Sentence]:
    """Yield the sentences of a block."""
    text = " ".join(html.unescape(block.text).split())
    text = _SHORT.sub(lambda found: found[0][:-1] + _DOT, text)
    text = re.sub(r"\.\.\.(?=\s+[a-z(]|\))", _DOT * 3, text)
    if block.kind == "shown":
        text = _CHOICES.sub("", _PLACE.sub("", text))
    for part in _END.split(text):
        words = sum(any(sign.isalnum() or sign == _CODE for sign in word) for word in part.split())
        if words:
            shown = part.replace(_CODE, "`..`").replace(_DOT, ".")
            yield Sentence(block.line, block.kind, shown, words, tuple(_offences(part, words, block.kind)))


def _offences(text: str, words: int, kind: str) -> Iterator[str]:
    """Yield what is wrong with a sentence."""
    if words > MOST_WORDS:
        yield f"{words} words"
    for phrase in BANNED:
        if re.search(rf"\b{phrase}\b", text, re.IGNORECASE):
            yield f"'{phrase}'"
    if kind == "docstring":
        return
    within = _NUMBERED.sub("", text).rstrip("; ")  # one that parts items of a list is no joint
    joints = sum(within.count(sign) for sign in ":;")
    if joints > MOST_JOINTS:
        yield f"{joints} colons and semicolons"
    for term, better in ONE_TERM.items():
        if re.search(rf"\b{term}s?\b", text, re.IGNORECASE):
            yield f"'{term}': say {better}"


def of_page(path: Path) -> Measured:
    """Return a page of Markdown, measured."""
    sentences = (s for block in blocks_of(path.read_text(encoding="utf-8")) for s in sentences_of(block))
    return Measured(_named(path), tuple(sentences))


def of_code(path: Path) -> list[Measured]:
    """Return what a file of the package says, measured: shown lines, public docstrings, and its texts."""
    found = [of_strings(path), of_docstrings(path)]
    below = path.relative_to(PACKAGE).as_posix() if path.is_relative_to(PACKAGE) else path.name
    return found if below.startswith(NO_TEXTS) else [*found, of_texts(path)]


def of_strings(path: Path) -> Measured:
    """Return what a user is shown by a file's code, measured: errors, warnings, prints, help."""
    found = (Block(line, "shown", text) for line, text in shown_by(ast.parse(path.read_text("utf-8"))))
    return Measured(_named(path), tuple(s for block in found for s in sentences_of(block)), has_mean=False)


def of_docstrings(path: Path) -> Measured:
    """Return the public docstrings of a file, measured."""
    sentences: list[Sentence] = []
    for line, text in docstrings_of(ast.parse(path.read_text("utf-8"))):
        for block in _blocks_of_docstring(text):
            sentences += sentences_of(Block(line, "docstring", block))
    return Measured(_named(path), tuple(sentences), has_mean=False)


def of_texts(path: Path) -> Measured:
    """Return all texts of a file's code of four words or more, such as those of reports, measured."""
    found = (Block(line, "docstring", text) for line, text in texts_of(ast.parse(path.read_text("utf-8"))))
    return Measured(_named(path), tuple(s for block in found for s in sentences_of(block)), has_mean=False)


def texts_of(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Yield line and text of the strings of four words or more that are no docstrings."""
    nodes: list[ast.AST] = [tree]
    while nodes:
        node = nodes.pop()
        if isinstance(node, ast.JoinedStr) or (
            isinstance(node, ast.Constant) and isinstance(node.value, str)
        ):
            text = "".join(_literal(node))
            if len(text.split()) >= LEAST_WORDS:
                yield getattr(node, "lineno", 1), text
        else:
            nodes += [
                child
                for child in ast.iter_child_nodes(node)
                if not (isinstance(child, ast.Expr) and isinstance(child.value, ast.Constant))
            ]


def shown_by(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Yield line and text of the strings that calls hand to a user; a filled-in value is a piece of code."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Call):
            values = [word.value for word in node.keywords if word.arg in HELP]
            name = getattr(node.func, "attr", getattr(node.func, "id", ""))
            if name in SHOWN:
                values += node.args
            for value in values:
                text = "".join(_literal(value))
                if any(sign.isalpha() for sign in text):
                    yield value.lineno, text


def _literal(node: ast.AST) -> Iterator[str]:
    """Yield the texts of an expression in order."""
    if isinstance(node, ast.Constant):
        yield node.value if isinstance(node.value, str) else ""
    elif isinstance(node, ast.FormattedValue | ast.Call):
        yield _CODE
    else:
        for child in ast.iter_child_nodes(node):
            yield from _literal(child)


def docstrings_of(tree: ast.Module, public: bool = True) -> Iterator[tuple[int, str]]:
    """Yield line and text of the docstrings of a module and of its public classes, functions and methods."""
    nodes: list[ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef] = [tree]
    while nodes:
        node = nodes.pop()
        text = ast.get_docstring(node)
        if text:
            yield getattr(node, "lineno", 1), text
        if not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            nodes += [
                child
                for child in node.body
                if isinstance(child, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef)
                and not (public and child.name.startswith("_"))
            ]


def _blocks_of_docstring(text: str) -> Iterator[str]:
    """Yield a docstring's paragraphs and entries; examples and headings of sections are none."""
    text = _TICKS.sub(_CODE, _FENCE.sub("", text))
    parts: list[str] = []
    section = example = False
    first = 0  # indentation of the block's first line
    for line in [*text.splitlines(), ""]:
        bare = line.strip()
        indent = len(line) - len(line.lstrip())
        example = bool(bare) and (example or bare.startswith(">>>"))
        heads = re.fullmatch(r"[A-Z]\w+:", bare) is not None
        entry = section and indent == 4
        listed = not section and indent > 0 and (first == 0 or indent <= first)
        if not bare or example or heads or entry or listed or bare.startswith("|") or _ITEM.match(bare):
            if parts:
                yield " ".join(parts)
            parts = []
        section = heads or (section and (not bare or line.startswith(" ")))
        if bare and not example and not heads and not bare.startswith("|"):
            first = first if parts else indent
            # The name of an entry is no part of its sentence.
            parts.append(re.sub(r"^[\w *,/()-]+?: ", "", bare) if entry else bare)


def _named(path: Path) -> str:
    return path.relative_to(ROOT).as_posix() if path.is_relative_to(ROOT) else str(path)


def pages() -> list[Path]:
    """Return the README, what is expected of a change, and the pages of the documentation."""
    return [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]


def _print_page(page: Measured, at_most: int) -> None:
    bad = page.offending
    mean = f"{page.mean:4.1f}" if page.has_mean else "   -"
    print(f"{'over' if page.is_over else 'ok':5} {mean} {page.longest:4} {len(bad):4}  {page.name}")
    for sentence in bad[:at_most]:
        print(f"      line {sentence.line}: {', '.join(sentence.offences)}: {sentence.text}")


def main(arguments: Iterable[str] | None = None) -> int:
    """Print each page's mean, longest sentence and offences; return 1 where one is over."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("pages", metavar="PAGE.md", nargs="*", type=Path, help="pages; else all")
    parser.add_argument("--package", action="store_true", help="measure the package's strings and docstrings")
    parser.add_argument("--all", action="store_true", help="print every offence, not only three of a page")
    options = parser.parse_args(None if arguments is None else list(arguments))
    measured = [of_page(path.resolve()) for path in options.pages]
    if not options.pages and not options.package:
        measured = [of_page(path) for path in pages()]
    if options.package or not options.pages:
        for path in sorted(PACKAGE.rglob("*.py")):
            measured += [item for item in of_code(path) if item.is_over]
    print("state mean most  bad  page")
    for item in measured:
        _print_page(item, sys.maxsize if options.all else 3)
    over = sum(item.is_over for item in measured)
    print(
        f"{over} of {len(measured)} over: at most {MOST_MEAN:g} words in the mean, {MOST_WORDS} in a sentence"
    )
    return 1 if over else 0


if __name__ == "__main__":
    sys.exit(main())
