"""Controllers by resolved rates for the environments' tasks: what a learned one is to be measured against.

Each takes an environment for its robot's lengths, drives and quick model, and for the anatomy and the plan
where there are any. What else it knows is in the observation; `Rates` alone reads the simulated posture.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass
from weakref import WeakKeyDictionary

import mujoco
import numpy as np

from catheter_sim.anatomy.anatomies import CHANNEL_M, TUMOUR_RADIUS_M, Chest, foramen, tumour, way
from catheter_sim.arrays import Array
from catheter_sim.channels import body_count
from catheter_sim.envs.clinical.base import ClinicalEnv
from catheter_sim.envs.clinical.deliver import DeliverEnv
from catheter_sim.envs.clinical.insert_and_tumour import InsertEnv, TumourEnv
from catheter_sim.envs.reach_and_track import ReachEnv, TrackEnv
from catheter_sim.envs.robots import Plant, change_toward
from catheter_sim.envs.tip import CONTROL_STEP_S, RATE_PER_S, Action, Observation, TipEnv, starts_near
from catheter_sim.mjcf.names import face as face_name
from catheter_sim.modelling.attach import INSERTION
from catheter_sim.procedure.heart import transform
from catheter_sim.procedure.operate import corrected, ideal
from catheter_sim.procedure.plan import PUSH_M_PER_S, ProcedureStep, displacements_m

# ----------------------------------------------------------------------------------------------------
# Simple controllers that reach targets and follow them: what a learned one is to be measured against.

GAIN = 0.3  # share of the way to the target in one step; the robot follows within a step or two
# The same of a moving target, whose own motion is added: friction takes a part of every change of a rod's or
# tendon's pull, all of it just after a reversal. From 2 on the catheters begin to swing.
FOLLOWING_GAIN = 1.5
LOOKING = 0.1  # robot lengths that a wrong direction weighs, per radian
# A bend that is farther than this from the planned one, in half turns, may belong to another branch.
_OTHER_BRANCH = 0.15
TRIALS = 12  # postures of the frictionless robot on the way from each start
_PLANNED: WeakKeyDictionary[Plant, tuple[tuple[float, ...], Array]] = (
    WeakKeyDictionary()
)  # last targets' bends
FOUND = 1e-3  # of the robot's length: the frictionless robot is at the point


def resolved_rate(env: ReachEnv, observation: Observation) -> Action:
    """Return the action that moves the tip toward the target by the frictionless Jacobian.

    Actions add up in the drives' levels, so that it goes on pulling where friction holds the robot.
    Straight to the target may end at a joint's limit, before a point that only another branch of
    postures reaches. A robot whose drives set its bends one by one (a catheter) therefore first goes
    near the posture in which the frictionless robot is at the target.

    Args:
        env: for the robot's lengths, drives and quick model; its state is not read.
        observation: of `env`.
    """
    part = _parts(env, observation)
    way = (part["target"] - part["tip"]) * env.length_m
    unit = env.plant.quick.bend_unit
    bend = part["bend"].reshape(unit.shape) * unit
    largest = RATE_PER_S * CONTROL_STEP_S
    if env.plant.quick.sets_bends:
        ahead = _planned_bends(env.plant, tuple(part["target"] * env.length_m)) - bend
        if np.abs(ahead / unit).max() > _OTHER_BRANCH:
            change = np.linalg.solve(env.drives.bend, GAIN * ahead)
            return np.clip(change / largest, -1.0, 1.0).astype(np.float32)
    return _toward(env, part["level"], GAIN * way, env.plant.quick.tip_slopes(part["level"], bend))


def following(env: TrackEnv, observation: Observation) -> Action:
    """Return the action that keeps the tip at a moving target by the frictionless Jacobian.

    The tip is to go where the target goes in the step to come, and one and a half times the way that it
    is behind; to turn toward the target's direction weighs less. The way began at rest and knows no other
    branch.

    Args:
        env: for the robot's lengths, drives and quick model; its state is not read.
        observation: of `env`.
    """
    part = _parts(env, observation)
    unit = env.plant.quick.bend_unit
    bend = part["bend"].reshape(unit.shape) * unit
    behind = FOLLOWING_GAIN * (part["target"] - part["tip"]) + part["target_velocity"] * CONTROL_STEP_S
    turned = FOLLOWING_GAIN * (part["target_direction"] - part["tip_direction"])
    looking = LOOKING * env.length_m
    quick = env.plant.quick
    slopes = np.concatenate(
        [quick.tip_slopes(part["level"], bend), looking * quick.direction_slopes(part["level"], bend)]
    )
    return _toward(env, part["level"], np.concatenate([env.length_m * behind, looking * turned]), slopes)


def frictionless_level(plant: Plant, target_m: Array) -> Array:
    """Return the levels at which the robot without friction and load is nearest to a point, shape (d,).

    Without simulation; of the postures found from several starts.
    """
    quick, length = plant.quick, float(plant.segment_length.sum())
    best, best_miss = np.zeros(len(plant.drives.names)), np.inf
    for level in starts_near(plant, target_m):
        for _ in range(TRIALS):
            tips, bends = quick.reach(level[np.newaxis], plant.rest_bends)
            miss = float(np.linalg.norm(target_m - tips[0]))
            if miss < best_miss:
                best, best_miss = level, miss
            if best_miss < FOUND * length:
                return best
            room = plant.drives.lowest - level, 1.0 - level
            level = level + change_toward(
                target_m - tips[0], quick.tip_slopes(level, bends[0]), length, *room
            )
    return best


def _parts(env: TipEnv, observation: Observation) -> dict[str, Array]:
    return {name: observation[place].astype(float) for name, place in env.layout.items()}


def _toward(env: TipEnv, level: Array, way: Array, slopes: Array) -> Action:
    """Return the action that goes `way`, shape (m,), as near as the drives can, by slopes (m, d)."""
    largest = RATE_PER_S * CONTROL_STEP_S
    least = np.clip(env.drives.lowest - level, -largest, 0.0)
    most = np.clip(1.0 - level, 0.0, largest)
    return (change_toward(way, slopes, env.length_m, least, most) / largest).astype(np.float32)


def _planned_bends(plant: Plant, target_m: tuple[float, ...]) -> Array:
    """Return the bends with which the frictionless robot is at the target, shape (*b) [rad, m]."""
    if plant not in _PLANNED or _PLANNED[plant][0] != target_m:
        level = frictionless_level(plant, np.array(target_m))
        _PLANNED[plant] = target_m, plant.quick.reach(level[np.newaxis], plant.rest_bends)[1][0]
    return _PLANNED[plant][1]


# ----------------------------------------------------------------------------------------------------
# Resolved rates of a robot in an anatomy: how its points move with its drives and its base.
#
# Slopes come from the simulated posture: MuJoCo's Jacobian of a point at the joints as they stand,
# friction, load and contacts included, times what drives do to joints without them (`quick_model`). Joints
# that a sheath still holds straight do not move; where the robot is pushed on, the joint that leaves it
# bends.


@dataclass(frozen=True)
class Wish:
    """That a point of the robot moves so.

    Attributes:
        element: whose far face the point is the middle of, from 1; the last one's is the tip.
        way_m: wished motion, shape (3,) [m].
        along: only these directions count, shape (k, 3), each as long as its weight.
    """

    element: int
    way_m: Array
    along: Array


class Rates:
    """A robot in a task, as its simulation stands now."""

    def __init__(self, env: ClinicalEnv, out_m: float) -> None:
        """Read the robot's state.

        Args:
            env: the task; its base slides along z.
            out_m: z beyond which the robot is free to bend [m].
        """
        self._env, plant = env, env.plant
        self._model, self._data = plant.simulator.model, plant.simulator.data
        mujoco.mj_fwdPosition(self._model, self._data)
        self.elements = body_count(plant.simulator.robot)
        sites = [self._model.site(face_name(k)).id for k in range(1, self.elements + 1)]
        self._sites = sites
        self.p_w = self._data.site_xpos[sites].copy()
        self._joints = self._joint_slopes(out_m)

    def choose(self, wishes: list[Wish]) -> Action:
        """Return the action that fulfils the wishes as well as one step can."""
        env, plant = self._env, self._env.plant
        slopes, ways = [], []
        for wish in wishes:
            jacobian = np.zeros((3, self._model.nv))
            mujoco.mj_jacSite(self._model, self._data, jacobian, None, self._sites[wish.element - 1])
            slopes.append(wish.along @ jacobian @ self._joints)
            ways.append(wish.along @ wish.way_m)
        ranges = np.array([motion.highest for motion in env.motions])
        ends = np.array([(motion.lowest, motion.highest) for motion in env.motions])
        rates = np.array([motion.rate_per_s for motion in env.motions]) / ranges
        largest = CONTROL_STEP_S * np.concatenate([np.full(len(plant.level), RATE_PER_S), rates])
        place = np.concatenate([plant.level, plant.carriage / ranges])
        lowest = np.concatenate([plant.drives.lowest, ends[:, 0] / ranges])
        least = np.clip(lowest - place, -largest, 0.0)
        most = np.clip(1.0 - place, 0.0, largest)
        change = change_toward(np.concatenate(ways), np.concatenate(slopes), env.length_m, least, most)
        return (change / largest).astype(np.float32)

    def _joint_slopes(self, out_m: float) -> Array:
        """Return how the joints move with the levels and the base's shares of its ranges, (nv, d + c)."""
        env, model, data = self._env, self._model, self._data
        plant = env.plant
        bend = plant.drives.bend
        drives = len(plant.level)
        slopes = np.zeros((model.nv, drives + len(env.motions)))
        length = float(plant.segment_length.sum()) / self.elements
        leaving = True
        places = {index: plant.quick.bend_of(model.joint(index).name) for index in range(model.njnt)}
        counts = Counter(places.values())
        for index, place in places.items():
            if place is None:
                continue
            count = counts[place]
            if data.xanchor[index, 2] < out_m:
                continue
            dof = int(model.jnt_dofadr[index])
            slopes[dof, :drives] = bend[place] / count
            if leaving:  # the joint that has just left the sheath
                natural = float(bend[place] @ plant.level) / count
                slopes[dof, drives] = natural / length
                leaving = False
        for number, motion in enumerate(env.motions):
            if motion.name == INSERTION:
                slopes[:, drives + number] *= motion.highest
            slopes[int(model.joint(motion.name).dofadr[0]), drives + number] = motion.highest
        return slopes


