"""Diagnoses and comparisons of measured data, and what can be done with them."""

from __future__ import annotations

import html
import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from catheter_sim.diagnosis.thresholds import COMPARING_BUDGET_S
from catheter_sim.errors import InputError, unknown
from catheter_sim.public.data import Listing, budget_of, jobs_of, path_of, progress_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from catheter_sim.core.robot import RobotSpec
    from catheter_sim.diagnosis.result import Cause
    from catheter_sim.diagnosis.result import DiagnosisResult as Result
    from catheter_sim.diagnosis.trials import Dataset
    from catheter_sim.foreign.diagnose import ForeignDiagnosis

# ----------------------------------------------------------------------------------------------------
# What a simulation gets wrong, given measured data: the diagnosis, and what can be done with it.

_CALL = "cs.diagnose(...)"  # as the report's command


@dataclass(frozen=True, repr=False)
class Diagnosis:
    """What was found in one data set: see `diagnose`, which returns it.

    Attributes:
        result: every figure and series, with its evidence.

    Examples:
        >>> import catheter_sim as cs
        >>> import numpy as np
        >>> time_s, noise = np.arange(24.0), np.random.default_rng(1)
        >>> specimen = cs.load_robot("mitral_transseptal", {"effects.backlash.width_mm": 0.4})
        >>> def measured(most_mm):
        ...     pull = {"time_s": time_s, "displacement_bending_mm": most_mm * np.sin(0.42 * time_s)}
        ...     seen = cs.statics(specimen, pull, model="pk").to_table(["tip_x_mm", "tip_z_mm"])
        ...     return pull | {name: tip + noise.normal(0.0, 0.05, 24) for name, tip in seen.columns.items()}
        >>> data = cs.dataset("mitral_transseptal", [measured(most) for most in (1.8, 2.1, 2.4)])
        >>> found = cs.diagnose(data)
        >>> found
        <Diagnosis: cause_found (backlash)>
        >>> width = found.to_table()[0]
        >>> width["parameter"], round(width["value"], 2)
        ('width_mm', 0.4)
    """

    result: Result

    @property
    def verdict(self) -> str:
        """Return "cause_found", "improved", "no_discrepancy", "unexplained" or "data_suspect"."""
        return self.result.verdict

    @property
    def causes(self) -> tuple[Cause, ...]:
        """Return the causes, the most probable first; none unless the verdict is "cause_found"."""
        return self.result.causes

    @property
    def corrections(self) -> tuple[Cause, ...]:
        """Return what lowers the held-out error and is not established, the most probable first."""
        return self.result.corrections

    @property
    def sentence(self) -> str:
        """Return what was found, in a sentence or two."""
        from catheter_sim.diagnosis.report import sentence

        return sentence(self.result)

    @cached_property
    def document(self) -> Mapping[str, Any]:
        """The content of `diagnosis.json`."""
        from catheter_sim.diagnosis.document import to_json

        return to_json(self.result)

    @property
    def robot(self) -> RobotSpec:
        """Return the specification with calibration, causes and corrections in it."""
        return self.result.extended_robot

    def to_table(self) -> Listing:
        """Return a row for each parameter of each cause, with its 95 % interval; no cause: no row.

        Of the verdict "improved": of each correction.
        """
        first = "correction" if self.corrections and not self.causes else "cause"
        return parameter_listing(self.verdict, self.causes or self.corrections, first, "gain_percent")

    def to_dataframe(self) -> Any:
        """Return `to_table` as a pandas `DataFrame`.

        Raises:
            InputError: pandas is not installed.
        """
        return self.to_table().to_dataframe()

    def plot(self, trial: str | None = None, ax: Any = None) -> Figure:
        """Return a figure of a trial over time: measured, before (calibrated, without causes) and after.

        Args:
            trial: its name or file; default: the first that was held out.
            ax: axes of matplotlib to draw into, one an output and one for the error; None: a new figure.

        Raises:
            InputError: no such trial, or `ax` holds something else.
        """
        from catheter_sim.diagnosis.pictures import is_point, series_figure, shown_columns

        fits = [fit for fit in self.result.fits if trial in (None, fit.file)]
        if not fits:
            raise unknown("trial", str(trial), dict.fromkeys(fit.file for fit in self.result.fits))
        fit = next((fit for fit in fits if fit.role == "heldout"), fits[0])
        columns = shown_columns(self.result, [fit])
        return series_figure(fit, columns, is_point(columns), ax, f"{fit.file} ({fit.role})")

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the report to a folder, as `catheter-sim diagnose` does.

        Raises:
            InputError: the folder cannot be made or written.
        """
        from catheter_sim.diagnosis.pipeline import write_diagnosis
        from catheter_sim.files import check_output_folder

        write_diagnosis(self.result, check_output_folder(path_of(path, "save")))

    def __repr__(self) -> str:
        names = ", ".join(" or ".join(cause.one_of) for cause in self.causes)
        return f"<Diagnosis: {self.verdict}{f' ({names})' if names else ''}>"

    def _repr_html_(self) -> str:
        table = self.to_table()._repr_html_() if self.causes or self.corrections else ""
        return f"<p>{html.escape(self.sentence)}</p>{table}"


def diagnose(
    dataset: Dataset | str | os.PathLike[str],
    out: str | os.PathLike[str] | None = None,
    jobs: int = 1,
    budget_s: float = math.inf,
    progress: bool | None = None,
    search_anyway: bool = False,
) -> Diagnosis:
    """Say what a simulation gets wrong about measured data, name the cause and extend the model by it.

    Args:
        dataset: from `load_dataset` or `dataset`, or a folder.
        out: a folder for the report; default: nothing is written. With it, a run that was stopped goes on
            where it was when it is started again.
        jobs: processes to fit with.
        budget_s: time after which the search for causes ends with the best so far [s].
        progress: show on standard error what is done; None: on a terminal, and in a notebook.
        search_anyway: look for causes where too little was measured to name any, too. By default that ends
            the diagnosis at once, with the verdict "data_suspect". With it, `sentence` says what fits, and
            that it cannot be proved; no cause is named.

    Raises:
        InputError: the data are not what they must be, or the folder cannot be written.

    Examples:
        >>> import catheter_sim as cs
        >>> import numpy as np
        >>> time_s, noise = np.arange(24.0), np.random.default_rng(1)
        >>> def measured(most_mm):
        ...     pull = {"time_s": time_s, "displacement_bending_mm": most_mm * np.sin(0.42 * time_s)}
        ...     seen = cs.statics("mitral_transseptal", pull, model="pk").to_table(["tip_x_mm", "tip_z_mm"])
        ...     return pull | {name: tip + noise.normal(0.0, 0.05, 24) for name, tip in seen.columns.items()}
        >>> data = cs.dataset("mitral_transseptal", [measured(most) for most in (1.8, 2.1, 2.4)])
        >>> cs.diagnose(data, out="report").verdict
        'no_discrepancy'
        >>> from pathlib import Path
        >>> Path("report/report.html").exists()
        True
    """
    from catheter_sim.diagnosis.document import stamped
    from catheter_sim.diagnosis.pipeline import diagnose as diagnose_into
    from catheter_sim.diagnosis.pipeline import diagnose_dataset
    from catheter_sim.diagnosis.trials import Dataset as Data
    from catheter_sim.diagnosis.workers import Workers
    from catheter_sim.files import check_output_folder
    from catheter_sim.public.data import load_dataset

    jobs, budget_s, shown = jobs_of(jobs), budget_of(budget_s), progress_of(progress)
    folder = None if out is None else check_output_folder(path_of(out, "out"))
    data = dataset if isinstance(dataset, Data) else load_dataset(dataset)
    if folder is None:
        place = Workers(jobs)
        found = diagnose_dataset(data, place, shown, budget_s=budget_s, search_anyway=search_anyway)
        return Diagnosis(stamped(found, _CALL))
    return Diagnosis(
        diagnose_into(
            data, folder, jobs, shown, budget_s=budget_s, command=_CALL, search_anyway=search_anyway
        )
    )


def parameter_listing(verdict: str, causes: Sequence[Cause], first: str, last: str) -> Listing:
    """Return a row for each parameter of each cause: its name, value and 95 % interval.

    `first` heads the causes' names; `last` is the figure of a cause that ends each row, "gain_percent" or
    "probability".
    """
    rows = tuple(
        {
            first: cause.name,
            "parameter": name,
            "value": parameter.value,
            "low": parameter.ci95[0],
            "high": parameter.ci95[1],
            last: getattr(cause, last),
        }
        for cause in causes
        for name, parameter in cause.parameters.items()
    )
    columns = (first, "parameter", "value", "low", "high", last)
    return Listing(verdict.replace("_", " "), columns, rows)


# ----------------------------------------------------------------------------------------------------
# What changed between two recordings of one robot, and what can be done with it.

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from catheter_sim.core.robot import RobotSpec
    from catheter_sim.diagnosis.changes.compare import Changes as Compared
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


# ----------------------------------------------------------------------------------------------------
# What somebody else's MJCF gets wrong, given measured data.


@dataclass(frozen=True, repr=False)
class ModelDiagnosis:
    """What was found in recordings of a robot that an MJCF describes: see `diagnose_model`, which returns it.

    Attributes:
        result: the fits with what each leaves on held-out trials.

    Examples:
        >>> import catheter_sim as cs
        >>> from catheter_sim.resources import assets_folder
        >>> found = cs.diagnose_model(assets_folder() / "foreign" / "ur5e")
        >>> found.verdict, found.causes
        ('cause_found', ('backlash',))
        >>> round(found.numbers["width_shoulder_pan"], 2)
        0.04
    """

    result: ForeignDiagnosis

    @property
    def verdict(self) -> str:
        """What was found: "cause_found", "improved", "no_discrepancy" or "unexplained"."""
        return self.result.verdict

    @property
    def causes(self) -> tuple[str, ...]:
        """The causes that are named; none unless the verdict is "cause_found"."""
        return self.result.causes

    @property
    def numbers(self) -> dict[str, float]:
        """The best fit's numbers by name, in the units that stand there, else in SI or the file's own."""
        return {number.name: value for number, value in self.result.best.fit.values.items()}

    def to_dict(self) -> dict[str, Any]:
        """Return what stands in `diagnosis.json`."""
        from catheter_sim.foreign.diagnose import document
        from catheter_sim.foreign.extended import extended_text

        _, left = extended_text(self.result.data.model, self.result.corrected)
        return document(self.result, left)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the report to a folder, as `catheter-sim diagnose` does.

        Raises:
            InputError: the folder cannot be written.
        """
        from catheter_sim.foreign.diagnose import write_foreign

        write_foreign(self.result, path_of(path, "path"))

    def __repr__(self) -> str:
        """Return the verdict and the causes."""
        return f"<ModelDiagnosis {self.verdict}: {', '.join(self.causes) or 'nothing named'}>"


