"""The transseptal catheter's tip by PK, MK, PI and their hybrid (Nayar 2022, Tables III and IV)."""

from __future__ import annotations

import csv
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.optimize import brentq

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.robots.catheter import measured as modified
from catheter_sim.robots.catheter.description import moved_segment
from catheter_sim.robots.catheter.kinematics import angle_rad, pulled_m, tool_frame
from catheter_sim.robots.catheter.measured import TorsionCalibration
from catheter_sim.robots.catheter.published import mitral_transseptal_rigid_end, mitral_transseptal_tube
from catheter_sim.robots.catheter.spec import CatheterRobot
from catheter_sim.robots.catheter.statics import balance
from catheter_sim.simulation.replay import simulate
from catheter_sim.tables import replaced_when_whole
from catheter_sim.validation import pictures
from catheter_sim.validation.lines import (
    ASSUMED,
    FITTED,
    MISSED,
    NO_GRAVITY,
    OUT_OF_REACH,
    PREDICTED,
    REFUTED,
    Line,
    ValidatedMotion,
    Validation,
    largest_distance,
    tips_mm,
)
from catheter_sim.validation.mitral import (
    JOINTS,
    PLATEAUS,
    ROWS_PER_S,
    CalibratedModels,
    calibrated,
    joint_angles_deg,
    largest_displacement_m,
    loops_of,
    moving_joint,
)

# ----------------------------------------------------------------------------------------------------
# The robots are `@tube` and `@rigid_end`: the dead-bands of Eqs 25-26, tendons that stretch, friction. They
# differ in where the tip is: 10.5 or 20 mm beyond the bending joint. All three joints move at once. The
# paper prints no trajectory, so it is chosen here (`trajectory`): in a cycle of 35 s the bending joint goes
# to 6 mm and back once, the proximal torsion joint to its printed plateau twice, the distal one three
# times. MK, PI and hybrid are calibrated as in the paper, on loops of each joint alone; MK is also taken as
# printed. The statics of joints and tendons give the tips (`balance`); the simulation is held against them.
#
# One number of the unknown trajectory is fitted: `amplitude` scales all three displacements, each held at
# its printed range (6 mm, the plateaus), so that more than 1 means a longer stay there. It is fitted to
# PK's error in space at no advance, and then PK's other rows and columns and PI's are predicted. MK and
# hybrid know the dead-bands of the very robot, so that how far they get is no prediction.
#
# Table IV, the tortuous path, leaves open on which loops MK was calibrated: "using the MK model here leads
# to large RMSE values". Both readings are shown: calibrated along that path, and along the straight one.

NAME = "mitral_transseptal"
CYCLE_S, CYCLES = 35.0, 2  # Nayar 2022, Section IV-C: a cycle's time; cycles are chosen
SWINGS = (1, 2, 3)  # of the joints in a cycle; chosen
ADVANCES_MM = (0.0, 10.0, 20.0)
PATH_DEG, PATH_MU = 180.0, 0.2  # of the tortuous path: assumed, from the vena cava through the septum
MODELS = ("PK", "MK as printed", "MK", "PI", "hybrid")
ELSEWHERE = ("MK", "PI", "hybrid")  # models that have a calibration: along the same path, or along another
COLUMNS = ("X", "Y", "Z", "3D")
SETS: Mapping[str, Callable[[], CatheterRobot]] = {
    "@tube": mitral_transseptal_tube,
    "@rigid_end": mitral_transseptal_rigid_end,
}
Row = tuple[float, float, float, float]  # X, Y, Z, 3D [mm]
TABLE_3_MM: Mapping[float, Mapping[str, Row]] = {
    0.0: {
        "PK": (14.67, 19.49, 38.37, 45.47),
        "MK": (2.51, 1.81, 2.52, 4.00),
        "PI": (2.45, 5.37, 5.76, 8.25),
        "hybrid": (2.35, 1.77, 2.52, 3.88),
    },
    10.0: {
        "PK": (18.00, 25.01, 49.21, 58.06),
        "MK": (3.62, 2.41, 2.25, 4.90),
        "PI": (2.59, 7.19, 6.40, 9.96),
        "hybrid": (3.41, 2.29, 2.25, 4.69),
    },
    20.0: {
        "PK": (20.05, 29.67, 58.44, 68.54),
        "MK": (4.05, 2.53, 3.63, 6.00),
        "PI": (3.98, 8.22, 8.66, 12.59),
        "hybrid": (3.81, 2.43, 3.63, 5.79),
    },
}
TABLE_4_MM: Mapping[float, Mapping[str, Row]] = {
    0.0: {"PK": (7.34, 10.23, 20.99, 24.47), "PI": (3.40, 0.83, 1.26, 3.72)},
    10.0: {"PK": (11.53, 15.21, 26.02, 32.37), "PI": (3.12, 2.91, 1.53, 4.53)},
    20.0: {"PK": (16.06, 18.99, 33.76, 41.93), "PI": (2.92, 5.59, 1.76, 6.54)},
}
TABLES = {"straight": ("Table III", TABLE_3_MM), "tortuous": ("Table IV", TABLE_4_MM)}
AMPLITUDES = (0.1, 100.0)  # between which the one number is sought
RIMS_MEET_RAD = np.radians(263.9)  # Nayar 2022, Section II-A: 264 deg at most
FITTED_TO = (0.0, "PK", 3)  # advance [mm], model, column of the row that it is fitted to
_SPECIMEN = "The specimen's own curvature, couplings and tracker are not printed"


