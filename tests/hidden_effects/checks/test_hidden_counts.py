"""What counts in the bench: who is right, the noise and the files as they say, each on both its sides."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from catheter_sim.catalogue import load_robot
from catheter_sim.channels import channel_of, read_inputs
from catheter_sim.core.inputs import Inputs
from catheter_sim.diagnosis.problem import Problem
from catheter_sim.diagnosis.trials import Trial
from catheter_sim.effects.apply import with_effects
from catheter_sim.lab.robots import BENCH_ROBOTS, bench_robot
from catheter_sim.tables import Table, read_table, write_table
from catheter_sim.theory.static_models import STATIC_MODELS
from hidden_effects import first_bench
from hidden_effects.first_bench import _coverage, score, summary
from hidden_effects.first_draws import (
    MISSING,
    TOLD_APART,
    KinkedCell,
    _measured,
    _table,
    distance,
    history,
    robot_of,
    story_of,
)
from hidden_effects.running import ANSWER, Folders, write_json


@pytest.fixture
def scored(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Return a function that scores an answer and a diagnosis; a rival stays as far as `apart` from it."""
    folders = Folders(tmp_path, 0)
    monkeypatch.setattr(first_bench, "_problem", lambda folders: (None, ()))
    monkeypatch.setattr(first_bench, "_refused", lambda path: "")
    monkeypatch.setattr(first_bench, "robot_as_written", lambda path: None)

    def run(
        story: str, true: list[str], verdict: str, named: list[str], apart: float = 99.0, alike: Any = ()
    ) -> dict[str, Any]:
        monkeypatch.setattr(first_bench, "distance", lambda *arguments: (apart, apart / 10.0))
        monkeypatch.setattr(first_bench, "_gains", lambda *arguments: {"inside": True})
        answer = {
            "index": 0,
            "story": story,
            "robot": "chest_tube",
            "effects": {} if story == "outside" else {name: {} for name in true},
            "outside": true[0] if story == "outside" else "",
            "simulated_size_over_noise": 10.0,
            "rows": 300,
            "noise": {"mm": 0.2, "deg": 0.3},
        }
        found = {
            "verdict": verdict,
            "unit": "mm",
            "causes": [{"name": name, "parameters": {}} for name in named],
            "indistinguishable": [list(group) for group in alike],
            "heldout": {"rmse_before": 2.0, "rmse_after": 0.24},
            "noise_floor": 0.3,
            "ranking": [{"causes": ["twist"]}, {"causes": sorted(true)}],
        }
        write_json(answer, folders.answer / ANSWER)
        write_json(found, folders.found / "diagnosis.json")
        return score(folders, {"seconds": 1.0, "failure": ""})

    return run


@pytest.mark.parametrize(
    ("named", "right"),
    [
        (["rate"], True),
        (["rate", "drift"], True),
        (["drift", "rate"], False),
        (["drift"], False),
        ([], False),
    ],
)
def test_single_effect_must_stand_first(scored, named, right):
    """The first that is named is the answer; one behind it is none."""
    assert scored("single", ["rate"], "cause_found", named)["right"] is right


@pytest.mark.parametrize(
    ("named", "right"),
    [
        (["rate", "drift"], True),
        (["drift", "rate"], True),
        (["rate"], False),
        (["rate", "payload"], False),
        (["payload", "rate", "drift"], True),
    ],
)
def test_both_of_a_pair_must_be_named(scored, named, right):
    """In any order; half of it is a miss."""
    assert scored("pair", ["rate", "drift"], "cause_found", named)["right"] is right


@pytest.mark.parametrize(
    ("story", "verdict", "right"),
    [
        ("none", "no_discrepancy", True),
        ("none", "unexplained", False),
        ("none", "cause_found", False),
        ("outside", "unexplained", True),
        ("outside", "no_discrepancy", False),
        ("outside", "cause_found", False),
    ],
)
def test_nothing_and_what_is_not_in_the_list_have_a_verdict_each(scored, story, verdict, right):
    """Nothing hidden: no discrepancy. A cause outside the list: unexplained."""
    true = ["kinked_cell"] if story == "outside" else []
    assert scored(story, true, verdict, ["drift"] if verdict == "cause_found" else [])["right"] is right


