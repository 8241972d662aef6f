"""Scores of an earlier version count for this one only where it gives the very same answers."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from tests.scripts_as_modules import script_module

carry_scores = script_module("carry_scores")
STORIES = ("none", "none", "single", "single", "pair", "outside")


def score(index: int, **changed: Any) -> dict[str, Any]:
    given = {"index": index, "story": STORIES[index % 6], "purpose": "judge", "seed": 3, "code": "old"}
    given |= {"commit": "abc", "verdict": "cause_found", "seconds": 5.0, "probabilities": {"rate": 0.1234}}
    return given | changed


def file_of(place: Path, scores: list[dict[str, Any]]) -> Path:
    file = place / "scores.jsonl"
    file.write_text("".join(json.dumps(item) + "\n" for item in scores))
    return file


def retried(monkeypatch: pytest.MonkeyPatch, **changed: Any) -> list[int]:
    """Let draws be diagnosed again with these differences; return which were."""
    asked: list[int] = []

    def run_bench(purpose: str, seed: int, draws: list[int], *_: Any, **__: Any) -> list[dict[str, Any]]:
        assert (purpose, seed) == ("judge", 3)
        asked.extend(draws)
        return [score(index, code="new", seconds=9.0, **changed) for index in draws]

    monkeypatch.setattr(carry_scores, "run_bench", run_bench)
    return asked


def test_scores_count_where_a_sample_gives_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Whoever gave them stays in them, however often they are carried."""
    file = file_of(tmp_path, [score(index) for index in range(30)])
    asked = retried(monkeypatch)
    for code in ("new", "newer"):
        monkeypatch.setattr(carry_scores, "judging_code", lambda code=code: code)
        assert carry_scores.main([str(file), "--draws", "12"]) == 0
    told = [json.loads(line) for line in file.read_text().splitlines()]
    assert [item["index"] for item in told] == list(range(30))
    assert {item["code"] for item in told} == {"newer"}
    assert {item["carried_from"] for item in told} == {"old (commit abc)"}
    assert {item["seconds"] for item in told} == {5.0}
    assert len(asked[:12]) == len(set(asked[:12]))
    assert {STORIES[index % 6] for index in asked[:12]} == set(STORIES)
    assert "12 of 12 give the same: 30 scores count for newer" in capsys.readouterr().out


def test_one_other_digit_is_another_answer(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    file = file_of(tmp_path, [score(index) for index in range(6)])
    before = file.read_text()
    retried(monkeypatch, probabilities={"rate": 0.1235})
    assert carry_scores.main([str(file)]) == 1
    assert file.read_text() == before
    assert "probabilities: {'rate': 0.1234} before, {'rate': 0.1235} now" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "holds scores of 0 codes"),
        ("{}\n", "cannot be read"),
        (json.dumps(score(1)) + "\n" + json.dumps(score(2, code="b")) + "\n", "holds scores of 2 codes"),
    ],
)
def test_a_file_without_scores_of_one_code_is_refused(
    tmp_path: Path, text: str, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "f.jsonl"
    file.write_text(text)
    assert carry_scores.main([str(file)]) == 2
    assert f"carry_scores: error: {file}: {said}" in capsys.readouterr().err
