"""A bench with a robot on it, and a robot as a file for plain MuJoCo."""

from __future__ import annotations

import html
import json
import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from catheter_sim.core.robot import number_of, whole_of
from catheter_sim.errors import InputError
from catheter_sim.public.data import (
    Listing,
    columns_of,
    gravity_of,
    jobs_of,
    path_of,
    progress_of,
    robot_of,
    texts_of,
)
from catheter_sim.public.planning import clocked_table, limits_of

if TYPE_CHECKING:
    from catheter_sim.closed_loop.loop import LoopOutcome, Proposed
    from catheter_sim.core.robot import RobotSpec
    from catheter_sim.diagnosis.trials import Dataset
    from catheter_sim.exporting.judge import Judgement
    from catheter_sim.exporting.write import ExportedModel
    from catheter_sim.lab.recorded import RecordedRig
    from catheter_sim.lab.simulated import SimulatedRig
    from catheter_sim.tables import Table

# ----------------------------------------------------------------------------------------------------
# A bench with a robot on it, simulated or real, and a loop that finds out what is wrong with the robot.


@dataclass(frozen=True, repr=False)
class FoundOut:
    """What a loop of experiments came to: see `Laboratory.find_out`, which returns it.

    Attributes:
        outcome: every diagnosis and proposal, in order.
        robot_name: of the robot on the bench.
        path: the folder with the story, the data and the last report.

    Examples:
        >>> import catheter_sim as cs
        >>> from pathlib import Path
        >>> from tempfile import TemporaryDirectory
        >>> limits = {"displacement_bending_mm": (-1.5, 1.5)}
        >>> with TemporaryDirectory() as folder:
        ...     settings = {"limits": limits, "columns": "tip_x_mm", "recordings": folder}
        ...     found = cs.laboratory("mitral_transseptal", **settings).find_out(Path(folder, "found"))
        ...     to_play = sorted(path.name for path in Path(folder).glob("*.csv"))
        >>> found.end, to_play[0]
        ('waiting', 'first_1_inputs.csv')
    """

    outcome: LoopOutcome
    robot_name: str
    path: Path

    @property
    def causes(self) -> tuple[str, ...]:
        """Return the causes that stand at 0.95 or more."""
        return self.outcome.causes

    @property
    def end(self) -> str:
        """Return why it ended: "sure", "budget", "suspect" data, "nothing to ask", or "waiting"."""
        return self.outcome.end

    @property
    def sentence(self) -> str:
        """Return what was found, in one sentence."""
        from catheter_sim.closed_loop.story import title_of

        return f"{title_of(self.outcome, self.robot_name)}: {self.outcome.words}"

    def to_table(self) -> Listing:
        """Return a row for each diagnosis: the recordings, what was found, and the experiment then proposed.

        `probability` is that of what is most probable, `minutes` what the experiment takes, `nats` how much
        it was expected to tell.
        """
        columns = ("recordings", "verdict", "most_probable", "probability", "proposed", "minutes", "nats")
        rows = []
        for step in self.outcome.steps:
            if step.found is None:
                continue
            name, value = max(step.found.believed.items(), key=lambda item: item[1], default=("", math.nan))
            asked = ("", 0.0, 0.0) if step.proposed is None else _asked(step.proposed)
            values = (step.recordings, step.found.verdict, name, value, *asked)
            rows.append(dict(zip(columns, values, strict=True)))
        return Listing("experiments", columns, tuple(rows))

    def __repr__(self) -> str:
        return f"<FoundOut: {self.sentence}>"

    def _repr_html_(self) -> str:
        return f"<p>{html.escape(self.sentence)}</p>{self.to_table()._repr_html_()}"


def _asked(proposed: Proposed) -> tuple[str, float, float]:
    return proposed.words, proposed.minutes, math.nan if proposed.nats is None else proposed.nats