@pytest.mark.parametrize(("apart", "right"), [(0.9 * TOLD_APART, True), (1.1 * TOLD_APART, False)])
def test_another_name_is_as_good_where_nobody_could_tell(scored, apart, right):
    """It stands in one group with the truth, and is nearer to it than can be told apart."""
    result = scored("single", ["rate"], "cause_found", ["drift"], apart, [["drift", "rate"]])
    assert result["right"] is right
    assert scored("single", ["rate"], "cause_found", ["drift"], apart)["right"] is False


def test_errors_are_over_the_floor_that_was_found_and_over_the_noise_that_was_hidden(scored):
    """0.24 mm after and 2 mm before; a floor of 0.3 mm, a noise of 0.2 mm; the truth in the second place."""
    result = scored("single", ["rate"], "cause_found", ["rate"])
    assert result["after_over_floor"] == pytest.approx(0.8)
    assert result["after_over_noise"] == pytest.approx(1.2)
    assert result["before_over_noise"] == pytest.approx(10.0)
    assert result["truth_tried"]["place"] == 2
    assert scored("single", ["coupling"], "unexplained", [])["truth_tried"]["place"] == 2
    assert scored("single", ["twist"], "cause_found", ["twist"])["truth_tried"]["place"] == 1


def draw(**more: Any) -> dict[str, Any]:
    """Return a score with what the table needs."""
    return {
        "index": 0,
        "story": "single",
        "robot": "chest_tube",
        "true": ["rate"],
        "size": 10.0,
        "rows": 300,
        "seconds": 30.0,
        "verdict": "cause_found",
        "failure": "",
        "named": ["rate"],
        "right": True,
    } | more


def line(table: dict[str, Any], what: str) -> dict[str, Any]:
    (found,) = (item for item in table["lines"] if item["what"].startswith(what))
    return found


def test_a_median_does_not_follow_one_bad_draw():
    """Of three errors over the floor one is ten times the others: the middle one stands."""
    table = summary([draw(after_over_floor=value) for value in (1.0, 1.1, 12.0)])
    assert line(table, "held-out error over the noise floor")["reached"] == pytest.approx(1.1)
    assert line(table, "held-out error over the noise floor")["met"] is True


def test_coverage_counts_what_can_be_compared():
    """Of four parameters one was fitted otherwise than hidden, and one lies outside: two of three."""
    rows = [
        {"parameter": "rate.lag_s", "true": 1.0, "fitted": 1.0, "low": 0.5, "high": 1.5}
        | {"comparable": comparable, "inside": inside}
        for comparable, inside in ((True, True), (True, True), (True, False), (False, False))
    ]
    found = line(summary([draw(coverage=rows)]), "true parameter in its 95 % interval")
    assert (found["count"], found["of"]) == (2, 3)


@pytest.mark.parametrize(("true", "inside"), [(0.79, False), (0.81, True), (0.99, True), (1.01, False)])
def test_an_interval_has_two_ends(true, inside):
    """A true value a little below it is missed, and so is one a little above it."""
    cause = {"name": "stiffness", "parameters": {"scale": {"value": 0.9, "ci95": [0.8, 1.0]}}}
    (row,) = _coverage({"stiffness": {"scale": true}}, [cause])
    assert row["comparable"] is True
    assert row["inside"] is inside


def test_seeds_and_blocks_deal_in_another_order():
    """Stories and robots: no two of six orders are alike."""
    size = len(BENCH_ROBOTS)
    for deal, count in ((story_of, 20), (robot_of, size)):
        orders = [
            tuple(deal(seed, block * count + place) for place in range(count))
            for seed in (1, 2)
            for block in range(3)
        ]
        assert len(set(orders)) == 6
        assert len({tuple(sorted(order)) for order in orders}) == 1


def test_noise_is_white_and_of_the_size_that_is_said():
    """Each column its own; no row hangs together with the next; up to a hundredth of the cells is empty."""
    noise = np.array([0.05, 2.0])
    clean = np.tile([3.0, -7.0], (400, 1))
    shares, errors = [], []
    for seed in range(40):
        measured = _measured(clean, noise, np.random.default_rng(seed))
        shares.append(np.isnan(measured).mean())
        errors.append((measured - clean) / noise)
    error = np.concatenate(errors)
    assert np.nanstd(error, axis=0) == pytest.approx([1.0, 1.0], rel=0.03)
    assert np.abs(np.nanmean(error, axis=0)).max() < 0.05
    assert np.abs(np.nanmean(error[1:] * error[:-1])) < 0.03
    assert np.mean(shares) == pytest.approx(0.5 * MISSING, rel=0.4)
    assert max(shares) < 2.0 * MISSING


