"""Arrays and kernels on a Warp device."""

from __future__ import annotations

from typing import Any, Protocol, TypeVar

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.law import RobotInModel
from catheter_sim.core.robot import RobotSpec
from catheter_sim.errors import InputError

# ----------------------------------------------------------------------------------------------------
# Warp and a device: what the laws on it need to place their arrays and launch their kernels.

PACKAGES = "mujoco-warp warp-lang"  # of the extra gpu
R_in = TypeVar("R_in", bound=RobotSpec, contravariant=True)


def require_warp() -> tuple[Any, Any]:
    """Return the modules `mujoco_warp` and `warp`.

    Raises:
        InputError: they are not installed.
    """
    try:
        import mujoco_warp
        import warp
    except ImportError as error:
        raise InputError(f"MuJoCo Warp is needed: pip install {PACKAGES} ({error})") from None
    warp.config.quiet = True
    return mujoco_warp, warp


def find_device(wp: Any, name: str | None) -> Any:
    """Return Warp's device of a name; default: a GPU where there is one.

    Raises:
        InputError: it does not exist.
    """
    try:
        return wp.get_device(name)
    except (RuntimeError, ValueError) as error:
        names = ", ".join(str(item) for item in wp.get_devices())
        raise InputError(f"device {name!r}: {' '.join(str(error).split())}; choices: {names}") from None


class DeviceLaw:
    """Something that a simulation does beside MuJoCo's own step, for all copies; here nothing.

    Attributes:
        changes_joints: whether it changes the stiffness of joints.
    """

    changes_joints = False

    def before(self) -> None:
        """Act before each step."""

    def between(self) -> None:
        """Act when positions and velocities are known, before forces move the robot.

        Applied forces are added to `data.qfrc_applied`.
        """

    def reset(self) -> None:
        """Forget the history."""


class DevicePulls(Protocol):
    """What pulls the tendons of all copies.

    Attributes:
        entering: tensions at the actuators, below zero where a driven tendon is slack, shape (m, k) [N].
    """

    entering: Any

    def between(self) -> None:
        """Find the tensions."""


class DeviceCopies:
    """A model of MuJoCo Warp, the states of its copies, and their laws' arrays; all on one device.

    Attributes:
        wp: the module `warp`.
        count: number of copies.
        model, data: MuJoCo Warp's.
    """

    def __init__(self, wp: Any, count: int, model: Any, data: Any) -> None:
        self.wp, self.count, self.model, self.data = wp, count, model, data

    def whole(self, values: Any) -> Any:
        """Return whole numbers on the device, of the same shape."""
        array = np.ascontiguousarray(values, dtype=np.int32)
        return self.wp.array(array, dtype=int, ndim=array.ndim)

    def real(self, values: Any) -> Any:
        """Return numbers in double precision on the device, of the same shape."""
        array = np.ascontiguousarray(values, dtype=np.float64)
        return self.wp.array(array, dtype=self.wp.float64, ndim=array.ndim)

    def each(self, values: Array) -> Any:
        """Return numbers in double precision on the device, once for each copy, shape (m, ...)."""
        return self.real(np.repeat(np.asarray(values)[np.newaxis], self.count, axis=0))

    def room(self, *shape: int, dtype: Any = None) -> Any:
        """Return zeros on the device for each copy, shape (m, ...); default: in double precision."""
        return self.wp.zeros((self.count, *shape), dtype=dtype or self.wp.float64)

    def filled(self, struct: Any, *values: Any) -> Any:
        """Return a Warp struct with these values, in the order of its fields."""
        item = struct()
        for name, value in zip(struct.vars, values, strict=True):
            setattr(item, name, value)
        return item

    def own(self, name: str) -> Any:
        """Give each copy its own values of a field of the model, and return them, shape (m, ...)."""
        field = getattr(self.model, name)
        if field.shape[0] != self.count:
            values = np.repeat(field.numpy()[:1], self.count, axis=0)
            field = self.wp.array(values, dtype=field.dtype, ndim=field.ndim)
            setattr(self.model, name, field)
        return field

    def launch(self, kernel: Any, shape: tuple[int, ...], *arguments: Any) -> None:
        """Run a kernel with one thread for each copy and each place in `shape`."""
        self.wp.launch(kernel, dim=(self.count, *shape), inputs=list(arguments))


# A kernel, its shape, and its arguments but the last: where it writes turns, shape (m, t, n) [rad].
TurnsKernel = tuple[Any, tuple[int, ...], list[Any]]


class Gpu(Protocol[R_in]):
    """`gpu.py`: a robot's laws on a Warp device, when its model is at rest; a kind may lack it."""

    def laws(
        self, robot: R_in, place: RobotInModel, copies: DeviceCopies, pulls: DevicePulls, tension: Any
    ) -> tuple[DeviceLaw, ...]:
        """Return the laws but friction, in the order of their turns.

        Args:
            robot: the robot.
            place: where it is in the simulator's model.
            copies: where they run.
            pulls: what knows the tensions at the actuators.
            tension: in the spans, as friction leaves it, shape (m, t, n) [N]; None: without friction.
        """

    def turns(self, robot: R_in, place: RobotInModel, copies: DeviceCopies, ends: Any) -> TurnsKernel:
        """Return what finds by how much tendons turn; `ends`: number of spans of each, on the device."""
