"""Implants a clip on the mitral valve of random hearts, through the septum, and says how well.

    python scripts/mitral_procedure.py -o results/procedure [--anatomies 100] [--seed 0] [--jobs 2] [--video]
    python scripts/mitral_procedure.py -o results/procedure_tube --robot mitral_transseptal@tube
    python scripts/mitral_procedure.py -o results/procedure_path --robot mitral_transseptal@tube --path

Nayar 2022, Section IV-E, simulated: introduce, align, bend, advance, orient, open, clip, close. Prints how
many implants end within 1 mm and 3 deg of their target, and the force on the atrium's wall; writes
procedure.csv, procedure.json and, of the first anatomy, procedure.mp4 with --video and procedure.png, the end
of a step, with --picture STEP. The controller knows
pure kinematics only, with --calibrated also the slack, play and stretch of the robot's drives; where they
are not ideal it is corrected by a tracker at the implant. With --path the tendons run through the rigid
curved phantom of Section IV-D first (180 deg of turn at mu 0.2, assumed), of which the controller knows
nothing. Exit status 0; 1 where fewer than 95 in 100 succeed; 2 for bad input.
"""

from __future__ import annotations

import argparse
import csv
import json
import math
import sys
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path

import mujoco
import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.catalogue import load_robot
from catheter_sim.cli.arguments import whole_number
from catheter_sim.errors import InputError, unknown
from catheter_sim.modelling.build import View
from catheter_sim.pictures.images import (
    Picture,
    in_corner,
    inset_size,
    open_renderer,
    with_caption,
    with_inset,
    write_picture,
    write_video,
)
from catheter_sim.pictures.offscreen import free_camera
from catheter_sim.procedure.heart import coaptation_axes, free_edge_z_m, random_anatomy
from catheter_sim.procedure.operate import (
    ANGLE_DEG,
    POSITION_MM,
    Attempt,
    StepReport,
    Touch,
    operate,
    run_series,
)
from catheter_sim.procedure.plan import Plan, ProcedureStep, plan, steps
from catheter_sim.robots.catheter.spec import CatheterRobot
from catheter_sim.simulation.simulator import Simulator
from catheter_sim.tables import replaced_when_whole
from catheter_sim.validation.mitral_tables import tortuous

TRANSSEPTAL_ROBOTS = ("mitral_transseptal", "mitral_transseptal@tube")
NEEDED = 0.95  # share of anatomies
_COLUMNS = (
    "anatomy", "succeeded", "holds", "position_error_mm", "angle_error_deg", "wall_peak_N", "wall_peak_step",
    "wall_place_x_mm", "wall_place_y_mm", "wall_place_z_mm", "torsion_proximal_deg", "bend_deg",
    "advance_under_leaflets_mm", "torsion_distal_deg", "insertion_mm", "corrections", "failure",
)  # fmt: skip
FPS, WIDTH, HEIGHT = 25, 1280, 720
FASTER = 2.0  # than the simulated motion
_HEIGHT_M, _CLIP_HEIGHT_M = 0.125, 0.034  # of what is seen, of the valve alone
_INSET = 0.45  # side of the close-up over the picture's height


def main() -> int:
    """Run the series; return the exit status."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder to write")
    parser.add_argument("--anatomies", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--robot", default="mitral_transseptal", help="id, or path of a .toml")
    parser.add_argument("--jobs", type=int, default=1, help="processes to work with")
    parser.add_argument("--calibrated", action="store_true", help="the controller knows the drives' losses")
    parser.add_argument("--path", action="store_true", help="through the curved path of Section IV-D")
    parser.add_argument("--video", action="store_true", help="write procedure.mp4 of the first anatomy")
    parser.add_argument("--picture", metavar="STEP", help="write procedure.png of a step's end, as open")
    parser.add_argument("--video-width", metavar="PX", type=whole_number(160, 4096), default=WIDTH)
    options = parser.parse_args()
    try:
        return run(options)
    except InputError as error:
        print(f"mitral_procedure: {error}", file=sys.stderr)
        return 2


def run(options: argparse.Namespace) -> int:
    """Run the series as asked; return 0 or 1.

    Raises:
        InputError: bad input.
    """
    for name in ("anatomies", "jobs"):
        if getattr(options, name) < 1:
            raise InputError(f"--{name} {getattr(options, name)}: must be at least 1")
    if options.seed < 0:
        raise InputError(f"--seed {options.seed}: must not be negative")
    robot = load_robot(options.robot)
    if not isinstance(robot, CatheterRobot):
        raise InputError(
            f"{options.robot}: not a catheter; choices: mitral_transseptal, mitral_transseptal@tube"
        )
    known = robot if options.calibrated else None
    if options.path:
        robot = tortuous(robot)
    first = np.random.default_rng([options.seed, 0])
    way = plan(robot, random_anatomy(first))  # refuses a robot of another design before the series
    names = [step.name for step in steps(way)]
    if options.picture is not None and options.picture not in names:
        raise unknown("step", options.picture, names, "--picture")
    try:
        options.output.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{options.output}: cannot be made: {error.strerror or error}") from None
    attempts = run_series(robot, options.anatomies, options.seed, known, options.jobs)
    write_series(attempts, options.output)
    print(summary_text(robot, attempts))
    if options.video or options.picture is not None:
        film(robot, way, first, known, options)
    good = sum(item.succeeded for item in attempts)
    return 0 if good >= NEEDED * len(attempts) else 1


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


_Frame = tuple[Array, ProcedureStep, float]  # the joints, the step, the force on the wall [N]


@dataclass
class _Film:
    """What is remembered of a procedure to draw it."""

    model: mujoco.MjModel | None = None
    frames: list[_Frame] = field(default_factory=list)
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
    known: CatheterRobot | None,
    options: argparse.Namespace,
) -> None:
    """Write what is asked for of the procedure: across the bending plane through the wall, and the valve.

    Raises:
        InputError: bad path, nothing to draw with, or the simulation diverged.
    """
    open_renderer(mujoco.MjModel.from_xml_string("<mujoco/>"), WIDTH, HEIGHT).close()
    taken = _Film()
    operate(robot, plan, rng, known, watch=taken.watch)
    assert taken.model is not None
    if options.picture is not None:
        end = [frame for frame in taken.frames if frame[1].name == options.picture][-1:]
        (image,) = _pictures(taken.model, end, plan, WIDTH, HEIGHT)
        write_picture(options.output / "procedure.png", image)
    if options.video:
        width = options.video_width
        frames = _pictures(taken.model, taken.frames, plan, width, 2 * round(0.5 * width * HEIGHT / WIDTH))
        write_video(options.output / "procedure.mp4", frames, FPS, len(taken.frames), progress=True)


def _pictures(
    model: mujoco.MjModel, frames: Sequence[_Frame], plan: Plan, width: int, height: int
) -> Iterator[Picture]:
    data = mujoco.MjData(model)
    options = mujoco.MjvOption()
    options.sitegroup[:] = 0
    side = round(_INSET * height)
    with open_renderer(model, width, height) as large, open_renderer(model, side, side) as small:
        for qpos, place, wall_N in frames:
            data.qpos[:] = qpos
            mujoco.mj_fwdPosition(model, data)
            large.update_scene(data, free_camera(_view(plan)), options)
            small.update_scene(data, free_camera(_close_up(plan)), options)
            image, close = large.render(), small.render()
            whole = inset_size(close.shape[0], image.shape[0])
            image = with_inset(image, close, in_corner(image, whole, (1, 1)))
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


if __name__ == "__main__":
    sys.exit(main())
