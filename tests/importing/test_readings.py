"""`import` beside the robot: encoders, planes and pictures are read, and what rests on a guess is a guess.

The files are made by a formula, an arc of constant curvature, not by the package.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from catheter_sim.cli.main import main
from catheter_sim.diagnosis.dataset import load_dataset
from catheter_sim.errors import InputError
from catheter_sim.importing.propose import Asked, Proposal, import_files

LENGTH_MM, RADIUS_MM = 87.0, 4.0
CLOCK = np.arange(60.0)
PULL_MM = 3.6 * np.sin(0.31 * CLOCK) * (0.5 + CLOCK / 120.0)  # up to 50 deg


def robot(folder: Path, angle_deg: float = 0.0) -> str:
    """Write a probe of one antagonistic pair that bends toward an angle; return its file."""
    tendons = "".join(
        f'[[tendons]]\nname = "{name}"\nchannel = "wheel"\nchannel_gain = {gain}\nradius_mm = {RADIUS_MM}\n'
        f'angle_deg = {angle_deg + turned}\nends_at = "tip"\nstiffness_N_per_mm = 2000.0\n'
        for name, gain, turned in (("left", 1.0, 0.0), ("right", -1.0, 180.0))
    )
    (folder / "probe.toml").write_text(
        'name = "probe"\ndescription = "one pair (assumed)"\nactuation = "displacement"\n'
        f'[[segments]]\nname = "tip"\nlength_mm = {LENGTH_MM}\ndisks = 12\nouter_radius_mm = 5.0\n'
        "bending_stiffness_N_mm2 = 3000.0\nmass_g = 8.0\ntorsion_stiffness_N_mm2 = 2500.0\n"
        f"{tendons}[friction]\nmu = 0.0\n"
    )
    return str(folder / "probe.toml")


def arc(angle_deg: float = 0.0) -> np.ndarray:
    """Return the tip of an arc along `PULL_MM`, shape (r, 3) [mm]: a way is a radius times a bend."""
    bend = np.where(PULL_MM == 0.0, 1e-9, PULL_MM / RADIUS_MM)
    across = LENGTH_MM / bend * (1.0 - np.cos(bend))
    toward = math.radians(angle_deg)
    return np.stack(
        [across * math.cos(toward), across * math.sin(toward), LENGTH_MM / bend * np.sin(bend)], axis=1
    )


def written(path: Path, header: str, *columns: np.ndarray) -> Path:
    rows = [",".join(f"{value:.9g}" for value in row) for row in zip(CLOCK, *columns, strict=True)]
    path.write_text(f"time_s,{header}\n" + "\n".join(rows) + "\n")
    return path


def proposed(path: Path, angle_deg: float = 0.0, **asked: object) -> tuple[Proposal, np.ndarray]:
    """Return the proposal for a file, and the pulls that are read back through it, shape (r,) [mm]."""
    folder = path.parent / "data"
    proposal, _ = import_files([path], robot(path.parent, angle_deg), folder, Asked(**asked))  # type: ignore[arg-type]
    (trial,) = load_dataset(folder).trials
    return proposal, 1e3 * trial.inputs.tendon[:, 0]


def unsure(proposal: Proposal) -> set[str]:
    return {guess.key.removeprefix("map.") for guess in proposal.guesses if not guess.sure}


WHEEL = "displacement_wheel_mm"


@pytest.mark.parametrize(
    ("turn", "start", "spool_mm", "unit"),
    [(4096, 2048, 3.0, 1.0), (4096, 1600, 3.0, 0.1), (2000, 1000, 2.0, 1e-3), (16384, 8192, 5.0, 1.0)],
)
def test_counts_are_recognised_and_said_to_be_guessed(
    turn: int, start: int, spool_mm: float, unit: float, tmp_path: Path
) -> None:
    """Whole numbers far from zero: the pulls come out as they were, and all that rests on it is unsure."""
    counts = start + np.round(PULL_MM / spool_mm * turn / math.tau)
    path = written(tmp_path / "take.csv", "Motor position,X,Y,Z", counts, *(unit * arc().T))
    proposal, pulls = proposed(path)
    entry = proposal.table[WHEEL]
    assert (entry["unit"], entry["counts_per_turn"], entry["zero"]) == ("counts", turn, start)
    assert entry["spool_radius_mm"] == spool_mm
    np.testing.assert_allclose(pulls, PULL_MM - PULL_MM[0], atol=0.02)
    assert proposal.table["tip"]["unit"] == {1.0: "mm", 0.1: "cm", 1e-3: "m"}[unit]
    sizes = {f"{WHEEL}.{key}" for key in ("unit", "counts_per_turn", "spool_radius_mm")}
    assert sizes | {"tip.unit", "axes"} <= unsure(proposal)


@pytest.mark.slow
def test_stated_counts_are_sure(tmp_path: Path) -> None:
    """With unit, turn and spool stated only the zero is guessed; a turn alone is found by the motion."""
    counts = 700 + np.round(PULL_MM / 3.0 * 2000 / math.tau)
    path = written(tmp_path / "take.csv", "wheel,X,Y,Z", counts, *arc().T)
    proposal, pulls = proposed(path, motor_unit="counts", counts_per_turn=2000.0, spool_radius_mm=3.0)
    assert unsure(proposal) == {f"{WHEEL}.zero"}
    np.testing.assert_allclose(pulls, PULL_MM - PULL_MM[0], atol=0.01)
    (tmp_path / "data" / "dataset.toml").unlink()
    proposal, _ = proposed(path, spool_radius_mm=3.0)
    assert proposal.table[WHEEL]["counts_per_turn"] in (
        2000.0,
        2048.0,
    )  # too near to tell by a robot's motion
    assert f"{WHEEL}.counts_per_turn" in unsure(proposal)


@pytest.mark.slow
def test_angles_are_no_counts(tmp_path: Path) -> None:
    """Degrees with decimals far from zero, and whole ones near it, stay degrees."""
    angles: list[np.ndarray] = [512.0 + np.degrees(PULL_MM / 3.0), np.round(np.degrees(PULL_MM / 2.5))]
    for number, angle_deg in enumerate(angles):
        folder = tmp_path / str(number)
        folder.mkdir()
        proposal, _ = proposed(written(folder / "take.csv", "motor,X,Y,Z", angle_deg, *arc().T))
        assert proposal.table[WHEEL]["unit"] == "deg"


PLANES = [
    ("tip_a,tip_b", (0, 2), (1.0, 1.0), 1.0, 0.0, "mm"),
    ("tip_a,tip_b", (0, 2), (-1.0, 1.0), 0.1, 0.0, "cm"),
    ("tip_b,tip_a", (2, 0), (1.0, -1.0), 1e-3, 0.0, "m"),
    ("tip_a,tip_b", (1, 2), (1.0, 1.0), 1.0 / 25.4, 90.0, "in"),
    ("u,v", (0, 2), (1.0, -1.0), 3.2, 0.0, None),
    ("cam_u_px,cam_v_px", (2, 1), (1.0, 1.0), 11.0, 90.0, None),
]


@pytest.mark.parametrize(("names", "axes", "signs", "scale", "toward_deg", "unit"), PLANES)
def test_two_coordinates_are_found_by_the_robots_own_motion(
    names: str,
    axes: tuple[int, int],
    signs: tuple[float, float],
    scale: float,
    toward_deg: float,
    unit: str | None,
    tmp_path: Path,
) -> None:
    """Which moving coordinate each column is, its sign, and its unit or mm for a pixel; all unsure."""
    header = names.replace("tip_a", "tip_x").replace("tip_b", "tip_y")
    tip = arc(toward_deg)
    columns = [40.0 + scale * sign * tip[:, axis] for axis, sign in zip(axes, signs, strict=True)]
    if header.startswith("tip_y"):
        header, columns = "tip_x,tip_y", columns
    path = written(tmp_path / "take.csv", f"displacement_wheel_mm,{header}", PULL_MM, *columns)
    proposal, _ = proposed(path, toward_deg)
    outputs = [f"tip_{'xyz'[axis]}_mm" for axis in axes]
    assert set(proposal.outputs) == set(outputs)
    for name, sign, column in zip(outputs, signs, header.split(","), strict=True):
        entry = proposal.table[name]
        assert (entry["column"], entry.get("sign", 1)) == (column, sign)
        assert entry.get("unit") == unit
        if unit is None:
            assert entry["scale"] == pytest.approx(1.0 / scale, rel=0.1)
        assert name in unsure(proposal)
    (trial,) = load_dataset(tmp_path / "data").trials
    for name, axis in zip(outputs, axes, strict=True):
        read = trial.outputs.columns[name]
        np.testing.assert_allclose(np.ptp(read), np.ptp(tip[:, axis]), rtol=0.1)


def test_a_plane_that_the_robot_does_not_show_is_written_by_hand(tmp_path: Path) -> None:
    """A motor that stands still moves no robot; the line says what to write."""
    path = written(tmp_path / "take.csv", "displacement_wheel_mm,u,v", 0.0 * PULL_MM, *arc().T[[0, 2]])
    with pytest.raises(InputError, match=r"which coordinates 'u' and 'v' are\. .*tip_x_mm = \{"):
        proposed(path)


def test_two_motors_of_one_name_are_no_point(tmp_path: Path) -> None:
    """`motor_x` and `motor_y` are no place in a plane."""
    path = written(tmp_path / "take.csv", "motor_x,motor_y", PULL_MM, PULL_MM)
    with pytest.raises(InputError, match="no point with x, y and z, or two of a plane"):
        proposed(path)


@pytest.mark.slow
def test_what_rests_on_a_guess_is_a_guess(tmp_path: Path) -> None:
    """A guessed spool makes the points' unit and axes unsure; stated, the same file's are sure."""
    path = written(tmp_path / "take.csv", "motor_deg,X,Y,Z", np.degrees(PULL_MM / 7.5), *(1e-3 * arc().T))
    proposal, _ = proposed(path)
    assert {"tip.unit", "axes", f"{WHEEL}.spool_radius_mm"} <= unsure(proposal)
    (tmp_path / "data" / "dataset.toml").unlink()
    proposal, _ = proposed(path, spool_radius_mm=7.5)
    assert "tip.unit" not in unsure(proposal)


def test_a_robot_that_moves_otherwise_is_no_evidence(tmp_path: Path) -> None:
    """Inputs are sure, but the points go their own way: neither their unit nor the axes are."""
    strange = np.stack([np.sin(1.7 * CLOCK), np.cos(2.3 * CLOCK), np.sin(2.9 * CLOCK)])
    path = written(tmp_path / "take.csv", "displacement_wheel_mm,X,Y,Z", PULL_MM, *(20.0 * strange))
    proposal, _ = proposed(path)
    assert {"tip.unit", "axes"} <= unsure(proposal)
    assert proposal.table["tip"]["unit"] == "mm"  # 40 mm of 87; as cm it would be five robots


def test_guessed_tensions_make_the_unit_unsure(tmp_path: Path) -> None:
    """A section's tensions whose column says no unit."""
    pull = 0.12 * (1.0 - np.cos(0.4 * CLOCK))
    bend = np.where(pull == 0.0, 1e-9, 2.5 * pull)
    tip = np.stack([60.0 / bend * (1.0 - np.cos(bend)), 0.0 * bend, 60.0 / bend * np.sin(bend)])
    keys = {}
    for header in ("tension right", "tension right [N]"):
        path = written(tmp_path / "take.csv", f"{header},X,Y,Z", pull, *tip)
        folder = tmp_path / header.replace(" ", "_")
        keys[header], _ = import_files([path], "neuroendoscope_section", folder, Asked())
    assert {"tension_right_N.unit", "tip.unit"} <= unsure(keys["tension right"])
    assert "tip.unit" not in unsure(keys["tension right [N]"])


