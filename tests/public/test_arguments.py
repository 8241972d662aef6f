"""Every public function checks its arguments in the same way, whatever they are given as."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from datetime import UTC, date, datetime, timedelta
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import catheter_sim as cs
from catheter_sim.core.robot import RobotSpec
from catheter_sim.public.data import table_of

ROBOT = "mitral_transseptal"
BEND = {"time_s": [0.0, 1.0], "displacement_bending_mm": [0.0, 1.0]}
TRIAL = BEND | {"tip_x_mm": [0.0, 1.0]}
NO_CHANNEL = {"time_s": [0.0], "nothing_mm": [1.0]}
FUNCTIONS = {name: getattr(cs, name) for name in cs.__all__ if inspect.isfunction(getattr(cs, name))}
WITH_ROBOT = [name for name, item in FUNCTIONS.items() if "robot" in inspect.signature(item).parameters]
ELSEWHERE = {"attach"}  # tested beside the simulator

# What a function makes of a robot, as a value that can be compared.
MADE: Mapping[str, Callable[[Any], Any]] = {
    "build": lambda robot: cs.build(robot).to_xml(),
    "control": lambda robot: cs.control(robot, {"angle_bending_deg": [0.0]}, models="pk").robot,
    "dataset": lambda robot: cs.dataset(robot, TRIAL).robot,
    "export": lambda robot: _refusal(cs.export, robot=robot, engine="none"),
    "inputs": lambda robot: cs.inputs(robot, BEND).tendon.tolist(),
    "inverse_kinematics": lambda robot: cs.inverse_kinematics(
        robot, {"tip_x_mm": [10.0]}, corrections=None
    ).inputs.tendon.tolist(),
    "laboratory": lambda robot: cs.laboratory(robot).limits,
    "list_effects": lambda robot: list(cs.list_effects(robot)),
    "list_models": lambda robot: list(cs.list_models(robot)),
    "read_inputs": lambda robot: cs.read_inputs(robot, "in.csv").tendon.tolist(),
    "save_robot": lambda robot: _text_of("saved.toml", partial(cs.save_robot, robot)),
    "sense": lambda robot: cs.sense(robot, BEND, uncertain={}).robot,
    "simulate": lambda robot: cs.simulate(robot, {"time_s": [0.0]}).postures[0].p_w.tolist(),
    "statics": lambda robot: cs.statics(robot, BEND, "pk").postures[1].p_w.tolist(),
    "to_pymjcf": lambda robot: cs.to_pymjcf(robot).to_xml_string(),
    "view": lambda robot: _sliders_of(robot),
    "which_model": lambda robot: cs.which_model(robot, BEND, reference="pk").robot,
    "workspace": lambda robot: cs.workspace(robot, samples=5).tip_mm.tolist(),
}
SLOW = {"build", "control", "export", "inverse_kinematics", "simulate", "to_pymjcf", "which_model"}

# Arguments with which a function ends soon, in an error or not.
SOON: Mapping[str, dict[str, Any]] = {
    "build": {"robot": "nothing"},
    "compare": {"before": "nowhere", "after": "nowhere"},
    "control": {"robot": ROBOT, "trajectory": NO_CHANNEL},
    "dataset": {"robot": ROBOT, "tables": TRIAL},
    "diagnose": {"dataset": "nowhere"},
    "diagnose_model": {"dataset": "nowhere"},
    "export": {"robot": "nothing", "engine": "none"},
    "inputs": {"robot": ROBOT, "table": NO_CHANNEL},
    "inverse_kinematics": {"robot": ROBOT, "targets": NO_CHANNEL},
    "laboratory": {"robot": ROBOT},
    "list_effects": {"robot": ROBOT},
    "list_models": {"robot": ROBOT},
    "load_dataset": {"path": "nowhere"},
    "load_robot": {"ref": ROBOT},
    "read_inputs": {"robot": ROBOT, "path": "nowhere"},
    "render": {"run": 5, "path": "tip.png"},
    "save_robot": {"robot": ROBOT, "path": "nowhere/robot.toml"},
    "sense": {"robot": ROBOT, "readings": NO_CHANNEL},
    "settle_together": {"simulators": "nothing"},
    "simulate": {"robot": ROBOT, "inputs": NO_CHANNEL},
    "statics": {"robot": ROBOT, "inputs": NO_CHANNEL, "model": "pk"},
    "step_together": {"simulators": "nothing"},
    "to_pymjcf": {"robot": "nothing"},
    "view": {"robot": "nothing"},
    "which_model": {"robot": ROBOT, "inputs": NO_CHANNEL},
    "workspace": {"robot": "nothing"},
}
WITHOUT = {"list_robots", "list_environments"}
JUNK: tuple[Any, ...] = (
    *(5, -1.5, "junk", object(), (), [], {"a": 1}, float("nan"), True, np.array([1.0, 2.0]), b"x", None),
    *([None], ["a", "b"], [[1]], np.int64(3), 3 + 4j, len),
)


def _refusal(call: Callable[..., Any], **arguments: Any) -> str:
    with pytest.raises(cs.InputError) as error:
        call(**arguments)
    return str(error.value)


def _sliders_of(robot: Any) -> list[str]:
    with cs.view(robot) as shown:
        return list(shown.table().columns)


def _text_of(name: str, write: Callable[[str], Any]) -> str:
    write(name)
    return Path(name).read_text()


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow) if name in SLOW else name for name in WITH_ROBOT]
)
def test_a_robot_is_an_id_a_file_or_a_robot(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whichever is given, the same comes out; what is none of these is refused in the same words."""
    if name in ELSEWHERE:
        return
    if name == "to_pymjcf":
        pytest.importorskip("dm_control")
    monkeypatch.chdir(tmp_path)
    Path("in.csv").write_text("time_s,displacement_bending_mm\n0,0\n1,1\n")
    robot = cs.load_robot(ROBOT)
    cs.save_robot(robot, "robot.toml")
    wanted = MADE[name](ROBOT)
    assert MADE[name](robot) == wanted
    if name != "laboratory":  # a file's bench has no reach of its own
        assert MADE[name]("robot.toml") == wanted
        assert MADE[name](tmp_path / "robot.toml") == wanted
    arguments = SOON[name] | {"robot": 5}
    told = "robot = 5: a robot, its id or the path of its .toml is needed"
    assert _refusal(FUNCTIONS[name], **arguments) == told
    assert isinstance(robot, RobotSpec)


