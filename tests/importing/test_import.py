"""`import`: what is proposed for a tracker's file is how the file was written, and what is guessed says so.

The files are made from a static model of the robot, in frames, units and names of trackers and loggers.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.channels import output_table, read_inputs
from catheter_sim.diagnosis.dataset import load_dataset
from catheter_sim.errors import InputError
from catheter_sim.importing.propose import Asked, Proposal, import_files
from catheter_sim.tables import Table
from catheter_sim.theory.static_models import STATIC_MODELS

ROBOT = "mitral_transseptal"
TIP = ("tip_x_mm", "tip_y_mm", "tip_z_mm")
ROWS = 24
HEADER = "t_s,pull_bending,pull_torsion_proximal,X,Y,Z"
CLOCK = np.arange(float(ROWS))
PULLS = {
    "displacement_bending_mm": 2.0 * np.sin(0.42 * CLOCK),
    "displacement_torsion_proximal_mm": 0.6 * np.sin(0.23 * CLOCK),
}


@pytest.fixture(scope="module")
def tip() -> np.ndarray:
    """Positions of the robot's tip along `PULLS`, shape (r, 3) [mm], by its static model."""
    robot = load_robot(ROBOT)
    inputs = read_inputs(robot, Table(CLOCK, dict(PULLS)))
    run = STATIC_MODELS["pk"].solve(robot, inputs, np.zeros(3))
    columns = output_table(robot, CLOCK, run.postures, TIP).columns
    return np.stack([columns[name] for name in TIP], axis=1)


def written(path: Path, header: str, columns: list[np.ndarray], sign: str = ",") -> Path:
    """Write columns below a header, nine digits."""
    rows = [sign.join(f"{value:.12g}" for value in row) for row in zip(*columns, strict=True)]
    path.write_text(header + "\n" + "\n".join(rows) + "\n")
    return path


def entry(proposal: Proposal, key: str) -> dict:
    return dict(proposal.table[key])


def unsure(proposal: Proposal) -> set[str]:
    return {guess.key for guess in proposal.guesses if not guess.sure}


Saw = Callable[..., list[np.ndarray]]


def seen_y_up(tip: np.ndarray, scale: float = 1e-3) -> list[np.ndarray]:
    """Return positions in a frame whose y axis points along the robot's z, far from its base."""
    x, y, z = tip.T
    return [scale * (x + 412.0), scale * (z - 87.0), scale * (950.0 - y)]


def check_read_back(folder: Path, tip: np.ndarray) -> None:
    """What is read from the folder is the robot's own channels in their units, the tracker's origin apart."""
    (trial,) = load_dataset(folder).trials
    robot = load_robot(ROBOT)
    given = read_inputs(robot, Table(CLOCK, dict(PULLS)))
    np.testing.assert_allclose(trial.inputs.tendon, given.tendon, atol=1e-9)
    measured = np.stack([trial.outputs.columns[name] for name in TIP], axis=1)
    np.testing.assert_allclose(measured - measured[0], tip - tip[0], atol=1e-6)


def test_metres_epoch_seconds_y_up_and_motor_degrees(tip: np.ndarray, tmp_path: Path) -> None:
    """Everything is found: clock, unit of length, axes, motors by name; the spool is as stated."""
    motors = [np.degrees(pull / 10.0) for pull in PULLS.values()]
    header = "timestamp,motor_bending_deg,motor_torsion_proximal_deg,tool_x,tool_y,tool_z"
    path = written(tmp_path / "take.csv", header, [1731000000.25 + 0.5 * CLOCK, *motors, *seen_y_up(tip)])
    proposal, _ = import_files([path], ROBOT, tmp_path / "data", Asked(spool_radius_mm=10.0))
    assert entry(proposal, "time_s") == {"column": "timestamp", "unit": "s"}
    assert proposal.table["axes"] == ["x", "-z", "y"]
    assert entry(proposal, "tip")["unit"] == "m"
    assert unsure(proposal) == set()
    check_read_back(tmp_path / "data", tip)


