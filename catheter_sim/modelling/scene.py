"""How a robot's model is lit and seen: materials, light, background and cameras, sized to the robot."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.robot import RobotSpec
from catheter_sim.mjcf.document import Element
from catheter_sim.robots import kind_of

FOVY_DEG = 20.0  # narrow: little perspective, so that what is near is hardly larger than what is far
SIDE_FOVY_DEG = 6.0  # almost parallel rays, to measure in the picture
LARGEST_IMAGE = (1920, 1080)  # of the offscreen buffer in the model file


@dataclass(frozen=True)
class View:
    """A camera that stands still.

    Attributes:
        name: the camera's name in the model.
        target: the point in the middle of its picture, base frame [m].
        backward: unit vector from the target to the camera.
        height: how much the picture shows from top to bottom, at the target [m].
        fovy_deg: angle between the picture's top and bottom edge [deg].
    """

    name: str
    target: Array
    backward: Array
    height: float
    fovy_deg: float = FOVY_DEG

    @property
    def position(self) -> Array:
        """Where the camera stands, base frame, shape (3,) [m]."""
        return self.target + self.backward * self.height / 2.0 / math.tan(math.radians(self.fovy_deg / 2.0))

    @property
    def axes(self) -> Array:
        """The picture's right and up directions, base frame, shape (2, 3); +z points up."""
        right = np.cross((0.0, 0.0, 1.0), self.backward)
        right /= np.linalg.norm(right)
        return np.stack([right, np.cross(self.backward, right)])


def robot_length(robot: RobotSpec) -> float:
    """Return the length of the straight robot, its tubes fully advanced [m]."""
    return kind_of(robot).model.length_m(robot)


def views(robot: RobotSpec) -> tuple[View, ...]:
    """Return the cameras: `side` on the xz plane, `overview` from above its front, `detail` of the base.

    `side` and `overview` hold everything that the robot reaches up to a half circle to either side.
    """
    length = robot_length(robot)
    radius = max(segment.outer_radius_m for segment in robot.segments)
    middle = np.array([0.0, 0.0, 0.46 * length])
    oblique = np.array([0.55, -1.0, 0.38])
    level, close = kind_of(robot).model.close_up(robot)
    return (
        View("side", middle, np.array([0.0, -1.0, 0.0]), 1.14 * length + 4.0 * radius, SIDE_FOVY_DEG),
        View("overview", middle, oblique / np.linalg.norm(oblique), 1.2 * length + 4.0 * radius),
        View("detail", np.array([0.0, 0.0, level]), oblique / np.linalg.norm(oblique), close),
    )


def add_scene(root: Element, robot: RobotSpec) -> None:
    """Add visual settings, materials, background, lights and cameras for `robot` to the model `root`."""
    length = robot_length(robot)
    root.add("statistic", extent=1.2 * length, center=(0.0, 0.0, 0.46 * length))
    visual = root.add("visual")
    width, height = LARGEST_IMAGE
    visual.add("global", fovy=FOVY_DEG, offwidth=width, offheight=height)  # fovy: of the free camera
    # Slices of a tendon's round: tendons are many, and thin.
    visual.add("quality", offsamples=4, numslices=12, numstacks=4)
    visual.add("headlight", ambient=[0.38] * 3, diffuse=[0.25] * 3, specular=[0.0] * 3)
    # The nearest is 0.01 of the extent away: near enough for a close look at one cell.
    visual.add("map", znear=0.01, zfar=20.0)
    sky = {"builtin": "gradient", "rgb1": (0.98, 0.985, 0.99), "rgb2": (0.80, 0.84, 0.88)}
    asset = root.part("asset")
    asset.add("texture", name="background", type="skybox", width=256, height=1536, **sky)
    asset.add("material", name="metal", specular=0.9, shininess=0.7, rgba=[0.60, 0.63, 0.68, 1.0])
    asset.add("material", name="plastic", specular=0.25, shininess=0.2, rgba=[0.86, 0.76, 0.60, 1.0])
    for name, direction, strength in (("key", (0.5, 0.9, -0.9), 0.55), ("fill", (-0.9, 0.6, 0.3), 0.2)):
        toward = np.array(direction) / np.linalg.norm(direction)
        root.part("worldbody").add(
            "light",
            name=name,
            directional=True,
            castshadow=False,  # at this scale the shadow map is coarse and slow
            pos=np.array([0.0, 0.0, 0.5 * length]) - 1.5 * length * toward,
            dir=toward,
            diffuse=[strength] * 3,
            specular=[0.3 * strength] * 3,
            ambient=[0.0] * 3,
        )
    for view in views(robot):
        root.part("worldbody").add(
            "camera", name=view.name, pos=view.position, xyaxes=view.axes.ravel(), fovy=view.fovy_deg
        )
