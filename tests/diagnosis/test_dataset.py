"""Data sets: what is read is what was measured, and what is wrong is named in one line."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from catheter_sim.catalogue import load_robot
from catheter_sim.channels import read_inputs
from catheter_sim.core.document import leaves, to_document
from catheter_sim.core.inputs import Inputs
from catheter_sim.diagnosis.dataset import load_dataset
from catheter_sim.diagnosis.trials import Trial, cycles, is_repeat, split_trials, unit_of
from catheter_sim.errors import InputError
from catheter_sim.resources import assets_folder
from catheter_sim.tables import Table, read_table, write_table
from tests.scripts_as_modules import script_module

OPENCR = assets_folder() / "examples" / "opencr_v4"

# Rows at which the published pattern labels change ("_hold" rows counted to their pattern), from
# ContinuumRoboticsLab/opencr-mujoco, commit 17fff8b; the labels themselves are not shipped.
TRAIN_PATTERNS = """21 34 48 62 76 89 104 119 134 163 192 221 249 276 302 338 367 395 423 451 479 508 544
566 591 614 639 659 680 717 736 773 807 826 846 866 891 909 931 949 971 989 1018 1052 1082 1102 1120 1141
1167 1194 1220 1247 1273 1300 1327 1361 1389 1423 1450 1481 1506 1530 1553 1575 1597"""
VAL_PATTERNS = "19 57 72 88 105 135 162 189 215 242 268 295 322 348 374 400 427"

TOML = """\
[dataset]
name = "loops"
robot = "neuroendoscope_section"
source = "made up for a test"
licence = "MIT"
[conditions]
gravity_mps2 = [0.0, 0.0, 0.0]
[channels]
inputs = ["tension_right_N", "tension_left_N"]
outputs = ["tip_x_mm", "tip_z_mm"]
[[trials]]
file = "a.csv"
role = "train"
[[trials]]
file = "b.csv"
role = "heldout"
"""
CSV = """\
time_s,tension_right_N,tension_left_N,tip_x_mm,tip_z_mm
0,0,0,0.1,60
1,0.2,0,18,56
2,0.4,0,,47
3,0.2,0,20,55
4,0,0,2,59.9
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A small data set without fault."""
    (tmp_path / "dataset.toml").write_text(TOML)
    (tmp_path / "a.csv").write_text(CSV)
    (tmp_path / "b.csv").write_text(CSV.replace("0.4", "0.35"))
    return tmp_path


def trial_of(pull: np.ndarray, file: str = "a.csv", role: str = "") -> Trial:
    """Return a trial of the section whose right tendon is pulled by `pull` [N], a row a second."""
    time_s = np.arange(float(len(pull)))
    zeros = np.zeros((len(pull), 3))
    inputs = Inputs(time_s, "tension", np.stack([pull, 0 * pull], axis=1), zeros, zeros)
    return Trial(file, role, inputs, Table(time_s, {"tip_x_mm": 50 * pull}, file))


def test_values_and_units(folder: Path) -> None:
    """Inputs come out in SI, outputs in their column's unit, an empty cell as NaN."""
    dataset = load_dataset(folder)
    first = dataset.trials[0]
    assert [trial.role for trial in dataset.trials] == ["train", "heldout"]
    assert first.inputs.tendon[2].tolist() == [0.4, 0.0]
    assert first.outputs.columns["tip_z_mm"].tolist() == [60, 56, 47, 55, 59.9]
    assert np.flatnonzero(np.isnan(first.outputs.columns["tip_x_mm"])).tolist() == [2]
    assert [unit_of(name) for name in ("tip_x_mm", "joint_x1_deg", "tension_right_N", "tip_qw")] == [
        "mm",
        "deg",
        "N",
        "1",
    ]


def test_columns_not_listed_are_ignored_if_they_are_channels(folder: Path) -> None:
    """A file may hold more channels than the data set uses; they change nothing."""
    before = load_dataset(folder).trials[0]
    text = CSV.splitlines()
    wide = "\n".join([text[0] + ",tip_y_mm", *(line + ",0" for line in text[1:])])
    (folder / "a.csv").write_text(wide)
    after = load_dataset(folder).trials[0]
    assert after.outputs.columns.keys() == before.outputs.columns.keys()
    assert (after.inputs.tendon == before.inputs.tendon).all()


