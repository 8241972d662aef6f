"""Valid texts made wrong: one draw of a random generator, one to three mutations."""

from __future__ import annotations

import random
import re
from collections.abc import Callable

# Numbers that break what was not thought of: huge, tiny, negative, not finite, or no number at all.
NUMBERS = (
    "0", "-1", "1", "2", "-0.0", "nan", "inf", "-inf", "1e308", "-1e308", "1e-308", "5e-324", "1e999",
    "1e16", "123456789012", "1" + "0" * 400, "1" + "0" * 5000, "0x" + "f" * 400, "1_000", "1e", "--1", "+5",
    "1.7e9", "1700000000.123", "0.1", "1e-9", "1e9", "2000", "20000", "١٢", "", " ", ".", "0b101", "007",
)  # fmt: skip
VALUES = (
    *NUMBERS,
    "true",
    '""',
    '"x"',
    '"../x"',
    '"a/b"',
    '"\\u0000"',
    '"nan"',
    "[]",
    "{}",
    "[1, 2]",
    "[[1.0]]",
    "{a = 1}",
    "1979-05-27T07:32:00Z",
    "[" * 40 + "]" * 40,
    "[" * 1500 + "]" * 1500,
    '"' + "long" * 25_000 + '"',
    "'''\nlines\n'''",
)
PIECES = (
    "\x00", "\n", "\r", "\t", ",", ";", '"', "'", "[", "]", "[[", "]]", "=", ".", "#", "/", "\\", "%s", "{0}",
    "\ufeff", "é", "中文", "\u202e", "😀", "time_s", "a." * 2000 + "b = 1\n", "x" * 2000, "0" * 300,
    "[effects.rate]\nlag_s = 0.2\n", "[[segments]]\n", "[[tendons]]\n", "[friction]\n",
    "kind = 'rolling'\n", "kind = 'catheter'\n",
)  # fmt: skip
_NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?![\w.])")
_WORD = re.compile(r"\w+")


def mutated(text: str, draw: random.Random) -> bytes:
    """Return `text` after one to three mutations, as bytes that may be no UTF-8."""
    for _ in range(draw.randint(1, 3)):
        text = draw.choice(MUTATIONS)(text, draw)
    data = bytearray(text.encode("utf-8", "surrogatepass"))
    if data and draw.random() < 0.15:
        for _ in range(draw.randint(1, 4)):
            data[draw.randrange(len(data))] ^= 1 << draw.randrange(8)
    return bytes(data)


def _replaced(pattern: re.Pattern[str], choices: tuple[str, ...], text: str, draw: random.Random) -> str:
    found = list(pattern.finditer(text))
    if not found:
        return text
    place = draw.choice(found)
    return text[: place.start()] + draw.choice(choices) + text[place.end() :]


def other_number(text: str, draw: random.Random) -> str:
    """Replace a number by one that breaks things."""
    return _replaced(_NUMBER, NUMBERS, text, draw)


def scaled_number(text: str, draw: random.Random) -> str:
    """Multiply a number by a power of ten, up or down: possible, and wrong."""
    found = list(_NUMBER.finditer(text))
    if not found:
        return text
    place = draw.choice(found)
    number = float(place[0]) * draw.choice([-1.0, 1e-6, 1e-3, 0.1, 10.0, 1e3, 1e6])
    return f"{text[: place.start()]}{number!r}{text[place.end() :]}"


def other_type(text: str, draw: random.Random) -> str:
    """Replace what stands behind an equals sign, or a number, by something of another type."""
    return _replaced(draw.choice([re.compile(r"(?<== ).*"), _NUMBER]), VALUES, text, draw)


def inserted(text: str, draw: random.Random) -> str:
    """Put a piece of text anywhere."""
    place = draw.randint(0, len(text))
    return text[:place] + draw.choice(PIECES) + text[place:]


def cut_out(text: str, draw: random.Random) -> str:
    """Leave out a span, short or long."""
    start = draw.randint(0, len(text))
    return text[:start] + text[start + draw.choice([1, 2, 10, 100, 10**6]) :]


def lines_changed(text: str, draw: random.Random) -> str:
    """Leave out a line, or write it again, once, elsewhere or a thousand times."""
    lines = text.split("\n")
    place = draw.randrange(len(lines))
    how = draw.randrange(5)
    if how == 0:
        del lines[place]
    elif how == 1:
        lines.insert(place, lines[place])
    elif how == 2:
        lines.insert(draw.randrange(len(lines)), lines[place])
    elif how == 3:
        lines[place:place] = [lines[place]] * 1000
    else:
        other = draw.randrange(len(lines))
        lines[place], lines[other] = lines[other], lines[place]
    return "\n".join(lines)


def words_swapped(text: str, draw: random.Random) -> str:
    """Exchange two words, keys, names or numbers."""
    found = list(_WORD.finditer(text))
    if len(found) < 2:
        return text
    first, second = sorted(draw.sample(found, 2), key=lambda place: place.start())
    middle = text[first.end() : second.start()]
    return text[: first.start()] + second[0] + middle + first[0] + text[second.end() :]


def word_changed(text: str, draw: random.Random) -> str:
    """Write a word wrongly, empty or very long."""
    words = ("", "x", "nan", "name", "1", "x" * 100_000, "é", "a b", "__class__", "CON")
    return _replaced(_WORD, words, text, draw)


MUTATIONS: tuple[Callable[[str, random.Random], str], ...] = (
    other_number,
    other_number,
    scaled_number,
    scaled_number,
    other_type,
    other_type,
    inserted,
    cut_out,
    lines_changed,
    words_swapped,
    word_changed,
)
