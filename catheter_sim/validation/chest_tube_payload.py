"""What a force on the tip does to a bent rod-driven robot, and what its rods can do about it; simulated.

"With the shape held" (chest_tube_2025, Table I) can mean three things, all measured here: the rods'
tensions are held, so that the robot yields; their lengths are held, as by actuators that nothing
drives back; or one rod's tension is raised until the tip is back. A force that bends the robot
further can only be met by the rod of the other side.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.robots.rolling.spec import Rod, RollingRobot
from catheter_sim.simulation.replay import simulate
from catheter_sim.simulation.simulator import Simulator
from catheter_sim.validation.chest_tube_bends import MOST_TENSION_N
from catheter_sim.validation.drives import NO_GRAVITY, given, tips_mm

PAYLOAD_N = 0.35  # chest_tube_2025, Table I
HELD_SHARE = 0.05  # assumed: of the length, by which the tip of a robot that holds its shape may move
_OPPOSITE = {"+x": "-x", "-x": "+x", "+y": "-y", "-y": "+y"}
_FORCE_STEPS, _TENSION_STEPS = 7, 16
_RAMP_S = 0.5
_LOCKED_RAMP_S = 1.0
_GRIP_N_PER_M = 1000.0  # by which a gripped rod's tension grows in one step, per length that it gave way


@dataclass(frozen=True)
class Pushed:
    """How far the tip moves under a force in the bending plane, square to the robot at the tip.

    Attributes:
        direction: "against the bend" or "with the bend".
        yields_mm: at the full force, tensions held.
        carries_N: the force, up to the full one, at which the tip has moved by `HELD_SHARE` of the
            length, tensions held.
        locked_mm: at the full force, the lengths of all rods held instead.
        locked_N: largest tension of a rod then.
        rod: name of the rod that can work against the force.
        best_mm, best_N: at the tension of that rod, up to `MOST_TENSION_N`, that brings the tip
            closest to where it was.
    """

    direction: str
    yields_mm: float
    carries_N: float
    locked_mm: float
    locked_N: float
    rod: str
    best_mm: float
    best_N: float


def pushed(robot: RollingRobot, rod: Rod, tension_N: float) -> tuple[Pushed, Pushed]:
    """Push the tip of `robot`, bent by one rod, against the bend and with it.

    Args:
        robot: of rigid links.
        rod: the one that bends it.
        tension_N: of that rod.

    Returns:
        The answers, against the bend first.
    """
    every = (*robot.tendons, *robot.passive_rods)
    other = next(item for item in every if (item.side, item.ends_at) == (_OPPOSITE[rod.side], rod.ends_at))
    # A rod that is free to slide can be gripped, too.
    gripped = replace(robot, tendons=every, passive_rods=())
    hold = np.zeros(len(every))
    hold[every.index(rod)] = tension_N
    bent = simulate(gripped, given(hold[np.newaxis]), NO_GRAVITY).postures[0]
    across = bent.R_w[-1][:, 1 if rod.side.endswith("y") else 0] * (1.0 if rod.side[0] == "+" else -1.0)
    return (
        _push(gripped, hold, every.index(rod), -PAYLOAD_N * across, "against the bend"),
        _push(gripped, hold, every.index(other), PAYLOAD_N * across, "with the bend"),
    )


def _push(robot: RollingRobot, hold: Array, rod: int, force: Array, direction: str) -> Pushed:
    """Raise the force at held tensions, then the tension of one rod under the force."""
    raised = np.linspace(hold[rod], MOST_TENSION_N, _TENSION_STEPS + 1)[1:]
    tension = np.tile(hold, (1 + _FORCE_STEPS + _TENSION_STEPS, 1))
    tension[-_TENSION_STEPS:, rod] = raised
    share = np.append(np.linspace(0.0, 1.0, _FORCE_STEPS + 1), np.ones(_TENSION_STEPS))
    inputs = given(tension, force_tip=share[:, np.newaxis] * force)
    run = simulate(robot, inputs, NO_GRAVITY, ramp_s=_RAMP_S).postures
    away = tips_mm(run) - tips_mm(run)[0]
    moved = np.linalg.norm(away, axis=1)
    loaded = slice(0, _FORCE_STEPS + 1)
    allowed = HELD_SHARE * sum(segment.length_m for segment in robot.segments) * 1e3
    worked = tension[_FORCE_STEPS : len(run), rod]
    locked_mm, locked_N = _locked(robot, hold, force)
    best_N, best_mm = _closest(worked, away[_FORCE_STEPS:])
    return Pushed(
        direction,
        float(moved[_FORCE_STEPS]),
        PAYLOAD_N * float(np.interp(allowed, np.maximum.accumulate(moved[loaded]), share[loaded])),
        locked_mm,
        locked_N,
        robot.tendons[rod].name,
        best_mm,
        best_N,
    )


def _locked(robot: RollingRobot, hold: Array, force: Array) -> tuple[float, float]:
    """Return how far the tip moves [mm] with all rods' lengths held, and the largest tension then [N]."""
    simulator = Simulator(robot, inertia=False)
    steps = round(_LOCKED_RAMP_S / simulator.model.opt.timestep)
    for i in range(1, steps + 1):
        simulator.set_inputs(hold * (1.0 - (1.0 - i / steps) ** 3))
        simulator.step()
    simulator.settle()
    start = simulator.posture().p_w[-1]
    rods = [simulator.model.tendon(f"tendon_{item.name}").id for item in robot.tendons]
    length, tension = simulator.data.ten_length[rods].copy(), hold.copy()
    for i in range(2 * steps):  # the second half at the full force
        tension += _GRIP_N_PER_M * (simulator.data.ten_length[rods] - length)
        tension = np.maximum(tension, 0.0)
        simulator.set_inputs(tension, min(i / steps, 1.0) * force)
        simulator.step()
    simulator.require_finite()
    return float(np.linalg.norm(simulator.posture().p_w[-1] - start) * 1e3), float(tension.max())


def _closest(at: Array, away: Array) -> tuple[float, float]:
    """Return where the way through the points `away`, shape (r, 3), is closest to zero, and how close."""
    best = (float(at[0]), float(np.linalg.norm(away[0])))
    for k in range(1, len(away)):
        step = away[k] - away[k - 1]
        square = float(step @ step)
        part = float(np.clip(-(away[k - 1] @ step) / square, 0.0, 1.0)) if square > 0.0 else 0.0
        near = float(np.linalg.norm(away[k - 1] + part * step))
        if near < best[1]:
            best = (float(at[k - 1] + part * (at[k] - at[k - 1])), near)
    return best
