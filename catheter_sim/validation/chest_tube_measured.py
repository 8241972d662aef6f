"""The chest-tube section calibrated to shapes, and repeated loadings (chest_tube_2025)."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import tomli_w
from scipy.optimize import least_squares

from catheter_sim.arrays import Array
from catheter_sim.catalogue import load_robot
from catheter_sim.core.document import leaves, to_document
from catheter_sim.core.robot import Friction, RobotSpec
from catheter_sim.diagnosis.dataset import load_dataset
from catheter_sim.diagnosis.fit import fit
from catheter_sim.diagnosis.noise import outputs_of
from catheter_sim.diagnosis.pipeline import diagnose_dataset
from catheter_sim.diagnosis.prepare import training_problem
from catheter_sim.diagnosis.problem import Problem
from catheter_sim.diagnosis.result import DiagnosisResult
from catheter_sim.diagnosis.trials import Trial, measured_of, split_trials
from catheter_sim.diagnosis.workers import Workers
from catheter_sim.errors import InputError
from catheter_sim.robots.rolling.complete import complete
from catheter_sim.robots.rolling.published import chest_tube_section_printed_shapes
from catheter_sim.simulation.replay import simulate
from catheter_sim.tables import Table, write_table
from catheter_sim.theory.static_models import STATIC_MODELS
from catheter_sim.theory.twins import by_static_model
from catheter_sim.theory.which_model import interleaved_s
from catheter_sim.validation import pictures
from catheter_sim.validation.lines import (
    ASSUMED,
    FITTED,
    IMPLEMENTED,
    NO_GRAVITY,
    OUT_OF_REACH,
    Line,
    Validation,
    given,
)

# ----------------------------------------------------------------------------------------------------
# Closing the loop on the chest-tube section: hide the prototype in simulated shapes, calibrate it back.
#
# As in chest_tube_2025, Section IV: shapes at published tensions, of which some are held out. The data come
# from the MuJoCo robot with the prototype's calibration, the calibration starts at Table II and goes
# through the diagnosis (`[calibration]` in a dataset.toml).
#
# Of the paper's sixteen points along the backbone one is the base, which the robot's frame fixes; the
# others are the links' tops.

SECTION = "chest_tube_section"
START = "chest_tube_section@table2"
HIDDEN = "chest_tube_section@prototype"
# Measured tensions of the prototype, published with the code of chest_tube_2025 [N].
TENSIONS_N = np.array(
    [
        *(0.0, 1.877, 2.815, 3.754, 4.692, 5.630, 7.507),
        *(10.323, 13.138, 16.891, 22.522, 29.091, 38.475, 47.859),
    ]
)
HELD_OUT = (3, 7, 11)  # positions in `TENSIONS_N`
NOISE_MM = 0.5
# What Section IV calibrates (friction, elastic constant, clearance, profile), and the links' modulus,
# with ranges around Table II that leave every number possible.
CALIBRATED_RANGES: dict[str, list[float]] = {
    "friction.mu": [0.0, 1.0],
    "stiffness_scale": [0.3, 5.0],
    "clearance_mm": [0.05, 1.2],
    "segments.section.larger_arm_mm": [2.0, 4.6],
    "segments.section.smaller_arm_mm": [0.5, 1.8],
    "segments.section.larger_radius_mm": [5.2, 9.0],
    "segments.section.smaller_radius_mm": [1.9, 6.0],
    "segments.section.link_modulus_Pa": [5e6, math.inf],
}
RECOVERED = ("friction.mu", "stiffness_scale", "clearance_mm")
_LINKS = 15
COLUMNS = tuple(f"body_{k}_{axis}_mm" for k in range(1, _LINKS + 1) for axis in "xz")


@dataclass(frozen=True)
class Draw:
    """One calibration of noisy shapes.

    Attributes:
        seed: of the noise.
        diagnosis: what the diagnosis of the draw says.
        error_percent: of the calibrated complete model on the held-out tensions, against what was
            measured, noise included (`model_error_percent`).
        floor_percent: the true shapes against what was measured: what noise leaves of any model.
        true_error_percent: the calibrated complete model against the true shapes.
        pcc_error_percent: of piecewise constant curvature, calibrated alike, against what was measured.
    """

    seed: int
    diagnosis: DiagnosisResult
    error_percent: float
    floor_percent: float
    true_error_percent: float
    pcc_error_percent: float

    def recovered(self) -> dict[str, bool]:
        """Return, for friction, elastic constant and clearance, whether their interval holds the truth."""
        truth = hidden_values()
        found = {}
        for name in RECOVERED:
            low, high = self.diagnosis.calibrated[name].ci95
            found[name] = low <= truth[name] <= high
        return found


def hidden_values() -> dict[str, float]:
    """Return the prototype's value of every number in `RANGES`, in file units.

    The prototype has its rods' own stiffness; seen from Table II it is a scale.
    """
    start, hidden = load_robot(START), load_robot(HIDDEN)
    values = dict(leaves(to_document(hidden)))
    own, other = (robot.tendons[0].bending_stiffness_N_m2 for robot in (start, hidden))  # type: ignore[union-attr]
    return {name: values[name] for name in CALIBRATED_RANGES} | {"stiffness_scale": other / own}


def simulated_shapes_mm() -> Array:
    """Return the prototype's shapes in the simulation, loaded from rest, shape (14, 15, 3) [mm]."""
    run = simulate(load_robot(HIDDEN), given(TENSIONS_N[:, np.newaxis]), NO_GRAVITY)
    if run.failure is not None:
        raise RuntimeError(run.failure)
    return np.array([posture.p_w for posture in run.postures]) * 1e3


