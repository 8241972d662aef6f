"""A robot as one MJCF file that plain MuJoCo runs."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from catheter_sim.errors import InputError
from catheter_sim.public.arguments import path_of, progress_of, robot_of

if TYPE_CHECKING:
    from catheter_sim.core.robot import RobotSpec
    from catheter_sim.exporting.judge import Judgement
    from catheter_sim.exporting.write import Model


@dataclass(frozen=True, repr=False)
class Export:
    """A robot as MJCF that needs nothing beside it, and what was measured of it: see `export`.

    Attributes:
        model: the file's text, its controls, and how each cause is carried.
        judgement: distances from the package's own simulation, and costs of what is left out [mm].

    Example:
        >>> import catheter_sim as cs
        >>> robot = cs.load_robot("notched_wrist")
        >>> exported = cs.export(robot)
        >>> exported.percent < 2.0
        True
        >>> print(exported.report().splitlines()[0])
        notched_wrist for mujoco
    """

    model: Model
    judgement: Judgement

    @property
    def text(self) -> str:
        """The MJCF."""
        return self.model.text

    @property
    def percent(self) -> float:
        """The largest distance from the package's simulation on held loops [% of the length]."""
        return self.judgement.percent

    def report(self) -> str:
        """Return what travelled, how, and what it costs that the rest did not, as text."""
        from catheter_sim.exporting.report import text_of

        return text_of(self.model, self.judgement)

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the MJCF to `path`, the report as JSON beside it; return the report's path.

        Raises:
            InputError: a file cannot be written, or `path` does not end in `.xml`.
        """
        from catheter_sim.exporting.report import json_of
        from catheter_sim.tables import replaced_when_whole

        beside = report_path(path)
        with replaced_when_whole(path) as file:
            file.write(self.text)
        with replaced_when_whole(beside) as file:
            file.write(json.dumps(json_of(self.model, self.judgement), indent=1) + "\n")
        return beside

    def __repr__(self) -> str:
        return f"<Export of {self.model.robot.name}: within {self.percent:.2g} % of its length>"

    def _repr_html_(self) -> str:
        return f"<pre>{escape(self.report())}</pre>"


def report_path(path: str | os.PathLike[str]) -> Path:
    """Return where the report of a file stands: `robot_export.json` beside `robot.xml`.

    Raises:
        InputError: the file does not end in `.xml`.
    """
    file = Path(path_of(path, "save"))
    if file.suffix.lower() != ".xml":
        raise InputError(f"{file}: a model's ending is needed; choices: .xml")
    return file.with_name(f"{file.stem}_export.json")


def export(
    robot: RobotSpec | str | os.PathLike[str],
    path: str | os.PathLike[str] | None = None,
    engine: str = "mujoco",
    progress: bool | None = None,
) -> Export:
    """Return a robot with its effects as one MJCF for plain MuJoCo, and how far it is from the package.

    What runs beside the package's steps (friction, rods, metal) becomes springs and plastic springs of the
    hinges, fitted to loops of the package's simulation; it is judged on others.

    Args:
        robot: a robot, its id or the path of its .toml, such as a diagnosis' `robot.toml`.
        path: of the .xml to write, with its report beside it; None: nothing is written.
        engine: "mujoco", or "mjx" or "warp", without what those do not say they know.
        progress: show on standard error what is done; None: on a terminal, and in a notebook.

    Raises:
        InputError: an unknown robot or engine, an impossible robot or effect, a file that cannot be written.
        SimulationDiverged: the package's own simulation does, on the loops.

    Example:
        >>> import catheter_sim as cs
        >>> sections = {"segments.section.disks": 5, "friction.mu": 0.0, "effects.actuation_gain.scale": 1.2}
        >>> exported = cs.export(cs.load_robot("neuroendoscope_section", sections), "section.xml")
        >>> [(cause.effect, cause.way, cause.how) for cause in exported.model.causes]
        [('actuation_gain', 'as it is', "actuators' gains")]
    """
    from catheter_sim.exporting.judge import judge
    from catheter_sim.exporting.write import write_model

    if path is not None:
        from catheter_sim.files import check_output_file

        check_output_file(path_of(path, "path"))
        check_output_file(report_path(path))
    shown = progress_of(progress)
    model = write_model(robot_of(robot), engine, progress=shown)
    found = Export(model, judge(model, shown))
    if path is not None:
        found.save(path)
    return found
