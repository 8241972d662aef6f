"""Closing the loop on the chest-tube section: hide the prototype in simulated shapes, calibrate it back.

As in chest_tube_2025, Section IV: shapes at published tensions, of which some are held out. The data come
from the MuJoCo robot with the prototype's calibration, the calibration starts at Table II and goes
through the diagnosis (`[calibration]` in a dataset.toml).

Of the paper's sixteen points along the backbone one is the base, which the robot's frame fixes; the
others are the links' tops.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import tomli_w

from catheter_sim.arrays import Array
from catheter_sim.catalogue import load_robot
from catheter_sim.core.document import leaves, to_document
from catheter_sim.diagnosis.dataset import load_dataset
from catheter_sim.diagnosis.fit import fit
from catheter_sim.diagnosis.noise import outputs_of
from catheter_sim.diagnosis.pipeline import diagnose_dataset
from catheter_sim.diagnosis.prepare import training_problem
from catheter_sim.diagnosis.problem import Problem
from catheter_sim.diagnosis.result import Diagnosis
from catheter_sim.diagnosis.trials import Trial, measured_of, split
from catheter_sim.diagnosis.workers import Workers
from catheter_sim.simulation.replay import simulate
from catheter_sim.tables import Table, write_table
from catheter_sim.theory.predict import by_static_model
from catheter_sim.validation.drives import NO_GRAVITY, given
from catheter_sim.validation.lines import Line, Validation

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
RANGES: dict[str, list[float]] = {
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
    diagnosis: Diagnosis
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
    return {name: values[name] for name in RANGES} | {"stiffness_scale": other / own}


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
        "calibration": RANGES,
    }
    (folder / "dataset.toml").write_text(tomli_w.dumps(document), encoding="utf-8")


def calibrate_draw(folder: Path, shapes_mm: Array, seed: int, jobs: int = 1) -> Draw:
    """Write a draw to `folder`, diagnose it, and return what came of it."""
    write_draw(folder, shapes_mm, seed)
    dataset = load_dataset(folder)
    diagnosis = diagnose_dataset(dataset, Workers(jobs), simulation=False)
    train, heldout = split(dataset)
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