@pytest.mark.slow
def test_a_reading_far_beyond_the_robot_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Counts stated to be degrees: 90 deg take pi/2 of 4 mm; the line says how many times that it is."""
    counts = 2048 + np.round(PULL_MM / 3.0 * 4096 / math.tau)
    path = written(tmp_path / "take.csv", "Motor,X,Y,Z", counts, *arc().T)
    given = [str(path), "--robot", robot(tmp_path), "--unit", "deg", "--spool-radius", "25"]
    assert main(["import", *given, "-o", str(tmp_path / "data")]) == 0
    out = capsys.readouterr().out
    (line,) = [line for line in out.splitlines() if line.startswith("DOUBT")]
    most = np.quantile(np.abs(counts - counts[0]), 0.95) * math.radians(25.0)
    assert f"{most / (RADIUS_MM * math.pi / 2.0):.0f} times the 6.3 mm that bend the robot fully" in line
    assert "an encoder's counts read as an angle" in line
    unsure_lines = sum(line.startswith("UNSURE") for line in out.splitlines())
    sure_lines = sum(line.startswith("sure") for line in out.splitlines())
    assert f"60 rows; {unsure_lines} of {unsure_lines + sure_lines} things are UNSURE" in out
    right = [*given[:3], "--unit", "counts", "--counts-per-turn", "4096", "--spool-radius", "3"]
    assert main(["import", *right, "-o", str(tmp_path / "right")]) == 0
    assert "DOUBT" not in capsys.readouterr().out


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--counts-per-turn", "0"], "--counts-per-turn 0: must be above 0"),
        (
            ["--unit", "deg", "--counts-per-turn", "9"],
            "--counts-per-turn: goes with --unit counts, not with deg",
        ),
    ],
)
def test_impossible_counts_are_refused(
    options: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = written(tmp_path / "take.csv", "Motor,X,Y,Z", PULL_MM, *arc().T)
    assert main(["import", str(path), "--robot", robot(tmp_path), "-o", str(tmp_path / "d"), *options]) == 2
    assert message in capsys.readouterr().err
