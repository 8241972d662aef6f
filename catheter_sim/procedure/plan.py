"""From an anatomy to a plan: where to puncture, the joint values of every step; and random cases."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares

from catheter_sim.anatomy.anatomies import middles
from catheter_sim.arrays import Array
from catheter_sim.errors import InputError, unknown
from catheter_sim.procedure.heart import (
    DOWN,
    FLOW_N,
    RANGES,
    Anatomy,
    Flow,
    base_frame,
    coaptation_axes,
    depth_m,
    free_edge_z_m,
    inward,
    pose_error,
    pushed_edge_z_m,
    random_anatomy,
    random_flow,
    septal_point,
    transform,
)
from catheter_sim.robots.catheter.description import (
    is_four_dof,
    is_transseptal,
    joint_stiffness,
    moved_segment,
    moving,
)
from catheter_sim.robots.catheter.kinematics import largest_angle_rad, pulled_m, tool_frame
from catheter_sim.robots.catheter.picture import IMPLANT_M, hinge_place_m, holder_length_m
from catheter_sim.robots.catheter.spec import CatheterRobot

# ----------------------------------------------------------------------------------------------------
# From an anatomy to a plan: where to puncture, how to lead the sheath, and the joint values of every step.
#
# The target. The clip stands across the coaptation line, upright in the valve, its arms' hinges just below
# the free edges. That is a whole pose, six numbers; four joints and the insertion do not reach it from
# everywhere. The way in is planned with them: the place within the fossa, and the direction in which the
# outer sheath comes through (Nayar 2022, Section IV-D, has one). Of all ways the one is taken that keeps to
# the ranges of the paper's demonstration (Section IV-E) and bends the sheath the least.

GRASP_M = 1.5e-3  # of the free edges above the arms' hinges; assumed
# Of the implant's foot below the free edges, as the holder has pushed them aside, before it opens: the arms,
# which begin beyond the foot, open under the leaflets and not between them. Assumed.
BELOW_EDGE_M = 0.5e-3
CLEARANCE_M = 3e-3  # of the straight implant from the opposite wall; assumed
SHEATH_RAD = math.radians(40.0)  # largest deflection of the sheath from the septum's normal; assumed
DELIVERING = ("mitral_transseptal", "mitral_4dof")  # robots of the designs that `plan_way` knows
REACHED = 1e-7  # [m, rad] largest part of a pose error that is none
# Nayar 2022, Section IV-E: 60 deg, 25 to 35 mm; how far from them counts as much as the others' range
_PREFERRED = {"bend": (math.radians(60.0), math.radians(15.0)), "advance": (30e-3, 6e-3)}
_POSE_WEIGHT = 1e2
_STEP = 1e-5  # of differences, in scaled variables
_SCALE = np.array([1e-2, 1e-2, 0.5, 0.5, 1e-2, 0.5, 0.5, 1e-2, 0.5])


@dataclass(frozen=True)
class Plan:
    """A way to the target."""

    anatomy: Anatomy  # for which it is
    target: Array  # tool frame in the valve frame, shape (4, 4)
    puncture: Array  # on the septum, shape (3,) [m]
    direction: Array  # of the sheath, unit vector into the atrium, shape (3,)
    straight_m: float  # insertion of the base up to which the robot is straight
    insertion_m: float  # of the base beyond the puncture, in the end
    q: Array  # joint values in the target, base to tip, shape (4,) [rad, m]
    below_m: float  # by how much further the tube is advanced before the implant opens

    def base(self, insertion_m: float) -> Array:
        """Return the robot's base frame at an insertion, valve frame, shape (4, 4)."""
        return base_frame(self.puncture, self.direction, self.anatomy.roll_rad, insertion_m)


def target_frame(robot: CatheterRobot, anatomy: Anatomy) -> Array:
    """Return the tool frame in which the closed clip holds both leaflets, valve frame, shape (4, 4)."""
    _, across = coaptation_axes(anatomy)
    turn = implant_turn_rad(robot)
    toward_x = math.cos(turn) * across - math.sin(turn) * np.cross(DOWN, across)
    beyond = hinge_place_m(robot, 1.0)[2] - robot.segments[-1].length_m
    height = free_edge_z_m(anatomy) - GRASP_M + beyond
    axes = np.stack([toward_x, np.cross(DOWN, toward_x), DOWN], axis=1)
    return transform(axes, np.array([0.0, 0.0, height]))


def implant_turn_rad(robot: CatheterRobot) -> float:
    """Return by how much the implant is turned in its holder about the tool's z, from x to y [rad].

    Its arms stand in the plane of the turn to the valve: the transseptal design bends in xz, the crossed
    one in yz. The latter is assumed: no paper says how the implant is mounted.
    """
    return 0.5 * math.pi if is_four_dof(robot) else 0.0


