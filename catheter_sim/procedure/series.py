"""The procedure in many random anatomies, their table, and a video of one."""

from __future__ import annotations

import csv
import json
import math
import os
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, field
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import mujoco
import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.errors import InputError
from catheter_sim.modelling.build import View
from catheter_sim.pictures.images import (
    Picture,
    open_renderer,
    require_even,
    with_caption,
    with_inset,
    write_video,
)
from catheter_sim.pictures.offscreen import free_camera
from catheter_sim.procedure.heart import Anatomy, coaptation_axes, free_edge_z_m, random_anatomy
from catheter_sim.procedure.operate import ANGLE_DEG, POSITION_MM, Outcome, StepReport, Touch, operate
from catheter_sim.procedure.plan import Plan, ProcedureStep, plan
from catheter_sim.robots.catheter.spec import CatheterRobot
from catheter_sim.simulation.simulator import Simulator
from catheter_sim.tables import replaced_when_whole

# ----------------------------------------------------------------------------------------------------
# A video of the procedure in one anatomy: across the bending plane through the wall, and the valve.

FPS = 25
FASTER = 2.0  # than the simulated motion
_HEIGHT_M, _CLIP_HEIGHT_M = 0.125, 0.034  # of what is seen, of the valve alone
_INSET = 0.45  # side of the close-up over the picture's height


@dataclass
class _Film:
    """What is remembered of a procedure to draw it."""

    model: mujoco.MjModel | None = None
    frames: list[tuple[Array, ProcedureStep, float]] = field(default_factory=list)
    calls: int = 0

    def watch(self, simulator: Simulator, place: ProcedureStep, touch: Touch) -> None:
        """Remember every so many steps."""
        self.model = simulator.model
        every = max(1, round(FASTER / FPS / simulator.model.opt.timestep))
        if self.calls % every == 0:
            self.frames.append((simulator.data.qpos.copy(), place, touch.wall_N))
        self.calls += 1


def film(
    robot: CatheterRobot,
    plan: Plan,
    rng: np.random.Generator,
    path: str | os.PathLike[str],
    known: CatheterRobot | None = None,
    width: int = 1280,
    height: int = 720,
    progress: bool = False,
) -> None:
    """Write an MP4 of the procedure.

    Args:
        robot, plan, rng, known: of `operate.operate`.
        path: file to write.
        width, height: [pixels], even.
        progress: show on standard error what is done.

    Raises:
        InputError: bad path or size, nothing to draw with, or the simulation diverged.
    """
    require_even(path, width, height)
    open_renderer(mujoco.MjModel.from_xml_string("<mujoco/>"), width, height).close()
    taken = _Film()
    operate(robot, plan, rng, known, watch=taken.watch)
    write_video(path, _pictures(taken, plan, width, height), FPS, len(taken.frames), progress)


def _pictures(taken: _Film, plan: Plan, width: int, height: int) -> Iterator[Picture]:
    model = taken.model
    assert model is not None
    data = mujoco.MjData(model)
    options = mujoco.MjvOption()
    options.sitegroup[:] = 0
    side = round(_INSET * height)
    with open_renderer(model, width, height) as large, open_renderer(model, side, side) as small:
        for qpos, place, wall_N in taken.frames:
            data.qpos[:] = qpos
            mujoco.mj_fwdPosition(model, data)
            large.update_scene(data, free_camera(_view(plan)), options)
            small.update_scene(data, free_camera(_close_up(plan)), options)
            image = with_inset(large.render(), small.render(), (1, 1))
            yield with_caption(image, _caption(place, wall_N), (0, 0))


def _view(plan: Plan) -> View:
    """Return the view across the plane of the sheath and the valve's axis, from slightly above."""
    approach = np.array([plan.direction[0], plan.direction[1], 0.0])
    approach /= np.linalg.norm(approach)
    backward = np.cross(approach, (0.0, 0.0, 1.0)) + np.array([0.0, 0.0, 0.25])
    return View(
        "procedure",
        -0.012 * approach + np.array([0.0, 0.0, 0.026]),
        backward / np.linalg.norm(backward),
        _HEIGHT_M,
    )


def _close_up(plan: Plan) -> View:
    """Return the view of the valve along its coaptation line."""
    along, _ = coaptation_axes(plan.anatomy)
    backward = along - np.array([0.0, 0.0, 0.15])
    place = np.array([0.0, 0.0, free_edge_z_m(plan.anatomy) + 0.006])
    return View("valve", place, backward / np.linalg.norm(backward), _CLIP_HEIGHT_M)


def _caption(place: ProcedureStep, wall_N: float) -> list[str]:
    q = np.degrees(place.q).round(1) + 0.0  # + 0.0 turns -0 into 0
    return [
        place.name,
        f"insertion {1e3 * place.insertion_m:.1f} mm",
        f"proximal torsion {q[0]:.1f} deg",
        f"bend {q[1]:.1f} deg",
        f"advance {1e3 * place.q[2]:.1f} mm",
        f"distal torsion {q[3]:.1f} deg",
        f"implant {100.0 * place.opening:.0f} % open",
        f"force on the wall {wall_N:.2f} N",
    ]


# ----------------------------------------------------------------------------------------------------
# The procedure in many random anatomies: what happened in each, and the table of it.