def model_error_percent(model_mm: Array, measured_mm: Array) -> float:
    """Return the mean distance of modelled and measured points over their distance from the base [%].

    chest_tube_2025, Section IV-A: "the Euclidean distance of each modeled point with its measured value
    divided by its distance from the base link". Arrays of shape (..., 2) or (..., 3), base at zero.
    """
    distance = np.linalg.norm(model_mm - measured_mm, axis=-1)
    return float(100.0 * (distance / np.linalg.norm(measured_mm, axis=-1)).mean())


def write_draw(folder: Path, shapes_mm: Array, seed: int) -> None:
    """Write shapes with noise as a data set: the held-out tensions in a trial of their own.

    Args:
        folder: to write to, made if need be.
        shapes_mm: from `simulated_shapes_mm`.
        seed: of the noise.
    """
    folder.mkdir(parents=True, exist_ok=True)
    noisy = shapes_mm + NOISE_MM * np.random.default_rng(seed).normal(size=shapes_mm.shape)
    held_out = np.isin(np.arange(len(TENSIONS_N)), HELD_OUT)
    trials = []
    for file, role, rows in (("train.csv", "train", ~held_out), ("heldout.csv", "heldout", held_out)):
        columns = {"tension_active_N": TENSIONS_N[rows]}
        columns |= {
            f"body_{k + 1}_{axis}_mm": noisy[rows, k, "xyz".index(axis)]
            for k in range(_LINKS)
            for axis in "xz"
        }
        write_table(Table(np.arange(float(rows.sum())), columns, file), folder / file)
        trials.append({"file": file, "role": role})
    document = {
        "dataset": {
            "name": f"chest-tube section, simulated prototype, draw {seed}",
            "robot": START,
            "source": f"simulation of {HIDDEN}, {NOISE_MM} mm white noise",
            "licence": "MIT",
        },
        "conditions": {"gravity_mps2": [0.0, 0.0, 0.0]},
        "channels": {"inputs": ["tension_active_N"], "outputs": list(COLUMNS)},
        "trials": trials,
        "calibration": CALIBRATED_RANGES,
    }
    (folder / "dataset.toml").write_text(tomli_w.dumps(document), encoding="utf-8")


