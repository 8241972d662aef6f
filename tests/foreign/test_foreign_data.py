"""Claims about data sets whose robot is somebody's MJCF: what is read, and what is refused in one line."""

from __future__ import annotations

import math
from collections.abc import Callable
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from catheter_sim.errors import InputError
from catheter_sim.foreign.model import ForeignTrial, is_foreign, noise_of, read_foreign
from tests.foreign.recorded import FILE, text_of, write_dataset


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_dataset(tmp_path_factory.mktemp("data"))


@pytest.fixture
def copied(folder: Path, tmp_path: Path) -> Path:
    for file in folder.iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes())
    return tmp_path


def test_trials_are_read_with_their_roles(folder: Path) -> None:
    data = read_foreign(folder)
    assert [trial.role for trial in data.trials] == ["train", "heldout"]
    assert [column.unit for column in data.model.columns] == ["deg", "deg", "mm", "mm"]
    assert data.trials[0].controls.shape == (151, 2)


def test_only_an_mjcf_that_is_driven_by_controls_is_foreign(folder: Path, copied: Path) -> None:
    assert is_foreign(folder)
    (copied / "dataset.toml").write_text(text_of(inputs='"tension_one_N"'))
    assert not is_foreign(copied)
    (copied / "dataset.toml").write_text(text_of(robot="neuroendoscope"))
    assert not is_foreign(copied)
    assert not is_foreign(copied / "nowhere")


def written(text: str) -> Callable[[Path], None]:
    return lambda folder: (folder / "dataset.toml").write_text(text)  # type: ignore[func-returns-value]


def mapped(line: str) -> Callable[[Path], None]:
    return written(f"{text_of()}[map]\n{line}\n")


def without_actuators(folder: Path) -> None:
    text = FILE.read_text()
    start, end = text.index("<actuator>"), text.index("</actuator>") + len("</actuator>")
    (folder / "two_link.xml").write_text(text[:start] + text[end:])


def broken(folder: Path) -> None:
    (folder / "two_link.xml").write_text("<mujoco><worldbody><body></mujoco>")


def cell(value: str) -> Callable[[Path], None]:
    def change(folder: Path) -> None:
        lines = (folder / "trial_1.csv").read_text().splitlines()
        cells = lines[5].split(",")
        lines[5] = ",".join([cells[0], value, *cells[2:]])
        (folder / "trial_1.csv").write_text("\n".join(lines) + "\n")

    return change


def short(folder: Path) -> None:
    lines = (folder / "trial_1.csv").read_text().splitlines()
    (folder / "trial_1.csv").write_text("\n".join(lines[:12]) + "\n")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (written(text_of(motion="held")), r'conditions.motion = .held.: "dynamic" is needed'),
        (
            written(text_of(inputs='"control_three"')),
            "unknown input channel 'control_three'; choices: control_one",
        ),
        (
            written(text_of().replace("site_end_x_mm", "site_tip_x_mm")),
            "unknown output column 'site_tip_x_mm'",
        ),
        (
            written(text_of().replace("motion", "settle_s = -1\nmotion")),
            "settle_s = -1: must lie in 0 to 60 s",
        ),
        (written(text_of().replace("-9.81]", "nan]")), "three finite numbers|3 finite numbers"),
        (written(text_of() + "[calibration]\n"), "unknown table 'calibration'"),
        (written(text_of(robot="other.xml")), "other.xml: no such file"),
        (
            mapped('control_one = { column = "control_one", unit = "mm" }'),
            "map.control_one: unit: unknown unit 'mm'; choices: deg, rad, turn, counts",
        ),
        (
            mapped('control_one = { column = "one", scale = 2.0 }'),
            "unknown column 'one'; choices: time_s, control_one",
        ),
        (mapped('load = { column = "control_one" }'), r"\[map\]: unknown key 'load'; choices: time_s"),
        (without_actuators, "the model has no actuator"),
        (broken, "two_link.xml: MuJoCo does not take it"),
        (cell(""), "line 6: control_one: a number is needed"),
        (cell("nan"), "control_one"),
        (short, "11 rows: a trial needs 20 at least"),
    ],
)
def test_what_cannot_be_used_is_refused_in_one_line(
    change: Callable[[Path], None], words: str, copied: Path
) -> None:
    change(copied)
    with pytest.raises(InputError, match=words) as raised:
        read_foreign(copied)
    assert "\n" not in str(raised.value)