def test_a_bench_holds_a_robot_that_no_paper_has(tmp_path: Path) -> None:
    """Given as a robot or as its file it is the same bench, and a data set names it by a file."""
    robot = cs.load_robot(ROBOT, {"friction.mu": 0.1})
    cs.save_robot(robot, tmp_path / "own.toml")
    limits = {"displacement_bending_mm": (-1.0, 1.0)}
    own, file = (cs.laboratory(item, limits=limits) for item in (robot, tmp_path / "own.toml"))
    assert own.robot == file.robot == robot
    assert own.limits == file.limits == limits
    assert own.rig.reference == f"{robot.name}.toml"
    assert cs.laboratory(cs.load_robot(ROBOT)).rig.reference == ROBOT


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(FUNCTIONS.keys() - WITHOUT - ELSEWHERE))
def test_what_no_argument_can_be_is_an_input_error(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of every argument of every function: a line, or it is taken; no other exception."""
    monkeypatch.chdir(tmp_path)
    for argument in inspect.signature(FUNCTIONS[name]).parameters:
        for junk in JUNK:
            try:
                FUNCTIONS[name](**(SOON[name] | {argument: junk}))
            except cs.InputError:
                continue
            except Exception as error:
                pytest.fail(f"{name}({argument}={junk!r}): {type(error).__name__}: {error}")


NUMBERS: tuple[tuple[str, str, dict[str, Any]], ...] = (
    ("compare", "jobs", {}),
    ("control", "noise_deg", {}),
    ("control", "seed", {}),
    ("control", "dead_band_mm", {"by": "torsion_distal"}),
    ("dataset", "warm_up_s", {}),
    ("diagnose", "budget_s", {}),
    ("diagnose", "jobs", {}),
    ("diagnose_model", "jobs", {}),
    ("inverse_kinematics", "tolerance_mm", {}),
    ("inverse_kinematics", "corrections", {}),
    ("laboratory", "seed", {}),
    ("laboratory", "longest_s", {}),
    ("sense", "noise_position_mm", {}),
    ("simulate", "most_steps", {}),
    ("which_model", "tolerance_percent", {}),
)


@pytest.mark.parametrize(("name", "argument", "how"), NUMBERS)
def test_numbers_of_numpy_are_pythons_and_a_boolean_is_none(
    name: str, argument: str, how: dict[str, str]
) -> None:
    """NumPy's whole numbers are taken where 1 is, and True is refused by the argument's name."""

    def said(value: Any) -> str:
        given = {how["by"]: value} if how else value
        try:
            FUNCTIONS[name](**(SOON[name] | {argument: given}))
        except cs.InputError as error:
            return str(error)
        return ""

    for one in (np.int64(1), np.uint8(1), np.array(1)):
        assert said(one) == said(1)
        assert argument not in said(one)
    for boolean in (True, np.True_):
        assert argument in said(boolean)


def test_half_floats_limits_bounds_and_vectors_are_taken() -> None:
    """NumPy's floats of any width within pairs, vectors and mappings, too; booleans there are refused."""
    half: Any = np.float32(0.5)
    range_mm: Any = np.array([0, 1], "f4")
    down: Any = (0, half, np.int8(-9))
    assert cs.laboratory(ROBOT, limits={"advance_mm": range_mm}).limits["advance_mm"] == (0.0, 1.0)
    free = cs.dataset(ROBOT, TRIAL, calibration={"friction.mu": (half - half, half)}).calibration
    assert free is not None
    assert [item.parameter.upper for item in free] == [0.5]
    assert cs.dataset(ROBOT, TRIAL, gravity_mps2=down).gravity_mps2.tolist() == [0, 0.5, -9]
    told = "gravity_mps2 = (True, 0, 0): three finite numbers are needed"
    assert _refusal(cs.dataset, robot=ROBOT, tables=TRIAL, gravity_mps2=(True, 0, 0)) == told
    assert "limits: advance_mm" in _refusal(cs.laboratory, robot=ROBOT, limits={"advance_mm": (False, True)})


@pytest.mark.parametrize(
    ("value", "taken"), [(np.True_, True), (np.bool_(False), True), ("no", False), (2, False)]
)
def test_flags_are_true_or_false(value: Any, taken: bool) -> None:
    """NumPy's booleans are; a text that says no is not taken for yes."""
    told = _refusal(cs.simulate, **SOON["simulate"], dynamic=value)
    assert told.startswith(
        "inputs: unknown input channel" if taken else f"dynamic = {value!r}: True or False"
    )


NOON = datetime(2024, 5, 1, 12)


@pytest.mark.parametrize(
    ("clock", "seconds"),
    [
        (np.array([0, 1500, 2500], "timedelta64[ms]"), [0.0, 1.5, 2.5]),
        (np.array([500, 1000], "timedelta64[ns]"), [5e-7, 1e-6]),
        (np.array([0, 2], "timedelta64[25s]"), [0.0, 50.0]),
        (np.array(["2024-05-01T12:00", "2024-05-01T12:01"], "datetime64[m]"), [0.0, 60.0]),
        (np.array(["2024-01-01T00:00:00.25", "2024-01-01T00:00:01"], "datetime64[ns]"), [0.0, 0.75]),
        (np.array(["2024-01", "2024-02"], "datetime64[M]"), [0.0, 31 * 86400.0]),
        ([timedelta(seconds=1), timedelta(milliseconds=1250)], [1.0, 1.25]),
        ([NOON, NOON + timedelta(microseconds=1)], [0.0, 1e-6]),
        ([NOON.replace(tzinfo=UTC), NOON.replace(tzinfo=UTC) + timedelta(hours=1)], [0.0, 3600.0]),
        ([date(2024, 2, 28), date(2024, 3, 1)], [0.0, 2 * 86400.0]),
    ],
)
def test_dates_and_durations_are_seconds_by_their_own_unit(clock: Any, seconds: list[float]) -> None:
    """Dates count from the first row; in every function that takes a table, as `table_of` is their door."""
    table = {"time_s": clock, "displacement_bending_mm": np.zeros(len(seconds))}
    np.testing.assert_allclose(table_of(table, "in").time_s, seconds, rtol=1e-12, atol=0.0)
    np.testing.assert_allclose(cs.inputs(ROBOT, table).time_s, np.subtract(seconds, seconds[0]), rtol=1e-12)
    measured = cs.dataset(ROBOT, table | {"tip_x_mm": np.arange(len(seconds))})
    np.testing.assert_allclose(measured.trials[0].outputs.time_s, seconds, rtol=1e-12)


@pytest.mark.parametrize(
    "clock",
    [
        np.array([0, 1], "timedelta64"),  # of no unit
        np.array([0, 1], "timedelta64[Y]"),  # of no length
        np.array(["NaT", "2024"], "datetime64[s]"),
        [NOON, None],
        [NOON, NOON.replace(tzinfo=UTC)],
        ["2024-05-01", "2024-05-02"],
        [True, False],
        [[0.0], [1.0, 2.0]],
    ],
)
def test_a_clock_without_seconds_is_refused(clock: Any) -> None:
    """In a line that names the column."""
    told = _refusal(cs.inputs, robot=ROBOT, table={"time_s": clock, "advance_mm": [0, 1]})
    assert told.startswith("inputs: ")
    assert "time_s" in told


def test_durations_dates_and_booleans_are_no_values_of_a_channel() -> None:
    """They would be read as the bare numbers that they are kept as."""
    for values in (np.array([0, 1], "timedelta64[ns]"), np.array([0, 1], "datetime64[s]"), [False, True]):
        told = _refusal(cs.inputs, robot=ROBOT, table={"time_s": [0, 1], "advance_mm": values})
        assert told.startswith("inputs: advance_mm: numbers are needed")