def calibrate_draw(folder: Path, shapes_mm: Array, seed: int, jobs: int = 1) -> Draw:
    """Write a draw to `folder`, diagnose it, and return what came of it."""
    write_draw(folder, shapes_mm, seed)
    dataset = load_dataset(folder)
    # Three held-out rows are too few to name a cause, which is not asked here: numbers are calibrated.
    diagnosis = diagnose_dataset(dataset, Workers(jobs), simulation=False, search_anyway=True)
    train, heldout = split_trials(dataset)
    problem = training_problem(dataset, train)
    (fitted,) = (item.before for item in diagnosis.fits if item.role == "heldout")
    model = np.stack([fitted.columns[name] for name in COLUMNS], axis=1)
    measured = measured_of(heldout[0], COLUMNS)
    truth = shapes_mm[list(HELD_OUT)][:, :, [0, 2]].reshape(len(HELD_OUT), -1)
    return Draw(
        seed=seed,
        diagnosis=diagnosis,
        error_percent=model_error_percent(_points(model), _points(measured)),
        floor_percent=model_error_percent(_points(truth), _points(measured)),
        true_error_percent=model_error_percent(_points(model), _points(truth)),
        pcc_error_percent=model_error_percent(_points(_pcc(problem, heldout)), _points(measured)),
    )


def _pcc(problem: Problem, heldout: Sequence[Trial]) -> Array:
    """Return what piecewise constant curvature, calibrated alike, says of the held-out tensions."""
    twin = by_static_model("pcc", problem.robot, COLUMNS, NO_GRAVITY)
    pcc = replace(problem, twin=twin)
    found = fit(pcc, (), cross_validate=False, thorough=True)
    return outputs_of(pcc, heldout[0], found)


def _points(values: Array) -> Array:
    return values.reshape(len(values), _LINKS, 2)


def validate_calibration(folder: Path) -> Validation:
    """Calibrate one draw of noisy shapes back to the hidden prototype; the data set goes into `folder`."""
    draw = calibrate_draw(folder / f"{SECTION}_calibration", simulated_shapes_mm(), seed=0)
    missed = [name for name, held in draw.recovered().items() if not held]
    what = f"calibrated from Table II to 11 tensions with {NOISE_MM} mm noise, three held out"
    source = "simulated prototype; error as in chest_tube_2025, Section IV-A"
    truth = hidden_values()
    told = "; ".join(
        f"{name} {item.value:.3g} (95 %: {item.ci95[0]:.3g} to {item.ci95[1]:.3g}; hidden {truth[name]:.3g})"
        for name, item in draw.diagnosis.calibrated.items()
    )
    lines = (
        Line(SECTION, f"{what}: error of the true shape", "%", draw.true_error_percent, 1.0, source),
        Line(
            SECTION,
            f"{what}: friction, elastic constant and clearance outside their own 95 % intervals",
            "-",
            float(len(missed)),
            0.0,
            "simulated prototype",
        ),
        Line(SECTION, f"{what}: error against measurements", "%", draw.error_percent, None, source),
        Line(SECTION, f"{what}: that of a perfect model", "%", draw.floor_percent, None, source),
        Line(
            SECTION,
            f"{what}: PCC, calibrated alike, error against measurements",
            "%",
            draw.pcc_error_percent,
            None,
            f"{source}; the paper measured 11.45 % for PCC, 2.25 % for its own model",
        ),
    )
    finding = (
        f"{SECTION}: shapes fix friction and the links' modulus, but trade the rods' stiffness against the "
        f"profile's arms and radii, and the clearance against friction: {told}. A calibration that prints "
        f"one number for each of these from shapes alone says more than it knows."
    )
    return Validation(lines, (finding,))