def plan(robot: CatheterRobot, anatomy: Anatomy) -> Plan:
    """Return a plan of the whole procedure.

    `InputError`: not the transseptal design, or no way within the limits.
    """
    if not is_transseptal(robot):
        raise InputError(f"{robot.name}: the procedure is for the transseptal design of joints")
    return plan_way(robot, anatomy)


def plan_way(robot: CatheterRobot, anatomy: Anatomy) -> Plan:
    """Return a plan of the way under the leaflets, for either catheter for the mitral valve.

    The crossed design (Nayar 2023) has no proximal torsion: its distal bending joint, toward +y, makes the
    turn, and its proximal one takes the torsion's place. So its sheath is to be led with a roll of about a
    quarter turn, +y toward the valve, and what is left of it is the proximal joint's.

    `InputError`: neither design, or no way within the limits.
    """
    if not (is_transseptal(robot) or is_four_dof(robot)):
        raise InputError(f"{robot.name}: the way is planned for the joints of {', '.join(DELIVERING)} only")
    target = target_frame(robot, anatomy)
    edge = pushed_edge_z_m(anatomy, robot.segments[-1].outer_radius_m)
    foot = float(target[2, 3]) + (robot.segments[-1].length_m - holder_length_m(robot))
    below = foot - (edge - BELOW_EDGE_M)
    low, high = _bounds(robot, anatomy, below)
    if (low >= high).any():
        raise InputError(f"{robot.name}: no plan: the stroke is shorter than the way under the leaflets")

    def unpacked(x: Array) -> tuple[Array, Array, float, Array]:
        values = x * _SCALE
        puncture = septal_point(anatomy, values[0], values[1])
        direction = _deflected(inward(anatomy, puncture), values[2], values[3])
        return puncture, direction, float(values[4]), values[5:]

    def missed(x: Array) -> Array:
        puncture, direction, insertion, q = unpacked(x)
        base = base_frame(puncture, direction, anatomy.roll_rad, insertion)
        return pose_error(target, base @ tool_frame(robot, q))

    def missing(x: Array) -> Array:
        return missed(x) / np.array([1e-2] * 3 + [0.5] * 3)

    def preferred(x: Array) -> Array:
        values = x * _SCALE
        wanted, spread = _PREFERRED["bend"]
        reach, room = _PREFERRED["advance"]
        radius = anatomy.fossa_radius_m
        aside = (values[0] - anatomy.fossa_y_m) / radius, (values[1] - anatomy.fossa_z_m) / radius
        joints = (values[6] - wanted) / spread, (values[7] + below - reach) / room
        return np.array([*aside, *(values[2:4] / SHEATH_RAD), *joints])

    start = np.clip(_start(robot, anatomy, below) / _SCALE, low + 1e-6, high - 1e-6)
    rough = least_squares(
        lambda x: np.concatenate([_POSE_WEIGHT * missing(x), preferred(x)]),
        start,
        bounds=(low, high),
        xtol=1e-6,
        ftol=1e-6,
    )
    # what the preferences have pulled off the pose is taken back
    exact = _solved(missing, rough.x, low, high)
    puncture, direction, insertion, q = unpacked(exact)
    error = missed(exact)
    if np.abs(error).max() > REACHED:
        raise InputError(
            f"{robot.name}: no plan: within the fossa, the sheath's deflection and the joints' limits the "
            f"implant stays {np.linalg.norm(error[:3]) * 1e3:.2g} mm and "
            f"{math.degrees(float(np.linalg.norm(error[3:]))):.2g} deg from its target"
        )
    straight = min(insertion, _straight_m(robot, anatomy, puncture, direction))
    return Plan(anatomy, target, puncture, direction, straight, insertion, q, below)


def _solved(missing: Callable[[Array], Array], start: Array, low: Array, high: Array) -> Array:
    """Return the solution of `missing` = 0 next to `start`, by Newton's shortest steps within the bounds."""
    x = start.copy()
    for _ in range(10):
        error = missing(x)
        slope = np.stack(
            [(missing(x + step) - missing(x - step)) / (2.0 * _STEP) for step in _STEP * np.eye(len(x))],
            axis=1,
        )
        free = np.ones(len(x), dtype=bool)
        for _ in range(len(x)):  # what would leave its bounds is held, and the others make up for it
            move = np.zeros(len(x))
            move[free] = np.linalg.lstsq(slope[:, free], -error, rcond=1e-9)[0]
            leaves = free & ((x + move < low) | (x + move > high))
            if not leaves.any():
                break
            free &= ~leaves
        x = np.clip(x + move, low, high)
        if np.abs(move).max() < 1e-11:
            break
    return x


