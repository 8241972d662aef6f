"""Which static model is accurate enough for given inputs, and fastest."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from catheter_sim.core.requirements import number_of
from catheter_sim.errors import InputError
from catheter_sim.public.arguments import AT_REST, gravity_of, path_of, progress_of, robot_of
from catheter_sim.public.data import inputs_of
from catheter_sim.public.listing import Listing

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from catheter_sim.core.robot import RobotSpec
    from catheter_sim.theory.which_model import ModelChoice as Result

TOLERANCE_PERCENT = 1.0
COLUMNS = ("model", "position_percent", "mean_percent", "orientation_deg", "ms", "failed", "within")


@dataclass(frozen=True, repr=False)
class ModelChoice:
    """What every static model does along some inputs: see `which_model`, which returns it.

    Attributes:
        robot: as it was specified, effects named.
        result: errors and times of all models.
        tolerance_percent: largest allowed distance of the tip [% of the robot's length].
        tolerance_deg: largest allowed angle between the tips' frames [deg].

    Examples:
        >>> import catheter_sim as cs
        >>> pull = {"time_s": [0.0, 1.0, 2.0], "tension_active_N": [5.0, 20.0, 5.0]}
        >>> choice = cs.which_model("chest_tube_section", pull, reference="complete_sliding")
        >>> "pcc" in [row["model"] for row in choice.to_table() if row["within"]]
        False
    """

    robot: RobotSpec
    result: Result
    tolerance_percent: float
    tolerance_deg: float

    @property
    def model(self) -> str | None:
        """The fastest model within the tolerance, of equally fast ones the most accurate; None: none is."""
        return self.result.model if any(row["within"] for row in self.to_table()) else None

    def to_table(self) -> Listing:
        """Return a row for each model, the fastest first.

        Columns: `model`, `position_percent` and `mean_percent` (largest and mean distance of the tip
        [% of length]), `orientation_deg` (largest angle between the tips' frames), `ms` (of a row, by the
        solver alone where all models have one, else by the model as it is called), `failed` (rows that it
        does not solve), `within` (the tolerance).
        """
        from catheter_sim.theory.which_model import accurate

        within = accurate(self.result.errors, self.tolerance_percent, self.tolerance_deg)
        rows = tuple(
            {
                "model": item.model,
                "position_percent": item.position_percent,
                "mean_percent": item.mean_percent,
                "orientation_deg": item.orientation_deg,
                "ms": item.ms,
                "failed": len(item.failed),
                "within": item in within,
            }
            for item in self.result.errors
        )
        return Listing(f"Static models of {self.robot.name} against {self.result.reference}", COLUMNS, rows)

    def to_dataframe(self) -> Any:
        """Return `to_table` as a pandas `DataFrame`.

        Raises:
            InputError: pandas is not installed.
        """
        return self.to_table().to_dataframe()

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write `to_table` to a CSV file.

        Raises:
            InputError: the file cannot be written, or does not end in `.csv`.
        """
        file = path_of(path, "save")
        if not file.lower().endswith(".csv"):
            raise InputError(f"{file}: a comparison is saved as a table; choices: .csv")
        self.to_table().save(file)

    def plot(self, ax: Any = None) -> Figure:
        """Return a figure of every model's error over its time.

        Args:
            ax: axes of matplotlib to draw into, one; None: a new figure.

        Raises:
            InputError: `ax` holds something else.
        """
        from catheter_sim.public.planning_figures import models_figure

        return models_figure(self, ax)

    def __repr__(self) -> str:
        return f"<ModelChoice of {self.robot.name}: {self.model or 'none'}>"

    def _repr_html_(self) -> str:
        return self.to_table()._repr_html_()


def which_model(
    robot: RobotSpec | str | os.PathLike[str],
    inputs: Any,
    tolerance_percent: float = TOLERANCE_PERCENT,
    tolerance_deg: float = math.inf,
    gravity_mps2: Sequence[float] = AT_REST,
    reference: str = "simulation",
    progress: bool | None = None,
) -> ModelChoice:
    """Return which static model of `robot` is accurate enough along `inputs`, and fastest.

    Args:
        robot: a robot, its id or its file.
        inputs: as for `simulate`; rows follow one another, friction's history included.
        tolerance_percent: largest allowed distance of the tip from the reference's [% of the robot's length].
        tolerance_deg: largest allowed angle between the tips' frames [deg].
        gravity_mps2: gravity in the base frame, shape (3,) [m/s^2].
        reference: "simulation", or one of `list_models(robot)`.
        progress: show on standard error what is done; None: on a terminal, and in a notebook.

    Raises:
        InputError: anything is not possible.
        SimulationDiverged: the simulation left the finite numbers.

    Examples:
        >>> import catheter_sim as cs
        >>> bend = {"time_s": [0.0, 1.0], "displacement_bending_mm": [1.0, 2.0]}
        >>> cs.which_model("mitral_transseptal", bend, reference="balance").model in ("pk", "balance")
        True
    """
    from catheter_sim.planning.models import compare_models

    value = robot_of(robot)
    percent, degrees = (
        number_of(number, what, "a number above zero", lambda size: size > 0.0)
        for what, number in (("tolerance_percent", tolerance_percent), ("tolerance_deg", tolerance_deg))
    )
    commanded, gravity, shown = inputs_of(value, inputs), gravity_of(gravity_mps2), progress_of(progress)
    result = compare_models(value, commanded, gravity, percent, degrees, str(reference), progress=shown)
    return ModelChoice(value, result, percent, degrees)