# ----------------------------------------------------------------------------------------------------
# The chest-tube section calibrated to shapes as in chest_tube_2025, Section IV-A, without the measured
# ones.
#
# doi 10.1109/LRA.2025.3597860. The measured shapes are not published. The authors' model came within 2.25 %
# of them, so that the printed balance's shapes, with the published calibration and at the measured
# tensions, are the best stand-in for them. To these are fitted the complete balance, with the seven numbers
# that the authors calibrate, and piecewise constant curvature with the five of these that it has.
# `chest_tube_section@printed_shapes` holds the first ones.
#
# A mean relative distance keeps the triangle inequality, but for distances from the base that differ by
# some per cent: what is off by e from the stand-in is off by e - 2.25 % to e + 2.25 % from the measured
# shapes, also at its best. For constant curvature the paper prints that figure.

STAND_IN, FITTED_SET = f"{SECTION}@prototype", f"{SECTION}@printed_shapes"
PULLED = tuple(range(1, len(TENSIONS_N)))  # positions in `TENSIONS_N`; the first one is straight
PRINTED_PERCENT, PCC_PERCENT = 2.25, 11.45  # Section IV-A: of the authors' model, of constant curvature
PRINTED_MS, PCC_MS = 23.16, 1.15  # Section IV-B, on an Intel 6700HQ
# What is calibrated, in file units, with its range; `ARMS` is the sum of both arms, whose half is the holes'
# distance from the axis: they stay inside the link. The clearance is no larger than the published one.
ARMS = "arms_mm"
_PROFILE = {
    "segments.section.smaller_arm_mm": (0.5, 1.8),
    "segments.section.larger_radius_mm": (5.2, 9.0),
    "segments.section.smaller_radius_mm": (1.9, 6.0),
}
RANGES: Mapping[str, Mapping[str, tuple[float, float]]] = {
    "complete": {
        "friction.mu": (0.0, 1.0),
        "clearance_mm": (0.05, 0.6),
        "stiffness_scale": (0.3, 5.0),
        ARMS: (3.0, 5.6),
        **_PROFILE,
    },
    "pcc": {"stiffness_scale": (0.3, 5.0), ARMS: (3.0, 5.6), **_PROFILE},
}
_START = {
    "friction.mu": 0.07,
    "clearance_mm": 0.5,
    "stiffness_scale": 1.5,
    ARMS: 5.3,
    "segments.section.smaller_arm_mm": 1.33,
    "segments.section.larger_radius_mm": 6.37,
    "segments.section.smaller_radius_mm": 3.8,
}
_ROUNDS = 5  # of timing


@dataclass(frozen=True)
class ShapeFit:
    """A static model calibrated to the stand-in for the measured shapes.

    Attributes:
        model: its name.
        values: what was calibrated, in file units.
        robot: with these values.
        shapes_mm: of the links' tops at `PULLED`, shape (13, 15, 3) [mm].
        error_percent: mean over `PULLED` (`model_error_percent`).
    """

    model: str
    values: Mapping[str, float]
    robot: RobotSpec
    shapes_mm: Array
    error_percent: float


def shapes_mm(robot: RobotSpec, model: str, rows: Sequence[int] = PULLED) -> Array:
    """Return the links' tops by a static model at some of `TENSIONS_N`, shape (r, 15, 3) [mm]."""
    tensions = TENSIONS_N[list(rows), np.newaxis]
    run = STATIC_MODELS[model].solve(robot, given(tensions), NO_GRAVITY)
    return np.array([posture.p_w for posture in run.postures]) * 1e3


def stand_in_mm(robot: str = STAND_IN) -> Array:
    """Return the printed balance's shapes at `PULLED`, shape (13, 15, 3) [mm]."""
    return shapes_mm(load_robot(robot), "printed")