def _bounds(robot: CatheterRobot, anatomy: Anatomy, below: float) -> tuple[Array, Array]:
    """Return the least and largest values of the planning variables, scaled."""
    limits = [robot.segments[index] for index in moving(robot)]
    radius = anatomy.fossa_radius_m / math.sqrt(2.0)  # a square within the fossa
    sheath = SHEATH_RAD / math.sqrt(2.0)
    first = robot.segments[0]
    out = 0.0 if first.joint == "bending" else first.length_m  # what does not bend may stay in the septum
    low = [anatomy.fossa_y_m - radius, anatomy.fossa_z_m - radius, -sheath, -sheath, -out]
    high = [anatomy.fossa_y_m + radius, anatomy.fossa_z_m + radius, sheath, sheath, 40e-3]
    for segment in limits:
        slides = segment.joint == "prismatic"
        low.append(0.0 if slides else -segment.limit_rad)
        high.append(segment.stroke_m - below if slides else segment.limit_rad)
    return np.array(low) / _SCALE, np.array(high) / _SCALE


def _start(robot: CatheterRobot, anatomy: Anatomy, below: float) -> Array:
    """Return where the search begins: the fossa's middle, the septum's normal, the paper's ranges."""
    bend, advance = _PREFERRED["bend"][0], _PREFERRED["advance"][0] - below
    proximal = 0.0 if is_four_dof(robot) else anatomy.roll_rad
    torsion = -anatomy.coaptation_rad
    return np.array([anatomy.fossa_y_m, anatomy.fossa_z_m, 0.0, 0.0, 0.0, proximal, bend, advance, torsion])


def _deflected(normal: Array, aside_rad: float, down_rad: float) -> Array:
    """Return a unit vector turned from `normal` sideways and toward the valve."""
    side = np.cross(DOWN, normal)
    side /= np.linalg.norm(side)
    down = np.cross(normal, side)
    turned = normal + math.tan(aside_rad) * side + math.tan(down_rad) * down
    return turned / np.linalg.norm(turned)


def _straight_m(robot: CatheterRobot, anatomy: Anatomy, puncture: Array, direction: Array) -> float:
    """Return the insertion of the base at which the straight implant is near the opposite wall [m]."""
    reach = tip_to_end_m(robot) + sum(segment.length_m for segment in robot.segments)
    inside = np.linspace(10e-3, 150e-3, 281)
    depth = depth_m(anatomy, puncture + inside[:, np.newaxis] * direction)
    far = inside[depth < CLEARANCE_M]
    return float(far[0]) - reach if len(far) else math.inf


def tip_to_end_m(robot: CatheterRobot) -> float:
    """Return how far the implant reaches beyond the tool frame [m]."""
    return holder_length_m(robot) + IMPLANT_M - robot.segments[-1].length_m


# ----------------------------------------------------------------------------------------------------
# The steps of the procedure as places to go to, and the displacements that take the joints there.
#
# Nayar 2022, Section IV-E: introduce, align, bend, advance under the leaflets, orient, manipulate the
# implant. Where the straight robot is too long for the atrium, it is pushed on while it bends. The implant
# opens under the leaflets, is drawn back until they lie on its arms, and closes.

# Speeds, slow against the robot's relaxation; assumed.
PUSH_M_PER_S = 20e-3
TURN_RAD_PER_S = math.radians(30.0)
OPENING_S = 1.0  # of the implant
HOLD_S = 0.4  # after every motion


@dataclass(frozen=True)
class ProcedureStep:
    """Where a step of the procedure ends."""

    name: str
    insertion_m: float  # of the robot's base beyond the puncture
    q: Array  # joint values, base to tip, shape (4,) [rad, m]
    opening: float  # of the implant, 0 closed, 1 open


def steps(plan: Plan) -> tuple[ProcedureStep, ...]:
    """Return the steps, from the straight robot in the atrium to the closed implant."""
    proximal, bend, advance, distal = plan.q
    straight, inside, deep = plan.straight_m, plan.insertion_m, advance + plan.below_m
    places = (
        ("insert", straight, (0.0, 0.0, 0.0, 0.0), 0.0),
        ("align", straight, (proximal, 0.0, 0.0, 0.0), 0.0),
        ("bend", inside, (proximal, bend, 0.0, 0.0), 0.0),
        ("advance", inside, (proximal, bend, deep, 0.0), 0.0),
        ("orient", inside, (proximal, bend, deep, distal), 0.0),
        ("open", inside, (proximal, bend, deep, distal), 1.0),
        ("clip", inside, (proximal, bend, advance, distal), 1.0),
        ("close", inside, (proximal, bend, advance, distal), 0.0),
    )
    return tuple(ProcedureStep(name, inner, np.array(q), opening) for name, inner, q, opening in places)