def diagnose_model(
    dataset: str | os.PathLike[str],
    out: str | os.PathLike[str] | None = None,
    jobs: int = 1,
    progress: bool | None = None,
) -> ModelDiagnosis:
    """Say what somebody's MJCF gets wrong about measured data: which generic cause, and how large.

    Gain, offset and play of actuators, delay, damping and dry friction of joints, stiffness of springs and
    servos, a payload, the tracker's frame.

    Args:
        dataset: a folder with `dataset.toml`, whose robot is an `.xml` and whose inputs are its controls.
        out: a folder for the report; default: nothing is written.
        jobs: simulations at a time.
        progress: show on standard error what is done; None: on a terminal, and in a notebook.

    Raises:
        InputError: the data or the model cannot be used, or the folder cannot be written.

    Examples:
        >>> import catheter_sim as cs
        >>> from catheter_sim.resources import assets_folder
        >>> cs.diagnose_model(assets_folder() / "foreign" / "ur5e", out="report")
        <ModelDiagnosis cause_found: backlash>
        >>> from pathlib import Path
        >>> Path("report/model.xml").exists()
        True
    """
    from catheter_sim.files import check_output_folder
    from catheter_sim.foreign.diagnose import diagnose_foreign

    jobs, shown = jobs_of(jobs), progress_of(progress)
    folder = path_of(dataset, "dataset")
    if out is not None:
        check_output_folder(path_of(out, "out"))
    found = ModelDiagnosis(diagnose_foreign(folder, jobs, shown))
    if out is not None:
        found.save(out)
    return found
