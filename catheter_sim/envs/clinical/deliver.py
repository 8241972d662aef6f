"""The task of bringing a clip under the leaflets of the mitral valve."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from catheter_sim.envs.clinical.base import ClinicalEnv, Motion
from catheter_sim.envs.clinical.heart import from_valve, implant_target, in_heart, turned, waiting_m
from catheter_sim.envs.observation import Bounds
from catheter_sim.envs.surroundings import Surroundings
from catheter_sim.envs.tip import CONTROL_STEP_S
from catheter_sim.errors import InputError
from catheter_sim.mjcf.catheter_implant import IMPLANT_M, holder_length_m
from catheter_sim.mjcf.scene import View
from catheter_sim.mjcf.surroundings import INSERTION
from catheter_sim.procedure.anatomy import median_anatomy, semi_axes_m
from catheter_sim.procedure.case import Case, median_case, random_case
from catheter_sim.procedure.flow import BEATS_PER_S, FLOW_N
from catheter_sim.procedure.frames import pose_error
from catheter_sim.procedure.operate import ANGLE_DEG, POSITION_MM
from catheter_sim.procedure.plan import DELIVERING, implant_turn_rad
from catheter_sim.procedure.scene import REGIONS
from catheter_sim.procedure.steps import PUSH_M_PER_S
from catheter_sim.render.framing import fitted_view
from catheter_sim.robots.catalogue import load_robot
from catheter_sim.robots.catheter import CatheterRobot
from catheter_sim.robots.kinds import Robot
from catheter_sim.robots.posture import Array

# Matsuda 2016, doi 10.1007/s00380-015-0763-0: of a catheter on the atrium's wall, 40 g are excessive.
LIMIT_N = 0.39
DEEPEST_M = 40e-3  # insertion of the base beyond the puncture, at most; as `plan` has it
ANGLE_WEIGHT = 0.1  # assumed: robot lengths that a half turn of the implant costs
HELD_STEPS = math.ceil(1.0 / (BEATS_PER_S * CONTROL_STEP_S))  # one whole beat: 9 steps