def toml(old: str, new: str) -> Callable[[Path], None]:
    def change(folder: Path) -> None:
        assert old in TOML
        (folder / "dataset.toml").write_text(TOML.replace(old, new, 1))

    return change


def csv(old: str, new: str) -> Callable[[Path], None]:
    def change(folder: Path) -> None:
        assert old in CSV
        (folder / "a.csv").write_text(CSV.replace(old, new))

    return change


def scaled(factor: float) -> Callable[[Path], None]:
    def change(folder: Path) -> None:
        for name in ("a.csv", "b.csv"):
            table = read_table(folder / name)
            rows = zip(
                table.time_s,
                table.columns["tension_right_N"],
                factor * np.nan_to_num(table.columns["tip_x_mm"]),
                factor * table.columns["tip_z_mm"],
                strict=True,
            )
            lines = [f"{t},{pull},0,{x},{z}" for t, pull, x, z in rows]
            (folder / name).write_text("\n".join([CSV.splitlines()[0], *lines]))

    return change


FAULTS = {
    "no dataset.toml": (lambda folder: (folder / "dataset.toml").unlink(), "dataset.toml: no such file"),
    "not TOML": (toml("[dataset]", "[dataset"), "not valid TOML"),
    "missing table": (toml("[conditions]\ngravity_mps2 = [0.0, 0.0, 0.0]\n", ""), r"conditions\] is missing"),
    "unknown table": (toml("[conditions]", "[weather]\nrain = 1\n[conditions]"), "unknown table 'weather'"),
    "missing key": (toml('licence = "MIT"\n', ""), "dataset.licence is missing"),
    "unknown key": (toml("licence", "license"), "unknown key 'license'; choices: name, robot, source, lic"),
    "wrong type": (toml('"loops"', "3"), "dataset.name: a text is needed, not 3"),
    "NaN gravity": (toml("[0.0, 0.0, 0.0]", "[0.0, nan, 0.0]"), "gravity_mps2: a list of three finite"),
    "two of gravity": (toml("[0.0, 0.0, 0.0]", "[0.0, 9.81]"), "gravity_mps2: a list of three"),
    "unknown robot": (toml('"neuroendoscope_section"', '"snake"'), "unknown robot 'snake'; choices: neuro"),
    "missing robot file": (toml('"neuroendoscope_section"', '"snake.toml"'), r"snake\.toml: no such file"),
    "unknown input": (toml("tension_left_N", "tension_up_N"), "unknown input channel 'tension_up_N'; choi"),
    "unknown output": (toml("tip_z_mm", "tip_w_mm"), "unknown output column 'tip_w_mm'; choices: tip_x"),
    "both in and out": (toml('"tip_z_mm"', '"tension_left_N"'), "'tension_left_N' is both an input and"),
    "channel twice": (toml('"tension_left_N"', '"tension_right_N"'), "'tension_right_N' stands twice"),
    "no inputs": (toml('["tension_right_N", "tension_left_N"]', "[]"), "channels.inputs: a list of channel"),
    "unknown role": (toml('"heldout"', '"test"'), "unknown role 'test'; choices: train, heldout"),
    "empty role": (toml('"heldout"', '""'), "unknown role ''"),
    "only heldout": (toml('"train"', '"heldout"'), "every trial is held out"),
    "file twice": (toml('"b.csv"', '"a.csv"'), "'a.csv' stands twice"),
    "file missing": (toml('"b.csv"', '"c.csv"'), r"trials\[1\].file: .*c.csv: no such file"),
    "unknown trial key": (toml("role", "part"), r"trials\[0\]: unknown key 'part'; choices: file, role"),
    "no trials": (lambda folder: (folder / "dataset.toml").write_text(TOML.split("[[")[0]), "trials"),
    "empty CSV": (lambda folder: (folder / "a.csv").write_text(""), "a.csv: the file is empty"),
    "header only": (lambda folder: (folder / "a.csv").write_text(CSV[:55] + "\n"), "a header without rows"),
    "ragged": (csv("2,0.4,0,,47", "2,0.4,0"), "a.csv: line 4: 3 cells where the header has 5"),
    "text in a cell": (csv("56", "abc"), "a.csv: line 3: tip_z_mm = 'abc': not a number"),
    "missing column": (csv("tip_z_mm", "tip_y_mm"), "a.csv: no column tip_z_mm, which dataset.toml lists"),
    "NaN in an input": (csv("3,0.2,0", "3,,0"), "a.csv: line 5: tension_right_N: a number is needed"),
    "time runs back": (csv("\n3,", "\n1.5,"), "a.csv: line 5: time_s = 1.5 does not come after 2"),
    "a pushing tendon": (csv("4,0,0", "4,-0.1,0"), "a.csv: line 6: tension_right_N = -0.1: a tendon cannot"),
    "micrometres for mm": (scaled(1e3), "tip_x_mm moves over 20000, but the robot is 60 mm long; is the col"),
    "output never measured": (
        lambda folder: [
            (folder / name).write_text(CSV.replace("60\n", "\n").replace("56", "").replace(",47", ",")
                                       .replace("55", "").replace("59.9", ""))
            for name in ("a.csv", "b.csv")
        ],
        "tip_z_mm has no value in any trial",
    ),
}  # fmt: skip


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_are_named_in_one_line(folder: Path, fault: str) -> None:
    """Each fault ends in one line that names the place, and the choices where there are any."""
    change, message = FAULTS[fault]
    load_dataset(folder)  # sound before the fault is planted
    change(folder)
    with pytest.raises(InputError, match=message) as caught:
        load_dataset(folder)
    assert "\n" not in str(caught.value)