def duration_s(robot: CatheterRobot, before: ProcedureStep, after: ProcedureStep) -> float:
    """Return how long the motion between two places takes at the stated speeds [s]."""
    needed = [abs(after.insertion_m - before.insertion_m) / PUSH_M_PER_S]
    needed.append(abs(after.opening - before.opening) * OPENING_S)
    for index, way in zip(moving(robot), np.abs(after.q - before.q), strict=True):
        slides = robot.segments[index].joint == "prismatic"
        needed.append(float(way) / (PUSH_M_PER_S if slides else TURN_RAD_PER_S))
    return max(needed)


def between(before: ProcedureStep, after: ProcedureStep, share: float) -> ProcedureStep:
    """Return the place at this share of the straight way between two, named after the second."""
    return ProcedureStep(
        after.name,
        before.insertion_m + share * (after.insertion_m - before.insertion_m),
        before.q + share * (after.q - before.q),
        before.opening + share * (after.opening - before.opening),
    )


def displacements_m(robot: CatheterRobot, q: Array, way: Array) -> Array:
    """Return what moves the joints to q, in the order of the pairs, shape (p,) [m].

    Pure kinematics (Nayar 2022, Eqs 3, 6), and what the robot is taken to lose on top of it. That is slack,
    the stretch under the joint's elastic moment, half of the drive's play in the direction of motion. Not
    friction. Joint values q, base to tip, shape (4,) [rad, m], move in the directions `way`, +1, -1 or 0.
    """
    order = moving(robot)
    result = []
    for number, pair in enumerate(robot.tendons):
        index = moved_segment(robot, number)
        segment, place = robot.segments[index], order.index(index)
        value = float(q[place])
        play = 0.5 * pair.play_m * float(way[place])
        if segment.joint == "prismatic":
            result.append(value + play)
            continue
        most = largest_angle_rad(segment)
        value = min(max(value, -most), most)
        lost = play + math.copysign(pair.slack_m, value) * float(abs(value) > 1e-9)
        if segment.joint == "bending" and math.isfinite(pair.stiffness_N_per_m):
            lost += joint_stiffness(robot, segment) * value / (segment.arm_m * pair.stiffness_N_per_m)
        result.append(float(pulled_m(segment, value)) + lost)
    return np.array(result)


# ----------------------------------------------------------------------------------------------------
# One patient for one robot, drawn at random: anatomy, planned way and flow.

# Of the crossed design's outer sheath, which is led by hand: 10 deg about the roll that would do without its
# proximal joint, +y toward the valve. Assumed.
CROSSED_ROLL_RAD = (math.radians(80.0), math.radians(100.0))
_MOST_DRAWS = 20


@dataclass(frozen=True)
class Case:
    """What an episode of the delivery has around the robot."""

    plan: Plan  # the way to the target; holds the anatomy
    flow: Flow  # its force


def ranges(robot: CatheterRobot) -> dict[str, tuple[float, float]]:
    """Return the ranges of the anatomies that `robot` meets, by name."""
    return RANGES | ({"roll_rad": CROSSED_ROLL_RAD} if is_four_dof(robot) else {})


def random_case(
    robot: CatheterRobot,
    rng: np.random.Generator,
    given: Mapping[str, float] | None = None,
    flow_N: tuple[float, float] = FLOW_N,
) -> Case:
    """Return a case; an anatomy in which there is no way is drawn again.

    Numbers of the anatomy that are `given` are not drawn; `flow_N` is the range of the force's amplitude.

    Raises:
        InputError: a robot of another design, an unknown name, a number outside its range, or no way in any
            of 20 anatomies.
    """
    bounds = ranges(robot)
    for name, value in (given or {}).items():
        if name not in bounds:
            raise unknown("number of the anatomy", name, bounds)
        low, high = bounds[name]
        if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
            raise InputError(f"anatomy: {name} = {value!r}: must be a number in {low:g} to {high:g}")

    def one() -> Case:
        anatomy = replace(random_anatomy(rng, bounds), **(given or {}))
        return Case(plan_way(robot, anatomy), random_flow(rng, flow_N))

    for _ in range(_MOST_DRAWS - 1):
        with suppress(InputError):
            return one()
    return one()


def median_case(robot: CatheterRobot) -> Case:
    """Return the case in the middle of all ranges, its flow along the valve's axis."""
    return Case(plan_way(robot, Anatomy(**middles(ranges(robot)))), Flow(0.5 * sum(FLOW_N), DOWN, 0.0))