def tortuous(robot: CatheterRobot) -> CatheterRobot:
    """Return the robot with its tendons led through a tortuous path (Section IV-D)."""
    return replace(robot, path_rad=float(np.radians(PATH_DEG)), friction=replace(robot.friction, mu=PATH_MU))


def straight(model: str) -> str:
    """Return what a model that was calibrated along the straight path is called."""
    return f"{model} calibrated along the straight path"


@dataclass(frozen=True)
class TipModels:
    """A robot on one path, and its models.

    Attributes:
        robot: of the transseptal design.
        models: calibrated on its own loops.
        elsewhere: calibrated along the straight path, where that is another one.
    """

    robot: CatheterRobot
    models: CalibratedModels
    elsewhere: CalibratedModels | None = None


def trajectory(robot: CatheterRobot, advance_mm: float, amplitude: float = 1.0) -> Inputs:
    """Return the chosen displacements and advance in time, shape (r, 4) [m]."""
    time = np.arange(round(CYCLE_S * CYCLES * ROWS_PER_S) + 1) / ROWS_PER_S
    rows = np.zeros((len(time), 4))
    for pair, (joint, swings) in enumerate(zip(JOINTS, SWINGS, strict=True)):
        share = amplitude * (0.5 - 0.5 * np.cos(2.0 * np.pi * swings * time / CYCLE_S))
        rows[:, pair] = largest_displacement_m(robot, joint) * np.minimum(share, 1.0)
    rows[:, 3] = advance_mm * 1e-3 * np.minimum(time / 5.0, 1.0)
    return moving_joint(rows)


def motion(
    bench: TipModels, advance_mm: float, amplitude: float = 1.0, simulated: bool = False
) -> ValidatedMotion:
    """Return the chosen motion at an advance by the statics, or simulated, and by every model."""
    inputs = trajectory(bench.robot, advance_mm, amplitude)
    if simulated:
        postures = simulate(bench.robot, inputs, NO_GRAVITY, dynamic=True).postures
    else:
        postures = balance(bench.robot, inputs, NO_GRAVITY).postures
    told = {name: _tips_mm(bench.robot, bench.models, inputs.tendon, name) for name in MODELS}
    if bench.elsewhere is not None:
        told |= {
            straight(name): _tips_mm(bench.robot, bench.elsewhere, inputs.tendon, name) for name in ELSEWHERE
        }
    return ValidatedMotion(inputs.time_s, tips_mm(postures), told)


def _tips_mm(robot: CatheterRobot, models: CalibratedModels, rows_m: Array, model: str) -> Array:
    """Return the tips that a model predicts, shape (r, 3) [mm]."""
    angles = {joint: _angle_rad(robot, models, joint, rows_m[:, k], model) for k, joint in enumerate(JOINTS)}
    q = np.stack(
        [angles["torsion_proximal"], angles["bending"], rows_m[:, 3], angles["torsion_distal"]], axis=1
    )
    return tool_frame(robot, q)[:, :3, 3] * 1e3


def _angle_rad(robot: CatheterRobot, models: CalibratedModels, joint: str, way_m: Array, model: str) -> Array:
    segment = robot.segments[moved_segment(robot, JOINTS.index(joint))]
    if model == "PK":
        return angle_rad(segment, way_m)
    if model == "PI" or (model == "hybrid" and joint != "bending"):
        return models.plays[joint](way_m)
    printed = model == "MK as printed"
    if joint == "bending":
        return modified.bending_rad(segment, way_m, modified.BENDING if printed else models.bending)
    torsion: Mapping[str, TorsionCalibration] = PLATEAUS if printed else models.torsion
    return modified.torsion_rad(segment, way_m, torsion[joint])


