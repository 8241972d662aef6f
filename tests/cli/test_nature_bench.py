"""A bench's scores go from one folder to the next by one file."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from catheter_sim.errors import InputError
from hidden_effects.natural import scores_in
from hidden_effects.options import hand_on, parser_of, take_up
from hidden_effects.running import Folders, write_json


def asked(folder: Path, seed: int = 3):
    """Return the options of a bench that keeps its scores in a file beside its folder."""
    words = ["-o", str(folder), "--purpose", "judge", "--seed", str(seed)]
    return parser_of("", 4).parse_args([*words, "--scores", str(folder.parent / "kept" / "scores.jsonl")])


def score(index: int, code: str = "this", named: str = "") -> dict:
    return {"purpose": "judge", "seed": 3, "index": index, "code": code, "named": [named] if named else []}


def test_scores_go_on_in_another_folder(tmp_path: Path) -> None:
    """Those of the present code alone, in the order of their draws; a folder's own stay."""
    one, other = tmp_path / "one", tmp_path / "other"
    for item in (score(11), score(2, named="drift"), score(3, code="before")):
        write_json(item, Folders(one, item["index"]).score)
    hand_on(asked(one), one, "this")
    lines = asked(one).scores.read_text().splitlines()
    assert [json.loads(line)["index"] for line in lines] == [2, 11]

    write_json(score(2, named="twist"), Folders(other, 2).score)
    take_up(asked(other), other)
    assert scores_in(other, "this") == [score(2, named="twist"), score(11)]


def test_without_a_file_nothing_is_read_or_written(tmp_path: Path) -> None:
    """Nor does a file that is not there yet stand in the way."""
    options = asked(tmp_path / "one")
    take_up(options, tmp_path / "one")
    assert not (tmp_path / "one").exists()
    plain = parser_of("", 4).parse_args(["-o", str(tmp_path)])
    take_up(plain, tmp_path)
    hand_on(plain, tmp_path, "this")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("{", "line 2: not the score of a draw"),
        ('{"purpose": "judge"}', "line 2: not the score of a draw"),
        ("[1]", "line 2: not the score of a draw"),
        (json.dumps(score(4) | {"seed": 4}), "of judge, seed 4, not of judge, seed 3; give another file"),
    ],
)
def test_a_line_that_is_no_score_of_this_bench_is_named(tmp_path: Path, line: str, words: str) -> None:
    options = asked(tmp_path / "one")
    options.scores.parent.mkdir()
    options.scores.write_text(json.dumps(score(1)) + "\n" + line + "\n")
    with pytest.raises(InputError, match=words):
        take_up(options, tmp_path / "one")
