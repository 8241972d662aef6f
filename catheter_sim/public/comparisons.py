"""What changed between two recordings of one robot, and what can be done with it."""

from __future__ import annotations

import html
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from catheter_sim.diagnosis.thresholds import COMPARING_BUDGET_S
from catheter_sim.errors import InputError
from catheter_sim.public.arguments import budget_of, jobs_of, path_of, progress_of
from catheter_sim.public.diagnoses import Diagnosis, parameter_listing
from catheter_sim.public.listing import Listing

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from catheter_sim.core.robot import RobotSpec
    from catheter_sim.diagnosis.changes.compare import Comparison as Compared
    from catheter_sim.diagnosis.changes.series import Series
    from catheter_sim.diagnosis.result import Cause
    from catheter_sim.diagnosis.trials import Dataset

    Recording = Dataset | str | os.PathLike[str]


@dataclass(frozen=True, repr=False)
class Comparison:
    """What changed between two recordings: see `compare`, which returns it.

    Attributes:
        result: every figure and series, with its evidence.
        over_time: the recordings of which it compares the last with the first; None: there were two.

    Examples:
        >>> import catheter_sim as cs
        >>> import numpy as np
        >>> time_s, noise = np.arange(24.0), np.random.default_rng(2)
        >>> def recording(width_mm):
        ...     robot = cs.load_robot("mitral_transseptal", {"effects.backlash.width_mm": width_mm})
        ...     trials = []
        ...     for most_mm in (1.8, 2.1, 2.4):
        ...         pull = {"time_s": time_s, "displacement_bending_mm": most_mm * np.sin(0.42 * time_s)}
        ...         seen = cs.statics(robot, pull, model="pk").to_table(["tip_x_mm", "tip_z_mm"])
        ...         noisy = {name: tip + noise.normal(0.0, 0.05, 24) for name, tip in seen.columns.items()}
        ...         trials.append(pull | noisy)
        ...     return cs.dataset("mitral_transseptal", trials)
        >>> found = cs.compare(recording(0.1), recording(0.6))
        >>> found.verdict, [change.name for change in found.changes]
        ('changed', ['backlash'])
        >>> round(found.to_table()[0]["value"], 1)
        0.5
    """

    result: Compared
    over_time: Series | None = None

    @property
    def verdict(self) -> str:
        """Return "changed", "unchanged", "unexplained" or "data_suspect"."""
        return self.result.verdict

    @property
    def changes(self) -> tuple[Cause, ...]:
        """Return what changed, the most probable first; none unless the verdict is "changed"."""
        return self.result.changes

    @property
    def sentence(self) -> str:
        """Return what was found, in a sentence or two."""
        from catheter_sim.diagnosis.changes.report import comparison_sentence

        return comparison_sentence(self.result)

    @cached_property
    def document(self) -> Mapping[str, Any]:
        """The content of `diagnosis.json`."""
        from catheter_sim.diagnosis.changes.report import comparison_document

        return comparison_document(self.result, self.over_time)

    @property
    def robot(self) -> RobotSpec:
        """Return the later recording's robot: the earlier one's with the changes in it."""
        return self.result.diagnosis.extended_robot

    def to_table(self) -> Listing:
        """Return a row for each parameter of each change, with its 95 % interval; no change: no row."""
        return parameter_listing(self.verdict, self.changes, "change", "probability")

    def series(self) -> Listing:
        """Return a row for each number that changed in each recording, with how it went; of two: no row.

        The course is "steady", "step after" a recording, "drift", "step or drift" where these cannot be told
        apart, or "irregular".
        """
        from catheter_sim.diagnosis.changes.report import COLUMNS, series_rows

        rows = () if self.over_time is None else tuple(series_rows(self.over_time))
        return Listing("series", COLUMNS, rows)

    def plot_series(self, ax: Any = None) -> Figure:
        """Return a figure of each number that changed over the recordings.

        Args:
            ax: axes of matplotlib to draw into, two in a row (one number: one); None: a new figure.

        Raises:
            InputError: there were only two recordings, or `ax` holds something else.
        """
        from catheter_sim.diagnosis.changes.report import series_figure

        if self.over_time is None:
            raise InputError("plot_series: there are only two recordings; compare([A, B], C) gives a series")
        return series_figure(self.over_time, ax)

    def to_dataframe(self) -> Any:
        """Return `to_table` as a pandas `DataFrame`.

        Raises:
            InputError: pandas is not installed.
        """
        return self.to_table().to_dataframe()

    def plot(self, trial: str | None = None, ax: Any = None) -> Figure:
        """Return a figure of a trial of the later recording, without what both share.

        Args:
            trial: its name or file; default: the first that was held out.
            ax: axes of matplotlib to draw into, one an output and one for the error; None: a new figure.

        Raises:
            InputError: no such trial, or `ax` holds something else.
        """
        return Diagnosis(self.result.diagnosis).plot(trial, ax)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the report to a folder, as `catheter-sim diagnose --since` does.

        Raises:
            InputError: the folder cannot be made or written.
        """
        from catheter_sim.diagnosis.changes.report import write_comparison
        from catheter_sim.files import check_output_folder

        write_comparison(self.result, check_output_folder(path_of(path, "save")), self.over_time)

    def __repr__(self) -> str:
        names = ", ".join(" or ".join(cause.one_of) for cause in self.changes)
        return f"<Comparison: {self.verdict}{f' ({names})' if names else ''}>"

    def _repr_html_(self) -> str:
        table = self.to_table()._repr_html_() if self.changes else ""
        return f"<p>{html.escape(self.sentence)}</p>{table}"


def compare(
    before: Recording | Sequence[Recording],
    after: Dataset | str | os.PathLike[str],
    out: str | os.PathLike[str] | None = None,
    jobs: int = 1,
    budget_s: float = COMPARING_BUDGET_S,
    progress: bool | None = None,
    search_anyway: bool = False,
) -> Comparison:
    """Say what changed between two data sets of one robot.

    What both share, named or not, is taken out: at rows with the same command and the same way to it by their
    difference, elsewhere by what explains the earlier recording. Only what is left is explained by causes.

    Args:
        before: the earlier recording: from `load_dataset` or `dataset`, a folder, or the folder of its
            finished report. A list of them: a series, the first one first. Each later one is compared with
            the first; what is returned is of the last, and its `series` has every number over all of them.
        after: the later one.
        out: a folder for the report; default: nothing is written.
        jobs: processes to fit with.
        budget_s: time after which the search for causes ends with the best so far [s].
        progress: show on standard error what is done; None: on a terminal, and in a notebook.
        search_anyway: look for changes where too little was measured to name any, too (as of `diagnose`).

    Raises:
        InputError: the data are not what they must be or not of one robot, or the folder cannot be written.

    Examples:
        >>> import catheter_sim as cs
        >>> import numpy as np
        >>> time_s, noise = np.arange(24.0), np.random.default_rng(1)
        >>> def recording(width_mm):
        ...     robot = cs.load_robot("mitral_transseptal", {"effects.backlash.width_mm": width_mm})
        ...     trials = []
        ...     for most_mm in (1.8, 2.1, 2.4):
        ...         pull = {"time_s": time_s, "displacement_bending_mm": most_mm * np.sin(0.42 * time_s)}
        ...         seen = cs.statics(robot, pull, model="pk").to_table(["tip_x_mm", "tip_z_mm"])
        ...         noisy = {name: tip + noise.normal(0.0, 0.05, 24) for name, tip in seen.columns.items()}
        ...         trials.append(pull | noisy)
        ...     return cs.dataset("mitral_transseptal", trials)
        >>> cs.compare(recording(0.2), recording(0.6))
        <Comparison: changed (backlash)>
        >>> cs.compare(recording(0.2), recording(0.2)).verdict
        'unchanged'
    """
    from catheter_sim.diagnosis.changes.compare import earlier_recording
    from catheter_sim.diagnosis.changes.series import compare_series
    from catheter_sim.diagnosis.document import stamped
    from catheter_sim.diagnosis.trials import Dataset as Data
    from catheter_sim.diagnosis.workers import Workers
    from catheter_sim.files import check_output_folder
    from catheter_sim.public.data import load_dataset

    place, budget_s, shown = Workers(jobs_of(jobs)), budget_of(budget_s), progress_of(progress)
    folder = None if out is None else check_output_folder(path_of(out, "out"))
    later = after if isinstance(after, Data) else load_dataset(after)
    given = [before] if isinstance(before, Data | str | os.PathLike) else list(before)
    earlier = [
        earlier_recording(item if isinstance(item, Data) else Path(path_of(item, "before")), later)
        for item in given
    ]
    series = compare_series(earlier, later, place, shown, budget_s=budget_s, search_anyway=search_anyway)
    last = replace(series.last, diagnosis=stamped(series.last.diagnosis, "cs.compare(...)"))
    found = Comparison(last, series if len(earlier) > 1 else None)
    if folder is not None:
        found.save(folder)
    return found