@dataclass(frozen=True, repr=False)
class Laboratory:
    """A robot on a bench: see `laboratory`, which returns it.

    Attributes:
        rig: the bench: `reset`, `play`, `read`.

    Examples:
        >>> import catheter_sim as cs
        >>> bench = cs.laboratory("mitral_4dof", hide=["backlash.play=8"], seed=3)
        >>> pull = {"time_s": [0.0, 1.0, 2.0, 3.0], "displacement_bending_proximal_mm": [0.0, 0.6, 1.2, 0.6]}
        >>> measured = bench.play(pull, "pull")
        >>> list(measured.columns)[:2], len(measured.time_s)
        (['displacement_bending_proximal_mm', 'tip_x_mm'], 4)
        >>> [(item["cause"], item["form"], item["size"]) for item in bench.hidden["hidden"]]
        [('backlash', 'play', 8.0)]
    """

    rig: SimulatedRig | RecordedRig

    @property
    def robot(self) -> RobotSpec:
        """Return the robot as specified, without what may be wrong with it."""
        return self.rig.robot

    @property
    def columns(self) -> tuple[str, ...]:
        """Return the output columns that the bench measures."""
        return self.rig.columns

    @property
    def limits(self) -> dict[str, tuple[float, float]]:
        """Return least and most of each input that the bench drives, in the unit of its column."""
        return dict(self.rig.limits.inputs)

    @property
    def hidden(self) -> Mapping[str, Any]:
        """What is wrong with a simulated robot, as `catheter-sim lab --reveal` writes it.

        Raises:
            InputError: the bench is real.
        """
        return self._simulated("hidden").answer()

    def play(self, inputs: Any, name: str, columns: Sequence[str] | str | None = None) -> Table:
        """Play inputs from rest, each row held until the robot rests, and return what was measured.

        Args:
            inputs: a file, a mapping or a data frame of input columns; without `time_s` rows are a second
                apart.
            name: of the play; the same name has the same readings, noise included.
            columns: outputs that are wanted; default: all that the bench measures.

        Returns:
            What was commanded and measured, in the units of the columns' names.

        Raises:
            InputError: the bench is real (`find_out` plays it), an unknown column, or beyond the limits; the
                message names the row.
        """
        rig = self._simulated("play")
        rig.reset()
        rig.play(clocked_table(inputs, "inputs"), str(name))
        return rig.read(None if columns is None else columns_of(columns))

    def find_out(
        self,
        path: str | os.PathLike[str],
        data: Dataset | None = None,
        experiments: int = 5,
        minutes: float = math.inf,
        wait_s: float = 0.0,
        jobs: int = 1,
        progress: bool | None = None,
    ) -> FoundOut:
        """Diagnose, propose an experiment, measure it, diagnose everything together, until a cause is sure.

        Args:
            path: folder of the loop's story, data, steps and last report; one that was begun is gone on with.
            data: recordings that there are already; default: the loops of each channel are played first.
            experiments: most that are made.
            minutes: most of the bench's time that is spent.
            wait_s: how long to wait for a real bench's recordings.
            jobs: processes to fit with.
            progress: show on standard error what is done; None: on a terminal, and in a notebook.

        Raises:
            InputError: the folder holds another loop, recordings of another robot or of other columns, or a
                number that cannot be.
        """
        from catheter_sim.closed_loop.loop import Budget, begun_with, run_loop
        from catheter_sim.closed_loop.story import write_story
        from catheter_sim.diagnosis.workers import Workers
        from catheter_sim.files import check_output_folder

        budget = Budget(
            whole_of(experiments, "experiments", "a whole number from 0", 0),
            number_of(minutes, "minutes", "a number from 0", lambda time: time >= 0.0),
            wait_s=number_of(wait_s, "wait_s", "a number from 0", lambda time: time >= 0.0),
        )
        place, shown = Workers(jobs_of(jobs)), progress_of(progress)
        first = begun_with(self.rig, data, "data") if data is not None else []
        folder = check_output_folder(path_of(path, "path"))
        outcome = run_loop(self.rig, folder, first, budget, place, shown)
        write_story(outcome, self.robot.name, folder)
        return FoundOut(outcome, self.robot.name, folder)

    def _simulated(self, what: str) -> SimulatedRig:
        from catheter_sim.lab.simulated import SimulatedRig as Simulated

        if not isinstance(self.rig, Simulated):
            raise InputError(f"{what}: a real bench hides nothing that is known, and is played by find_out")
        return self.rig

    def __repr__(self) -> str:
        from catheter_sim.lab.simulated import SimulatedRig as Simulated

        kind = "simulated" if isinstance(self.rig, Simulated) else "real"
        return f"<Laboratory: {kind} {self.robot.name}, measures {', '.join(self.columns)}>"


