"""The task of bringing the tip of a chest tube's robot to an aspiration point in the pleural space."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from catheter_sim.anatomy.chest import (
    RANGES,
    Chest,
    aspiration_point,
    channel_boxes,
    diaphragm,
    lung,
    median_chest,
    meshes,
    random_chest,
    wall_boxes,
)
from catheter_sim.arrays import Array
from catheter_sim.core.robot import RobotSpec
from catheter_sim.envs.clinical.base import ClinicalEnv, Motion
from catheter_sim.envs.observation import Bounds
from catheter_sim.envs.surroundings import Surroundings, let_touch, robot_tree
from catheter_sim.mjcf.document import ALL_DIGITS
from catheter_sim.modelling.surroundings import INSERTION, ROLL, add_mesh, carry, text, touched

GUIDE_M = 3.3e-3  # half the width of the guide outside the skin; assumed: 0.2 mm of room on each side
STROKE_M = RANGES["wall_m"][1] + 0.17  # of the insertion, from the skin
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
    skin, its tip at the skin, and is pushed through a dissected channel in the chest wall, 26.6 to 80.2 mm
    thick (chest_tube_2025, Section II.B), into the pleural space, where a large effusion has pushed the lung
    away by 65 to 80 mm. There it has to turn toward the apex: the aspiration point lies 90 to 125 mm from the
    channel's axis, 36 to 44 mm under the wall. `anatomy.chest` has all numbers, their ranges and sources.

    ## Action

    `Box(-1, 1, (10,), float32)`: changes of the eight tension drives, in shares of 0.05 of their ranges (the
    rods' ranges as in `ChestTubeReach-v0`, but for 3 rad: 89 and 100 N), then the insertion, 3 mm a step at
    full action, from 0 to 250 mm, and the roll at the skin, 3 deg a step, +-60 deg.

    ## Observation

    A flat `Box` of float32; `layout` maps names to slices. First `target`, the aspiration point, then what
    `reach.ReachEnv` shows of the robot (`tip` to `bend`), in the entry frame: origin where the channel opens
    into the pleural space, z along it inward, x toward the apex, the bending direction before the roll. Then

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
    the aspiration point (10 mm, assumed: about the tube's own diameter of 9.3 mm), and without it where a
    limit is passed or the simulation diverges. It is truncated after 200 steps (20 s).

    ## Reset

    `reset(seed=...)` draws an anatomy with its aspiration point; `options={"anatomy": Chest(...)}` sets one.
    `info`: as in `tumour.TumourEnv`, without `points_reached`.

    ## Arguments

    Those of `reach.ReachEnv`; gravity is in the entry frame.
    """

    motions = (
        Motion(INSERTION, 0.0, STROKE_M, 30e-3),
        Motion(ROLL, -math.pi / 3.0, math.pi / 3.0, math.pi / 6.0),
    )
    limits_N: ClassVar[Mapping[str, float]] = {
        "wall": WALL_LIMIT_N,
        "lung": ORGAN_LIMIT_N,
        "diaphragm": ORGAN_LIMIT_N,
    }

    def draw(self, rng: np.random.Generator) -> Chest:
        """Return a random anatomy."""
        return random_chest(rng)

    def middle(self) -> Chest:
        """Return the anatomy in the middle of all ranges."""
        return median_chest()

    def surround(self, anatomy: Chest, robot: RobotSpec, actuation: str) -> Surroundings:
        """Return the robot in its guide before the skin."""
        root = robot_tree(robot, actuation)
        length = sum(segment.length_m for segment in robot.segments)
        base = np.eye(4)
        base[2, 3] = -anatomy.wall_m - length
        carry(root, robot.dynamics, base, roll=True)
        world = root.part("worldbody")
        let_touch(robot, world)
        guide = channel_boxes(GUIDE_M, -anatomy.wall_m, base[2, 3] - 0.02, GUIDE_M + _GUIDE_WALL_M)
        for region, boxes, found in (
            ("wall", wall_boxes(anatomy), FOUND_M),
            ("guide", guide, _GUIDE_FOUND_M),
        ):
            for number, (half, middle) in enumerate(boxes):
                shape = {"type": "box", "size": text(half), "pos": text(middle), "margin": found}
                touched(world, name=f"tissue_{region}_{number}", **shape)
        organs = {
            "lung": (anatomy.lung_radius_m, lung(anatomy)),
            "diaphragm": (anatomy.diaphragm_radius_m, diaphragm(anatomy)),
        }
        for name, (radius, middle) in organs.items():
            shape = {"type": "sphere", "size": radius, "pos": text(middle), "margin": FOUND_M}
            touched(world, name=f"tissue_{name}_0", **shape)
        for name, mesh in meshes(anatomy).items():
            add_mesh(root, name, mesh, _RGBA[name])
        stiffness = {
            "wall": WALL_N_PER_M,
            "lung": ORGAN_N_PER_M,
            "diaphragm": ORGAN_N_PER_M,
            "guide": GUIDE_N_PER_M,
        }
        return Surroundings(root.text(ALL_DIGITS), stiffness, (INSERTION, ROLL))

    def begin(self) -> None:
        """Take the aspiration point from the anatomy."""
        self.target_m = aspiration_point(self.anatomy)

    def judge(self) -> tuple[float, bool]:
        """Return minus the tip's distance, and whether it is near enough."""
        return -self._distance_m / self.length_m, self._distance_m <= self.tolerance_m

    def task_bounds(self) -> Bounds:
        """Return the wall's thickness and the lung's place."""
        return {
            "wall": (np.zeros(1), 1.0),
            "lung": (np.full(3, -2.0), 2.0),
            "lung_radius": (np.zeros(1), 1.0),
        }

    def task_parts(self) -> Mapping[str, Array]:
        """Return the wall's thickness, and the lung's middle and radius."""
        return {
            "wall": np.array([self.anatomy.wall_m / self.length_m]),
            "lung": lung(self.anatomy) / self.length_m,
            "lung_radius": np.array([self.anatomy.lung_radius_m / self.length_m]),
        }

    def seen_points(self) -> Array:
        """Return corners of what matters."""
        return np.array([[-0.08, -0.06, -0.1], [0.16, 0.06, 0.12]])
