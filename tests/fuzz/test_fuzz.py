"""Ten thousand wrong inputs, each drawn from its own seed: every one ends in 0, 1 or 2 and a few lines.

`FIRST` cases of each kind are in the fast set. A case that fails is named by its kind and number; the
same number draws the same input again.
"""

from __future__ import annotations

import random
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from ends import LIMIT_S, End, TooLong, end_of_call, end_of_command
from mutations import NUMBERS, mutated

from catheter_sim.catalogue import load_robot, robot_toml
from catheter_sim.channels import input_channels
from catheter_sim.core.document import leaves, to_document
from catheter_sim.diagnosis.dataset import load_dataset
from catheter_sim.diagnosis.trials import split_trials
from catheter_sim.errors import InputError
from catheter_sim.tables import read_table

CASES = 2000  # of each kind
FIRST = 40
_PARTS = 4
# Small robots of each kind, so that a case takes milliseconds, and a static model of each.
_THREE_JOINTS = ("segments.section.joints=3", "segments.section.length_mm=45")
SMALL = (
    ("neuroendoscope_section", ("disks_per_segment=4",), "fkm_sliding"),
    ("spacer_disk", ("disks_per_segment=3", "links_per_subsegment=1"), "CC"),
    ("chest_tube_section", _THREE_JOINTS, "pcc"),
    ("chest_tube_section@prototype", _THREE_JOINTS, "complete"),
    ("mitral_4dof", (), "pk"),
    ("mitral_transseptal@tube", (), "balance"),
)
DATASET = """\
[dataset]
name = "loops"
robot = "robot.toml"
source = "made up for a test"
licence = "MIT"
[conditions]
gravity_mps2 = [0.0, 0.0, -9.81]
[channels]
inputs = ["tension_right_N", "tension_left_N"]
outputs = ["tip_x_mm", "tip_z_mm", "joint_x1_deg"]
[calibration]
friction.mu = [0.0, 0.5]
mount.axial_stiffness_N_per_mm = [1.0, inf]
[[trials]]
file = "a.csv"
role = "train"
[[trials]]
file = "b.csv"
role = "heldout"
[[trials]]
file = "c.csv"
"""
TRIAL = """\
time_s,tension_right_N,tension_left_N,tip_x_mm,tip_z_mm,joint_x1_deg,label
0,0,0,0.1,60,0,rest
1.5,0.2,0,18,56,2.5,pull
2.25,0.4,0,,47,4,pull
3,0.2,0,20,55,,"let, go"
1e1,0,0,2,59.9,0.1,rest
"""


@cache
def small_robot_text(index: int) -> str:
    """Return the `.toml` of one of the small robots."""
    reference, settings, _ = SMALL[index]
    return robot_toml(load_robot(reference, settings))


@cache
def inputs_text(index: int) -> str:
    """Return a file of three rows of inputs of one of the small robots."""
    reference, settings, _ = SMALL[index]
    robot = load_robot(reference, settings)
    names = input_channels(robot)
    rows = [["time_s", *names, "force_tip_x_N"]]
    rows += [[str(row / 2), *(f"{0.05 * row:g}" for _ in names), "0"] for row in range(3)]
    return "\n".join(",".join(row) for row in rows) + "\n"


def robot_case(draw: random.Random) -> list[Callable[[], End]]:
    """A robot's file, listed, and driven or built where it is still a robot."""
    index = draw.randrange(len(SMALL))
    Path("robot.toml").write_bytes(mutated(small_robot_text(index), draw))
    Path("in.csv").write_text(inputs_text(index))
    then = draw.choice(["build", "statics", "statics", "statics"])
    words = ["--inputs", "in.csv", "--model", SMALL[index][2]] if then == "statics" else []
    return [
        lambda: end_of_command(["list", "robot.toml", *draw.choice([[], ["--json"]])]),
        lambda: end_of_command([then, "robot.toml", *words, "-o", "out"]),
    ]


def inputs_case(draw: random.Random) -> list[Callable[[], End]]:
    """A file of inputs, through a static model, or now and then through the simulation."""
    index = draw.randrange(len(SMALL))
    reference, settings, model = SMALL[index]
    Path("in.csv").write_bytes(mutated(inputs_text(index), draw))
    how = draw.choice([*[["statics", "--model", model]] * 9, ["simulate"]])
    if how == ["simulate"] and draw.random() < 0.5 and _seconds("in.csv") < 5.0:  # longer ones may run longer
        how.append("--dynamic")
    words = [how[0], reference, *how[1:], "--inputs", "in.csv", "-o", "out"]
    return [lambda: end_of_command([*words, *(f"--set={item}" for item in settings)])]


def _seconds(path: str) -> float:
    try:
        return float(np.ptp(read_table(path).time_s))
    except InputError:
        return 0.0


