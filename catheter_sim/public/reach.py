"""The cloud of points that a robot's tip can reach."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from numbers import Integral
from typing import TYPE_CHECKING, Any

from catheter_sim.errors import InputError, shown
from catheter_sim.public.arguments import AT_REST, gravity_of, path_of, robot_of
from catheter_sim.public.listing import Listing, data_frame, listing_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from catheter_sim.arrays import Array
    from catheter_sim.core.robot import RobotSpec
    from catheter_sim.planning.workspace import Workspace as Cloud

_MOST_SAMPLES = 100_000


@dataclass(frozen=True, repr=False)
class Workspace:
    """Reachable tips: see `workspace`, which returns it.

    Attributes:
        robot: as it was specified, effects named.
        cloud: inputs, tips and directions.

    Examples:
        >>> import catheter_sim as cs
        >>> found = cs.workspace("mitral_4dof", samples=200)
        >>> found
        <Workspace of mitral_4dof: 200 points>
        >>> list(found.extent())
        ['tip_x_mm', 'tip_y_mm', 'tip_z_mm']
    """

    robot: RobotSpec
    cloud: Cloud

    def __len__(self) -> int:
        return len(self.cloud.tip_mm)

    @property
    def tip_mm(self) -> Array:
        """The tips, shape (n, 3) [mm]."""
        return self.cloud.tip_mm

    def extent(self) -> dict[str, tuple[float, float]]:
        """Return the least and largest coordinate of the tips [mm]."""
        low, high = self.cloud.tip_mm.min(axis=0), self.cloud.tip_mm.max(axis=0)
        return {f"tip_{axis}_mm": (float(low[k]), float(high[k])) for k, axis in enumerate("xyz")}

    def to_table(self) -> Listing:
        """Return a row for each point: the inputs' columns, the tip's place, the direction of its axis."""
        return listing_of(f"Workspace of {self.robot.name}", self._columns())

    def to_dataframe(self) -> Any:
        """Return `to_table` as a pandas `DataFrame`.

        Raises:
            InputError: pandas is not installed.
        """
        return data_frame(self._columns())

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write `to_table` to a CSV file.

        Raises:
            InputError: the file cannot be written, or does not end in `.csv`.
        """
        file = path_of(path, "save")
        if not file.lower().endswith(".csv"):
            raise InputError(f"{file}: a workspace is saved as a table; choices: .csv")
        self.to_table().save(file)

    def plot(self, ax: Any = None) -> Figure:
        """Return a figure of the tips from the side, from the front and from above.

        Args:
            ax: axes of matplotlib to draw into, three; None: a new figure.

        Raises:
            InputError: `ax` holds something else.
        """
        from catheter_sim.public.planning_figures import workspace_figure

        return workspace_figure(self, ax)

    def _columns(self) -> dict[str, Any]:
        from catheter_sim.planning.drives import input_table
        from catheter_sim.planning.targets import DIRECTION

        cloud = self.cloud
        columns: dict[str, Any] = dict(input_table(self.robot, cloud.inputs, cloud.inputs.time_s).columns)
        columns |= {f"tip_{axis}_mm": cloud.tip_mm[:, k] for k, axis in enumerate("xyz")}
        return columns | {name: cloud.direction[:, k] for k, name in enumerate(DIRECTION)}

    def __repr__(self) -> str:
        return f"<Workspace of {self.robot.name}: {len(self)} points>"

    def _repr_html_(self) -> str:
        return self.to_table()._repr_html_()


def workspace(
    robot: RobotSpec | str | os.PathLike[str],
    samples: int = 2000,
    seed: int = 0,
    limits: Mapping[str, Sequence[float]] | None = None,
    gravity_mps2: Sequence[float] = AT_REST,
) -> Workspace:
    """Return where the tip of `robot` comes to under inputs drawn within their ranges, each from rest.

    By the robot's analytic twin, effects included; draws without a balance are left out.

    Args:
        robot: a robot, its id or its file.
        samples: how many draws, up to 100,000.
        seed: of the draws, from 0.
        limits: as for `inverse_kinematics`.
        gravity_mps2: gravity in the base frame, shape (3,) [m/s^2].

    Raises:
        InputError: anything is not possible, or no draw has a balance.

    Examples:
        >>> import catheter_sim as cs
        >>> reach = cs.workspace("chest_tube_section", samples=50, limits={"tension_active_N": (0, 20)})
        >>> reach.extent()["tip_y_mm"]
        (0.0, 0.0)
    """
    from catheter_sim.planning.drives import plan_drives, with_limits
    from catheter_sim.planning.workspace import workspace as solve
    from catheter_sim.public.inverse import limits_of

    value = robot_of(robot)
    if not _is_whole(samples) or not 1 <= samples <= _MOST_SAMPLES:
        raise InputError(f"samples = {shown(samples)}: a whole number of 1 to {_MOST_SAMPLES} is needed")
    if not _is_whole(seed) or seed < 0:
        raise InputError(f"seed = {shown(seed)}: a whole number from 0 is needed")
    drives = with_limits(plan_drives(value), limits_of(limits), "limits")
    return Workspace(value, solve(value, drives, gravity_of(gravity_mps2), int(samples), int(seed)))


def _is_whole(value: object) -> bool:
    """Return whether a value is a whole number, Python's or NumPy's; True and False are none."""
    return isinstance(value, Integral) and not isinstance(value, bool)