def test_missing_folder(tmp_path: Path) -> None:
    """A folder that does not exist is called that."""
    with pytest.raises(InputError, match="no such folder"):
        load_dataset(tmp_path / "nothing")


def test_columns_not_listed_are_ignored_with_a_note(folder: Path) -> None:
    """Whatever they hold, and whether or not the robot knows them; a robot's own input counts as zero."""
    before = load_dataset(folder)
    assert before.notes == ()
    lines = CSV.splitlines()
    head = lines[0] + ",pattern,,pattern,force_tip_x_N"
    (folder / "a.csv").write_text("\n".join([head, *(line + ",pull,,x,3" for line in lines[1:])]))
    dataset = load_dataset(folder)
    assert [note.text for note in dataset.notes] == [
        "a.csv: not listed in dataset.toml and ignored: pattern, (a column without a name), force_tip_x_N. "
        "Of these the robot's own inputs are taken as zero: force_tip_x_N.",
    ]
    (folder / "b.csv").write_bytes((folder / "a.csv").read_bytes().replace(b"0.4", b"0.35"))
    (note,) = load_dataset(folder).notes  # one for both
    assert note.text.startswith("a.csv, b.csv: not listed in dataset.toml and ignored: pattern, ")
    for old, new in zip(before.trials, dataset.trials, strict=True):
        assert new.outputs.columns.keys() == old.outputs.columns.keys()
        assert not new.inputs.force_tip.any()
        assert (new.inputs.tendon == old.inputs.tendon).all()


def test_a_typo_of_a_listed_column_is_an_error(folder: Path) -> None:
    """It is not ignored, as the listed one is not there."""
    csv("tip_z_mm", "tip_Z_mm")(folder)
    with pytest.raises(InputError, match=r"a.csv: no column tip_z_mm, .*; columns: .*tip_Z_mm"):
        load_dataset(folder)


@pytest.mark.parametrize("spelling", ["./a.csv", "sub/../a.csv", "link.csv", "hard.csv", "sub/link.csv"])
def test_one_file_under_two_names_is_one_file(folder: Path, spelling: str) -> None:
    """What trains is not held out under another spelling, through a link or a folder."""
    (folder / "sub").mkdir()
    (folder / "link.csv").symlink_to(folder / "a.csv")
    (folder / "sub" / "link.csv").symlink_to(folder / "link.csv")
    (folder / "hard.csv").hardlink_to(folder / "a.csv")
    toml('"b.csv"', f'"{spelling}"')(folder)
    with pytest.raises(InputError) as caught:
        load_dataset(folder)
    assert str(caught.value).endswith(
        f"dataset.toml: trials[1].file: '{spelling}' is the same file as trials[0].file, 'a.csv'"
    )


