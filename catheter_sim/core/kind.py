"""What a kind of robot answers for itself, so that nothing outside its folder asks which kind it is.

A kind is a folder under `robots/`. Each of its faces is a module with a fixed name (`description.py`,
`model.py`) that is held to one of the protocols below, or to several: the module's functions are the
protocol's methods. A face is imported when it is first used. Some may be missing (`steering.py` and all that
have no protocol as cached property below); whoever needs one then says so in one line (`robots.face_of`).
"""

from __future__ import annotations

import importlib
import importlib.util
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

from catheter_sim.arrays import Array
from catheter_sim.core.effect import Handle, Mover, Sizes
from catheter_sim.core.inputs import Drive, Outputs
from catheter_sim.core.law import Batched, Laws
from catheter_sim.core.motion import Integration
from catheter_sim.core.published import InputLimits, QuickModel, Robots, SpeedCase
from catheter_sim.core.robot import RobotSpec
from catheter_sim.core.statics import Statics, Twins
from catheter_sim.errors import InputError

if TYPE_CHECKING:  # what listing robots and registering environments need not wait for
    import mujoco
    import trimesh

    from catheter_sim.mjcf.document import Element
    from catheter_sim.mjcf.parts import Part

S = TypeVar("S", bound=RobotSpec)
R_in = TypeVar("R_in", bound=RobotSpec, contravariant=True)


@dataclass(frozen=True)
class CloseUp:
    """Where a picture looks closely at a robot as it stands, and what it draws there.

    Attributes:
        middle: what is in the middle, base frame, shape (3,) [m].
        across: the direction to look along, one way or the other, shape (3,), of length 1.
        height_m: what is seen from top to bottom.
        lines: points of each, base frame, shape (n, 3) [m], and its colour, red, green, blue, opacity.
        words: what is shown, in a few words for each line of text.
    """

    middle: Array
    across: Array
    height_m: float
    lines: tuple[tuple[Array, tuple[float, float, float, float]], ...]
    words: tuple[str, ...]


class Checks(Protocol[R_in]):
    """`checks.py`: is this robot possible?"""

    def check(self, robot: R_in, where: str) -> None:
        """Raise `InputError` where a number of `robot`, called `where`, is impossible."""


class Drives(Protocol[R_in]):
    """`drives.py`: what drives a robot, and what does it report?"""

    def actuations(self, robot: R_in) -> tuple[str, ...]:
        """Return the kinds of actuator inputs that `robot` takes: "tension", "displacement"."""

    def drives(self, robot: R_in, actuation: str) -> tuple[Drive, ...]:
        """Return the input columns under `actuation`, one of `actuations`, in the order of files."""

    def outputs(self, robot: R_in) -> Outputs:
        """Return what the output columns are."""


class Handles(Protocol[R_in]):
    """`handles.py`: where may a cause of error act on a robot, and what is large for it?"""

    def handles(self, robot: R_in) -> tuple[Handle, ...]:
        """Return the places at which causes may act; those with names of their own in their order."""

    def movers(self, robot: R_in) -> tuple[Mover, ...]:
        """Return what each input channel moves."""

    def sizes(self, robot: R_in) -> Sizes:
        """Return what bends `robot` by a radian."""


class Model(Protocol[R_in]):
    """`model.py`: what is my MuJoCo model?"""

    def add(self, root: Element, robot: R_in, actuation: str) -> None:
        """Add `robot` to the model `root`, which has a scene: bodies, what they show, tendons, actuators.

        The site `names.TIP`, a site `names.face(k)` for each of `drives.outputs(robot).elements`, a joint for
        each of its `joints` and an actuator for each tendon, in the robot's order and first, must be there.

        Raises:
            InputError: the robot takes no such inputs.
        """

    def integration(self, robot: R_in, actuation: str) -> Integration:
        """Return how the model is stepped where the robot moves."""

    def length_m(self, robot: R_in) -> float:
        """Return the length of the straight robot, all pushed out that can be [m]."""

    def close_up(self, robot: R_in) -> tuple[float, float]:
        """Return the height of the close-up's middle, and how much it shows from top to bottom [m]."""

    def remarks(self, robot: R_in) -> tuple[str, ...]:
        """Return what a user who builds the model should know of it, a line each."""


class Picture(Protocol[R_in]):
    """`picture.py`: what is drawn of me, and which of it lies about my axis?"""

    CENTRELINE_PARTS: tuple[str, ...]
    """What the names of geoms begin with (`<prefix>_`) whose middle is the axis of the straight robot."""

    def meshes(self, robot: R_in) -> Mapping[str, trimesh.Trimesh]:
        """Return every mesh that `parts` names, by its name."""

    def parts(self, robot: R_in, element: int) -> tuple[Part, ...]:
        """Return what a body of the chain shows: 0 for what carries the base, then from base to tip."""

    def geom_places(self, robot: R_in, model: mujoco.MjModel) -> Array:
        """Return where the model's geoms stand in their bodies, as simulated, shape (ngeom, 3) [m]."""