_COLUMNS = (
    "anatomy", "succeeded", "holds", "position_error_mm", "angle_error_deg", "wall_peak_N", "wall_peak_step",
    "wall_place_x_mm", "wall_place_y_mm", "wall_place_z_mm", "torsion_proximal_deg", "bend_deg",
    "advance_under_leaflets_mm", "torsion_distal_deg", "insertion_mm", "corrections", "failure",
)  # fmt: skip


@dataclass(frozen=True)
class Attempt:
    """One anatomy of a series.

    Attributes:
        number: of the anatomy in its series, from 0.
        anatomy: the anatomy.
        outcome: how it ended; None where it did not.
        failure: None, or the line that says why it did not.
    """

    number: int
    anatomy: Anatomy
    outcome: Outcome | None
    failure: str | None

    @property
    def succeeded(self) -> bool:
        """Whether the implant reached its target."""
        return self.outcome is not None and self.outcome.succeeded


def attempt(robot: CatheterRobot, known: CatheterRobot | None, seed: int, number: int) -> Attempt:
    """Plan and operate in anatomy `number` of the series `seed`; `known` as in `operate.operate`."""
    rng = np.random.default_rng([seed, number])
    anatomy = random_anatomy(rng)
    try:
        return Attempt(number, anatomy, operate(robot, plan(robot, anatomy), rng, known), None)
    except InputError as error:  # no plan, or a simulation that diverged
        return Attempt(number, anatomy, None, str(error))


def run_series(
    robot: CatheterRobot, count: int, seed: int, known: CatheterRobot | None = None, jobs: int = 1
) -> list[Attempt]:
    """Return the attempts of a series, in order; they do not depend on `jobs`, the number of processes."""
    one = partial(attempt, robot, known, seed)
    if jobs == 1:
        return [one(number) for number in range(count)]
    with ProcessPoolExecutor(jobs, get_context("spawn")) as pool:
        return list(pool.map(one, range(count)))


def summary_text(robot: CatheterRobot, attempts: Sequence[Attempt]) -> str:
    """Return what a series came to, as lines of text."""
    done = [item.outcome for item in attempts if item.outcome is not None]
    good = sum(item.succeeded for item in attempts)
    lines = [
        f"{robot.name}: within {POSITION_MM:g} mm and {ANGLE_DEG:g} deg of the target in {good} of "
        f"{len(attempts)} anatomies; both leaflets held in {sum(end.holds for end in done)}"
    ]
    figures: dict[str, list[float]] = {
        "position error [mm]": [end.position_error_mm for end in done],
        "angle error [deg]": [end.angle_error_deg for end in done],
        "peak force on the atrium's wall [N]": [end.wall_peak_N for end in done],
        "corrections by the tracker": [float(sum(step.corrections for step in end.steps)) for end in done],
    }
    for name, values in figures.items():
        if values:
            lines.append(
                f"  {name}: median {np.median(values):.3g}, 95 % below {np.quantile(values, 0.95):.3g}, "
                f"largest {max(values):.3g}"
            )
    lines += [f"  anatomy {item.number}: {item.failure}" for item in attempts if item.failure]
    return "\n".join(lines)


def write_series(attempts: Sequence[Attempt], folder: Path) -> None:
    """Write `procedure.csv`, a row for each anatomy, and `procedure.json` with everything.

    Raises:
        InputError: the folder cannot be written.
    """
    with replaced_when_whole(folder / "procedure.csv") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(_COLUMNS)
        writer.writerows(_row(item) for item in attempts)
    with replaced_when_whole(folder / "procedure.json") as file:
        json.dump([_document(item) for item in attempts], file, indent=1)
        file.write("\n")


def _row(item: Attempt) -> list[object]:
    end = item.outcome
    if end is None:
        return [item.number, False, False, *[""] * (len(_COLUMNS) - 4), item.failure]
    worst = max(end.steps, key=lambda step: step.wall_peak_N)
    q, below = end.plan.q, end.plan.below_m
    numbers = (
        end.position_error_mm,
        end.angle_error_deg,
        end.wall_peak_N,
    )
    joints = (*np.degrees(q[:2]), 1e3 * (q[2] + below), math.degrees(q[3]), 1e3 * end.plan.insertion_m)
    touched = end.wall_peak_N > 0.0
    return [
        item.number,
        end.succeeded,
        end.holds,
        *(f"{value:.4g}" for value in numbers),
        worst.name if touched else "",
        *(f"{value:.4g}" if touched else "" for value in worst.wall_place_mm),
        *(f"{value:.4g}" for value in joints),
        sum(step.corrections for step in end.steps),
        "",
    ]


def _document(item: Attempt) -> dict[str, object]:
    document: dict[str, object] = {"anatomy": item.number, "failure": item.failure, **asdict(item.anatomy)}
    end = item.outcome
    if end is not None:
        document["outcome"] = {
            "robot": end.robot,
            "succeeded": end.succeeded,
            "holds": end.holds,
            "position_error_mm": end.position_error_mm,
            "angle_error_deg": end.angle_error_deg,
            "arms_deg": list(end.arms_deg),
            "puncture_mm": (1e3 * end.plan.puncture).tolist(),
            "direction": end.plan.direction.tolist(),
            "steps": [_plain(step) for step in end.steps],
        }
    return document


def _plain(step: StepReport) -> dict[str, object]:
    """Return a step without NaN, which JSON does not have."""
    document = asdict(step)
    if math.isnan(step.wall_place_mm[0]):
        document["wall_place_mm"] = None
    return document
