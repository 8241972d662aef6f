"""The frame that all pages fill, and the checks by which they are judged: each fault is found."""

from __future__ import annotations

import pytest
from page_checks import read_page

GOOD = """<!DOCTYPE html><html><head>
<meta name="viewport" content="width=device-width, initial-scale=1">
<style>img { max-width: 100%; } .scroll { overflow-x: auto; } main { max-width: 880px; }</style></head>
<body><p>About 3.5 mm, i.e. little. Next: <code>a_b.csv</code></p>
<div class="scroll"><table><tr><td>1</td></tr></table></div>
<img alt="two words" src="data:image/png;base64,"></body></html>"""


def test_a_good_page_has_no_fault() -> None:
    """Numbers, abbreviations and files shown as files are no keys."""
    page = read_page(GOOD)
    assert page.problems == []
    assert page.seen.startswith("About 3.5 mm, i.e. little.")


@pytest.mark.parametrize(
    ("good", "bad", "says"),
    [
        ("width=device-width", "width=1024", "viewport"),
        ('class="scroll"', 'class="box"', "scrolling box"),
        ("overflow-x: auto", "overflow-x: hidden", "do not scroll"),
        ("max-width: 100%", "height: auto", "wider than the screen"),
        ("max-width: 880px", "width: 880px", "a style of 880 px"),
        ("max-width: 880px", "min-width: 400px", "a style of 400 px"),
        ("<p>", '<p style="width: 500px">', "<p> is 500 px wide"),
        ("<img ", '<img width="600" ', "<img> is 600 px wide"),
        ("two words", "", "a picture with the words"),
        ("two words", "of tip_x_mm now", "raw key in a picture"),
        ("little", "actuation_gain.scale", "a raw key: actuation_gain"),
        ("little", "friction.mu", "a raw key: friction.mu"),
        ("little", "tip_x_mm", "a raw key: tip_x_mm"),
        ("</table>", "", "closes <table>"),
        ("src=", 'srcset="" src="https://example.org/a.png" title=', "another machine"),
        ("<p>", '<script src="a.js"></script><p>', "<script>"),
    ],
)
def test_every_fault_is_found(good: str, bad: str, says: str) -> None:
    """Of a good page with one fault planted."""
    assert GOOD.count(good) >= 1
    problems = read_page(GOOD.replace(good, bad, 1)).problems
    assert any(says in problem for problem in problems), problems
