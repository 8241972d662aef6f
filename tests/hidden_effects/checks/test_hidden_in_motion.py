"""The bench in motion: its data owe nothing to what is judged by them, and a draw is itself again."""

from __future__ import annotations

import ast
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from catheter_sim.arrays import Array
from catheter_sim.channels import posture_columns
from catheter_sim.diagnosis.dataset import load_dataset
from catheter_sim.effects import EFFECTS
from catheter_sim.simulation.replay import simulate
from hidden_effects import in_motion
from hidden_effects.in_motion import CAUSES, HANGING, Specimen, arriving, measured
from tests.simulation.moving import pulled, swinging

COLUMNS = ("tip_x_mm", "tip_z_mm")
PLAIN = Specimen(replace(swinging(), links_per_subsegment=3, hinges="rod"), 0.01)


def test_what_makes_the_data_imports_neither_effects_nor_diagnosis() -> None:
    tree = ast.parse(Path(str(in_motion.__file__)).read_text())
    names = [
        name
        for node in ast.walk(tree)
        if isinstance(node, ast.Import | ast.ImportFrom)
        for name in (
            [node.module or ""] if isinstance(node, ast.ImportFrom) else [a.name for a in node.names]
        )
    ]
    assert any(name.startswith("catheter_sim.simulation") for name in names)
    assert not [name for name in names if name.split(".")[1:2] in (["effects"], ["diagnosis"])]


def test_every_cause_has_a_name_of_the_list() -> None:
    assert {cause for cause, _ in CAUSES} <= set(EFFECTS)


def own(specimen: Specimen, seconds: float = 0.5) -> Array:
    postures = simulate(specimen.robot, pulled(0, seconds), HANGING, dynamic=True).postures
    return np.stack(list(posture_columns(specimen.robot, postures, COLUMNS).values()), axis=1)


@pytest.mark.slow
def test_with_nothing_hidden_the_finer_model_moves_as_the_robot_does() -> None:
    """To a hundredth of the motion: it has other links, another step and another integrator."""
    fine = measured(PLAIN, pulled(0, 0.5), HANGING, COLUMNS)
    apart = float(np.sqrt(np.mean((fine - own(PLAIN)) ** 2)))
    assert 0.0 < apart < 0.02 * float(np.ptp(fine[:, 0]))


@pytest.mark.slow
def test_what_is_hidden_is_what_the_specification_would_say() -> None:
    """A load and damping by the bench's code, and by the package's own, move the robot alike."""
    hidden = replace(PLAIN, tip_mass_kg=0.02, damping_time_s=0.03)
    robot = replace(PLAIN.robot, tip_mass_kg=0.02)
    robot = replace(robot, dynamics=replace(robot.dynamics, damping_time_s=0.03))
    fine, plain = (measured(item, pulled(0, 0.5), HANGING, COLUMNS) for item in (hidden, PLAIN))
    said = own(replace(PLAIN, robot=robot))
    change = float(np.sqrt(np.mean((fine - plain) ** 2)))
    assert float(np.sqrt(np.mean((fine - said) ** 2))) < 0.1 * change


def test_a_lag_a_delay_and_a_play_do_to_a_ramp_what_they_must() -> None:
    """A ramp of slope s comes late by s lag, long after its start, or s delay; play holds half its width."""
    inputs = pulled(0, 2.0)
    ramp = np.stack([inputs.time_s, 2.0 * inputs.time_s], axis=1)
    inputs = replace(inputs, tendon=ramp)
    for specimen in (replace(PLAIN, lag_s=0.1), replace(PLAIN, delay_s=0.1)):
        assert ramp[-1] - arriving(specimen, inputs)[-1] == pytest.approx([0.1, 0.2], rel=1e-3)
    assert ramp[-1] - arriving(replace(PLAIN, play_N=0.3), inputs)[-1] == pytest.approx([0.15, 0.15])


def test_a_draw_is_written_read_and_not_made_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What is hidden is not in the data set; a scored draw is taken over."""
    one = in_motion.Draw(
        swinging(),
        "rate",
        "lag",
        replace(PLAIN, lag_s=0.1),
        9.0,
        0.1,
        COLUMNS,
        (pulled(0, 0.1), pulled(1, 0.1)),
        (np.zeros((11, 2)), np.ones((11, 2))),
    )
    in_motion.write_data(one, tmp_path / "data")
    read = load_dataset(tmp_path / "data")
    assert read.motion.moving
    assert [trial.role for trial in read.trials] == ["train", "heldout"]
    assert np.allclose(read.trials[1].inputs.tendon, one.trials[1].tendon)
    assert read.robot == one.robot  # as specified: the lag is in no file
    score = {"index": 3, "right": True, "code": in_motion.judging_code()}
    in_motion.write_json(score, tmp_path / "scores" / "draw_003.json")
    monkeypatch.setattr(in_motion, "drawn", lambda *_: pytest.fail("made again"))
    assert in_motion.run_draw(1, 3, tmp_path, 2, 0.1, 1, 1.0) == score
    monkeypatch.setattr(in_motion, "judging_code", lambda: "other")
    with pytest.raises(pytest.fail.Exception, match="made again"):
        in_motion.run_draw(1, 3, tmp_path, 2, 0.1, 1, 1.0)


def test_the_seed_decides_the_draw(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(in_motion, "measured", lambda specimen, inputs, *_: np.zeros((len(inputs), 4)))
    monkeypatch.setattr(in_motion, "_gap_mm", lambda *_: 0.0)
    first, again, other = (in_motion.drawn(seed, 1, "none", 2, 0.2) for seed in (7, 7, 8))
    assert first.robot == again.robot != other.robot
    assert np.array_equal(first.trials[0].tendon, again.trials[0].tendon)
    assert (first.cause, first.size) == ("", 0.0)