@pytest.mark.parametrize(
    ("roles", "refused"),
    [
        (("train", "heldout", "heldout"), True),
        (("train", "heldout", "train"), False),  # it only weighs more
        (("train", "train", "train"), False),  # refused elsewhere: nothing is held out
        ((None, None, None), False),  # the tool keeps repeats in training
        ((None, "heldout", "heldout"), True),
        ((None, "heldout", None), False),
        (("heldout", "train", None), True),
    ],
)
def test_a_copy_of_a_trial_tests_nothing(folder: Path, roles: tuple[str | None, ...], refused: bool) -> None:
    """Byte for byte the same file cannot train and be held out, whoever chose the roles."""
    (folder / "copy.csv").write_bytes((folder / "a.csv").read_bytes())
    entries = [
        f'[[trials]]\nfile = "{file}"\n' + (f'role = "{role}"\n' if role else "")
        for file, role in zip(("a.csv", "b.csv", "copy.csv"), roles, strict=True)
    ]
    (folder / "dataset.toml").write_text(TOML.split("[[trials]]")[0] + "".join(entries))
    if refused:
        with pytest.raises(InputError, match=r"'copy.csv' is a copy of 'a.csv', byte for byte, and one of"):
            load_dataset(folder)
    else:
        assert len(load_dataset(folder).trials) == 3


def test_a_repeat_is_no_copy(folder: Path) -> None:
    """The same inputs measured again are a legal test, in other digits by one."""
    (folder / "b.csv").write_text(CSV.replace("59.9", "59.8"))
    train, heldout = split_trials(load_dataset(folder))
    assert is_repeat(train[0], heldout[0])


def test_a_repeat_is_one_whenever_it_was_recorded(folder: Path) -> None:
    """Two trials of one session, stamped in epoch seconds, repeat one another."""
    lines = CSV.splitlines()
    for name, start in (("a.csv", 1778538602.521), ("b.csv", 1778539017.043)):
        rows = [line.split(",") for line in lines[1:]]
        stamped = [",".join([f"{start + float(row[0]):.3f}", *row[1:]]) for row in rows]
        (folder / name).write_text("\n".join([lines[0], *stamped]))
    first, second = load_dataset(folder).trials
    assert is_repeat(first, second)
    assert first.inputs.time_s.tolist() == [0, 1, 2, 3, 4]
    assert first.outputs.time_s[1] == 1778538603.521  # as in the file


def test_missing_keys_are_told_all_at_once(folder: Path) -> None:
    """A table and keys of two others that are missing stand in one line."""
    text = TOML.replace("[conditions]\ngravity_mps2 = [0.0, 0.0, 0.0]\n", "")
    text = text.replace('licence = "MIT"\n', "").replace('outputs = ["tip_x_mm", "tip_z_mm"]\n', "")
    (folder / "dataset.toml").write_text(text)
    with pytest.raises(InputError) as caught:
        load_dataset(folder)
    assert str(caught.value).endswith(
        "dataset.toml: the table [conditions], dataset.licence, channels.outputs are missing"
    )


def test_roles_rule_the_split(folder: Path) -> None:
    """Roles that are given are kept."""
    train, heldout = split_trials(load_dataset(folder))
    assert [trial.file for trial in train] == ["a.csv"]
    assert [trial.file for trial in heldout] == ["b.csv"]


def test_all_train_leaves_nothing_to_test(folder: Path) -> None:
    """A data set whose trials all train says so instead of testing on them."""
    toml('"heldout"', '"train"')(folder)
    with pytest.raises(InputError, match="every trial has the role train"):
        split_trials(load_dataset(folder))


