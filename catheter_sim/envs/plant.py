"""A simulated robot with all its effects, moved by its drives."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import mujoco
import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.posture import Posture
from catheter_sim.core.robot import RobotSpec
from catheter_sim.effects.apply import check_effects, embodied, remembers_what_was_seen, reshaping
from catheter_sim.effects.steps import Commands, Sight
from catheter_sim.envs.quick_model import input_range, quick_model
from catheter_sim.envs.surroundings import Surround
from catheter_sim.errors import InputError
from catheter_sim.mjcf.names import TIP
from catheter_sim.robots import check_robot
from catheter_sim.simulation.simulator import Simulator

START_S = 1.0  # simulated time in which a load that acts at rest (an offset, a payload) comes on


class Plant:
    """A simulated robot, its effects included.

    Effects on the inputs go from command to command, one for each `move`, and those on what is seen from look
    to look. What they send beyond the end of a catheter's joint, where
    its gaps have closed or its tendon is unwound, stops there: the drive stands against it.

    Attributes:
        specified: the robot with its effects named.
        simulator: the robot with its effects built in.
        quick: the robot without its effects, friction and load.
        drives: what moves it.
        segment_length: shape (s,) [m].
        rest_bends: bends of the unloaded robot, as `quick` has them, shape (*b).
        level: of the drives now, shape (d,).
        sees_the_past: what is seen depends on what was.
        inertial: it moves as its masses and its own damping let it.
        carriage: where the base is held, from where it stands in the model: the joints of `Surroundings`,
            shape (c,) [m, rad].
        hinges: of every joint that bends its number, its place among the bends, and how many share that.
        planned: the last target for which a controller asked, and the bends that it found; None: none yet.
    """

    def __init__(
        self,
        robot: RobotSpec,
        actuation: str | None,
        gravity_mps2: Sequence[float],
        largest_bend_rad: float | None = None,
        surround: Surround | None = None,
        inertial: bool = False,
    ) -> None:
        """Build the model.

        Args:
            robot: the robot, with or without effects.
            actuation: "tension" or "displacement"; default: the robot's own. Effects on the inputs
                are in its unit.
            gravity_mps2: in the base frame, shape (3,) [m/s^2].
            largest_bend_rad: see `quick_model.quick_model`.
            surround: puts the robot into surroundings; default: it stands alone, its base at rest.
            inertial: it moves as its masses and its own damping let it; otherwise it follows its inputs
                without overshoot, its masses have weight alone.

        Raises:
            InputError: the robot knows no such actuation, an effect is unknown or acts on the shape,
                there is nothing to drive, or it is inertial and in surroundings.
        """
        if inertial and surround is not None:
            raise InputError("dynamics = 'inertial': not in surroundings; choices there: quasi-static")
        self.inertial = inertial
        actuation = actuation or robot.actuation
        self.quick = quick_model(robot, actuation, largest_bend_rad)
        self.drives = self.quick.drives
        self.specified = replace(robot, actuation=actuation)
        check_effects(self.specified)
        outside = reshaping(self.specified)
        if outside:
            raise InputError(
                f"{robot.name}: {', '.join(f'effects.{name}' for name in outside)}: acts on the shape of the "
                "whole robot, which `simulate` shows and an environment does not; leave it out"
            )
        built_in = embodied(self.specified)
        check_robot(built_in, robot.name)
        # By default without inertia, as in all checks against theory: dry friction remembers every overshoot,
        # and how far a robot of assumed mass and damping overshoots is not known.
        around = surround(built_in, actuation) if surround else None
        self.simulator = Simulator(
            built_in,
            actuation,
            gravity_mps2,
            inertia=False,
            model_text=around.text if around else None,
            tissue_N_per_m=around.tissue_N_per_m if around else None,
        )
        self._stream_N = around.stream_N if around else None
        names = around.carriage if around else ()
        self._carriage = np.array([self.simulator.model.actuator(name).id for name in names], dtype=int)
        self._range = input_range(built_in)
        self._arriving = Commands(self.specified)
        self.sees_the_past = remembers_what_was_seen(self.specified)
        self.segment_length = self.quick.segment_length
        self._bend_of = np.zeros((*self.quick.bend_unit.shape, self.simulator.model.nq))
        places: dict[int, tuple[int, ...]] = {}
        for index in range(self.simulator.model.njnt):
            joint = self.simulator.model.joint(index)
            place = self.quick.bend_of(joint.name)
            if place is not None:
                places[index] = place
                self._bend_of[(*place, int(joint.qposadr[0]))] = 1.0
        counts = Counter(places.values())
        self.hinges = tuple((index, place, counts[place]) for index, place in places.items())
        self.planned: tuple[tuple[float, ...], Array] | None = None
        self.rest_bends = self._bend_of @ self.simulator.model.qpos_spring
        self.reset()

    def reset(self) -> None:
        """Return to rest: drives at zero, weight and constant loads acting, no history.

        Raises:
            SimulationDiverged: it does not stand.
        """
        self.simulator.reset()
        self.level = np.zeros(len(self.drives.names))
        self.carriage = np.zeros(len(self._carriage))
        self._time_s = 0.0
        self._arriving.reset()
        self._sights: dict[str, tuple[Sight, float]] = {}
        self._wrench = np.zeros(len(self.specified.tendons) + 6)
        loaded = self._arrived(0.0)
        if loaded.any():
            self._ramp(loaded, START_S)
        self.settle()

    def move(self, level: Array, duration_s: float, carriage: Array | None = None) -> None:
        """Move the drives linearly to `level`, shape (d,), in `duration_s` of simulated time.

        With them the base goes to `carriage`, shape (c,) [m, rad]; by default it stays.

        Raises:
            SimulationDiverged: the state is no longer finite.
        """
        self.level = np.array(level)
        self._time_s += duration_s
        self._ramp(self._arrived(duration_s), duration_s, carriage)

    def settle(self) -> None:
        """Wait under the present inputs until the robot is at rest, 5 simulated seconds at most.

        Aids for coming to rest act meanwhile, also where it is inertial.
        """
        if self.inertial:
            self.simulator.hold()
        self.simulator.settle()
        if self.inertial:
            self.simulator.let_go()

    def posture(self) -> Posture:
        """Return where the robot is."""
        # A step leaves the tendons' lengths, and so a driven tendon's tension, as before its motion.
        mujoco.mj_fwdPosition(self.simulator.model, self.simulator.data)
        return self.simulator.posture()

    def seen(self, p_w: Array, R_w: Array, what: str = "tip") -> tuple[Array, Array]:
        """Return what is measured now of positions (..., 3) [m] and orientations (..., 3, 3) of something."""
        sight, last_s = self._sights.get(what, (None, self._time_s))
        sight = sight or Sight(self.specified)
        self._sights[what] = sight, self._time_s
        return sight.look(p_w, R_w, self._time_s - last_s)

    def segment_bends(self) -> Array:
        """Return the robot's bends, sums of its joints, shape (*b)."""
        return self._bend_of @ self.simulator.data.qpos

    def bends_at(self, qpos: Array) -> Array:
        """Return the bends at many positions (m, nq), shape (m, *b)."""
        return np.moveaxis(np.tensordot(self._bend_of, qpos, axes=(-1, -1)), -1, 0)

    def inputs_at(self, level: Array) -> Array | None:
        """Return the tendons' inputs, shape (m, t), that levels (m, d) become whatever came before them.

        None where an effect changes inputs: it may remember earlier ones, or loads the tip.
        """
        if self._arriving.change:
            return None
        return np.clip(np.matmul(self.drives.tendon, level[..., np.newaxis])[..., 0], *self._range)

    def _arrived(self, duration_s: float) -> Array:
        """Return the tendons' inputs and the tip's wrench that the present levels become, (t + 6,)."""
        tendon, force, moment = self._arriving.step(self.drives.tendon @ self.level, duration_s)
        return np.concatenate([np.clip(tendon, *self._range), force, moment])

    def _ramp(self, wrench: Array, duration_s: float, carriage: Array | None = None) -> None:
        simulator, tendons = self.simulator, len(self.specified.tendons)
        steps = max(1, round(duration_s / simulator.model.opt.timestep))
        before, base_before = self._wrench, self.carriage
        if carriage is not None:
            self.carriage = np.array(carriage)
        for step in range(1, steps + 1):
            now = before + (wrench - before) * (step / steps)
            base = base_before + (self.carriage - base_before) * (step / steps)
            simulator.data.ctrl[self._carriage] = base
            force = now[tendons : tendons + 3]
            if self._stream_N is not None:
                time_s = self._time_s - duration_s * (1.0 - step / steps)
                force = force + self._stream_N(time_s, simulator.data.site(TIP).xpos)
            simulator.put_inputs(now[:tendons], force, now[tendons + 3 :])
            simulator.step()
        self._wrench = wrench
        simulator.require_finite()
