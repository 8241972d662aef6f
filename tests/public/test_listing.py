"""One list of rows is what text, HTML and JSON show; the command line's `list` is fed by the same."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest

import catheter_sim as cs
from catheter_sim.public.data import Listing, listing_of

ROWS = Listing(
    "Two <rows>",
    ("name", "value", "of"),
    ({"name": "a<b", "value": 1.23456789, "of": ("x", "y")}, {"name": "c", "value": float("inf"), "of": ()}),
)


def test_text_html_and_json_show_the_same_cells() -> None:
    """Every cell of the text stands in the HTML, escaped; JSON holds the values themselves."""
    header, *lines = str(ROWS).splitlines()
    assert header.split() == ["name", "value", "of"]
    assert [re.split(r" {2,}", line) for line in lines] == [["a<b", "1.23457", "x, y"], ["c", "inf"]]
    shown = ROWS._repr_html_()
    assert "<td>a&lt;b</td><td>1.23457</td><td>x, y</td>" in shown
    assert "Two &lt;rows&gt;" in shown
    assert json.loads(ROWS.to_json()) == [
        {"name": "a<b", "value": 1.23456789, "of": ["x", "y"]},
        {"name": "c", "value": "inf", "of": []},
    ]


def test_listing_is_a_sequence_of_rows() -> None:
    """It has a length, rows by index, and columns by name."""
    assert len(ROWS) == 2
    assert ROWS[1]["name"] == "c"
    assert [row["name"] for row in ROWS] == ROWS.column("name") == ["a<b", "c"]
    made = listing_of("T", {"time_s": np.array([0.0, 1.0]), "x": ["a", "b"]})
    assert made[1] == {"time_s": 1.0, "x": "b"}


def test_long_listing_is_cut_in_a_notebook() -> None:
    """HTML shows the first rows, and says how many more there are."""
    shown = listing_of("Many", {"k": list(range(50))})._repr_html_()
    assert "<p>20 more rows</p>" in shown


@pytest.mark.slow
def test_lists_are_those_of_the_command_line() -> None:
    """Robots, models, environments and effects are the rows that `catheter-sim list --json` shows."""
    from catheter_sim.cli.list_verb import listing

    content = listing()
    assert cs.list_robots().column("id") == [row["id"] for row in content["robots"]]
    assert cs.list_models().column("name") == [row["name"] for row in content["static_models"]]
    assert cs.list_environments().column("id") == [row["id"] for row in content["environments"]]
    for reference in cs.list_robots().column("id"):
        ours = [(row["effect"], row["parameter"]) for row in cs.list_effects(reference)]
        theirs = [
            (effect["name"], item["name"])
            for effect in content["effects"]
            for item in effect["parameters"][reference]
        ]
        assert ours == theirs
