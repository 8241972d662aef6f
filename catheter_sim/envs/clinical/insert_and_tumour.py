"""The tasks of a chest tube in the pleural space and of an endoscope at a tumour."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
import trimesh

from catheter_sim.anatomy import anatomies
from catheter_sim.anatomy.anatomies import Chest, Ventricles
from catheter_sim.arrays import Array
from catheter_sim.core.robot import RobotSpec
from catheter_sim.envs.clinical.base import BaseMotion, ClinicalEnv
from catheter_sim.envs.surroundings import Surroundings, on_a_slide
from catheter_sim.envs.tip import Bounds
from catheter_sim.mjcf.document import ALL_DIGITS, Element
from catheter_sim.modelling.attach import INSERTION, ROLL, add_mesh, text, touched, touched_block

# ----------------------------------------------------------------------------------------------------
# The task of bringing the tip of a chest tube's robot to an aspiration point in the pleural space.

GUIDE_M = 3.3e-3  # half the width of the guide outside the skin; assumed: 0.2 mm of room on each side
INSERT_STROKE_M = anatomies.ranges_of(Chest)["wall_m"][1] + 0.17  # of the insertion, from the skin
# Assumed: 20 cm of water, what a lung bears as pressure across it, on the face of the robot of 6.2 mm: 59 mN.
ORGAN_LIMIT_N = 1961.3 * math.pi * 3.1e-3**2
WALL_LIMIT_N = 10.0  # assumed: chest tubes are pushed through muscle by hand, with more
ORGAN_N_PER_M = 50.0  # assumed: a flat punch of the robot's radius on a half-space of some 6 kPa
WALL_N_PER_M = 500.0  # assumed
GUIDE_N_PER_M = 2000.0  # assumed: stiff against the robot
FOUND_M = 0.5e-3  # of the robot from tissue, where a contact is known before it presses
_GUIDE_FOUND_M = 0.15e-3
_GUIDE_WALL_M = 5e-3
_RGBA = {"wall": "0.90 0.74 0.62 0.25", "lung": "0.86 0.52 0.55 0.35", "diaphragm": "0.70 0.32 0.30 0.35"}


class InsertEnv(ClinicalEnv[Chest]):
    """Bring the tip of a chest tube's robot through the chest wall to an aspiration point.

    ## The robot and the way

    `ChestTubeInsert-v0` is the full robot of chest_tube_2025, 375 mm of three sections, in its MuJoCo
    simulation with the rods' friction and its effects; 0.1 s a step. It lies in a straight guide outside the
    skin, its tip at the skin. It is pushed through a dissected channel in the chest wall, 26.6 to 80.2 mm
    thick (chest_tube_2025, Section II.B), into the pleural space. There a large effusion has pushed the
    lung away by 65 to 80 mm. There it has to turn toward the apex: the aspiration point lies 90 to 125 mm
    from the channel's axis, 36 to 44 mm under the wall. `anatomy.anatomies` has all numbers, their ranges
    and sources.

    ## Action

    `Box(-1, 1, (10,), float32)`: changes of the eight tension drives, in shares of 0.05 of their ranges (the
    rods' ranges as in `ChestTubeReach-v0`, but for 3 rad: 89 and 100 N). Then the insertion, 3 mm a step at
    full action, from 0 to 250 mm, and the roll at the skin, 3 deg a step, +-60 deg.

    ## Observation

    A flat `Box` of float32; `layout` maps names to slices. First `target`, the aspiration point, then what
    `ReachEnv` shows of the robot (`tip` to `bend`), in the entry frame. Its origin is where the channel
    opens into the pleural space, z along it inward, x toward the apex, the bending direction before the
    roll. Then

    | part | size | what | unit |
    |---|---|---|---|
    | `wall` | 1 | thickness of the chest wall | L = 375 mm |
    | `lung` | 3 | middle of the lung, a ball | L |
    | `lung_radius` | 1 | its radius | L |
    | `base` | 2 | insertion and roll | ranges' upper ends |
    | `force` | 3 | largest force in the last step: wall, lung, diaphragm | limit |

    ## Tissue

    Lung and diaphragm press back with 50 N/m under each link, the wall with 500 N/m (assumed), without
    friction. Lung and diaphragm bear 59 mN each: 20 cm of water, a pressure that a lung bears, on the face of
    the robot (assumed). The wall bears 10 N, the sum of the normal forces in the channel (assumed).

    ## Reward

    Minus the tip's distance from the aspiration point in robot lengths, minus 0.1 times the largest share of
    a limit in this step. Passing a limit, and a diverging simulation, costs 200.

    ## Episode

    It starts at rest, all drives slack. It terminates with success when the tip comes within `tolerance_m` of
    the aspiration point (10 mm, assumed: about the tube's own diameter of 9.3 mm). It ends without success
    where a limit is passed or the simulation diverges. It is truncated after 200 steps (20 s).

    ## Reset

    `reset(seed=...)` draws an anatomy with its aspiration point; `options={"anatomy": Chest(...)}` sets one.
    `info`: as in `TumourEnv`, without `points_reached`.

    ## Arguments

    Those of `ReachEnv`; gravity is in the entry frame.
    """

    anatomy_kind = Chest
    motions = (
        BaseMotion(INSERTION, 0.0, INSERT_STROKE_M, 30e-3),
        BaseMotion(ROLL, -math.pi / 3.0, math.pi / 3.0, math.pi / 6.0),
    )
    limits_N: ClassVar[Mapping[str, float]] = {
        "wall": WALL_LIMIT_N,
        "lung": ORGAN_LIMIT_N,
        "diaphragm": ORGAN_LIMIT_N,
    }

    def surround(self, anatomy: Chest, robot: RobotSpec, actuation: str) -> Surroundings:
        root, length = on_a_slide(robot, actuation, -anatomy.wall_m)
        world = root.part("worldbody")
        begins = -anatomy.wall_m - length - 0.02
        guide = anatomies.channel_boxes(GUIDE_M, -anatomy.wall_m, begins, GUIDE_M + _GUIDE_WALL_M)
        for region, boxes, found in (
            ("wall", anatomies.wall_boxes(anatomy), FOUND_M),
            ("guide", guide, _GUIDE_FOUND_M),
        ):
            for number, (half, middle) in enumerate(boxes):
                shape = {"type": "box", "size": text(half), "pos": text(middle), "margin": found}
                touched(world, name=f"tissue_{region}_{number}", **shape)
        organs = {
            "lung": (anatomy.lung_radius_m, anatomies.lung(anatomy)),
            "diaphragm": (anatomy.diaphragm_radius_m, anatomies.diaphragm(anatomy)),
        }
        for name, (radius, middle) in organs.items():
            shape = {"type": "sphere", "size": radius, "pos": text(middle), "margin": FOUND_M}
            touched(world, name=f"tissue_{name}_0", **shape)
        for name, mesh in anatomies.meshes(anatomy).items():
            add_mesh(root, name, mesh, _RGBA[name])
        stiffness = {
            "wall": WALL_N_PER_M,
            "lung": ORGAN_N_PER_M,
            "diaphragm": ORGAN_N_PER_M,
            "guide": GUIDE_N_PER_M,
        }
        return Surroundings(root.text(ALL_DIGITS), stiffness, (INSERTION, ROLL))

    def begin(self) -> None:
        self.target_m = anatomies.aspiration_point(self.anatomy)

    def judge(self) -> tuple[float, bool]:
        return -self._distance_m / self.length_m, self._distance_m <= self.tolerance_m

    def task_bounds(self) -> Bounds:
        return {
            "wall": (np.zeros(1), 1.0),
            "lung": (np.full(3, -2.0), 2.0),
            "lung_radius": (np.zeros(1), 1.0),
        }

    def task_parts(self) -> Mapping[str, Array]:
        return {
            "wall": np.array([self.anatomy.wall_m / self.length_m]),
            "lung": anatomies.lung(self.anatomy) / self.length_m,
            "lung_radius": np.array([self.anatomy.lung_radius_m / self.length_m]),
        }

    def seen_points(self) -> Array:
        return np.array([[-0.08, -0.06, -0.1], [0.16, 0.06, 0.12]])


# ----------------------------------------------------------------------------------------------------
# The task of bringing the tip of a neuroendoscope to points of a tumour of the posterior third ventricle.

POINTS = 3  # of the tumour that the tip is brought to; assumed
TUMOUR_STROKE_M = 75e-3  # of the insertion; the longest way is 57 mm
# 20 mmHg on the tip's face. Brain retractors caused no damage in 15 min up to this pressure: Rosenoern and
# Diemer 1985, doi 10.3171/jns.1985.63.4.0608, in rats. That a region bears no more in all is assumed.
RETRACTION_PA = 20.0 * 133.322
FACE_RADIUS_M = 1.7e-3  # Kato 2016: outer diameter 3.4 mm
LIMIT_N = RETRACTION_PA * math.pi * FACE_RADIUS_M**2  # 24 mN
# assumed: a flat punch of the robot's radius on a half-space of E = 5.5 kPa, of the order of brain's modulus
TISSUE_N_PER_M = 25.0
SHEATH_N_PER_M = 200.0  # assumed: stiff against the robot
REGIONS = ("lateral", "foramen", "third", "tumour")
_WALL_RGBA, _TUMOUR_RGBA, _SHEATH_RGBA = "0.86 0.55 0.55 0.22", "0.62 0.30 0.42 0.75", "0.55 0.60 0.66 0.35"
_SHEATH_WALL_M = 1e-3
_SHEATH_FOUND_M = 0.25e-3  # less than the room in it: a straight robot touches nothing


class TumourEnv(ClinicalEnv[Ventricles]):
    """Bring the tip of a neuroendoscope to three points of a tumour of the posterior third ventricle.

    ## The robot and the way

    `NeuroendoscopeTumour-v0` is the robot of Kato 2016, 120 mm of two sections, in its MuJoCo simulation with
    tendon friction and its effects; 0.1 s a step. It lies in a straight sheath that was put through a
    precoronal burr hole and the frontal lobe into the lateral ventricle (the approach of Kato 2016,
    Introduction). Its tip is at the sheath's end, and it is pushed out of it. The way to the tumour is an
    arc of 47 to 57 mm that turns by 40 to 60 deg: through the lateral ventricle, the foramen of Monro and
    the third ventricle. `anatomy.anatomies` has all its numbers, their ranges and sources.

    ## Action

    `Box(-1, 1, (6,), float32)`: changes of the four tension drives, in shares of 0.05 of their ranges.
    (These are distal 0.61 N, proximal 0.74 N: 3 rad of a section without friction. Kato 2016 articulates
    with up to 0.65 N.) Or with `action_type="displacement"` (`(4,)`) of the two bends asked for. Then the
    insertion, 2 mm a step at full action, from 0 to 75 mm, and the roll of the robot at the burr hole, 3
    deg a step, +-60 deg.

    ## Observation

    A flat `Box` of float32; `layout` maps names to slices. First `target`, the next point, then what
    `ReachEnv` shows of the robot (`tip` to `bend`), in the entry frame: origin at the sheath's end, z
    along it inward, x the bending direction before the roll. Then

    | part | size | what | unit |
    |---|---|---|---|
    | `foramen` | 3 | its middle | L = 120 mm |
    | `foramen_axis` | 3 | unit vector along the way there | 1 |
    | `points_left` | 1 | share of the points that were not reached yet | 1 |
    | `base` | 2 | insertion and roll | ranges' upper ends |
    | `force` | 4 | largest in the last step: lateral ventricle, foramen, third ventricle, tumour | limit |

    ## Tissue

    Walls and tumour press back with 25 N/m under each cell (assumed: a flat punch of the robot's radius on a
    half-space of 5.5 kPa), without friction. Each of the four regions bears 24.2 mN, the sum of the normal
    forces on it. That is 20 mmHg on the tip's face, the pressure under a retractor up to which no damage
    was found (Rosenoern and Diemer 1985, doi 10.3171/jns.1985.63.4.0608). The sheath is no tissue.

    ## Reward

    Minus the way left in robot lengths, from the tip to the next point and on through the others, minus 0.1
    times the largest share of a limit in this step. Passing a limit, and a diverging simulation, costs 200.

    ## Episode

    It starts at rest, all drives slack. Three points on the tumour's open surface are to be reached one
    after the other, each to within `tolerance_m`: 5 mm, the target value of Kato 2016 for a tumour of 2 cm.
    It terminates with success when the last one is, and without it where a region's limit is passed or the
    simulation diverges. It is truncated after 200 steps (20 s).

    ## Reset

    `reset(seed=...)` draws an anatomy and the points; `options={"anatomy": Ventricles(...)}` sets one.
    `info` of `reset` and `step`: as in `ReachEnv`, in the entry frame, and `force_N` and `peak_force_N`
    (by region: largest in the last step, and in the episode), `insertion_mm`, `roll_deg`, `points_reached`,
    `pressed_too_hard`.

    ## Arguments

    Those of `ReachEnv`; gravity is in the entry frame.
    """

    anatomy_kind = Ventricles
    motions = (
        BaseMotion(INSERTION, 0.0, TUMOUR_STROKE_M, 20e-3),
        BaseMotion(ROLL, -math.pi / 3.0, math.pi / 3.0, math.pi / 6.0),
    )
    limits_N: ClassVar[Mapping[str, float]] = dict.fromkeys(REGIONS, LIMIT_N)
    points_m: Array

    def surround(self, anatomy: Ventricles, robot: RobotSpec, actuation: str) -> Surroundings:
        root, length = on_a_slide(robot, actuation, 0.0)
        world = root.part("worldbody")
        around = anatomies.ventricle_wall(anatomy)
        per_ring = len(around.cells) // (len(anatomies.ring_places(anatomy)) - 1)
        blocks = zip(anatomies.blocks(around), anatomies.facings(around), strict=True)
        for number, (corners, facing) in enumerate(blocks):
            ring = number // per_ring
            name = "lateral" if anatomies.ring_places(anatomy)[ring] < anatomy.lateral_length_m else "third"
            name = "foramen" if anatomies.is_foramen(anatomy, ring) else name
            touched_block(root, f"tissue_{name}_{number}", corners, facing, margin=FOUND_M)
        touched(
            world,
            name="tissue_tumour_0",
            margin=FOUND_M,
            type="sphere",
            size=anatomies.TUMOUR_RADIUS_M,
            pos=text(anatomies.tumour(anatomy)),
        )
        _add_sheath(world, length)
        add_mesh(root, "ventricles", anatomies.shell(around), _WALL_RGBA)
        add_mesh(root, "tumour", anatomies.tumour_mesh(anatomy), _TUMOUR_RGBA)
        add_mesh(root, "sheath", _sheath_mesh(length), _SHEATH_RGBA)
        stiffness = {**dict.fromkeys(REGIONS, TISSUE_N_PER_M), "sheath": SHEATH_N_PER_M}
        return Surroundings(root.text(ALL_DIGITS), stiffness, (INSERTION, ROLL))

    def begin(self) -> None:
        self.points_m = anatomies.tumour_points(self.anatomy, self.np_random, POINTS)
        self._next = 0
        self.target_m = self.points_m[0]

    def judge(self) -> tuple[float, bool]:
        if self._distance_m <= self.tolerance_m:
            self._next += 1
            if self._next < POINTS:
                self.target_m = self.points_m[self._next]
        if self._next == POINTS:
            return 0.0, True
        left = self.points_m[self._next :]
        between = np.linalg.norm(np.diff(left, axis=0), axis=1).sum()
        return -(self._distance_m + float(between)) / self.length_m, False

    def task_bounds(self) -> Bounds:
        return {
            "foramen": (np.full(3, -2.0), 2.0),
            "foramen_axis": (np.full(3, -1.0), 1.0),
            "points_left": (np.zeros(1), 1.0),
        }

    def task_parts(self) -> Mapping[str, Array]:
        at = anatomies.foramen(self.anatomy)
        return {
            "foramen": at.p_w[0] / self.length_m,
            "foramen_axis": at.R_w[0, :, 2],
            "points_left": np.array([(POINTS - self._next) / POINTS]),
        }

    def seen_points(self) -> Array:
        around = anatomies.ventricle_wall(self.anatomy)
        return np.concatenate([around.outer, [(0.0, 0.0, -0.02)]])

    def _info(self) -> dict[str, Any]:
        return {**super()._info(), "points_reached": self._next}


def _add_sheath(world: Element, length: float) -> None:
    """Add the sheath's four sides."""
    half, wide = 0.5 * length + 0.01, 4.0 * anatomies.SHEATH_M
    for number, (axis, side) in enumerate(((0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0))):
        size, pos = np.array([wide, wide, half]), np.array([0.0, 0.0, -half])
        size[axis], pos[axis] = _SHEATH_WALL_M, side * (anatomies.SHEATH_M + _SHEATH_WALL_M)
        touched(
            world,
            name=f"tissue_sheath_{number}",
            type="box",
            size=text(size),
            pos=text(pos),
            margin=_SHEATH_FOUND_M,
        )


def _sheath_mesh(length: float) -> trimesh.Trimesh:
    outer = anatomies.SHEATH_M + 0.5 * _SHEATH_WALL_M
    tube = trimesh.creation.annulus(anatomies.SHEATH_M, outer, length, sections=24)
    tube.apply_translation((0.0, 0.0, -0.5 * length))
    return tube
