"""`cs.laboratory`: the bench of the command line, from Python; what cannot be is refused in its own words."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import catheter_sim as cs
from catheter_sim.closed_loop.loop import LoopFinding, LoopOutcome, LoopStep, Proposed
from catheter_sim.lab.simulated import stand_in
from catheter_sim.public.laboratories import FoundOut
from catheter_sim.tables import Table

PULL = {"time_s": [0.0, 1.0, 2.0], "displacement_bending_proximal_mm": [0.0, 0.8, 0.4]}
LIMITS = {"displacement_bending_proximal_mm": (-1.0, 1.0)}


def two(table: dict[str, list[float]]) -> list[dict[str, list[float]]]:
    """Return a trial and one that differs from it."""
    return [table, {name: [*values[:-1], 2.0 * values[-1]] for name, values in table.items()}]


@pytest.mark.slow
def test_a_play_is_that_of_the_bench() -> None:
    """Readings are the stand-in's, noise included; another seed has others, fewer columns the same ones."""
    bench = cs.laboratory("mitral_4dof", hide="backlash.play=8", seed=3)
    found = bench.play(PULL, "in")
    rig = stand_in("mitral_4dof", ["backlash.play=8"], seed=3)
    rig.reset()
    rig.play(Table(np.arange(3.0), {name: np.array(PULL[name]) for name in LIMITS}), "in")
    for name, values in rig.read().columns.items():
        np.testing.assert_array_equal(found.columns[name], values)
    other = cs.laboratory("mitral_4dof", hide=["backlash.play=8"], seed=4).play(PULL, "in")
    assert np.abs(other.columns["tip_x_mm"] - found.columns["tip_x_mm"]).max() > 0.01
    one = bench.play(PULL, "in", columns="tip_x_mm")
    assert set(one.columns) == {*LIMITS, "tip_x_mm"}
    np.testing.assert_array_equal(one.columns["tip_x_mm"], found.columns["tip_x_mm"])
    assert "simulated mitral_4dof" in repr(bench)


def test_what_is_hidden_is_told_when_asked() -> None:
    """The form and size are what was asked for."""
    (item,) = cs.laboratory("mitral_4dof", hide=["backlash.play=8"]).hidden["hidden"]
    assert (item["cause"], item["form"], item["size"]) == ("backlash", "play", 8.0)


@pytest.mark.slow
def test_what_is_drawn_differs_with_the_seed() -> None:
    """Cause, form or size."""
    drawn = {str(cs.laboratory("mitral_4dof", "random", seed=seed).hidden["hidden"]) for seed in range(3)}
    assert len(drawn) == 3


def test_a_real_bench_is_waited_for(tmp_path: Path) -> None:
    """The loop leaves what is to be played, says what is missing, and goes on with the same folder."""
    inbox = tmp_path / "inbox"
    inbox.mkdir()
    bench = cs.laboratory("mitral_4dof", limits=LIMITS, columns=["tip_x_mm"], recordings=inbox)
    assert bench.limits == LIMITS
    assert bench.columns == ("tip_x_mm",)
    for _ in range(2):
        found = bench.find_out(tmp_path / "out")
        assert (found.end, found.causes) == ("waiting", ())
        assert "first_1.csv" in found.sentence
        assert len(found.to_table()) == 0
    assert (found.path / "story.md").is_file()
    assert (inbox / "first_1_inputs.csv").is_file()
    with pytest.raises(cs.InputError, match="hidden: a real bench"):
        _ = bench.hidden
    with pytest.raises(cs.InputError, match="played by find_out"):
        bench.play(PULL, "in")


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"hide": "gremlins"}, "gremlins"),
        ({"seed": -1}, "seed = -1"),
        ({"longest_s": 0.0}, "longest_s = 0.0"),
        ({"columns": "tip_q_mm"}, "columns: .*tip_q_mm"),
        ({"limits": {"pull": (0, 1)}}, "limits: .*pull"),
        ({"limits": {"advance_mm": 3}}, "limits: advance_mm = 3"),
        ({"gravity_mps2": (0, 0, 9.81)}, "gravity_mps2: of a real bench"),
        ({"recordings": "."}, "recordings: columns and limits"),
        ({"recordings": ".", "hide": "backlash"}, "hide: a real bench"),
        ({"recordings": "nowhere", "limits": LIMITS, "columns": ["tip_x_mm"]}, "nowhere: no such folder"),
    ],
)
def test_what_no_bench_can_do_is_refused(settings: dict[str, object], said: str) -> None:
    """In the words of the arguments, not of the command line."""
    with pytest.raises(cs.InputError, match=said) as caught:
        cs.laboratory("mitral_4dof", **settings)  # type: ignore[arg-type]
    assert "--" not in str(caught.value)


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"experiments": 1.5}, "experiments = 1.5"),
        ({"minutes": -1.0}, "minutes = -1.0"),
        ({"wait_s": float("nan")}, "wait_s = nan"),
        ({"jobs": 0}, "jobs = 0"),
    ],
)
def test_a_loop_without_sense_is_refused(tmp_path: Path, settings: dict[str, object], said: str) -> None:
    """Before anything is written."""
    bench = cs.laboratory("mitral_4dof")
    with pytest.raises(cs.InputError, match=said):
        bench.find_out(tmp_path / "out", **settings)  # type: ignore[arg-type]
    assert not (tmp_path / "out").exists()


def test_recordings_of_another_robot_do_not_begin_a_loop(tmp_path: Path) -> None:
    """Nor those of other columns."""
    table = {**PULL, "tip_x_mm": [0.0, 1.0, 2.0]}
    bench = cs.laboratory("mitral_4dof")
    with pytest.raises(cs.InputError, match="data: measures tip_x_mm; the bench"):
        bench.find_out(tmp_path / "out", cs.dataset("mitral_4dof", two(table)))
    other = {"time_s": [0.0, 1.0], "displacement_bending_mm": [0.0, 1.0], "tip_x_mm": [0.0, 1.0]}
    with pytest.raises(cs.InputError, match="data: is of mitral_transseptal"):
        bench.find_out(tmp_path / "out", cs.dataset("mitral_transseptal", two(other)))


def test_a_table_tells_what_was_believed_and_proposed(tmp_path: Path) -> None:
    """A row for each diagnosis: the most probable, and the experiment after it."""
    first = LoopStep(0, None, Proposed("first", "loops", 2.0))
    unsure = LoopFinding("unexplained", {"rate": 0.2, "outside": 0.7}, "a sentence", [])
    sure = LoopFinding("cause_found", {"rate": 0.96, "outside": 0.1}, "a sentence", ["rate"])
    steps = (
        first,
        LoopStep(4, unsure, Proposed("experiment_1", "holds", 3.0, nats=0.5)),
        LoopStep(8, sure, None, "sure"),
    )
    found = FoundOut(LoopOutcome(steps, "sure", ("rate",), "it is sure"), "robot", tmp_path)
    table = found.to_table()
    assert table.column("recordings") == [4, 8]
    assert table.column("most_probable") == ["outside", "rate"]
    assert table.column("probability") == [0.7, 0.96]
    assert table.column("proposed") == ["holds", ""]
    assert table.column("minutes") == [3.0, 0.0]
    assert table.column("nats") == [0.5, 0.0]
    assert found.causes == ("rate",)