@pytest.mark.parametrize("name", BENCH_ROBOTS)
def test_inputs_stay_in_reach_and_are_read_back_from_their_file(name, tmp_path):
    """No channel is pulled beyond its reach, some of them to half of it; a channel's tension is the sum of
    its tendons'. Written as a trial's file and read as any user's, the inputs are the same."""
    generator = np.random.default_rng(4)
    bench = bench_robot(name, generator)
    channels = channel_of(bench.robot)
    largest = 0.0
    for _ in range(6):
        inputs = history(bench, generator, rich=True)
        for reach, channel in zip(bench.trials.reach, dict.fromkeys(channels), strict=True):
            mine = inputs.tendon[:, [own == channel for own in channels]]
            pulled = mine.sum(axis=1) if inputs.actuation == "tension" else mine[:, 0]
            assert np.abs(pulled).max() <= max(reach, bench.trials.pretension_N) * 1.001
            largest = max(largest, float(np.abs(pulled).max()) / reach)
        write_table(_table(bench.robot, inputs, (), np.zeros((len(inputs), 0))), tmp_path / "trial.csv")
        again = read_inputs(bench.robot, read_table(tmp_path / "trial.csv"))
        np.testing.assert_allclose(again.tendon, inputs.tendon, rtol=1e-8, atol=1e-12)
        np.testing.assert_array_equal(again.time_s, inputs.time_s)
    assert largest > 0.5


def test_kinked_cell_bends_by_its_size_times_what_exceeds_its_bound():
    """The same way as it was bent, about the same axis; all other cells as before."""
    robot = load_robot("chest_tube_section")
    tension = np.array([[0.0], [30.0]])
    zeros = np.zeros((2, 3))
    inputs = Inputs(np.arange(2.0), "tension", tension, zeros, zeros)
    before = STATIC_MODELS["complete"].solve(robot, inputs, np.zeros(3)).postures[1]
    after = KinkedCell(2.0, {"element": 5, "fold_from_rad": 0.05}).change_postures((before,))[0]

    def bends(posture) -> np.ndarray:
        turned = np.einsum("kji,kjl->kil", posture.R_w[:-1], posture.R_w[1:])
        return Rotation.from_matrix(turned).as_rotvec()

    old, new = bends(before), bends(after)
    angle = np.linalg.norm(old[4])  # of element 5 against element 4
    assert angle > 0.06
    np.testing.assert_allclose(new[4], old[4] * (1.0 + 2.0 * (angle - 0.05) / angle), atol=1e-9)
    others = np.arange(len(old)) != 4
    np.testing.assert_allclose(new[others], old[others], atol=1e-9)


@pytest.mark.parametrize("noise", [0.1, 0.4])
def test_distance_is_the_root_of_the_squares_over_the_noise(noise):
    """Of a robot whose output is 0.3 mm off in each of 25 rows, from the one without effects: 0.3 / noise
    times 5, and 0.3 / noise a value."""
    robot = load_robot("chest_tube_section")
    rows = 25
    zeros = np.zeros((rows, 3))
    inputs = Inputs(np.arange(float(rows)), "tension", np.zeros((rows, 1)), zeros, zeros)

    def twin(robots, inputs, every):
        off = np.array([item.effects.get("stiffness", {}).get("scale", 1.0) - 1.0 for item in robots])
        return np.broadcast_to(off[:, None, None], (len(robots), rows, 1))[:, ::every]

    trial = Trial("a.csv", "train", inputs, Table(inputs.time_s, {"tip_x_mm": np.zeros(rows)}))
    problem = Problem(robot, (), (trial,), ("tip_x_mm",), np.ones(1), twin)
    true = with_effects(robot, {"stiffness": {"scale": 1.3}})
    found = distance(problem, (trial,), true, {"mm": noise}, (), {})
    assert found == pytest.approx((5.0 * 0.3 / noise, 0.3 / noise))
    holed = replace(trial, outputs=Table(inputs.time_s, {"tip_x_mm": np.where(inputs.time_s < 9, np.nan, 0)}))
    found = distance(replace(problem, trials=(holed,)), (holed,), true, {"mm": noise}, (), {})
    assert found == pytest.approx((4.0 * 0.3 / noise, 0.3 / noise))