def test_split_by_trials_keeps_repeats_in_training(folder: Path) -> None:
    """About 30 % of the rows are held out, from the end, and never a repeat of a training trial."""
    ramp = np.concatenate([np.linspace(0, 1, 10), np.linspace(1, 0, 10)])
    trials = [trial_of(scale * ramp, f"{k}.csv") for k, scale in enumerate([0.1, 0.2, 0.3, 0.4, 0.5, 0.6])]
    trials.append(trial_of(0.2 * ramp, "repeat.csv"))
    assert is_repeat(trials[1], trials[-1])
    assert not is_repeat(trials[1], trials[2])
    dataset = replace(load_dataset(folder), trials=tuple(trials))
    train, heldout = split_trials(dataset)
    assert [trial.file for trial in heldout] == ["4.csv", "5.csv"]
    assert {trial.role for trial in heldout} == {"heldout"}
    assert {trial.role for trial in train} == {"train"}
    assert len(train) + len(heldout) == len(trials)


def test_split_of_one_trial_falls_between_cycles(folder: Path) -> None:
    """One trial is cut where it rests; the held-out part keeps its history but not its training rows."""
    ramp = np.concatenate([np.linspace(0, 0.5, 10), np.linspace(0.5, 0, 10)[1:]])
    pull = np.concatenate([ramp, ramp[1:], ramp[1:], ramp[1:]])
    dataset = replace(load_dataset(folder), trials=(trial_of(pull),))
    (train,), (heldout,) = split_trials(dataset)
    row = len(train.inputs)
    assert pull[row] == 0.0
    assert row == 54
    assert len(heldout.inputs) == len(pull)
    measured = np.isfinite(heldout.outputs.columns["tip_x_mm"])
    assert not measured[:row].any()
    assert measured[row:].all()


def test_cycles_are_the_published_patterns() -> None:
    """On the real robot the cuts are where its authors' pattern labels change, to three rows.

    Where one pattern runs into the next without rest there is nothing to cut at. One label (row 544)
    changes four rows before the motion of the pattern before has ended, so the cut comes after it.
    """
    dataset = load_dataset(OPENCR)
    for trial, text, found in zip(dataset.trials, (TRAIN_PATTERNS, VAL_PATTERNS), (0.95, 0.8), strict=True):
        changes = np.array([int(word) for word in text.split()])
        cuts = np.array([part.start for part in cycles(trial)[1:]])
        off = np.abs(cuts[:, None] - changes).min(axis=1)
        assert set(cuts[off > 3]) <= {548}
        assert (np.abs(changes[:, None] - cuts).min(axis=1) <= 3).mean() >= found


def test_partial_loops_are_no_cycles() -> None:
    """A loop that goes back to two thirds of its peak is one cycle; a return to rest makes two."""
    corners = [0.0, 0.6, 0.4, 0.6, 0.0, 0.3, 0.0]
    pull = np.interp(np.arange(0, 6.01, 0.1), np.arange(7.0), corners)
    parts = cycles(trial_of(pull))
    assert [part.start for part in parts] == [0, 40]


def test_a_standing_pretension_is_rest() -> None:
    """Loops that come back to the pretension, not to zero, are cycles; a circle without rest is one."""
    level = np.interp(np.arange(0, 5.01, 0.1), np.arange(6.0), [0.0, 0.2, 0.6, 0.2, 0.6, 0.2])
    assert [part.start for part in cycles(trial_of(level))] == [0, 30]
    angle = np.linspace(0.0, 6.0 * np.pi, 200)
    circle = np.max([np.cos(angle - shift) for shift in (0.0, 2.0944, 4.1888)], axis=0)
    assert cycles(trial_of(circle)) == [slice(0, 200)]


@given(st.lists(st.floats(0, 1, allow_subnormal=False), min_size=1, max_size=60))
@settings(max_examples=100, deadline=None)
def test_cycles_cover_every_row_once(pull: list[float]) -> None:
    """Whatever the inputs, the cycles are a partition of the rows in order, none empty."""
    rows = np.arange(len(pull))
    parts = cycles(trial_of(np.array(pull)))
    assert all(part.stop > part.start for part in parts)
    assert np.concatenate([rows[part] for part in parts]).tolist() == rows.tolist()


