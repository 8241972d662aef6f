"""A video of the procedure in one anatomy: across the bending plane through the wall, and the valve."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass, field

import mujoco
import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.modelling.scene import View
from catheter_sim.pictures.backend import open_renderer
from catheter_sim.pictures.framing import free_camera
from catheter_sim.pictures.images import Picture, require_even, with_caption, with_inset, write_video
from catheter_sim.procedure.anatomy import coaptation_axes
from catheter_sim.procedure.contact import Touch
from catheter_sim.procedure.operate import operate
from catheter_sim.procedure.plan import Plan
from catheter_sim.procedure.steps import Step
from catheter_sim.procedure.valve import free_edge_z_m
from catheter_sim.robots.catheter.spec import CatheterRobot
from catheter_sim.simulation.simulator import Simulator

FPS = 25
FASTER = 2.0  # than the simulated motion
_HEIGHT_M, _CLIP_HEIGHT_M = 0.125, 0.034  # of what is seen, of the valve alone
_INSET = 0.45  # side of the close-up over the picture's height


@dataclass
class _Film:
    """What is remembered of a procedure to draw it."""

    model: mujoco.MjModel | None = None
    frames: list[tuple[Array, Step, float]] = field(default_factory=list)
    calls: int = 0

    def watch(self, simulator: Simulator, place: Step, touch: Touch) -> None:
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


def _caption(place: Step, wall_N: float) -> list[str]:
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