# ----------------------------------------------------------------------------------------------------
# Model-based controllers of the clinical tasks: resolved rates with what the anatomy asks for besides.

_LEAD_M = 3e-3  # that the tip is asked to go ahead on the way, in one step
_NEAR_M = 1.5e-3  # the same near the foramen and beyond it
_BEFORE_M, _PASSED_M = 6e-3, 4e-3  # of the tip before and behind the foramen's middle: near it
_CLEAR_M = 3.5e-3  # of the tip's middle from the tumour, on the way's axis: from there it turns to the points
_ENOUGH = 0.7  # of the tolerance: so near it goes to a point, and no nearer, as that moves the shaft least
_OFF_M = 2.2e-3  # least distance of the tip's middle from the tumour: the tip's radius and a margin
_SHAFT, _SHAFT_GAIN = 1.0, 0.3  # weight of the shaft's place in the foramen against the tip's; share a step
_TURN_M = 34e-3  # radius of the turn in the pleural space
_AHEAD = 3  # points of the way, a millimetre apart, that the tip is asked to go in a step
_FOLLOW, _FOLLOW_GAIN = 0.3, 0.3  # weight of a link's place on the way against the tip's; share a step
_ROLL_GAIN = 0.3  # share of the roll's error that goes in a step


def tumour_rates(env: TumourEnv) -> Action:
    """Return the action of resolved rates in `TumourEnv`.

    The tip follows the planned way until it is through the foramen, and then goes toward the next point from
    the end of the way, as near as is asked for; the shaft is to stay in the middle of the foramen meanwhile.
    On the way to the foramen, where the robot is hardly bent yet, it is rolled into the plane of the way.
    """
    rates = Rates(env, 0.0)
    tip, anatomy = rates.p_w[-1], env.anatomy
    hole = foramen(anatomy)
    middle, axes = hole.p_w[0], hole.R_w[0]
    ahead = float((tip - middle) @ axes[:, 2])
    most = _LEAD_M if ahead < -_BEFORE_M else _NEAR_M
    if ahead < _PASSED_M:
        s = np.linspace(0.0, anatomy.length_m, 400)
        places = way(anatomy, s).p_w
        nearest = int(np.linalg.norm(places - tip, axis=1).argmin())
        goal = way(anatomy, s[nearest] + most).p_w[0]
    else:
        end = way(anatomy, np.array([anatomy.length_m - _CLEAR_M])).p_w[0]
        back = end - env.target_m
        goal = env.target_m + _limited(back, _ENOUGH * env.tolerance_m)
    wishes = [Wish(rates.elements, _kept_off(tip, _limited(goal - tip, most), tumour(anatomy)), np.eye(3))]
    if ahead > 0.0:
        along = (rates.p_w - middle) @ axes[:, 2]
        element = int(np.abs(along).argmin())
        back = _SHAFT_GAIN * (middle - rates.p_w[element])
        wishes.append(Wish(element + 1, back, _SHAFT * axes[:, :2].T))
    action = rates.choose(wishes)
    if ahead < -_BEFORE_M:
        roll = math.atan2(middle[1], middle[0]) if math.hypot(*middle[:2]) > 1e-3 else anatomy.azimuth_rad
        error = 0.5 * (roll + anatomy.azimuth_rad) - env.plant.carriage[1]
        action[-1] = np.clip(_ROLL_GAIN * error / (env.motions[1].rate_per_s * CONTROL_STEP_S), -1.0, 1.0)
    return action