# ----------------------------------------------------------------------------------------------------
# Both tables by column, for both sets: as the trajectory was chosen, and with its one number fitted.


@dataclass(frozen=True)
class TableRow:
    """One row of Table III or IV for one set.

    Attributes:
        set_name, path, advance_mm, model: which row; `model` of `MODELS`.
        printed_mm: X, Y, Z, 3D; None where the paper prints none.
        chosen_mm: ours along the chosen trajectory, shape (4,).
        fitted_mm: ours with the fitted amplitude, shape (4,); None where no amplitude gives the fitted row.
    """

    set_name: str
    path: str
    advance_mm: float
    model: str
    printed_mm: Row | None
    chosen_mm: Array
    fitted_mm: Array | None

    @property
    def kind(self) -> str:
        """What ours with the fitted amplitude is worth."""
        if (self.advance_mm, self.model) == FITTED_TO[:2]:
            return FITTED
        return PREDICTED if self.model in ("PK", "PI") else OUT_OF_REACH


@dataclass(frozen=True)
class SetTables:
    """A set's rows of one table, and the amplitude that was fitted; None where none gives the row."""

    rows: tuple[TableRow, ...]
    amplitude: float | None


def benches(set_name: str) -> dict[str, TipModels]:
    """Return a set's robot along both paths, with its models, by path."""
    robot = SETS[set_name]()
    along = {"straight": robot, "tortuous": tortuous(robot)}
    models = {
        path: calibrated(item, {joint: loops_of(item, joint, by_statics=True) for joint in JOINTS})
        for path, item in along.items()
    }
    return {
        "straight": TipModels(robot, models["straight"]),
        "tortuous": TipModels(along["tortuous"], models["tortuous"], models["straight"]),
    }


def fitted_amplitude(bench: TipModels, printed_mm: float) -> float | None:
    """Return the amplitude at which PK's error in space at no advance is the printed one, None if none."""

    def excess(log_amplitude: float) -> float:
        found = motion(bench, FITTED_TO[0], float(np.exp(log_amplitude)))
        return float(found.rmse_mm(FITTED_TO[1])[FITTED_TO[2]]) - printed_mm

    low, high = np.log(AMPLITUDES)
    if excess(low) * excess(high) > 0.0:
        return None
    return float(np.exp(brentq(excess, low, high, xtol=1e-4)))


def set_tables(set_name: str, path: str, bench: TipModels) -> SetTables:
    """Return a set's rows of the table of a path: those that are printed, and MK and hybrid besides."""
    table = TABLES[path][1]
    amplitude = fitted_amplitude(bench, table[FITTED_TO[0]][FITTED_TO[1]][FITTED_TO[2]])
    rows = []
    for advance in ADVANCES_MM:
        chosen = motion(bench, advance)
        fitted = None if amplitude is None else motion(bench, advance, amplitude)
        for name in chosen.model_mm:
            ours = None if fitted is None else fitted.rmse_mm(name)
            printed = table[advance].get(name)
            rows.append(TableRow(set_name, path, advance, name, printed, chosen.rmse_mm(name), ours))
    return SetTables(tuple(rows), amplitude)


def farthest_mm(set_name: str) -> float:
    """Return the largest difference of PK's and MK's tips along z, at any displacement, no advance [mm].

    Without torsion, which turns about z. Nayar 2022, Eqs 3, 15 and 25, printed numbers.
    """
    robot = SETS[set_name]()
    segment = robot.segments[1]
    way = np.linspace(0.0, float(pulled_m(segment, RIMS_MEET_RAD)), 601)
    z = []
    for bend in (angle_rad(segment, way), modified.bending_rad(segment, way)):
        q = np.zeros((len(way), 4))
        q[:, 1] = bend
        z.append(tool_frame(robot, q)[:, 2, 3] * 1e3)
    return float(np.abs(z[0] - z[1]).max())


