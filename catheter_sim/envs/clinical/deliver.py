"""The task of bringing a clip under the leaflets of the mitral valve."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any, cast

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.document import Settings
from catheter_sim.core.robot import RobotSpec
from catheter_sim.envs.clinical.base import BaseMotion, ClinicalEnv
from catheter_sim.envs.surroundings import Surroundings
from catheter_sim.envs.tip import (
    CONTROL_STEP_S,
    Bounds,
    checked_above_zero,
    checked_pair,
)
from catheter_sim.errors import InputError, shown
from catheter_sim.mjcf.document import ALL_DIGITS, Element, read
from catheter_sim.mjcf.names import TIP
from catheter_sim.modelling.attach import CARRIER, INSERTION, quaternion, text
from catheter_sim.modelling.build import View
from catheter_sim.pictures.offscreen import fitted_view
from catheter_sim.procedure.heart import BEATS_PER_S, DOWN, FLOW_N, Flow, pose_error, transform
from catheter_sim.procedure.operate import (
    ANGLE_DEG,
    POSITION_MM,
    REGIONS,
    WAITING_M,
    WALL_N_PER_M,
    build_scene,
)
from catheter_sim.procedure.plan import (
    DELIVERING,
    PUSH_M_PER_S,
    Case,
    implant_turn_rad,
    median_case,
    random_case,
    tip_to_end_m,
)
from catheter_sim.robots import kind_of
from catheter_sim.robots.catheter.spec import CatheterRobot
from catheter_sim.units import in_file_units

# ----------------------------------------------------------------------------------------------------
# The sheath's frame, in which an environment has the procedure's scene: the robot's base frame at an
# insertion of zero. Origin in the puncture, +z along the sheath into the atrium, +x where the robot bends
# first.

LEAFLET_N_PER_M = WALL_N_PER_M  # assumed


def waiting_m(robot: CatheterRobot) -> float:
    """Return the insertion of the base at which the robot waits before the septum, < 0 [m]."""
    return -sum(segment.length_m for segment in robot.segments) - tip_to_end_m(robot) - WAITING_M


def from_valve(case: Case) -> Array:
    """Return the valve's frame in the sheath's frame, shape (4, 4)."""
    sheath = case.plan.base(0.0)
    R = sheath[:3, :3].T
    return transform(R, -R @ sheath[:3, 3])


def stream(case: Case) -> Callable[[float, Array], Array]:
    """Return the flow's force on the tip, shape (3,) [N], by time [s] and place [m]; sheath's frame."""
    R = from_valve(case)[:3, :3]
    flow = replace(case.flow, direction=R @ case.flow.direction)
    return partial(_force_N, flow)  # which can be pickled, as a function made here cannot


def _force_N(flow: Flow, time_s: float, tip_m: Array) -> Array:
    return flow.force_N(time_s, float(tip_m[2]))


def turned(angle_rad: float) -> Array:
    """Return a turn about z, shape (4, 4)."""
    cosine, sine = np.cos(angle_rad), np.sin(angle_rad)
    return transform(np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]]), np.zeros(3))


# ----------------------------------------------------------------------------------------------------
# The task of bringing a clip under the leaflets of the mitral valve.

# Matsuda 2016, doi 10.1007/s00380-015-0763-0: of a catheter's tip on the atrium's wall, 40 g are excessive;
# of leaflets assumed.
LIMIT_N = 0.39
DEEPEST_M = 40e-3  # insertion of the base beyond the puncture, at most; as `plan` has it
ANGLE_WEIGHT = 0.1  # assumed: robot lengths that a half turn of the implant costs
_BELOW, _SHEATH_M = 0.3, 10e-3  # of what a picture shows: share of the height below the annulus, sheath
HELD_STEPS = math.ceil(1.0 / (BEATS_PER_S * CONTROL_STEP_S))  # one whole beat: 9 steps
_PARTS = {  # the task's own parts of an observation: size, bounds
    "target_direction": (3, -1.0, 1.0),
    "target_side": (3, -1.0, 1.0),
    "tip_side": (3, -1.0, 1.0),
    "annulus": (3, -2.0, 2.0),
    "atrium": (3, 0.0, 2.0),
    "beat": (2, -1.0, 1.0),
    "held": (1, 0.0, 1.0),
}


class DeliverEnv(ClinicalEnv[Case]):
    """Bring a clip through the septum under the leaflets of a mitral valve, and hold it there in the flow.

    The delivery of Nayar 2022, Section IV-E (`catheter_sim.procedure`): introduce, align, bend, advance under
    the leaflets, orient, in a heart drawn at random. The implant stays closed: to open it, draw it back and
    close it on the leaflets is not part of the task. The sheath has been led through the septum as the plan
    has it (`procedure.plan`), so that the target can be reached; all that follows is the task.

    ## The robot and the action

    A catheter for the mitral valve in its MuJoCo simulation, 0.1 s a step: `mitral_transseptal` (Nayar 2022)
    or `mitral_4dof` (Nayar 2023), or a robot `.toml` with the same joints. `Box(-1, 1, (5,), float32)`: for
    the four displacements of `ReachEnv` how far their levels move, in shares of 0.05, then how far the
    base moves along the sheath, in shares of 2 mm (20 mm/s). It goes from where the implant waits 3 mm before
    the septum to 40 mm beyond the puncture.

    `mitral_4dof` has no proximal torsion. Its distal bending joint makes the turn to the valve, its proximal
    one takes the torsion's place. The sheath is rolled by a quarter turn to within 10 degrees, and the clip
    is mounted with its arms in the plane of that turn (both assumed).

    ## The heart

    `procedure.heart.RANGES`: The atrium is 25 to 30 by 24 to 29 mm (semi-axes) and 54 to 64 mm high, the
    fossa 42 to 48 mm above the annulus. The semi-axes of the annulus are 16 to 20 and 14 to 17 mm. The
    leaflets meet 4 to 10 mm below it over 4 to 8 mm, their line turned by up to 40 degrees. The sheath is
    rolled by 20 to 40 degrees (`mitral_4dof`: 80 to 100). Sources stand there; most is assumed. Wall and
    leaflets press back by 200 N/m (assumed) under each element of the robot; leaflets give way on their
    hinges besides. No friction.

    The flow shakes the tip by a sinusoidal force 70 times a minute (Nayar 2022, Section IV-F), 4.6 to 18.4 mN
    in amplitude: the paper's tip swung by 0.13 mm, which takes 9.2 mN. From half to twice of that is assumed.
    Its line lies within 30 degrees of the valve's axis; both, and its phase, are drawn (`procedure.heart`).

    ## Observation

    A flat `Box` of float32; `layout` maps names to slices. Places are in the sheath's frame: origin in the
    puncture, +z along the sheath into the atrium, +x where the robot bends first. L is the length of the
    straight robot with its tube all out. First `target` and the parts of `ReachEnv` (`tip` to `bend`),
    then

    | part | size | what | unit |
    |---|---|---|---|
    | `target_direction` | 3 | unit vector along the valve's axis into the ventricle: the tool's z there | 1 |
    | `target_side` | 3 | unit vector across the coaptation line: which way the arms are to open | 1 |
    | `tip_side` | 3 | which way the arms would open | 1 |
    | `annulus` | 3 | middle of the annulus | L |
    | `atrium` | 3 | its horizontal semi-axes and its height | L |
    | `beat` | 2 | cosine and sine of the phase of the flow, as an ECG would tell | 1 |
    | `held` | 1 | share of the beat for which the implant has been held in place | 1 |
    | `base` | 1 | insertion from where it waits | its range |
    | `force` | 5 | largest in this step on the wall and the leaflets' four plates | limit |

    `target` is where the tool's frame is wanted, `tip` where it is, as measured.

    ## Reward

    After each step, minus three terms. The first is the distance of the implant's middle from where it is
    wanted in robot lengths. The second is a tenth of the whole angle by which it is turned in half turns.
    The third is a tenth of the largest share of a force limit. A force beyond its limit and a simulation
    that diverges cost 200.

    ## Episode

    It terminates with success after 9 steps in a row, one whole beat, in which the implant was held. After
    each its middle is within `tolerance_m` of its place between the leaflets (centred on their gap and at
    the planned depth), and turned from it by at most `angle_deg`. No force may ever be beyond its limit. It
    terminates without success where one is, or where the simulation diverges. The registered environments
    are truncated after 200 steps (20 s). 1 mm and 3 degrees are the procedure's own measure. The limit,
    on the wall and on each plate of a leaflet, is 0.39 N: Matsuda 2016 (doi 10.1007/s00380-015-0763-0)
    takes 40 g of a catheter's tip on the wall for excessive. Of leaflets it is assumed.

    ## Reset

    `reset(seed=...)` draws a heart and a flow. `options={"anatomy": case}` sets them: a
    `procedure.plan.Case`, of `procedure.plan.random_case`, which takes given numbers.

    `info` of `reset` and `step`: that of the other tasks (`tip_mm`, `target_mm` and so on, true, sheath's
    frame), `force_N` and `peak_force_N` by region, `pressed_too_hard`, `insertion_mm`. Of the implant
    `centring_mm`, `depth_mm` (of its middle across the valve's axis, and along it beyond its place),
    `tilt_deg`, `turn_deg` (of its axis, and about it), `angle_deg` (the whole). Of the flow `beat_deg`,
    `flow_N` (on the tip now, shape (3,)).

    ## Arguments

    Those of `ReachEnv` but for `action_type` and `largest_bend_rad`, which are not for catheters; and

    - `tolerance_m`, `angle_deg`: see Episode; default 1 mm and 3 degrees.
    - `flow_N`: range of the force's amplitude [N]; (0, 0) for still blood.
    """

    limits_N = dict.fromkeys(REGIONS, LIMIT_N)
    target: Array  # frame in which the implant is wanted, shape (4, 4)
    _implant: Array  # where it is, true
    _measured_side: Array
    _heart: Mapping[str, Array]
    _held: int
    _time_s: float

    def __init__(
        self,
        robot: RobotSpec | str | os.PathLike[str],
        settings: Settings = (),
        tolerance_m: float = 1e-3 * POSITION_MM,
        angle_deg: float = ANGLE_DEG,
        flow_N: tuple[float, float] = FLOW_N,
        **arguments: Any,
    ) -> None:
        """Build the robot in the median heart; see the class's text.

        Raises:
            InputError: an argument is impossible, or the robot has other joints.
        """
        self.angle_rad = math.radians(checked_above_zero("angle_deg", angle_deg, 180.0))
        needed = "two amplitudes are needed, the lower first, none below 0"
        self._flow_N = checked_pair("flow_N", flow_N, needed)
        if self._flow_N[0] < 0.0:
            raise InputError(f"flow_N = {shown(flow_N)}: {needed}")
        super().__init__(robot, settings=settings, tolerance_m=tolerance_m, **arguments)
        self.begin()

    def _prepare(self) -> None:
        known: Any = self._drawn_robot()
        kind = kind_of(known)
        if not kind.has("delivery"):
            raise InputError(f"{known.name}: delivers no implant; choices: {', '.join(DELIVERING)}")
        self.known = known
        self.waiting_m = waiting_m(known)
        self._mount = turned(implant_turn_rad(known))
        self.motions = (BaseMotion(INSERTION, 0.0, DEEPEST_M - self.waiting_m, PUSH_M_PER_S),)
        self.middle_ahead_m: float = kind.face("delivery", "delivery").middle_ahead_m(known)
        super()._prepare()

    def draw(self, rng: np.random.Generator) -> Case:
        return random_case(self.known, rng, flow_N=self._flow_N)

    def middle(self) -> Case:
        return median_case(self.known)

    def surround(self, anatomy: Case, robot: RobotSpec, actuation: str) -> Surroundings:
        catheter = cast("CatheterRobot", robot)
        root = read(build_scene(catheter, anatomy.plan, tissue=True).text)
        root.part("statistic").set(center=(0.0, 0.0, 0.03))
        world = root.part("worldbody")
        there = from_valve(anatomy)
        heart = Element("body", name="heart", pos=text(there[:3, 3]), quat=quaternion(there[:3, :3]))
        for child in list(world.children):
            if child.get("name") == CARRIER:
                child.set(pos=text((0.0, 0.0, waiting_m(catheter))), quat=quaternion(np.eye(3)))
            elif child.tag != "light":
                heart.append(child)
        world.append(heart)
        stiffness = {region: WALL_N_PER_M if region == "wall" else LEAFLET_N_PER_M for region in REGIONS}
        return Surroundings(root.text(ALL_DIGITS), stiffness, (INSERTION,), stream(anatomy))

    def begin(self) -> None:
        self._held, self._time_s = 0, 0.0
        self._look()
        # the tool frame under the leaflets, x the way in which the arms open
        tool = self.anatomy.plan.target.copy()
        tool[:3, 3] += self.anatomy.plan.below_m * DOWN
        self.target = from_valve(self.anatomy) @ tool @ self._mount
        self.target_m = self.target[:3, 3].copy()
        anatomy = self.anatomy.plan.anatomy
        size = np.array([anatomy.atrium_x_m, anatomy.atrium_y_m, anatomy.atrium_height_m])
        annulus = from_valve(self.anatomy)[:3, 3]
        self._heart = {"annulus": annulus / self.length_m, "atrium": size / self.length_m}

    def judge(self) -> tuple[float, bool]:
        self._time_s += CONTROL_STEP_S
        self._look()
        error = self._error()
        distance, angle = (float(np.linalg.norm(part)) for part in (error[:3], error[3:]))
        near = distance <= self.tolerance_m and angle <= self.angle_rad
        self._held = self._held + 1 if near else 0
        cost = distance / self.length_m + ANGLE_WEIGHT * angle / math.pi
        return -cost, self._held >= HELD_STEPS

    def task_bounds(self) -> Bounds:
        return {name: (np.full(size, low), high) for name, (size, low, high) in _PARTS.items()}

    def task_parts(self) -> Mapping[str, Array]:
        beat = self.anatomy.flow.beat_rad(self._time_s)
        return {
            "target_direction": self.target[:3, 2],
            "target_side": self.target[:3, 0],
            "tip_side": self._measured_side,
            **self._heart,
            "beat": np.array([math.cos(beat), math.sin(beat)]),
            "held": np.array([self._held / HELD_STEPS]),
        }

    def seen_points(self) -> Array:
        anatomy = self.anatomy.plan.anatomy
        ends = np.array([anatomy.atrium_x_m, anatomy.atrium_y_m, anatomy.atrium_height_m])
        corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-_BELOW, 1)]) * ends
        there = from_valve(self.anatomy)
        return np.concatenate([corners @ there[:3, :3].T + there[:3, 3], [(0.0, 0.0, -_SHEATH_M)]])

    def _look(self) -> None:
        """Take down where the implant is."""
        site = self.plant.simulator.data.site(TIP)
        axes = site.xmat.reshape(3, 3).copy()
        self._implant = transform(axes, site.xpos.copy()) @ self._mount
        self._measured_side = (
            self.plant.measured(site.xpos.copy(), axes, "implant")[1] @ self._mount[:3, :3]
        )[:, 0]

    def _error(self) -> Array:
        """Return what is missing at the implant's middle: position [m], rotation vector [rad]; shape (6,)."""
        ahead = transform(np.eye(3), np.array([0.0, 0.0, self.middle_ahead_m]))
        return pose_error(self.target @ ahead, self._implant @ ahead)

    def _info(self) -> dict[str, Any]:
        error, axis = self._error(), self.target[:3, 2]
        deep = -float(error[:3] @ axis)
        cosine = min(max(float(self._implant[:3, 2] @ axis), -1.0), 1.0)
        more = {
            "centring_m": float(np.linalg.norm(error[:3] + deep * axis)),
            "depth_m": deep,
            "tilt_rad": math.acos(cosine),
            "turn_rad": abs(float(error[3:] @ axis)),
            "angle_rad": float(np.linalg.norm(error[3:])),
            "beat_rad": self.anatomy.flow.beat_rad(self._time_s),
            "flow_N": stream(self.anatomy)(self._time_s, self._implant[:3, 3]),
        }
        return {**super()._info(), **in_file_units(more)}

    def _view(self) -> View:
        """Return the view across the plane of sheath and valve's axis, a little from the ventricle's side."""
        valve = from_valve(self.anatomy)[:3, :3]
        across = np.cross((0.0, 0.0, 1.0), valve[:, 2])
        backward = across / np.linalg.norm(across) + 0.25 * valve[:, 2]
        view = View("delivery", np.zeros(3), backward / np.linalg.norm(backward), 0.1)
        return fitted_view(view, self.seen_points(), *self._size)
