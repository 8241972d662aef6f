"""A continuum robot as a chain of hinged links with spatial tendons, in MJCF.

Names in the model (i, k count from 1 at the base):

- bodies `link_<i>`, origin at the link's hinge; `foot`, the fixed backbone below the first hinge, where
  mass is spread along the robot; `mount` where the mount gives way;
- joints `x<i>`, `y<i>`, `t<i>` (bending toward +x, toward +y, twist) and `mount`;
- sites `face_<k>` (centre of disk k's distal face), `tip`, `hole_<tendon>_<k>` (k = 0: base);
- tendons and actuators `tendon_<tendon>`.
"""

from __future__ import annotations

import math

import mujoco
import numpy as np

from catheter_sim.kinds.continuum.drives import outputs
from catheter_sim.kinds.continuum.layout import (
    Link,
    Piece,
    axes_of,
    disk_heights,
    hole_angle_rad,
    last_disk,
    links,
    pieces,
)
from catheter_sim.kinds.continuum.mjcf.meshes import tendon_width
from catheter_sim.kinds.continuum.spec import ContinuumRobot, Tendon
from catheter_sim.mjcf import names
from catheter_sim.mjcf.backend import mjcf
from catheter_sim.mjcf.colours import tendon_colour
from catheter_sim.mjcf.mount import add_feed, add_mount, pass_feed

# An inextensible tendon driven by displacement is a spring this many times stiffer than the
# robot's bending seen from that tendon: its stretch stays below 0.1 % of the bending's share.
INEXTENSIBLE_RATIO = 1000.0


def add_chain(root: mjcf.RootElement, robot: ContinuumRobot) -> list[mjcf.Element]:
    """Add the links, joints and holes of `robot`; return the base and the links' bodies."""
    bodies = _add_bodies(root, robot)
    _add_holes(root, robot, bodies)
    return bodies


def add_tendons(root: mjcf.RootElement, robot: ContinuumRobot) -> None:
    """Add the tendons of `robot` through their holes."""
    for index, tendon in enumerate(robot.tendons):
        element = root.tendon.add("spatial", name=names.tendon(tendon.name), width=tendon_width(robot))
        element.rgba = tendon_colour(index)
        pass_feed(element, robot, tendon.name)
        for k in range(last_disk(robot, tendon) + 1):
            element.add("site", site=names.hole(tendon.name, k))


def rest_angles(robot: ContinuumRobot) -> np.ndarray:
    """Return the hinges' angles in the unloaded robot, in the order of `drives.outputs` [rad]."""
    angles = []
    for link in links(robot):
        segment = link.segment
        curvature = {"x": segment.rest_curvature_x_per_m, "y": segment.rest_curvature_y_per_m}
        angles += [curvature[axis] * link.length_m for axis in axes_of(segment)]
        if math.isfinite(segment.torsion_stiffness_N_m2):
            angles.append(0.0)
    return np.array(angles)


def _add_bodies(root: mjcf.RootElement, robot: ContinuumRobot) -> list[mjcf.Element]:
    """Add the bodies and joints; return the base and the links' bodies."""
    base = add_mount(root, robot)
    chain = links(robot)
    foot, *carried = pieces(robot)
    bodies = [base]
    hinge_z = 0.0
    for link, piece in zip(chain, carried, strict=True):
        body = bodies[-1].add("body", name=names.link(link.index), pos=(0, 0, link.hinge_z_m - hinge_z))
        hinge_z = link.hinge_z_m
        _add_joints(body, robot, link)
        _add_mass(body, piece, hinge_z)
        face = link.face_z_m - link.hinge_z_m
        if link.disk:
            body.add("site", name=names.face(link.disk), pos=(0, 0, face), size=(1e-4,), group=5)
        bodies.append(body)
    if foot.mass_kg > 0.0:
        _add_mass(base.add("body", name="foot"), foot, 0.0)
    last = chain[-1]
    bodies[-1].add("site", name=names.TIP, pos=(0, 0, last.face_z_m - last.hinge_z_m), size=(1e-4,), group=5)
    return bodies


def _add_mass(body: mjcf.Element, piece: Piece, origin_z: float) -> None:
    """Give a body whose origin is at a height of the straight robot [m] its mass."""
    body.add(
        "inertial",
        pos=(0, 0, piece.centre_z_m - origin_z),
        mass=piece.mass_kg,
        diaginertia=(piece.transverse_kg_m2, piece.transverse_kg_m2, piece.axial_kg_m2),
    )