def fit_shapes(
    model: str,
    wanted_mm: Array,
    rows: Sequence[int] = PULLED,
    ranges: Mapping[str, tuple[float, float]] | None = None,
) -> ShapeFit:
    """Calibrate a static model to shapes, from one start.

    Args:
        model: of `RANGES`.
        wanted_mm: at all of `PULLED`, shape (13, 15, 3) [mm].
        rows: positions in `TENSIONS_N` that are fitted to; the first of all is no shape.
        ranges: of what is calibrated; default: `RANGES`.
    """
    ranges = RANGES[model] if ranges is None else ranges
    low, high = np.array(list(ranges.values())).T
    wanted = wanted_mm[np.asarray(rows) - 1]
    away = np.linalg.norm(wanted, axis=-1, keepdims=True)

    def residual(values: Array) -> Array:
        try:
            found = shapes_mm(_robot(dict(zip(ranges, values, strict=True))), model, rows)
        except InputError:  # no such robot, or no balance
            return np.ones(2 * wanted[..., 0].size)
        return ((found - wanted) / away)[..., [0, 2]].ravel()

    start = np.array([_START[name] for name in ranges])
    found = least_squares(residual, start, bounds=(low, high), x_scale=high - low, diff_step=1e-4)
    values = {name: float(value) for name, value in zip(ranges, found.x, strict=True)}
    robot = _robot(values)
    shapes = shapes_mm(robot, model)
    return ShapeFit(model, values, robot, shapes, model_error_percent(shapes, wanted_mm))


def _robot(values: Mapping[str, float]) -> RobotSpec:
    """Return Table II's section with calibrated values."""
    smaller = values["segments.section.smaller_arm_mm"]
    settings = {name: value for name, value in values.items() if name != ARMS}
    # A rod's edge on the link's surface is no longer in it: a nanometre less.
    settings["segments.section.larger_arm_mm"] = values[ARMS] - smaller - 1e-6
    return load_robot(SECTION, settings)


def validate_printed_shapes(folder: Path) -> Validation:
    """Check the fitted set and constant curvature beside it; the picture goes into `folder`."""
    wanted = stand_in_mm()
    fitted = load_robot(FITTED_SET)
    ours = shapes_mm(fitted, "complete")
    run = simulate(fitted, given(TENSIONS_N[:, np.newaxis]), NO_GRAVITY)
    simulated = np.array([posture.p_w for posture in run.postures])[list(PULLED)] * 1e3
    kept = [row for row in PULLED if row not in HELD_OUT]
    without = fit_shapes("complete", wanted, kept)
    held = np.array(HELD_OUT) - 1
    pcc = fit_shapes("pcc", wanted)
    pictures.printed_shapes(wanted, simulated, pcc.shapes_mm, folder / f"{SECTION}_printed_shapes.png")
    what = "shapes of the printed balance (@prototype) at thirteen measured tensions"
    paper = (
        f"chest_tube_2025, Section IV-A: {PRINTED_PERCENT} % of the measured shapes, which are not published"
    )

    def line(name: str, error: float, printed: float | None, source: str, kind: str = FITTED) -> Line:
        gap = np.nan if printed is None else abs(error - printed)
        return Line(SECTION, f"{what}: {name}", "%", gap, None, source, error, None, printed, kind)

    lines = (
        line("complete balance, @printed_shapes", model_error_percent(ours, wanted), PRINTED_PERCENT, paper),
        line("simulation, @printed_shapes", model_error_percent(simulated, wanted), PRINTED_PERCENT, paper),
        line(
            "complete balance, fitted without three tensions, on these",
            model_error_percent(without.shapes_mm[held], wanted[held]),
            PRINTED_PERCENT,
            paper,
        ),
        line(
            "complete balance, @prototype as published",
            model_error_percent(shapes_mm(load_robot(STAND_IN), "complete"), wanted),
            None,
            "its numbers are the printed balance's",
            OUT_OF_REACH,
        ),
        line(
            "PCC, calibrated",
            pcc.error_percent,
            PCC_PERCENT,
            "chest_tube_2025, Section IV-A and Fig. 11; another specimen gives another figure "
            "(chest_tube_front.md)",
            ASSUMED,
        ),
    )
    return Validation(lines, (_finding(pcc),))