def test_a_map_reads_what_a_bench_wrote(folder: Path, copied: Path) -> None:
    """Dates, encoders' counts from a zero of their own, cm in axes of a tracker's: the trial is the same."""
    plain = read_foreign(folder)
    for trial in plain.trials:
        text = (folder / trial.file).read_text().splitlines()
        rows = np.array([[float(cell) for cell in line.split(",")] for line in text[1:]])
        lines = ["stamp;target;target 2;p;second;X;Y;Z"]
        for time_s, one, two, first, second, x, z in rows:
            stamp = (datetime(2025, 1, 1, 9) + timedelta(seconds=time_s)).isoformat() + "Z"
            counts = (
                2047.0 + one * 4096.0 / math.tau,
                -two * 1000.0 / math.tau,
                512.0 - first * 1024.0 / 360.0,
            )
            numbers = (*counts, math.radians(second), 0.1 * x, 0.1 * z, 0.0)
            lines.append(";".join([stamp, *(f"{value:.12g}" for value in numbers)]))
        (copied / trial.file).write_text("\n".join(lines) + "\n")
    (copied / "dataset.toml").write_text(
        text_of() + "[map]\n"
        'axes = ["x", "-z", "y"]\n'
        'time_s = { column = "stamp", unit = "date" }\n'
        'control_one = { column = "target", unit = "counts", counts_per_turn = 4096, zero = 2047 }\n'
        f'control_two = {{ column = "target 2", scale = {math.tau / 1000.0!r}, sign = -1 }}\n'
        'joint_first_deg = { column = "p", unit = "counts", counts_per_turn = 1024, zero = 512, sign = -1 }\n'
        'joint_second_deg = { column = "second", unit = "rad" }\n'
        'site_end = { columns = ["X", "Y", "Z"], unit = "cm" }\n'
    )
    for own, trial in zip(plain.trials, read_foreign(copied).trials, strict=True):
        np.testing.assert_allclose(trial.time_s, own.time_s, atol=1e-6)
        np.testing.assert_allclose(trial.controls, own.controls, atol=1e-8)
        np.testing.assert_allclose(trial.outputs, own.outputs, atol=1e-6)


def test_a_single_trial_is_cut(copied: Path) -> None:
    """Its beginning trains; all of it is played and the rest is judged, which does not start at rest."""
    (copied / "dataset.toml").write_text(
        text_of().split("[[trials]]")[0] + '[[trials]]\nfile = "trial_1.csv"\n'
    )
    train, heldout = read_foreign(copied).trials
    assert (train.role, heldout.role) == ("train", "heldout")
    assert len(train.time_s) == 106  # of 151 rows
    assert len(heldout.controls) == 151
    assert np.isnan(heldout.outputs[:106]).all()
    assert np.isfinite(train.outputs).all()
    assert np.isfinite(heldout.outputs[106:]).all()
    lines = (copied / "trial_1.csv").read_text().splitlines()
    empty = [",".join([*line.split(",")[:3], "", "", "", ""]) for line in lines[100:]]
    (copied / "trial_1.csv").write_text("\n".join([*lines[:100], *empty]) + "\n")
    with pytest.raises(InputError, match=r"only trial and is cut at row 107; no output .* in its last part"):
        read_foreign(copied)


def test_noise_is_told_from_motion() -> None:
    generator = np.random.default_rng(3)
    time_s = np.arange(0.0, 6.0, 0.02)
    motion = np.stack([20.0 * np.sin(2.0 * time_s), np.full(len(time_s), 5.0)], axis=1)
    outputs = motion + generator.normal(size=motion.shape) * (0.1, 0.4)
    found = noise_of([ForeignTrial("a", "train", time_s, np.zeros((len(time_s), 1)), outputs)], 1e-4)
    assert found == pytest.approx([0.1, 0.4], rel=0.15)


def test_a_control_without_a_column_stays_as_the_file_begins(copied: Path) -> None:
    key = '<keyframe><key qpos="0.1 0.2" ctrl="0.3 -0.4"/></keyframe></mujoco>'
    (copied / "two_link.xml").write_text(FILE.read_text().replace("</mujoco>", key))
    (copied / "dataset.toml").write_text(text_of(inputs='"control_one"'))
    controls = read_foreign(copied).trials[0].controls
    assert np.ptp(controls[:, 0]) > 0.1
    assert (controls[:, 1] == -0.4).all()


def test_trials_that_all_train_are_refused(copied: Path) -> None:
    (copied / "dataset.toml").write_text(
        text_of()
        .replace('role = "heldout"', 'role = "train"')
        .replace('1.csv"\n', '1.csv"\nrole = "train"\n')
    )
    with pytest.raises(InputError, match="every trial has the role train"):
        read_foreign(copied)