def test_opencr_pulls_bend_toward_the_pulled_tendon() -> None:
    """In the real data each tendon moves the tip toward its own angle, so the frame is not mirrored."""
    dataset = load_dataset(OPENCR)
    trial = dataset.trials[0]
    tip = np.stack([trial.outputs.columns[f"tip_{axis}_mm"] for axis in "xy"], axis=1)
    pull = trial.inputs.tendon * 1e3
    for index, tendon in enumerate(dataset.robot.tendons):
        others = np.delete(pull, index, axis=1).max(axis=1)
        alone = (others < -5.0) & (pull[:, index] > 1.5)  # the others let out
        slack = (others < -5.0) & (np.abs(pull[:, index]) < 0.3)
        assert alone.sum() >= 3
        assert slack.sum() >= 1
        motion = tip[alone].mean(axis=0) - tip[slack].mean(axis=0)
        off = np.arctan2(motion[1], motion[0]) - tendon.angle_rad
        assert abs(np.degrees(np.angle(np.exp(1j * off)))) < 12.0, tendon.name


def test_opencr_robot_states_the_source_of_every_number() -> None:
    """Every number of the shipped robot stands under a source, or a prefix of its name does."""
    robot = load_robot(OPENCR / "opencr_v4.toml")
    for key, _ in leaves(to_document(robot)):
        parts = key.split(".")
        assert any(".".join(parts[:n]) in robot.sources for n in range(1, len(parts) + 1)), key
    assert robot.segments[0].bending_stiffness_N_m2 == pytest.approx(50e9 * np.pi / 4 * 0.5e-3**4, rel=1e-5)


def test_conversion_keeps_numbers_and_maps_servos(tmp_path: Path) -> None:
    """The conversion starts the clock at zero, renames servos to tendons and changes no digit."""
    script = script_module("convert_opencr_v4")
    servos = [4, 3, 9, 5, 2, 8, 6, 1, 7]
    header = ["timestamp", "pattern_label", *(f"servo_{k}_mm" for k in servos), "tip_x", "tip_y", "tip_z"]
    rows = [
        ["1778538602.52163", "one", *(f"{k}.5" for k in servos), "-2.085078", "8.168024", "187.961009"],
        ["1778538603.166227", "one", *(f"{k}.25" for k in servos), "-2.2", "9.7", "188.1"],
    ]
    for kind in ("train", "val"):
        text = "\n".join(",".join(row) for row in [header, *rows])
        (tmp_path / f"{script.RECORDING}_{kind}.csv").write_text(text)
    target = tmp_path / "out.csv"
    assert script.convert_series(tmp_path / f"{script.RECORDING}_train.csv", target) == 2
    robot = load_robot(OPENCR / "opencr_v4.toml")
    table = read_table(target)
    assert table.time_s.tolist() == [0.0, 0.644597]
    assert table.columns["displacement_base_1_mm"].tolist() == [4.5, 4.25]
    assert table.columns["displacement_middle_2_mm"].tolist() == [2.5, 2.25]
    assert table.columns["displacement_tip_3_mm"].tolist() == [7.5, 7.25]
    assert table.columns["tip_x_mm"].tolist() == [-2.085078, -2.2]
    driven = {name: values for name, values in table.columns.items() if name.startswith("displacement")}
    assert read_inputs(robot, replace(table, columns=driven)).tendon[0, 2] == pytest.approx(9.5e-3)
    (tmp_path / f"{script.RECORDING}_train.csv").write_text("a,b\n1,2\n")
    with pytest.raises(InputError, match="line 1: the columns must be timestamp"):
        script.convert_series(tmp_path / f"{script.RECORDING}_train.csv", target)
    with pytest.raises(InputError, match="No such file"):
        script.convert(tmp_path / "nowhere", tmp_path)


def test_a_trackers_origin_and_metres_are_no_fault_of_the_file(folder: Path) -> None:
    """Positions metres away, or a thousandth as large, are read: only the robot's motion can tell of them."""
    scaled(1e-3)(folder)
    assert load_dataset(folder).trials[0].outputs.columns["tip_z_mm"][0] == pytest.approx(0.06)
    for name in ("a.csv", "b.csv"):
        table = read_table(folder / name)
        far = {column: values + 2e6 * column.startswith("tip") for column, values in table.columns.items()}
        write_table(replace(table, columns=far), folder / name)
    assert load_dataset(folder).trials[0].outputs.columns["tip_z_mm"][0] == pytest.approx(2e6 + 0.06)