def _add_joints(body: mjcf.Element, robot: ContinuumRobot, link: Link) -> None:
    segment, dynamics = link.segment, robot.dynamics

    def hinge(name: str, axis: tuple[int, int, int], rigidity: float, rest: float, cubic: float) -> None:
        stiffness = robot.stiffness_scale * rigidity / link.length_m
        body.add(
            "joint",
            name=name,
            type="hinge",
            axis=axis,
            # torque = -(k1 q + k2 q^2 + k3 q^3), q from springref
            stiffness=(stiffness, 0.0, stiffness * cubic / link.length_m**2) if cubic else stiffness,
            springref=rest,
            damping=stiffness * dynamics.relaxation_time_s,
            armature=stiffness * dynamics.inertia_time_s**2,
        )

    bending, cubic = segment.bending_stiffness_N_m2, segment.stiffness_cubic_m2
    both = {
        f"x{link.index}": ((0, 1, 0), segment.rest_curvature_x_per_m),
        f"y{link.index}": ((-1, 0, 0), segment.rest_curvature_y_per_m),
    }
    turns = [f"{axis}{link.index}" for axis in axes_of(segment)]
    # Two turns in a row, x before y, also twist by half of their product; every other link takes it back.
    for name in turns if link.index % 2 else reversed(turns):
        axis, curvature = both[name]
        hinge(name, axis, bending, curvature * link.length_m, cubic)
    if math.isfinite(segment.torsion_stiffness_N_m2):
        hinge(f"t{link.index}", (0, 0, 1), segment.torsion_stiffness_N_m2, 0.0, 0.0)


def _add_holes(root: mjcf.RootElement, robot: ContinuumRobot, bodies: list[mjcf.Element]) -> None:
    heights = disk_heights(robot)
    disk_links = [link for link in links(robot) if link.disk]

    def xy(tendon: Tendon, height: float) -> tuple[float, float]:
        angle = hole_angle_rad(robot, tendon, height)
        return tendon.radius_m * math.cos(angle), tendon.radius_m * math.sin(angle)

    def hole(body: mjcf.Element, name: str, pos: tuple[float, float, float]) -> None:
        body.add("site", name=name, pos=pos, size=(1e-4,), group=5)

    for tendon in robot.tendons:
        add_feed(root, robot, tendon.name, xy(tendon, 0.0))
        hole(bodies[0], names.hole(tendon.name, 0), (*xy(tendon, 0.0), 0.0))
        for link in disk_links[: last_disk(robot, tendon)]:
            position = (*xy(tendon, float(heights[link.disk])), link.face_z_m - link.hinge_z_m)
            hole(bodies[link.index], names.hole(tendon.name, link.disk), position)


def drive_stiffness(robot: ContinuumRobot, tendon: Tendon) -> float:
    """Return the stiffness of a displacement-driven tendon, a finite one for an inextensible [N/m]."""
    if math.isfinite(tendon.stiffness_N_per_m):
        return tendon.stiffness_N_per_m
    end = last_disk(robot, tendon)
    compliance = 0.0
    for link in links(robot):
        hinge_stiffness = robot.stiffness_scale * link.segment.bending_stiffness_N_m2 / link.length_m
        compliance += tendon.radius_m**2 / hinge_stiffness * bool(axes_of(link.segment))
        if link.disk == end:
            break
    return INEXTENSIBLE_RATIO / compliance


def add_displacement_actuators(root: mjcf.RootElement, robot: ContinuumRobot) -> None:
    """Add actuators that take the tendons' displacements; to be called when the tendons are there."""
    lengths = _rest_lengths(root, robot)
    for index, tendon in enumerate(robot.tendons):
        name = names.tendon(tendon.name)
        stiffness = drive_stiffness(robot, tendon)
        # force = -pretension - k (displacement + length - rest length), pulls only
        root.actuator.add(
            "general",
            name=name,
            tendon=name,
            biastype="affine",
            gainprm=(-stiffness,),
            biasprm=(stiffness * lengths[index] - tendon.pretension_N, -stiffness, 0.0),
            forcerange=(-1e9, 0.0),
        )


def _rest_lengths(root: mjcf.RootElement, robot: ContinuumRobot) -> np.ndarray:
    """Return the tendons' lengths in the unloaded robot, with their slack, in the robot's order [m]."""
    model = mujoco.MjModel.from_xml_string(root.to_xml_string())
    data = mujoco.MjData(model)
    for name, angle in zip(outputs(robot).joints, rest_angles(robot), strict=True):
        data.qpos[model.joint(name).qposadr[0]] = angle
    mujoco.mj_fwdPosition(model, data)
    lengths = [data.ten_length[model.tendon(names.tendon(tendon.name)).id] for tendon in robot.tendons]
    return np.array(lengths) + [tendon.slack_m for tendon in robot.tendons]
