"""The documentation lists the forms as they are."""

from __future__ import annotations

from pathlib import Path

from hidden_effects.natural import forms_table

PAGE = Path(__file__).parents[4] / "docs" / "truth" / "independent_bench.md"


def test_documentation_lists_every_form():
    """The table on the page is the one that the list of forms gives."""
    assert forms_table() in PAGE.read_text()