class JointProfile(Protocol[R_in]):
    """`profile.py`, which may be missing: where do I hide what a picture's close-up must show?"""

    def close_up(self, robot: R_in, model: mujoco.MjModel, data: mujoco.MjData, qpos: Array) -> CloseUp:
        """Return where to look closely as `data` stands.

        `qpos`, shape (nq,): the joint positions by which one place is chosen for a whole video.
        """


class Steering(Protocol[R_in]):
    """`steering.py`, which may be missing: how do environments drive me, and what does a speed test play?"""

    def quick_model(self, robot: R_in, actuation: str, largest_bend_rad: float | None) -> QuickModel:
        """Return the model without friction and load by which an environment steers.

        Args:
            robot: the robot.
            actuation: one of `drives.actuations`.
            largest_bend_rad: what one drive alone may ask of a segment; None: the model's own default.

        Raises:
            InputError: tendons bend nothing, or a largest bend does not apply to such robots.
        """

    def input_range(self, robot: R_in) -> tuple[Array, Array]:
        """Return the least and largest input of each tendon that the simulation takes, shape (t,) each."""

    def input_limits(self, robot: R_in, actuation: str) -> InputLimits:
        """Return the inputs beyond which the robot as its file describes it cannot follow.

        Raises:
            InputError: as of `quick_model`.
        """

    def speed_case(self, robot: R_in, levels: int) -> SpeedCase:
        """Return what the speed test plays: inputs in so many levels that move every joint to and fro."""


@dataclass(frozen=True)
class Kind(Generic[S]):
    """A kind of robot.

    Attributes:
        name: as in a file's `kind`.
        spec: the class of its robots, a frozen dataclass.
        package: of its faces.
    """

    name: str
    spec: type[S]
    package: str

    def __reduce__(self) -> tuple[Callable[[str], Kind[Any]], tuple[str]]:
        return _kind_in, (self.package,)  # faces are modules, which cannot be pickled

    def face(self, name: str, what: str) -> Any:
        """Return the face `name`, without which there is no `what` ("environment") for this kind.

        Raises:
            InputError: this kind has no such face.
        """
        module = f"{self.package}.{name}"
        if importlib.util.find_spec(module) is None:
            raise InputError(f"no {what} for robots of kind {self.name!r}")
        return importlib.import_module(module)

    def has(self, name: str) -> bool:
        """Return whether this kind has the face `name`."""
        return importlib.util.find_spec(f"{self.package}.{name}") is not None

    @cached_property
    def checks(self) -> Checks[S]:
        """Is this robot possible?"""
        return importlib.import_module(f"{self.package}.description")

    @cached_property
    def drives(self) -> Drives[S]:
        """What drives a robot, and what does it report?"""
        return importlib.import_module(f"{self.package}.description")

    @cached_property
    def handles(self) -> Handles[S]:
        """Where may a cause of error act on a robot?"""
        return importlib.import_module(f"{self.package}.description")

    @cached_property
    def model(self) -> Model[S]:
        """What is my MuJoCo model?"""
        return importlib.import_module(f"{self.package}.model")

    @cached_property
    def picture(self) -> Picture[S]:
        """What is drawn of me, and which of it lies about my axis?"""
        return importlib.import_module(f"{self.package}.picture")

    @cached_property
    def profile(self) -> JointProfile[S] | None:
        """Where must a picture look closely? None: at the base."""
        return self.face("profile", "close-up") if self.has("profile") else None

    @cached_property
    def steering(self) -> Steering[S]:
        """How do environments drive me? Where there is no such face, `robots.face_of` says so to users."""
        return importlib.import_module(f"{self.package}.steering")

    @cached_property
    def robots(self) -> Robots:
        """Which robots of this kind are there?"""
        return importlib.import_module(f"{self.package}.published")

    @cached_property
    def statics(self) -> Statics[S]:
        """Which static models are there?"""
        return importlib.import_module(f"{self.package}.statics")

    @cached_property
    def twin(self) -> Twins[S]:
        """Which twin do fits go by?"""
        return importlib.import_module(f"{self.package}.twin")

    @cached_property
    def laws(self) -> Laws[S]:
        """Which forces run beside a step?"""
        return importlib.import_module(f"{self.package}.laws")

    @cached_property
    def batched(self) -> Batched[S] | None:
        """The laws of many copies at once; None: this kind does not have them."""
        return self.face("batched", "batch of copies") if self.has("batched") else None


def _kind_in(package: str) -> Kind[Any]:
    kind: Kind[Any] = importlib.import_module(package).KIND
    return kind
