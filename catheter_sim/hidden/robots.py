"""The robots of the hidden-effect bench: how each is driven, what is measured, who makes its data.

The data come from the MuJoCo simulation, of the spacer-disk robot from a Cosserat rod where that knows what
is hidden; the diagnosis fits an analytic twin (`diagnosis.twin`). They share no code that solves for
equilibrium. Where the twin bends in arcs, the simulated chain has other links than the robot's own
simulation, too, with which a diagnosis confirms what it found.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from catheter_sim.effects._scales import tension_N
from catheter_sim.errors import unknown
from catheter_sim.robots.catalogue import load_robot
from catheter_sim.robots.channels import body_count, channel_of
from catheter_sim.robots.kinds import Robot
from catheter_sim.robots.specification import ContinuumRobot, Friction, Segment, Tendon

_DISKS = 12  # a segment; with fewer, an arc from disk to disk and a finer chain differ by too much
FILE_REFERENCE = "robot.toml"  # of a robot that has no id: its file lies in the data set's folder


@dataclass(frozen=True)
class BenchRobot:
    """A robot as the bench uses it.

    Attributes:
        reference: how a data set names it.
        robot: as specified.
        drive: "pull" (tensions, one channel or two at a time), "joints" (a catheter's, to and fro) or
            "heading" (displacements that bend one segment in some direction).
        reach: largest input of each channel, in the channels' order, shape (c,) [N, or m].
        pretension_N: largest standing tension of all channels.
        axes: in which positions are measured.
        angles: further outputs, in degrees.
        links: hinges per subsegment of the simulation that makes the data; 0: the robot's own.
        rods: data by the rod model `VC_ref_noproj` wherever it knows the robot with what is hidden.
        rows: of a rich trial, about.
        together: whether channels of two sections are pulled at the same time. With friction the twin and
            the simulation then differ: a tendon slides where another one bends the section around it.
    """

    reference: str
    robot: Robot
    drive: str
    reach: tuple[float, ...]
    pretension_N: float = 0.0
    axes: str = "xyz"
    angles: tuple[str, ...] = ()
    links: int = 0
    rows: int = 60
    together: bool = True
    rods: bool = False

    @property
    def bodies(self) -> tuple[int, ...]:
        """Elements at a third, half and two thirds of the robot."""
        return tuple(max(1, round(body_count(self.robot) * share)) for share in (1 / 3, 1 / 2, 2 / 3))


def bench_robot(name: str, generator: np.random.Generator) -> BenchRobot:
    """Return a robot of the bench; one that stands in a file has drawn dimensions.

    Raises:
        InputError: no such robot.
    """
    if name not in BENCH_ROBOTS:
        raise unknown("robot of the bench", name, BENCH_ROBOTS)
    return BENCH_ROBOTS[name](generator)


def _by_id(
    reference: str,
    drive: str,
    reach: tuple[float, ...],
    pretension_N: float = 0.0,
    axes: str = "xyz",
    angles: tuple[str, ...] = (),
    links: int = 0,
    rows: int = 60,
    together: bool = True,
    rods: bool = False,
) -> Callable[[np.random.Generator], BenchRobot]:
    def make(generator: np.random.Generator) -> BenchRobot:
        robot = load_robot(reference)
        return BenchRobot(
            reference, robot, drive, reach, pretension_N, axes, angles, links, rows, together, rods
        )

    return make


def _file_displacement(generator: np.random.Generator) -> BenchRobot:
    """Return one segment with three elastic tendons, driven by displacement, without friction."""
    length = generator.uniform(0.05, 0.09)
    radius = generator.uniform(3.5e-3, 5e-3)
    segment = Segment("arm", length, _DISKS, radius + 5e-4, generator.uniform(1.5e-3, 4e-3), 3e-3)
    tendons = tuple(
        Tendon(
            f"t{k}",
            radius,
            math.radians(120.0 * k + 20.0),
            "arm",
            stiffness_N_per_m=generator.uniform(6e3, 12e3),
            pretension_N=1.0,
        )
        for k in range(3)
    )
    robot = ContinuumRobot("arm", "", (segment,), tendons, Friction(0.0), actuation="displacement")
    return BenchRobot(FILE_REFERENCE, robot, "heading", (radius,) * 3, links=2)


def _file_tension(generator: np.random.Generator) -> BenchRobot:
    """Return two segments with three tendons each, driven by tension, without friction."""
    radius = generator.uniform(3e-3, 5e-3)
    segments = tuple(
        Segment(
            name, generator.uniform(0.03, 0.05), _DISKS, radius + 5e-4, generator.uniform(1e-3, 3e-3), 2e-3
        )
        for name in ("lower", "upper")
    )
    tendons = tuple(
        Tendon(f"{part.name}_{k}", radius, math.radians(120.0 * k + 60.0 * index), part.name)
        for index, part in enumerate(segments)
        for k in range(3)
    )
    robot = ContinuumRobot("two_segments", "", segments, tendons, Friction(0.0))
    reach = (0.8 * tension_N(robot),) * len(channel_of(robot))
    return BenchRobot(FILE_REFERENCE, robot, "pull", reach, links=2, rods=True)


_MM = 1e-3
_TRANSSEPTAL = tuple(f"angle_{name}_deg" for name in ("bending", "torsion_proximal", "torsion_distal"))
_FOUR_DOF = tuple(f"angle_{name}_deg" for name in ("bending_proximal", "bending_distal", "torsion"))
BENCH_ROBOTS: Mapping[str, Callable[[np.random.Generator], BenchRobot]] = {
    # Two tendons that both pull slip together in the nominal statics, each by itself in the simulation.
    "neuroendoscope_section": _by_id("neuroendoscope_section", "pull", (0.45, 0.45), 0.04, "xz"),
    "neuroendoscope": _by_id(
        "neuroendoscope", "pull", (0.35, 0.35, 0.7, 0.7), 0.0, "xz", rows=20, together=False
    ),
    "chest_tube_section": _by_id("chest_tube_section", "pull", (45.0,), 0.0, "xz", rows=45),
    "chest_tube_section@prototype": _by_id(
        "chest_tube_section@prototype", "pull", (35.0,), 0.0, "xz", rows=45
    ),
    "chest_tube": _by_id("chest_tube", "pull", (25.0,) * 8, rows=30, together=False),
    "mitral_transseptal": _by_id(
        "mitral_transseptal", "joints", (1.5 * _MM, 2.5 * _MM, 1.5 * _MM, 40 * _MM), angles=_TRANSSEPTAL
    ),
    "mitral_4dof": _by_id(
        "mitral_4dof", "joints", (1.5 * _MM, 2.5 * _MM, 1.5 * _MM, 40 * _MM), angles=_FOUR_DOF
    ),
    "spacer_disk": _by_id("spacer_disk", "pull", (4.0,) * 4, 0.3, "yz", links=2, rods=True),
    "file_displacement": _file_displacement,
    "file_tension": _file_tension,
}
