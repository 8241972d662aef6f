"""One desired motion followed in several ways: a feedforward each, with or without PID.

The controller takes the robot for what it believes it to be, the nominal one say; the robot that is
simulated may stretch, rub and have slack. That difference is what feedback is there for.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import cast

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.controllers import motors as motor
from catheter_sim.controllers.loop import MODELS, ControlRun, Tracker, along, feedforward, joint_kinds_of, run
from catheter_sim.controllers.motors import FEEDBACK_HZ as RATE_HZ
from catheter_sim.controllers.motors import Gains, Pid
from catheter_sim.core.robot import RobotSpec
from catheter_sim.errors import InputError, unknown
from catheter_sim.robots import kind_of
from catheter_sim.robots.catheter.spec import CatheterRobot
from catheter_sim.simulation.simulator import Simulator

MOTORS = ("none", "pd", "observer")


@dataclass(frozen=True)
class Way:
    """How a motion is followed."""

    model: str  # feedforward, of `loop.MODELS`
    feedback: bool  # whether PID on the tracker's angles is added, in joints that are asked to move

    @property
    def name(self) -> str:
        """As papers write it: "TE+PID"."""
        return f"{self.model.upper()}{'+PID' if self.feedback else ''}"


@dataclass(frozen=True)
class Setting:
    """What all ways of following share."""

    gains: Gains  # of the PID controllers
    noise_deg: float = 0.0  # standard deviation of every measured angle, white [deg]
    frame_error_deg: float = 0.0  # what every angle is measured too large [deg]
    seed: int = 0  # of the noise, the same for every way
    rate_hz: float = RATE_HZ  # ticks a second
    # Of `MOTORS`: pairs follow at once; by a motor's PD; by PD with a disturbance observer.
    motors: str = "none"
    motor_gain: float = 1.0  # the motors' gain over the nominal one that their controller takes them to have
    # Dead-bands that the feedforward compensates, by pair.
    dead_band_m: Mapping[str, float] = field(default_factory=dict)


def way_of(text: str) -> Way:
    """Return the way that a text names, as "pk" or "TE+PID".

    Raises:
        InputError: it names none.
    """
    model, _, feedback = text.strip().lower().partition("+")
    if model not in MODELS or feedback not in ("", "pid"):
        choices = [name for item in MODELS for name in (item, f"{item}+pid")]
        raise unknown("way of control", text.strip(), choices)
    return Way(model, bool(feedback))


def follow(
    robot: RobotSpec,
    believed: RobotSpec,
    desired: Array,
    ways: Sequence[Way],
    setting: Setting,
    progress: bool = False,
) -> dict[str, ControlRun]:
    """Return the controlled motions of a catheter, which the controller believes to be another, by way.

    Joint values are desired for every tick, shape (r, t) [rad or m].

    Raises:
        InputError: no such feedforward or motor for this robot, or a displacement beyond its range.
    """
    if setting.motors not in MOTORS:
        raise unknown("motors", setting.motors, MOTORS)
    simulator = Simulator(robot)
    kinds = joint_kinds_of(simulator)
    pairs = [pair.name for pair in robot.tendons]
    alike = kind_of(robot) is kind_of(believed)
    if not alike or pairs != [pair.name for pair in believed.tendons]:
        raise InputError(f"{robot.name}: cannot be taken for {believed.name}, which has other pairs")
    turned = [name for name, kind in zip(pairs, kinds, strict=True) if kind != "prismatic"]
    asked = [name for k, name in enumerate(pairs) if name in turned and np.any(desired[:, k])]
    own = motor.Motor(gain=setting.motor_gain * motor.NOMINAL.gain)
    servo = motor.servo(own, setting.motors == "observer")
    servos = {} if setting.motors == "none" else dict.fromkeys(turned, servo)
    found = {}
    for way in ways:
        model_m = along(feedforward(cast(CatheterRobot, believed), way.model, setting.dead_band_m), desired)
        tracker = Tracker(
            np.radians(setting.noise_deg),
            np.random.default_rng(setting.seed),
            np.radians(setting.frame_error_deg),
        )
        controllers = {name: Pid(setting.gains, setting.rate_hz) for name in asked if way.feedback}
        found[way.name] = run(
            simulator,
            desired,
            model_m,
            setting.rate_hz,
            controllers,
            tracker,
            servos,
            progress=f"control, {way.name}" if progress else "",
        )
    return found