def _finding(pcc: ShapeFit) -> str:
    other = fit_shapes("complete", stand_in_mm(SECTION))
    alike = fit_shapes("pcc", stand_in_mm(SECTION))
    return (
        f"{SECTION}: with seven numbers calibrated the complete balance has the printed one's shapes as "
        "nearly as the authors' model had the measured ones, so that these shapes cannot tell the two "
        "balances apart. It is so of the published calibration and of Table II's set "
        f"({other.error_percent:.1f} %; constant curvature {pcc.error_percent:.1f} and "
        f"{alike.error_percent:.1f} %). Three of the numbers end at their bounds: they are effective ones."
    )


def validate_times(folder: Path) -> Validation:
    """Time the models on the fourteen measured tensions, as the paper does; nothing goes into `folder`.

    All models take turns in one run; of each the median round counts. Nothing is judged: another computer.
    """
    robot, inputs = load_robot(STAND_IN), given(TENSIONS_N[:, np.newaxis])
    calls = {
        name: (lambda solve=STATIC_MODELS[name].solve: solve(robot, inputs, NO_GRAVITY))
        for name in ("printed", "pcc", "complete")
    }
    for call in calls.values():
        call()  # kernels are compiled
    spent = interleaved_s(calls, time.process_time, _ROUNDS)
    each_ms = {name: 1e3 * seconds / len(TENSIONS_N) for name, seconds in spent.items()}
    lines = []
    for name, printed in (("printed", PRINTED_MS), ("pcc", PCC_MS), ("complete", None)):
        source = "chest_tube_2025, Section IV-B, on an Intel 6700HQ" if printed else "not in the paper"
        gap = np.nan if printed is None else abs(each_ms[name] - printed)
        what = f"time of a configuration, fourteen measured tensions at once: {name}"
        lines.append(Line(SECTION, what, "ms", gap, None, source, each_ms[name], None, printed, OUT_OF_REACH))
    return Validation(tuple(lines), ())


# ----------------------------------------------------------------------------------------------------
# Five repeated loadings of the chest-tube section, drawn: what Fig. 14 of chest_tube_2025 shows, measured.
#
# doi 10.1109/LRA.2025.3597860, Section IV-B: five tests, fourteen tensions, points along the backbone;
# errors of the authors' model over its length. Here the measured robot is `@printed_shapes` by the complete
# balance, the model the printed balance with the published calibration. The fourteen printed tensions are
# 0 and multiples of `STEP_N` to 0.0005 N: the motor's current step, so that each tension is anywhere within
# half of it. That the paper does not say so, and **what else differs from test to test is assumed**:
# friction of each test even within 20 %, each point off by 0.5 mm along each axis (standard deviation). So
# the spread is no prediction; that an error over the distance from the base is largest at the base follows
# from any noise of the points.

TESTS, SEED = 5, 0
FRICTION_SHARE = 0.2  # assumed
STEP_N = 0.93841  # largest number of which all printed tensions are multiples
ARM_TOLERANCE_MM = 0.5  # chest_tube_2025, Table I: A1 = 3 +- 0.5 mm, A2 = 1 +- 0.5 mm
LENGTH_MM = 225.0
PRINTED = {"tip": (2.88, 1.22), "shape": (2.55, 0.72)}  # mean and standard deviation [% of length]


@dataclass(frozen=True)
class Repeats:
    """Errors of the model in the repeated tests.

    Attributes:
        away_mm: distance of every point, shape (tests, 14, 15) [mm].
        over_distance: the same over each point's distance from the base, shape (tests, 14, 15) [%].
    """

    away_mm: Array
    over_distance: Array

    def mean_and_spread(self, which: str) -> tuple[float, float]:
        """Return the mean and the standard deviation of the tip's or the shape's error [% of length]."""
        every = self.away_mm[:, :, -1] if which == "tip" else self.away_mm.mean(axis=2)
        return float(100.0 * every.mean() / LENGTH_MM), float(100.0 * every.std() / LENGTH_MM)