def insert_way(anatomy: Chest) -> Array:
    """Return points a millimetre apart from the channel's mouth to the aspiration point, shape (n, 3) [m].

    Straight on, round an arc of `_TURN_M` into the plane of the wall, and straight on.
    """
    depth, across = anatomy.target_depth_m, anatomy.target_away_m
    first, turn = depth - _TURN_M, 0.5 * math.pi * _TURN_M
    s = np.arange(0.0, first + turn + across - _TURN_M, 1e-3)
    angle = np.clip((s - first) / _TURN_M, 0.0, 0.5 * math.pi)
    after = np.maximum(s - first - turn, 0.0)
    x = _TURN_M * (1.0 - np.cos(angle)) + after
    z = np.minimum(s, first) + _TURN_M * np.sin(angle)
    azimuth = anatomy.target_azimuth_rad
    return np.stack([x * math.cos(azimuth), x * math.sin(azimuth), z], axis=1)


def insert_rates(env: InsertEnv) -> Action:
    """Return the action of resolved rates in `InsertEnv`.

    The tip goes along `insert_way`, and each link that is out of the wall is to stay on it; the robot is
    rolled into the plane of the way while it is still in the wall.
    """
    rates = Rates(env, 0.0)
    tip, way_m = rates.p_w[-1], insert_way(env.anatomy)
    turn = env.anatomy.target_azimuth_rad - env.plant.carriage[1]
    action = np.zeros(env.action_space.shape, dtype=np.float32)
    if tip[2] < 0.0 and float(np.hypot(*tip[:2])) < CHANNEL_M:
        action[-2] = 1.0
    else:
        nearest = int(np.linalg.norm(way_m - tip, axis=1).argmin())
        goal = way_m[min(nearest + _AHEAD, len(way_m) - 1)]
        wishes = [Wish(rates.elements, _limited(goal - tip, _AHEAD * 1e-3), np.eye(3))]
        for element in range(rates.elements - 1, 0, -1):
            place = rates.p_w[element - 1]
            if place[2] < 0.0:
                break
            other = way_m[int(np.linalg.norm(way_m - place, axis=1).argmin())]
            wishes.append(Wish(element, _FOLLOW_GAIN * (other - place), _FOLLOW * np.eye(3)))
        action = rates.choose(wishes)
    action[-1] = np.clip(turn / (env.motions[1].rate_per_s * CONTROL_STEP_S), -1.0, 1.0)
    return action