def validate_motion(folder: Path) -> Validation:
    """Show Tables III and IV for both sets; writes `mitral_tables.csv` and `mitral_motion.png`."""
    made = {name: benches(name) for name in SETS}
    found = {(name, path): set_tables(name, path, made[name][path]) for name in SETS for path in TABLES}
    lines = [line for (name, path), item in found.items() for line in _set_lines(name, path, item)]
    lines += [_reach_line(name) for name in SETS]
    lines.append(_larger_input_line(made["@rigid_end"]))
    shown = []
    for path, bench in made["@rigid_end"].items():
        run = motion(bench, ADVANCES_MM[-1], simulated=True)
        by_statics = motion(bench, ADVANCES_MM[-1])
        what = f"@rigid_end, {path} path, advance 20 mm, chosen trajectory: tip of the simulation, largest"
        far = largest_distance(run.tip_mm, by_statics.tip_mm)
        lines.append(Line(NAME, what, "mm", far, STATICS_MM, "statics of joints and tendons, row by row"))
        shown.append((f"@rigid_end, {path} path, advance 20 mm", run))
    pictures.motions(shown, MODELS, folder / "mitral_motion.png")
    write_tables([row for item in found.values() for row in item.rows], folder / "mitral_tables.csv")
    return Validation(tuple(lines), _findings(found))


PROCEDURE_DEG = 60.0  # Nayar 2022, Section IV-E: "bent by around 60 deg"
STATICS_MM = 1.0  # of the moving tip from rest's: it lags by a few relaxation times of 10 ms


def write_tables(rows: list[TableRow], path: Path) -> None:
    """Write every row and column of both tables for both sets as one CSV file, in mm."""
    with replaced_when_whole(path) as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(
            ["set", "path", "advance_mm", "model", "column", "printed", "chosen", "fitted", "kind"]
        )
        for row in rows:
            for k, column in enumerate(COLUMNS):
                figures = [
                    "" if values is None else f"{values[k]:.2f}"
                    for values in (row.printed_mm, row.chosen_mm, row.fitted_mm)
                ]
                kind = "" if row.printed_mm is None else row.kind
                if kind == FITTED and k != FITTED_TO[2]:
                    kind = PREDICTED
                where = [row.set_name, row.path, f"{row.advance_mm:g}", row.model, column]
                table.writerow([*where, *figures, kind])


def _set_lines(name: str, path: str, item: SetTables) -> list[Line]:
    """Return a set's errors in space, along the chosen trajectory and with the fitted amplitude."""
    table, printed = TABLES[path]
    lines = []
    for row in item.rows:
        where = f"{name}, {path} path, advance {row.advance_mm:g} mm: tip by {row.model}, RMSE"
        ours = float(row.chosen_mm[3])
        theirs = None if row.printed_mm is None else row.printed_mm[3]
        why = f"Nayar 2022, {table}. The trajectory is chosen here. {_SPECIMEN}"
        gap = ours if theirs is None else abs(ours - theirs)
        lines.append(Line(NAME, where, "mm", gap, None, why, ours, None, theirs, OUT_OF_REACH))
        if theirs is not None and row.kind != OUT_OF_REACH:
            lines.append(_fitted_line(f"{where}, one amplitude fitted", row, theirs, table, item.amplitude))
    at = {row.model: row for row in item.rows if row.advance_mm == ADVANCES_MM[-1]}
    where = f"{name}, {path} path, advance 20 mm"
    lines += _ratios(where, {m: float(row.chosen_mm[3]) for m, row in at.items()}, printed[20.0], table)
    return lines


def _fitted_line(what: str, row: TableRow, theirs: float, table: str, amplitude: float | None) -> Line:
    """Return a row with the one number of the trajectory fitted; what is left of it where none does."""
    fitted_to = f"PK, no advance, {TABLES[row.path][1][0.0]['PK'][3]} mm"
    if row.fitted_mm is None or amplitude is None:
        why = f"Nayar 2022, {table}; no amplitude gives {fitted_to}, with this tip"
        return Line(NAME, what, "mm", np.nan, None, why, None, None, theirs, MISSED)
    ours = float(row.fitted_mm[3])
    why = f"Nayar 2022, {table}; amplitude {amplitude:.3g} fitted to {fitted_to}"
    return Line(NAME, what, "mm", abs(ours - theirs), None, why, ours, None, theirs, row.kind)


def _reach_line(name: str) -> Line:
    """Return what PK's error along z can be at most, beside the printed one."""
    ours, printed = farthest_mm(name) + TABLE_3_MM[0.0]["MK"][2], TABLE_3_MM[0.0]["PK"][2]
    what = f"{name}, straight path, no advance: most that PK can be off along z, whatever the trajectory"
    why = "Nayar 2022, Table III, PK, Z; Eqs 3 and 25 apart at any displacement, and MK's own 2.52 mm"
    kind = REFUTED if ours < printed else OUT_OF_REACH
    return Line(NAME, what, "mm", max(printed - ours, 0.0), None, why, ours, None, printed, kind)