def laboratory(
    robot: RobotSpec | str | os.PathLike[str],
    hide: Sequence[str] | str = (),
    seed: int = 0,
    limits: Mapping[str, Sequence[float]] | None = None,
    columns: Sequence[str] | str = (),
    longest_s: float = 3600.0,
    recordings: str | os.PathLike[str] | None = None,
    gravity_mps2: Sequence[float] = (0.0, 0.0, 0.0),
) -> Laboratory:
    """Return a bench with a robot on it.

    A simulated one hides causes by laws that the diagnosis does not share, measures with a tracker's noise,
    and its specimen differs from the specification as a real one does. A real one is a folder in which
    recordings arrive.

    Args:
        robot: a robot, its id or its file; one that is none of a paper's needs `limits`.
        hide: of a simulated robot: causes, each "CAUSE", "CAUSE.FORM" or "CAUSE.FORM=SIZE" by the names of
            docs/truth/independent_bench.md, or "random". A size that is left out is drawn so that it shows.
        seed: of a simulated robot: of specimen, sizes and noise.
        limits: least and most of each input in the unit of its column; default: the robot's usual reach.
        columns: output columns that are measured; of a simulated bench, besides its own.
        longest_s: that one play may take [s].
        recordings: a real bench: the folder in which its recordings arrive. Needs `limits` and `columns`.
        gravity_mps2: of a real bench: in the base frame; a simulated one draws its own.

    Raises:
        InputError: unknown robot, cause, form or column, impossible limits, no such folder, or a real bench
            that hides something.

    Examples:
        >>> import catheter_sim as cs
        >>> bench = cs.laboratory("mitral_transseptal", hide="actuation_gain.common=20", seed=2)
        >>> bench.limits["advance_mm"]
        (0.0, 40.0)
        >>> [item["cause"] for item in bench.hidden["hidden"]]
        ['actuation_gain']
    """
    import numpy as np

    from catheter_sim.lab.recorded import recorded_rig
    from catheter_sim.lab.rig import AS_ARGUMENTS
    from catheter_sim.lab.simulated import stand_in

    held = os.fspath(robot) if isinstance(robot, str | os.PathLike) else robot_of(robot)
    given = limits_of(limits)
    hidden = texts_of(hide, "hide", "causes, as backlash.play=8,")
    wanted = tuple(texts_of(columns, "columns", "names of output columns"))
    seed = whole_of(seed, "seed", "a whole number from 0", 0)
    longest_s = number_of(longest_s, "longest_s", "a number above 0", lambda time: time > 0.0)
    if recordings is not None:
        if hidden:
            raise InputError("hide: a real bench (recordings) hides nothing that is known")
        if not wanted or not given:
            raise InputError("recordings: columns and limits are needed: what the bench measures and can do")
        folder = Path(path_of(recordings, "recordings"))
        gravity = gravity_of(gravity_mps2)
        return Laboratory(recorded_rig(folder, held, wanted, given, longest_s, gravity, AS_ARGUMENTS))
    if np.any(gravity_of(gravity_mps2)):
        raise InputError("gravity_mps2: of a real bench alone; a simulated one draws its own")
    rig = stand_in(held, hidden, seed, given or None, longest_s, further=wanted, said=AS_ARGUMENTS)
    return Laboratory(rig)


# ----------------------------------------------------------------------------------------------------
# A robot as one MJCF file that plain MuJoCo runs.


@dataclass(frozen=True, repr=False)
class Export:
    """A robot as MJCF that needs nothing beside it, and what was measured of it: see `export`.

    Attributes:
        model: the file's text, its controls, and how each cause is carried.
        judgement: distances from the package's own simulation, and costs of what is left out [mm].

    Examples:
        >>> import catheter_sim as cs
        >>> robot = cs.load_robot("notched_wrist")
        >>> exported = cs.export(robot)
        >>> exported.percent < 2.0
        True
        >>> print(exported.report().splitlines()[0])
        notched_wrist for mujoco
    """

    model: ExportedModel
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

    Examples:
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