def repeats(tests: int = TESTS, seed: int = SEED) -> Repeats:
    """Return the errors of so many drawn tests."""
    draw = np.random.default_rng(seed)
    model = shapes_mm(load_robot(STAND_IN), "printed", range(len(TENSIONS_N)))
    robot = chest_tube_section_printed_shapes()
    away = []
    for _ in range(tests):
        mu = robot.friction.mu * draw.uniform(1.0 - FRICTION_SHARE, 1.0 + FRICTION_SHARE)
        step = STEP_N * draw.uniform(-0.5, 0.5, TENSIONS_N.shape)
        tension = np.where(TENSIONS_N > 0.0, TENSIONS_N + step, 0.0)
        one = replace(robot, friction=Friction(mu))
        run = complete(one, given(tension[:, None]), NO_GRAVITY)
        measured = np.array([posture.p_w for posture in run.postures]) * 1e3
        measured += NOISE_MM * draw.normal(size=measured.shape)
        away.append(np.linalg.norm(model - measured, axis=-1))
    every = np.array(away)
    return Repeats(every, 100.0 * every / np.linalg.norm(model, axis=-1))


def validate_repeats(folder: Path) -> Validation:
    """Show the spread of five drawn tests; the picture goes into `folder`."""
    found = repeats()
    along = found.over_distance.mean(axis=(0, 1))
    pictures.repeats(found, TENSIONS_N, folder / f"{SECTION}_repeats.png")
    source = (
        "chest_tube_2025, Fig. 14; friction and points of each test are assumed, tensions by the motor's step"
    )
    lines = []
    for which, printed in PRINTED.items():
        for name, ours, theirs in zip(
            ("mean", "standard deviation"), found.mean_and_spread(which), printed, strict=True
        ):
            what = f"five drawn tests, printed balance: error of the {which} over length, {name}"
            lines.append(
                Line(SECTION, what, "%", abs(ours - theirs), None, source, ours, None, theirs, ASSUMED)
            )
    what = (
        "five drawn tests: error over the distance from the base, first link over the least along the section"
    )
    ratio = float(along[0] / along.min())
    lines.append(
        Line(SECTION, what, "-", np.nan, None, f"{source}; printed: worst there", ratio, kind=ASSUMED)
    )
    return Validation((*lines, *arm_lines()), ())


def arm_lines(tension_N: float = 10.323) -> list[Line]:
    """Return by how much the tip moves where a lever is at an end of its printed tolerance."""
    source = "chest_tube_2025, Table I (A1 = 3 +- 0.5 mm, A2 = 1 +- 0.5 mm); complete balance"
    pulled = given(np.array([[tension_N]]))
    lines = []
    for key in ("larger_arm_mm", "smaller_arm_mm"):
        tips = []
        for change in (0.0, -ARM_TOLERANCE_MM, ARM_TOLERANCE_MM):
            arm = dict(leaves(to_document(load_robot(START))))[f"segments.section.{key}"] + change
            changed = load_robot(START, {f"segments.section.{key}": arm})
            balance = STATIC_MODELS["complete"].solve(changed, pulled, NO_GRAVITY)
            tips.append(1e3 * balance.postures[0].p_w[-1])
        moved = float(np.linalg.norm(np.array(tips[1:]) - tips[0], axis=1).max())
        what = f"{key} +- {ARM_TOLERANCE_MM:g} mm, {tension_N:g} N: tip moves by, larger of both"
        lines.append(Line(SECTION, what, "mm", np.nan, None, source, moved, kind=IMPLEMENTED))
    return lines