def displacement_at_mm(robot: CatheterRobot, bend_deg: float) -> float:
    """Return the displacement at which the bending joint first reaches a bend, drawn from rest [mm]."""
    rows = np.zeros((801, 4))
    rows[:, 0] = np.linspace(0.0, 8e-3, len(rows))
    angle = joint_angles_deg(robot, balance(robot, moving_joint(rows), NO_GRAVITY).postures)["bending"]
    return float(np.interp(bend_deg, angle, rows[:, 0] * 1e3))


def _larger_input_line(along: Mapping[str, TipModels]) -> Line:
    """Return how much more displacement the tortuous path asks for, to the bend of the procedure."""
    ours = [displacement_at_mm(bench.robot, PROCEDURE_DEG) for bench in along.values()]
    ratio = ours[1] / ours[0]
    what = f"displacement to bend by {PROCEDURE_DEG:g} deg, along the tortuous over along the straight path"
    why = f"Nayar 2022, Section IV-E; {ours[0]:.2f} and {ours[1]:.2f} mm, with the path's friction assumed"
    return Line(NAME, what, "-", max(1.0 - ratio, 0.0), None, why, ratio, kind=PREDICTED, said="larger")


def _ratios(where: str, error: Mapping[str, float], printed: Mapping[str, Row], table: str) -> list[Line]:
    """Show the ratios of the models' errors beside the table's.

    Table IV gives no figures of MK and hybrid, but says that PI does better.
    """
    lines = []
    source = f"Nayar 2022, {table}. The trajectory is chosen here"
    for a, b in (("MK", "PK"), ("PI", "PK"), ("hybrid", "PK"), ("PI", "MK")):
        ours, what = error[a] / error[b], f"{where}: RMSE of {a} over {b}"
        if a in printed and b in printed:
            theirs = printed[a][3] / printed[b][3]
            gap, why = abs(ours - theirs), f"{source}. {_SPECIMEN}"
            lines.append(Line(NAME, what, "-", gap, None, why, ours, None, theirs, OUT_OF_REACH))
        elif (a, b) == ("PI", "MK"):
            why = f"{source}. Both are calibrated along the same path: the other way round"
            gap = max(ours - 1.0, 0.0)
            lines.append(Line(NAME, what, "-", gap, None, why, ours, kind=MISSED, said="below 1"))
    if straight("MK") in error:
        for a, b in (("PI", "MK"), ("PI", "hybrid")):
            ours = error[straight(a)] / error[straight(b)]
            what = f"{where}: RMSE of {a} over {b}, both calibrated along the straight path"
            why = f"{source}. Which loops the models were calibrated on is not printed"
            gap = max(ours - 1.0, 0.0)
            lines.append(Line(NAME, what, "-", gap, None, why, ours, kind=ASSUMED, said="below 1"))
    return lines


def _findings(found: Mapping[tuple[str, str], SetTables]) -> tuple[str, ...]:
    told = []
    for (name, path), item in found.items():
        if item.amplitude is None:
            told.append(f"{name}, {TABLES[path][0]}: none")
            continue
        gaps = [
            abs(float(row.fitted_mm[3]) - row.printed_mm[3]) / row.printed_mm[3]
            for row in item.rows
            if row.fitted_mm is not None and row.printed_mm is not None and row.kind == PREDICTED
        ]
        told.append(
            f"{name}, {TABLES[path][0]}: amplitude {item.amplitude:.2f}, the {len(gaps)} predicted errors in "
            f"space off by {100.0 * float(np.mean(gaps)):.0f} % on average, {100.0 * max(gaps):.0f} % at most"
        )
    pk = {
        (path, row.advance_mm): float(row.chosen_mm[3])
        for path in TABLES
        for row in found["@rigid_end", path].rows
        if row.model == "PK"
    }
    return (
        f"{NAME}: the paper prints a rigid distal end of 20 mm; that the measured point is its end is "
        "inferred, since where on the holder the tracker sat is not printed. One amplitude of the "
        f"trajectory fitted to PK's error at no advance: {'; '.join(told)}.",
        f"{NAME}: along one and the same trajectory PK's error at 20 mm grows from the straight to the "
        f"tortuous path ({pk['straight', 20.0]:.1f} to {pk['tortuous', 20.0]:.1f} mm with @rigid_end), where "
        "the tables have it fall (68.54 to 41.93 mm): reversed. Their trajectories need not be one.",
        f"{NAME}: the tip errors are of a robot with the printed dead-bands, not of the paper's "
        "specimen: its tube's own curvature, its couplings and its tracker are not in them.",
    )
