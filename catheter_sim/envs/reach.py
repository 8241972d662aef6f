"""The task of bringing the tip of a robot to a point and resting there."""

from __future__ import annotations

import os
from collections.abc import Mapping
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.robot import RobotSpec
from catheter_sim.core.settings import Settings
from catheter_sim.envs.arguments import checked_options, checked_whole
from catheter_sim.envs.observation import Bounds, Observation
from catheter_sim.envs.targets import random_target, require_reachable
from catheter_sim.envs.tip import DIVERGED_REWARD, TARGET_CLEARANCE, Action, TipEnv
from catheter_sim.pictures.images import Picture

HOLD_STEPS = 5  # assumed: half a second
REST_S = 1.0  # assumed: at rest is a tip that would take longer than this for one tolerance


class ReachEnv(TipEnv):
    """Bring the tip of a tendon- or rod-driven robot to a target, and rest there.

    ## The robot

    Any robot of the package, in its MuJoCo simulation with tendon friction (so that the way matters:
    the same inputs give other postures on the way out and on the way back; the two nominal mitral
    catheters have none), with its effects. A control step is 0.1 s of simulated time. With
    `dynamics="quasi-static"`, the default, the robot follows its inputs with a lag (the relaxation time of
    its dynamics, 0.05 s by default) and without overshoot: its mass has weight, but no inertia. With
    `dynamics="inertial"` it moves as its masses and its own damping let it, from rest at every reset; the
    published robots' damping is assumed (`settings` may set `dynamics.damping_time_s`). There is no contact:
    not with surroundings, not with itself (but for the rolling joints').

    ## Action

    `Box(-1, 1, (d,), float32)`: for each drive how far its level moves in this step, in shares of the
    largest change, 0.05 (the rate is limited to 0.5 a second). Levels stay in their ranges; within
    the step the inputs move linearly.

    - `action_type="tension"`: a drive is an input channel of the robot, each antagonist its own. Level
      0 is slack, level 1 the tension at which it alone would bend a segment by `largest_bend_rad` if
      there were no friction; for rolling joints 100 N at most (chest_tube_2025, Table I).
    - `action_type="displacement"` (not for robots of rolling joints, whose rods know tension only): a
      drive is the bend asked of one segment in one direction, level -1 to 1 for minus to plus
      `largest_bend_rad`. Each tendon is pulled in or paid out by what these bends shorten or lengthen
      its path (constant curvature), antagonists together. Of a catheter (displacement only) a drive is
      a channel, the displacement of a pair on its pulley: level -1 to 1 is where inextensible taut
      tendons bring the joint to its limits, and its angle is not linear in it. A tube's level 0 to 1 is
      an advance by its stroke, 60 mm in 2 s. Where an effect sends a pair beyond the end of its joint,
      gaps closed or tendon unwound, the drive stops there.

    `drives.names` names the drives, `drives.tendon` holds the tendons' inputs at level 1.
    `NeuroendoscopeReach-v0` has four tension drives: distal right and left up to 0.32 N, proximal
    right and left up to 0.39 N (a side's two tendons together). `ChestTubeReach-v0` has eight, its
    rods: base and middle right up to 24.0 N and left up to 26.6 N, tip right and left up to 19.5 N,
    tip front and back up to 44.3 N. Rods bend what they pass too: the middle's ranges end where the
    base is bent so far. `ChestTubeSectionReach-v0` has one, up to 50.2 N (`largest_bend_rad` is 3).
    `MitralTransseptalReach-v0` has four displacements: bending 3.82 mm (120 deg), proximal torsion 3.12 mm
    and distal torsion 3.29 mm (75 deg), advance 60 mm. `Mitral4dofReach-v0` too: proximal bending 3.38 mm
    (90 deg), distal bending 4.49 mm (120 deg), torsion 2.75 mm (75 deg), advance 60 mm. Their last
    torsion turns the tool about its axis and does not move the tip: three drives matter here.

    ## Observation

    A flat `Box` of float32, all parts finite and of order one; `layout` maps names to slices, L is
    the length of the straight robot (of a catheter with its tube all out: 117.34 mm and 108.18 mm), s
    and t its numbers of segments and tendons (of a catheter pairs and tube), b that of its bends: 2 s, of
    a catheter one for each joint.

    | part | size | what | unit |
    |---|---|---|---|
    | `target` | 3 | the target, base frame | L |
    | `tip` | 3 | the tip, base frame | L |
    | `tip_direction` | 3 | unit vector along the tip's axis | 1 |
    | `tip_velocity` | 3 | mean velocity of the tip over the last step | L/s |
    | `level` | d | levels of the drives | range |
    | `tension` | t | tensions at the actuators | ranges of the tension drives |
    | `bend` | b | bend of each segment toward +x and +y, its joints' sums | half turns |
    | | | of a catheter: torsion, bend and advance of its joints, base to tip | half turns; strokes |
    | `held` | 1 | share of `hold_steps` for which the tip has been at rest at the target | 1 |

    The tension of a catheter's pair is the tauter tendon's, in shares of what holds its bending joint
    at the limit (torsion joints and tube: of the largest of these; a tube has none).
    Tip, direction and velocity are as measured, effects on the outputs included. What lies beyond the bounds
    of the space is cut off (only displacement drives reach them, by tension). Friction has a memory
    that is not in the observation: the tensions between the tendons' holes.

    ## Reward

    Minus the distance of the tip from the target, in robot lengths, after each step. Nothing is added
    at success: the episode, and with it the cost, ends. A simulation that diverges costs 200, as much
    as 100 steps at the largest distance there is.

    ## Episode

    It starts at rest with slack tendons, under gravity if there is any. It terminates with success
    where the tip has been at rest at the target after each of `hold_steps` steps in a row: within
    `tolerance_m` of it, and in this step slower than one tolerance a second. It also terminates where
    the simulation diverges (`info["diverged"]`), with the last finite observation. The registered
    environments are truncated after 100 steps (10 s).

    The default tolerance is the target value of Kato 2016 (doi 10.1007/s11548-015-1310-2): a mean
    error of 5 mm leaves good margins in aiming at a tumour of 2 cm. `ChestTubeReach-v0` keeps it (1.3 %
    of the robot's length). The single sections and the mitral catheters ask for 2 mm, the notched wrist, 6 mm
    long, for 0.2 mm (assumed).

    The tip has to stay, for half a second (5 steps, assumed), because chance passes through targets: the tip
    of a section moves on a curve, and friction holds it still where random actions turn about. After random
    actions it is at rest at the target in some step of 11 of 100 episodes of `NeuroendoscopeReach-v0`, and of
    12 and 2 of `NeuroendoscopeSectionReach-v0` and `ChestTubeSectionReach-v0`; for 5 steps in 1, 0 and 0.

    ## Reset

    `reset(seed=...)` draws a target by driving the simulated robot from rest with random inputs to
    where it settles: every target is reachable. It lies at least a tenth of the robot's length from
    the tip at rest. `options={"target": (x, y, z)}` sets it instead, in m in the base frame; one that
    the simulated robot cannot be brought to within the tolerance is refused. The search drives it
    from rest and takes about a second.

    `info` of `reset` and `step`, in the units of files, which stand at the end of the names: `tip_mm`,
    `target_mm` (true ones, base frame), `distance_mm`, `speed_mm_per_s`, `commanded_tension_N` or
    `commanded_displacement_mm` (of each tendon), `is_success`, `diverged`; and `drawn`, of what is
    `randomised`: each key and the value of this episode, in the key's unit.

    ## Arguments

    - `robot`: a robot id, the path of a robot `.toml`, or a robot (`cs.load_robot`).
    - `settings`: a text `KEY=VALUE` as for `--set`, a list of such texts, or a mapping of keys to values
      (`{"friction.mu": 0}`); effects included (`"effects.backlash.width_N=0.02"`).
    - `action_type`: "tension" or "displacement"; default: the robot's own.
    - `gravity_mps2`: in the base frame, default none.
    - `tolerance_m`, `hold_steps`: see Episode.
    - `dynamics`: "quasi-static" or "inertial", see The robot.
    - `largest_bend_rad`: sets the drives' ranges, but not of catheters, which have their joints' limits
      and refuse it; default a quarter turn (assumed), but 3 rad in `ChestTubeSectionReach-v0`, so that its
      rod goes through the tensions of the prototype's published measurement, up to 47.9 N. With friction
      it bends by 2.5 rad there.
    - `render_mode`: None or "rgb_array".
    - `randomised`: settings that are drawn evenly within bounds, and the robot built anew, at every reset:
      `{"friction.mu": (0.1, 0.5), "effects.actuation_gain.scale": (0.9, 1.1)}`. They may change the drives'
      ranges with them, where these depend on what is drawn (a stiffness, a radius).
    - `observation`: "state", as above, or "pixels": a picture, `Box(0, 255, (height, width, 3), uint8)`, of
      what the simulation is, not of what is measured. `info` is the same.
    - `width`, `height`: of the picture [pixels]; default 640 and 480, as observation 64 and 64. The target is
      a green sphere of the tolerance's radius.
    """

    reset_options: ClassVar[tuple[str, ...]] = ("target",)

    def __init__(
        self,
        robot: RobotSpec | str | os.PathLike[str],
        settings: Settings = (),
        action_type: str | None = None,
        *,
        hold_steps: int = HOLD_STEPS,
        **arguments: Any,
    ) -> None:
        """Build the robot; see the class's text.

        Raises:
            InputError: an argument is impossible.
        """
        self.hold_steps, self._held = checked_whole("hold_steps", hold_steps), 0
        super().__init__(robot, settings, action_type, **arguments)

    def reset(
        self, *, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[Observation | Picture, dict[str, Any]]:
        """Start an episode; see the class's text.

        Args:
            seed: of the random targets from now on; None: go on with the present generator.
            options: `{"target": (x, y, z)}` [m], or nothing for a random target.

        Raises:
            InputError: an unknown option, or a target that is out of reach.
        """
        super().reset(seed=seed, options=options)
        if self.randomised:
            self._checked_targets.clear()
        given = self.target_of(options or {})
        if given is None:
            clearance = TARGET_CLEARANCE * self.length_m
            given = random_target(self.plant, self.np_random, clearance).tip_m
        self.target_m = given
        self._held = 0
        self._start()
        return self._observation(), self._info()

    def step(self, action: Action) -> tuple[Observation | Picture, float, bool, bool, dict[str, Any]]:
        """Move the drives for one control step; see the class's text."""
        if not self._moved(action):
            self._held = 0
            return self._observation(), DIVERGED_REWARD, True, False, self._info()
        speed = np.linalg.norm(self._now.velocity)
        self._held = self._held + 1 if arrived(self._distance_m, speed, self.tolerance_m) else 0
        info = self._info()
        return self._observation(), -self._distance_m / self.length_m, info["is_success"], False, info

    def target_of(self, options: Mapping[str, Any]) -> Array | None:
        """Return the target that options of `reset` set, shape (3,) [m], or None.

        Raises:
            InputError: an unknown option, or a target that is out of reach.
        """
        target = checked_options(options, self.reset_options).get("target")
        return None if target is None else self._reachable(target)

    @cached_property
    def _checked_targets(self) -> set[tuple[float, ...]]:
        """Targets that were found in reach."""
        return set()

    def _reachable(self, target_m: Any) -> Array:
        """Return `target_m`; one that was found in reach before is not sought again."""
        try:
            known = tuple(float(value) for value in target_m)
        except (TypeError, ValueError):
            known = ()
        if known in self._checked_targets:
            return np.array(known)
        target = require_reachable(self.plant, target_m, self.tolerance_m)
        self._checked_targets.add(tuple(target))
        return target

    def _observation(self) -> Observation | Picture:
        return self._observed({"target": self.target_m / self.length_m})

    def _info(self) -> dict[str, Any]:
        return self._handed_out({**self._common_info(), "is_success": self._held >= self.hold_steps})

    def _more_bounds(self) -> Bounds:
        return {"held": (np.zeros(1), 1.0)}

    def _more_parts(self) -> Mapping[str, Array]:
        return {"held": np.array([self._held / self.hold_steps])}


def arrived(distance_m: Any, speed_m_per_s: Any, tolerance_m: float) -> Any:
    """Return whether a tip is at rest at its target, or many tips, shapes (...)."""
    return (distance_m <= tolerance_m) & (speed_m_per_s < tolerance_m / REST_S)