def test_a_radius_that_is_not_stated_is_guessed_and_said_to_be(tip: np.ndarray, tmp_path: Path) -> None:
    """The radius with which the robot moves like the file, of round ones; it stays unsure."""
    motors = [np.degrees(pull / 7.5) for pull in PULLS.values()]
    header = "time (ms);servo bend;servo torsion proximal;X;Y;Z"
    path = written(tmp_path / "take.csv", header, [1e3 * CLOCK, *motors, *tip.T], ";")
    proposal, _ = import_files([path], ROBOT, tmp_path / "data", Asked())
    for channel in PULLS:
        assert entry(proposal, channel)["spool_radius_mm"] == 7.5
        assert f"map.{channel}.spool_radius_mm" in unsure(proposal)
    assert entry(proposal, "time_s")["unit"] == "ms"
    assert entry(proposal, "tip")["unit"] == "mm"


def test_metres_that_nothing_states_are_found_and_stay_unsure(tip: np.ndarray, tmp_path: Path) -> None:
    """As mm the robot would hardly move; neither unit is called sure, nor the motion. Stated, both are."""
    pulls = [1e-3 * pull for pull in PULLS.values()]
    path = written(
        tmp_path / "take.csv",
        HEADER,
        [CLOCK, *pulls, *seen_y_up(tip)],
    )
    proposal, _ = import_files([path], ROBOT, tmp_path / "data", Asked())
    units = {f"map.{channel}.unit" for channel in PULLS} | {"map.tip.unit"}
    assert {entry(proposal, key)["unit"] for key in (*PULLS, "tip")} == {"m"}
    assert units <= unsure(proposal)
    check_read_back(tmp_path / "data", tip)
    proposal, _ = import_files([path], ROBOT, tmp_path / "again", Asked(input_unit="m", point_unit="m"))
    assert not units & unsure(proposal)
    check_read_back(tmp_path / "again", tip)
    with pytest.raises(InputError, match=r"--input-unit N: displacement_bending_mm is in mm; choices: mm, m"):
        import_files([path], ROBOT, tmp_path / "wrong", Asked(input_unit="N"))
    small = written(tmp_path / "mm.csv", HEADER, [CLOCK, *PULLS.values(), *tip.T])
    proposal, _ = import_files([small], ROBOT, tmp_path / "mm", Asked())
    assert {entry(proposal, key)["unit"] for key in (*PULLS, "tip")} == {"mm"}
    assert units <= unsure(proposal)


def test_a_motor_that_turns_the_other_way_is_seen(tip: np.ndarray, tmp_path: Path) -> None:
    """One sign of two turned is no motion of the tracker: the robot says which."""
    bending, torsion = PULLS.values()
    header = "t_s,disp_bending_mm,disp_torsion_proximal_mm,X,Y,Z"
    path = written(tmp_path / "take.csv", header, [CLOCK, bending, -torsion, *tip.T])
    proposal, _ = import_files([path], ROBOT, tmp_path / "data", Asked())
    turned = [name for name in PULLS if entry(proposal, name).get("sign") == -1]
    assert len(turned) == 1
    assert {f"map.{name}.sign" for name in turned} <= unsure(proposal)


def test_motive_take_beside_the_motors_log(tip: np.ndarray, tmp_path: Path) -> None:
    """The take is in the head's metres; the log's clock runs beside it; columns are matched by name."""
    kinds = "Rigid Body"
    head = (
        "Format Version,1.23,Take Name,a,Rotation Type,Quaternion,Length Units,Meters,Coordinate Space,Global"
        "\n\n"
        f",,{kinds},{kinds},{kinds},Marker,Marker,Marker\n,,Base,Base,Base,Tip,Tip,Tip\n,,1,1,1,2,2,2\n"
        ",,Position,Position,Position,Position,Position,Position\nFrame,Time (Seconds),X,Y,Z,X,Y,Z"
    )
    still = [np.full(ROWS, value) for value in (0.4, 0.9, 0.1)]
    take = written(tmp_path / "take.csv", head, [CLOCK, CLOCK, *still, *seen_y_up(tip)])
    log = written(tmp_path / "log.csv", "t,bending_mm,torsion_proximal_mm", [CLOCK, *PULLS.values()])
    proposal, data = import_files([take], ROBOT, tmp_path / "data", Asked(log=log))
    assert entry(proposal, "tip") == {
        "columns": ["Tip Position X", "Tip Position Y", "Tip Position Z"],
        "unit": "m",
    }
    assert "map.tip.unit" not in unsure(proposal)
    assert len(data.trials[0].inputs) == ROWS
    check_read_back(tmp_path / "data", tip)