def settings_case(draw: random.Random) -> list[Callable[[], End]]:
    """Settings of the command line, and of the library (environments take the same)."""
    index = draw.randrange(len(SMALL))
    reference, settings, model = SMALL[index]
    keys = [key for key, _ in leaves(to_document(load_robot(reference, settings)))]
    keys += [f"effects.{key}" for key in ("rate.lag_s", "actuation_gain.scale", "payload.force_x_N")]
    keys += ["name", "sources", "actuation", "kind", "effects", "segments", "tendons.0.name", "description"]
    valid = f"{draw.choice(keys)}={draw.choice([*NUMBERS, '0.1', '1', '2', 'x'])}"
    text = valid if draw.random() < 0.6 else mutated(valid, draw).decode("utf-8", "surrogateescape")
    text = text.replace("\x00", "")  # no argument of a program holds it
    Path("in.csv").write_text(inputs_text(index))
    words = ["statics", reference, "--model", model, "--inputs", "in.csv", "-o", "out"]
    return [
        lambda: end_of_call(lambda: load_robot(reference, [*settings, text])),
        lambda: end_of_command([*words, *(f"--set={item}" for item in settings), f"--set={text}"]),
    ]


def dataset_case(draw: random.Random) -> list[Callable[[], End]]:
    """A data set whose `dataset.toml` is wrong."""
    _write_dataset()
    Path("dataset.toml").write_bytes(mutated(DATASET, draw))
    return [lambda: end_of_call(lambda: split_trials(load_dataset(".")))]


def trial_case(draw: random.Random) -> list[Callable[[], End]]:
    """A data set one of whose trials is wrong."""
    _write_dataset()
    Path(draw.choice(["a.csv", "b.csv"])).write_bytes(mutated(TRIAL, draw))
    return [lambda: end_of_call(lambda: split_trials(load_dataset(".")))]


def _write_dataset() -> None:
    Path("dataset.toml").write_text(DATASET)
    Path("robot.toml").write_text(small_robot_text(0))
    for name, value in (("a", "0.4"), ("b", "0.35"), ("c", "0.3")):
        Path(f"{name}.csv").write_text(TRIAL.replace("0.4", value))


KINDS: dict[str, Callable[[random.Random], list[Callable[[], End]]]] = {
    "robot": robot_case,
    "inputs": inputs_case,
    "settings": settings_case,
    "dataset": dataset_case,
    "trial": trial_case,
}


def fault_of(kind: str, case: int) -> str:
    """Return what is wrong with the end of a case, "" for nothing. A second step needs a sound first one."""
    for step in KINDS[kind](random.Random(f"{kind} {case}")):
        try:
            end = step()
        except TooLong:
            return f"runs for more than {LIMIT_S} s"
        except Exception as error:
            return f"{type(error).__name__}: {error}"[:300]
        if end.fault():
            return f"{end.fault()}: {end.err[:300]}"
        if end.status != 0:
            break
    return ""


def faults(kind: str, cases: range) -> list[str]:
    """Return the faults of `cases`, each with its number."""
    found = ((case, fault_of(kind, case)) for case in cases)
    return [f"{kind} {case}: {fault}" for case, fault in found if fault]


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty working directory."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("kind", KINDS)
def test_valid_inputs_are_sound(kind: str) -> None:
    """What is mutated is valid before."""
    if kind in ("dataset", "trial"):
        _write_dataset()
        split_trials(load_dataset("."))
    for index, (reference, settings, model) in enumerate(SMALL):
        Path("in.csv").write_text(inputs_text(index))
        Path("robot.toml").write_text(small_robot_text(index))
        words = ["--model", model, "--inputs", "in.csv", "-o", "out"]
        if kind == "robot":
            assert end_of_command(["statics", "robot.toml", *words]) == End(0, "")
        elif kind in ("inputs", "settings"):
            changed = [f"--set={item}" for item in settings]
            assert end_of_command(["statics", reference, *words, *changed]) == End(0, "")


def test_a_fault_is_seen() -> None:
    """A long line, a defect, a warning, many lines, silence and a strange status are faults."""
    for end in (
        End(2, "x" * 1000),
        End(2, "error: internal error: KeyError"),
        End(0, "RuntimeWarning: overflow"),
        End(2, "a\nb\nc\nd\n"),
        End(2, ""),
        End(141, ""),
    ):
        assert end.fault()
    assert not End(2, "error: one line\n").fault()
    assert not End(0, "").fault()


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_wrong_input_ends_well(kind: str) -> None:
    """The first cases of each kind."""
    assert faults(kind, range(FIRST)) == []


@pytest.mark.parametrize(
    "part",
    [pytest.param(part, marks=pytest.mark.long if part else pytest.mark.slow) for part in range(_PARTS)],
)
@pytest.mark.parametrize("kind", KINDS)
def test_much_wrong_input_ends_well(kind: str, part: int) -> None:
    """All other cases."""
    share = (CASES - FIRST) // _PARTS
    assert faults(kind, range(FIRST + part * share, FIRST + (part + 1) * share)) == []


def test_all_cases_are_run() -> None:
    """The parts are all the cases, ten thousand in all."""
    assert (CASES - FIRST) % _PARTS == 0
    assert CASES * len(KINDS) == 10_000
