"""A controller that delivers the implant: the planned way, then resolved rates on the analytic Jacobian.

It knows the plan and the nominal robot, taken for ideal (`procedure.operate.ideal`), and sees the rest in the
observation. It has no memory: in which part of the way it is follows from where the robot stands.
"""

from __future__ import annotations

import math

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.envs.clinical.deliver import DeliverEnv
from catheter_sim.envs.clinical.heart import implant_frame
from catheter_sim.envs.observation import Observation
from catheter_sim.envs.tip import CONTROL_STEP_S, RATE_PER_S, Action
from catheter_sim.procedure.feedback import corrected
from catheter_sim.procedure.operate import ideal
from catheter_sim.procedure.steps import PUSH_M_PER_S, Step, displacements_m

GAIN = 0.5  # share of a joint's error that a step takes away on the way to the valve
SHARE = 0.4  # the same of the implant's error under resolved rates
BENT_RAD = math.radians(4.0)  # from the planned bend: near enough to go on by the implant's place
OUT_M = 2e-3  # advance of the tube from which the way to the valve is over
ASIDE_M, TILT_RAD = 2e-3, math.radians(5.0)  # off the valve's axis, within which the implant is advanced
AHEAD_M = 5e-3  # of the next place on the axis, which the tube's share of the way is taken from
_STRAIGHT_M = 0.5e-3  # before the end of the straight way
_STILL = np.zeros(4)


def deliver(env: DeliverEnv, observation: Observation) -> Action:
    """Return the action that goes on with the delivery.

    Straight in, as far as the opposite wall lets it, the torsions turned already; then bent, and pushed on
    as it bends; then by the implant's place and turn, under the leaflets only once it stands above them.

    Args:
        env: for the robot's lengths and drives, the plan and the target; its state is not read.
        observation: of `env`.
    """
    part = {name: observation[place].astype(float) for name, place in env.layout.items()}
    way, known = env.anatomy.plan, ideal(env.known)
    joints = part["bend"] * env.plant.quick.bend_unit
    inserted = env.waiting_m + float(part["base"][0]) * env.motions[0].highest
    asked = env.plant.quick.reach(part["level"][np.newaxis], _STILL)[1][0]
    now = Step("", inserted, asked, 0.0)
    on_the_way = joints[2] < OUT_M and abs(way.q[1] - joints[1]) > BENT_RAD
    if not on_the_way:
        step = _placed(env, part, now, joints)
    elif inserted < way.straight_m - _STRAIGHT_M and joints[1] < BENT_RAD:
        turns = known.segments[0].joint == "torsion"
        goal = np.array([way.q[0] if turns else 0.0, 0.0, 0.0, way.q[3]])
        step = Step("", way.straight_m, asked + GAIN * (goal - joints), 0.0)
    else:
        share = min(max(joints[1] / way.q[1], 0.0), 1.0)
        goal = np.array([way.q[0], way.q[1], 0.0, way.q[3]])
        inside = way.straight_m + share * (way.insertion_m - way.straight_m)
        step = Step("", inside, asked + GAIN * (goal - joints), 0.0)
    level = displacements_m(known, step.q, _STILL) / np.diag(env.drives.tendon)
    change = (level - part["level"]) / (RATE_PER_S * CONTROL_STEP_S)
    push = (step.insertion_m - inserted) / (PUSH_M_PER_S * CONTROL_STEP_S)
    return np.clip(np.append(change, push), -1.0, 1.0).astype(np.float32)


def _placed(env: DeliverEnv, part: dict[str, Array], now: Step, joints: Array) -> Step:
    """Return the command that brings the implant to its place, or to the next one on the valve's axis."""
    length = env.length_m
    target, here = (
        implant_frame(part[f"{name}_side"], part[axis], length * part[name])
        for name, axis in (("target", "target_direction"), ("tip", "tip_direction"))
    )
    down, missing = target[:3, 2], target[:3, 3] - here[:3, 3]
    ahead = float(missing @ down)
    aside = float(np.linalg.norm(missing - ahead * down))
    above = aside < ASIDE_M and float(here[:3, 2] @ down) > math.cos(TILT_RAD)
    next_one = target.copy()
    next_one[:3, 3] -= max(ahead - (AHEAD_M if above else 0.0), 0.0) * down
    base = np.eye(4)
    base[2, 3] = now.insertion_m
    return corrected(env.known, base, Step("", now.insertion_m, joints, 0.0), now, here, next_one, SHARE)
