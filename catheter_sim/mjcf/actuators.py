"""Actuators that a model has alike for every kind of robot."""

from __future__ import annotations

from catheter_sim.core.robot import RobotSpec
from catheter_sim.mjcf.backend import mjcf
from catheter_sim.mjcf.names import tendon

MAX_TENSION_N = 100.0  # control range of a tension actuator


def add_tension_actuators(root: mjcf.RootElement, robot: RobotSpec) -> None:
    """Add an actuator for each tendon whose control is its tension [N]; the tendons must be there."""
    for item in robot.tendons:
        name = tendon(item.name)
        root.actuator.add("motor", name=name, tendon=name, gear=(-1,), ctrlrange=(0, MAX_TENSION_N))