def _limited(way_m: Array, most_m: float) -> Array:
    """Return a motion, no longer than `most_m`."""
    size = float(np.linalg.norm(way_m))
    return way_m * min(1.0, most_m / max(size, 1e-12))


def _kept_off(tip: Array, move: Array, ball: Array) -> Array:
    """Return a motion that does not bring the tip's middle nearer to the tumour than `_OFF_M`."""
    inward = (ball - tip) / np.linalg.norm(ball - tip)
    room = float(np.linalg.norm(ball - tip)) - TUMOUR_RADIUS_M - _OFF_M
    return move - inward * max(0.0, float(move @ inward) - room)


# ----------------------------------------------------------------------------------------------------
# A controller that delivers the implant: the planned way, then resolved rates on the analytic Jacobian.
#
# It knows the plan and the nominal robot, taken for ideal (`procedure.operate.ideal`), and sees the rest in
# the observation. It has no memory: in which part of the way it is follows from where the robot stands.

JOINT_GAIN = 0.5  # share of a joint's error that a step takes away on the way to the valve
IMPLANT_GAIN = 0.4  # the same of the implant's error under resolved rates
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
    part = _parts(env, observation)
    way, known = env.anatomy.plan, ideal(env.known)
    joints = part["bend"] * env.plant.quick.bend_unit
    inserted = env.waiting_m + float(part["base"][0]) * env.motions[0].highest
    asked = env.plant.quick.reach(part["level"][np.newaxis], _STILL)[1][0]
    now = ProcedureStep("", inserted, asked, 0.0)
    on_the_way = joints[2] < OUT_M and abs(way.q[1] - joints[1]) > BENT_RAD
    if not on_the_way:
        step = _placed(env, part, now, joints)
    elif inserted < way.straight_m - _STRAIGHT_M and joints[1] < BENT_RAD:
        turns = known.segments[0].joint == "torsion"
        goal = np.array([way.q[0] if turns else 0.0, 0.0, 0.0, way.q[3]])
        step = ProcedureStep("", way.straight_m, asked + JOINT_GAIN * (goal - joints), 0.0)
    else:
        share = min(max(joints[1] / way.q[1], 0.0), 1.0)
        goal = np.array([way.q[0], way.q[1], 0.0, way.q[3]])
        inside = way.straight_m + share * (way.insertion_m - way.straight_m)
        step = ProcedureStep("", inside, asked + JOINT_GAIN * (goal - joints), 0.0)
    level = displacements_m(known, step.q, _STILL) / np.diag(env.drives.tendon)
    change = (level - part["level"]) / (RATE_PER_S * CONTROL_STEP_S)
    push = (step.insertion_m - inserted) / (PUSH_M_PER_S * CONTROL_STEP_S)
    return np.clip(np.append(change, push), -1.0, 1.0).astype(np.float32)


def _placed(env: DeliverEnv, part: dict[str, Array], now: ProcedureStep, joints: Array) -> ProcedureStep:
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
    return corrected(
        env.known, base, ProcedureStep("", now.insertion_m, joints, 0.0), now, here, next_one, IMPLANT_GAIN
    )


def implant_frame(side: Array, direction: Array, place: Array) -> Array:
    """Return the frame of which x and z were seen, not quite at right angles, shape (4, 4)."""
    z = direction / np.linalg.norm(direction)
    x = side - (side @ z) * z
    x /= np.linalg.norm(x)
    return transform(np.stack([x, np.cross(z, x), z], axis=1), place)