def test_clocks_that_never_meet_both_begin_at_their_first_rows(tip: np.ndarray, tmp_path: Path) -> None:
    """A take from zero beside a log of epoch seconds: taken to begin together, and said to be a guess."""
    take = written(tmp_path / "take.csv", "t,X,Y,Z", [CLOCK, *tip.T])
    log = written(
        tmp_path / "log.csv", "epoch_s,bending_mm,torsion_proximal_mm", [1.7e9 + CLOCK, *PULLS.values()]
    )
    proposal, _ = import_files([take], ROBOT, tmp_path / "data", Asked(log=log))
    assert {"map.time_s.origin", "map.inputs_time_s.origin"} <= unsure(proposal)
    check_read_back(tmp_path / "data", tip)


def test_vicon_export_with_the_motors_on_an_analog_card(tip: np.ndarray, tmp_path: Path) -> None:
    """Trajectories and devices stand in one file, frames are seconds by their rate, units are the file's."""
    written(tmp_path / "a", "Frame,Sub Frame,X,Y,Z\n,,mm,mm,mm", [CLOCK + 1, 0 * CLOCK, *seen_y_up(tip, 1.0)])
    written(
        tmp_path / "b",
        "Frame,Sub Frame,bending,torsion_proximal\n,,mm,mm",
        [CLOCK + 1, 0 * CLOCK, *PULLS.values()],
    )
    parts = [(tmp_path / name).read_text() for name in ("a", "b")]
    text = f"Trajectories\n100\n,,Arm:Tip,,\n{parts[0]}\nDevices\n100\n,,Drive,\n{parts[1]}"
    (tmp_path / "take.csv").write_text(text)
    proposal, data = import_files([tmp_path / "take.csv"], ROBOT, tmp_path / "data", Asked())
    assert proposal.table["axes"] == ["x", "-z", "y"]
    assert data.trials[0].inputs.time_s[-1] == pytest.approx(0.01 * (ROWS - 1))
    check_read_back(tmp_path / "data", tip)


def test_a_data_sets_own_columns_are_taken_as_they_are(tip: np.ndarray, tmp_path: Path) -> None:
    """Names that are channels already need no guess but the axes."""
    path = written(tmp_path / "t.csv", ",".join(("time_s", *PULLS, *TIP)), [CLOCK, *PULLS.values(), *tip.T])
    proposal, _ = import_files([path], ROBOT, tmp_path / "data", Asked())
    assert proposal.inputs == tuple(PULLS)
    assert proposal.outputs == TIP
    assert proposal.table["axes"] == ["x", "y", "z"]
    assert unsure(proposal) == set()


@pytest.mark.parametrize(
    ("header", "message"),
    [
        ("a,b,c,X,Y,Z", "no column that can be an input; mitral_transseptal has displacement_bending_mm"),
        ("time_s,bending_mm,d,e,f,g", "no point with x, y and z"),
    ],
)
def test_a_file_without_inputs_or_positions_is_refused(
    header: str, message: str, tip: np.ndarray, tmp_path: Path
) -> None:
    """One line says what is missing and which columns there are; nothing is written."""
    texts = [np.full(ROWS, np.nan)] if header.startswith("a") else [PULLS["displacement_bending_mm"]]
    columns = [CLOCK, *texts, texts[0], *tip.T]
    path = written(tmp_path / "take.csv", header, columns)
    with pytest.raises(InputError, match=message):
        import_files([path], ROBOT, tmp_path / "data", Asked())
    assert not (tmp_path / "data").exists()


def test_a_folder_with_a_data_set_is_not_written_over(tip: np.ndarray, tmp_path: Path) -> None:
    """What a user has changed by hand stays."""
    (tmp_path / "dataset.toml").write_text("mine")
    path = written(
        tmp_path / "take.csv", "t,bending_mm,X,Y,Z", [CLOCK, PULLS["displacement_bending_mm"], *tip.T]
    )
    with pytest.raises(InputError, match="is there already"):
        import_files([path], ROBOT, tmp_path, Asked())
    assert (tmp_path / "dataset.toml").read_text() == "mine"
