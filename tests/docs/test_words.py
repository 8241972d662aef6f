"""Claims about the words: pages keep to the rules of `scripts/words.py`, which notices what breaks them."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from tests.scripts_as_modules import script_module

words = script_module("words")
ROOT = Path(__file__).resolve().parents[2]
# Pages that are not within the rules yet: a list that only shrinks. A new page is held to them.
_NOT_YET: dict[str, list[str]] = {}
NOT_YET = [ROOT / folder / f"{name}.md" for folder, names in _NOT_YET.items() for name in names]


def measured(text: str) -> list[tuple[str, int, tuple[str, ...]]]:
    """Return text, words and offences of the sentences of a page's text."""
    found = [sentence for block in words.blocks_of(text) for sentence in words.sentences_of(block)]
    return [(sentence.text, sentence.words, sentence.offences) for sentence in found]


def offences(text: str) -> list[str]:
    """Return all offences of a page's text."""
    return [offence for _, _, found in measured(text) for offence in found]


@pytest.mark.parametrize(
    "path",
    [path for path in words.pages() if path not in NOT_YET],
    ids=lambda path: path.stem,
)
def test_a_page_is_within_the_rules(path: Path) -> None:
    """At most 20 words in the mean of a page, 35 in a sentence, one colon; one term for each thing."""
    page = words.of_page(path)
    assert page.sentences
    bad = [f"line {item.line}: {', '.join(item.offences)}: {item.text}" for item in page.offending]
    assert bad == []
    assert page.mean <= words.MOST_MEAN


@pytest.mark.slow
def test_the_package_is_within_the_rules() -> None:
    """What a user is shown, public docstrings, and the texts of reports: no long sentence, no banned word."""
    files = sorted(words.PACKAGE.rglob("*.py"))
    assert len(files) > 100
    bad = [
        f"{item.name}:{sentence.line}: {', '.join(sentence.offences)}: {sentence.text}"
        for path in files
        for item in words.of_code(path)
        for sentence in item.offending
    ]
    assert bad == []


def test_pages_that_are_not_held_yet_are_there() -> None:
    """A page that was moved is held."""
    assert [path for path in NOT_YET if not path.exists()] == []


@pytest.mark.parametrize(
    ("text", "offence"),
    [
        (f"{'word ' * 36}ends.", "37 words"),
        (f"- {'word ' * 36}in an item", "39 words"),
        (f"| {'word ' * 36} | short |\n", "36 words"),
        ("It has this: a part; another part.", "2 colons and semicolons"),
        ("Draw the robot anew.", "'anew'"),
        ("The verdict stands\nopen.", "'stands open'"),
        ("The truth of it.", "'truth': say validation"),
        ("These verbs [are told](a.md) to you.", "'are told'"),
        ("It moves the fast twin.", "'twin': say fast model"),
    ],
)
def test_a_planted_sentence_is_noticed(text: str, offence: str) -> None:
    """By itself, and between sentences that are right."""
    assert offence in offences(text)
    assert offence in offences(f"# A head\n\nThis is right.\n\n{text}\n\nSo is this.\n")


def test_a_page_of_long_sentences_is_over(tmp_path: Path) -> None:
    """Its mean counts text and lists, so that short cells of tables hide nothing; the exit status says it."""
    page = tmp_path / "page.md"
    sentence = f"{'word ' * 20}word.\n\n"
    page.write_text(sentence * 3 + "| a | b |\n|---|---|\n" + "| 1 | 2 |\n" * 9)
    assert words.of_page(page).mean == 21.0
    assert not words.of_page(page).offending
    assert words.main([str(page)]) == 1
    page.write_text(sentence.replace("word word ", "") * 3)
    assert words.main([str(page)]) == 0


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("The tip moves by 0.5 mm. It rests.", ["The tip moves by 0.5 mm.", "It rests."]),
        ("See Eq. (3), e.g. by Rao et al. 2021, Fig. 4.", ["See Eq. (3), e.g. by Rao et al. 2021, Fig. 4."]),
        ("It takes 4 N. Rods bend.", ["It takes 4 N.", "Rods bend."]),
        ("York P. A. did.", ["York P. A. did."]),
        ("`run` stops. `list` does not!", ["`..` stops.", "`..` does not!"]),
        ('He says "no." [It](a.md) is.', ['He says "no.', "It is."]),
        ("- one\n- two\n  more\n\n1. three", ["one", "two more", "three"]),
        ("# Head\ntext", ["Head", "text"]),
        ("![alt. text](a.png) beside", ["alt.", "text", "beside"]),
        ("Before:\n\n```text\na; b; c: d\n```\n\nafter", ["Before:", "after"]),
        ("<!-- a; b: c; -->**Bold.** _so_ <b>on</b>", ["Bold.", "so on"]),
        ("Lists, tables ... and more.", ["Lists, tables ... and more."]),
    ],
)
def test_sentences_are_split(text: str, found: list[str]) -> None:
    """At full stops that end one, at marks, and where a block ends; code and comments are no words."""
    assert [sentence for sentence, _, _ in measured(text)] == found


def test_what_parts_items_is_no_joint() -> None:
    """At an item's end alone."""
    assert not offences("- this: one;\n- that: two;\n")
    assert offences("- this: one; two\n")


def test_code_is_one_word_and_a_ratio_no_colon() -> None:
    """So are a time of day and an address."""
    ((_, count, found),) = measured("At 10:30 `a b c; d: e` has 2:1, see https://here.example: two.")
    assert count == 8
    assert found == ()


CODE = '''
def _hidden():
    """Draw anew."""

def public(name):
    """Draw anew.

    Args:
        name: the thing; of what: of {name}.

    >>> anew
    """
    warn(f"a word: {name} has no end; no start: none")
    raise InputError(f"{path}: tendons.{name}: is not there; choices: a, b")
'''


def test_strings_that_reach_a_user_are_found_by_the_syntax_tree(tmp_path: Path) -> None:
    """Names in the code are none; a place in front and the choices are no sentence."""
    (tmp_path / "code.py").write_text(CODE)
    (warned, raised) = words.of_strings(tmp_path / "code.py").sentences
    assert warned.offences == ("2 colons and semicolons",)
    assert (raised.text, raised.offences) == ("is not there", ())


def test_texts_of_reports_are_found(tmp_path: Path) -> None:
    """Wherever they stand; names, short strings and texts below numbers are none."""
    code = '_SAID = {"key": f"the robot {name} is drawn anew"}\nNUMBER = 1\n"""[rows] Drawn anew here."""\n'
    (tmp_path / "code.py").write_text(code)
    assert [item.offences for item in words.of_texts(tmp_path / "code.py").sentences] == [("'anew'",)]


def test_public_docstrings_are_measured(tmp_path: Path) -> None:
    """Private ones and examples are not."""
    (tmp_path / "code.py").write_text(CODE)
    found = words.of_docstrings(tmp_path / "code.py").sentences
    assert [(item.text, item.offences) for item in found] == [
        ("Draw anew.", ("'anew'",)),
        ("the thing; of what: of {name}.", ()),
    ]
    assert not list(words.docstrings_of(ast.parse("x = 'anew'")))
