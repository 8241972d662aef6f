"""What a diagnosis returns, and how it is written to a folder.

`diagnosis.json` follows the project's contract; a number that is not finite becomes null there, and
`undefined` says why. Undefined never passes a check.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain, count
from pathlib import Path, PurePath
from typing import Any

from catheter_sim.diagnosis.trials import Dataset
from catheter_sim.errors import InputError
from catheter_sim.robots.catalogue import robot_toml
from catheter_sim.robots.kinds import Robot
from catheter_sim.tables import Array, Table, replaced_when_whole, write_table

CAUSE_FOUND, DATA_SUSPECT = "cause_found", "data_suspect"
VERDICTS = (CAUSE_FOUND, "no_discrepancy", "unexplained", DATA_SUSPECT)
NEXT_EXPERIMENT_FILE = "next_experiment.csv"
SIGNIFICANT = 0.01  # p-value of a test of residuals
_DIGITS = 6  # significant, in diagnosis.json
_LONGEST_NAME = 200  # of a trial, in the name of a file [bytes]; systems allow some 255 in all


@dataclass(frozen=True)
class FittedParameter:
    """A fitted number in the unit of its name, its 95 % interval, and the value that does nothing."""

    value: float
    ci95: tuple[float, float]
    null: float | None = None


@dataclass(frozen=True)
class Cause:
    """A named cause: an effect with its fitted parameters.

    Attributes:
        name: from the closed list of effects.
        parameters: by name, unit included ("width_mm").
        gain_percent: this cause's share of the held-out gain [% of the error before].
    """

    name: str
    parameters: Mapping[str, FittedParameter]
    gain_percent: float


@dataclass(frozen=True)
class Candidate:
    """A set of causes that was tried; () is the model with none.

    Attributes:
        causes: names of effects.
        heldout_rmse: on the held-out part, in the diagnosis's unit.
        cross_validated_rmse: inside the training part, by which the set was chosen.
    """

    causes: tuple[str, ...]
    heldout_rmse: float
    cross_validated_rmse: float


@dataclass(frozen=True)
class UnitResult:
    """Held-out figures over all outputs of one unit.

    Attributes:
        unit: "mm", "deg", "N" or "1".
        noise_floor: what no model can fall below, in that unit.
        rmse_before: of the calibrated model without causes.
        rmse_after: of the extended model.
        gain_percent: 100 (1 - after / before).
        gain_percent_ci95: in which the gain on as many other trials would lie, 95 %.
        chance: probability of as much gain on the held-out stretches where there is none.
    """

    unit: str
    noise_floor: float
    rmse_before: float
    rmse_after: float
    gain_percent: float
    gain_percent_ci95: tuple[float, float]
    chance: float = 0.0


@dataclass(frozen=True)
class Suspicion:
    """What looks wrong with the data themselves.

    Attributes:
        what: a sentence.
        where: file, or columns, that it is about; "": all of the data.
        rows: first and last row of the file, counted from 1, from which and to which; (): all.
    """

    what: str
    where: str = ""
    rows: tuple[int, ...] = ()

    @property
    def words(self) -> str:
        """Return it as one line."""
        return f"{self.where}: {self.what}" if self.where else self.what


@dataclass(frozen=True)
class TrialFit:
    """One trial, measured and computed, row by row.

    Attributes:
        file: the trial's file in the data set.
        role: "train" or "heldout".
        time_s: shape (r,) [s].
        measured: outputs as measured, in file units; NaN is missing.
        before: outputs of the calibrated model without causes.
        after: outputs of the extended model.
    """

    file: str
    role: str
    time_s: Array
    measured: Table
    before: Table
    after: Table


@dataclass(frozen=True)
class Separation:
    """By how much inputs tell two causes apart: root mean square, over the noise.

    Attributes:
        twin: between the chosen cause and the other one, fitted anew, in the analytic twin.
        simulation: between the two in the simulation; NaN if it was not asked.
    """

    twin: float
    simulation: float


@dataclass(frozen=True)
class NextExperiment:
    """What to measure next: in words, and as inputs to play, if that helps.

    Attributes:
        words: for a person.
        inputs: in file units; None: none helps.
        apart: what the inputs do to effects that these data cannot tell apart, by "rival for chosen".
    """

    words: str
    inputs: Table | None = None
    apart: Mapping[str, Separation] = field(default_factory=dict)


@dataclass(frozen=True)
class StructureTest:
    """What one test says of the residuals.

    Attributes:
        name: one of `structure.TESTS`.
        coordinate: on what the residuals hang most, of those that belong to the test; unit included.
        share_percent: of the residuals' mean square, in means along that coordinate [%], chance included.
        p_value: probability of as strong a dependence, of any coordinate of the test, if there is none.
    """

    name: str
    coordinate: str
    share_percent: float
    p_value: float

    @property
    def significant(self) -> bool:
        """Return whether the residuals hang on it (at `SIGNIFICANT`)."""
        return self.p_value <= SIGNIFICANT


@dataclass(frozen=True)
class Diagnosis:
    """The answer for one data set, with its evidence.

    Attributes:
        dataset: what was diagnosed.
        verdict: one of `VERDICTS`.
        unit: the unit reported first; where there are several, the worse-explained one.
        by_unit: figures of every unit; holds `unit`.
        causes: by their share of the gain; empty unless the verdict is "cause_found".
        ranking: every set of causes that was tried, best first; holds the one with none.
        indistinguishable: groups of names that explain these data equally well.
        next_experiment: what would tell them apart.
        extended_robot: the specification with calibration and causes in it.
        fits: every trial.
        notes: doubts and facts that a reader must know, a sentence each.
        extra: further figures by name, unit included ("tip_rmse_aligned_after_mm").
        calibrated: numbers of this specimen, by name, beside the specified ones (`null`).
        structure: tests of the residuals, by stage ("before", "after").
        suspicions: what looks wrong with the data; not empty where the verdict is "data_suspect".
        registration: how measured positions were moved into the base frame (`registration.document`).
        chosen_in_training: the causes chosen before the held-out data were looked at.
    """

    dataset: Dataset
    verdict: str
    unit: str
    by_unit: Mapping[str, UnitResult]
    causes: tuple[Cause, ...]
    ranking: tuple[Candidate, ...]
    indistinguishable: tuple[tuple[str, ...], ...]
    next_experiment: NextExperiment
    extended_robot: Robot
    fits: tuple[TrialFit, ...]
    notes: tuple[str, ...] = ()
    extra: Mapping[str, float] = field(default_factory=dict)
    calibrated: Mapping[str, FittedParameter] = field(default_factory=dict)
    structure: Mapping[str, tuple[StructureTest, ...]] = field(default_factory=dict)
    suspicions: tuple[Suspicion, ...] = ()
    registration: Mapping[str, Any] = field(default_factory=dict)
    chosen_in_training: tuple[str, ...] = ()

    @property
    def headline(self) -> UnitResult:
        """The figures of the unit that is reported first."""
        return self.by_unit[self.unit]


def to_json(diagnosis: Diagnosis) -> dict[str, Any]:
    """Return `diagnosis` as the document of `diagnosis.json`.

    Every number has six significant digits. One that is not finite is None, and its dotted key
    stands under `undefined` with the reason.
    """
    head = diagnosis.headline
    document: dict[str, Any] = {
        "dataset": diagnosis.dataset.name,
        "robot": diagnosis.dataset.robot_reference,
        "unit": diagnosis.unit,
        "verdict": diagnosis.verdict,
        "noise_floor": head.noise_floor,
        "heldout": _heldout(head),
        "causes": [
            {
                "name": cause.name,
                "parameters": _parameters(cause.parameters),
                "gain_percent": cause.gain_percent,
            }
            for cause in diagnosis.causes
        ],
        "ranking": [
            {
                "causes": list(candidate.causes),
                "heldout_rmse": candidate.heldout_rmse,
                "cross_validated_rmse": candidate.cross_validated_rmse,
            }
            for candidate in diagnosis.ranking
        ],
        "indistinguishable": [list(group) for group in diagnosis.indistinguishable],
        "suspicions": [
            {"what": item.what, "where": item.where, "rows": list(item.rows)} for item in diagnosis.suspicions
        ],
        "registration": dict(diagnosis.registration),
        "next_experiment": diagnosis.next_experiment.words,
        "next_experiment_inputs": NEXT_EXPERIMENT_FILE if diagnosis.next_experiment.inputs else None,
        "next_experiment_over_noise": {
            name: {"twin": item.twin, "simulation": item.simulation}
            for name, item in diagnosis.next_experiment.apart.items()
        },
        "by_unit": {
            unit: {"noise_floor": result.noise_floor, **_heldout(result)}
            for unit, result in diagnosis.by_unit.items()
        },
        "notes": list(diagnosis.notes),
        "extra": dict(diagnosis.extra),
        "calibrated": _parameters(diagnosis.calibrated),
        "residual_tests": {
            stage: [
                {
                    "test": test.name,
                    "coordinate": test.coordinate,
                    "share_percent": test.share_percent,
                    "p_value": test.p_value,
                }
                for test in tests
            ]
            for stage, tests in diagnosis.structure.items()
        },
    }
    undefined: dict[str, str] = {}
    finite: dict[str, Any] = _finite(document, "", undefined)
    if undefined:
        finite["undefined"] = undefined
    return finite


def write_results(diagnosis: Diagnosis, folder: str | os.PathLike[str], model_xml: str) -> tuple[Path, ...]:
    """Write everything that a diagnosis leaves into `folder`, made if need be; return the files.

    Each file is written whole or not at all, and `diagnosis.json` last, so that a folder with one
    is complete.

    Args:
        diagnosis: what was found.
        folder: where to; files of an earlier diagnosis are replaced.
        model_xml: the extended robot as MJCF.

    Raises:
        InputError: the folder cannot be made or written.
    """
    # Here, since these two import this module.
    from catheter_sim.diagnosis.pictures import figures
    from catheter_sim.diagnosis.report import report_html

    target = Path(folder)
    try:
        target.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{target}: cannot be made: {error.strerror or error}") from None
    written: list[Path] = []

    def put(name: str, content: str | bytes) -> None:
        with replaced_when_whole(target / name, binary=isinstance(content, bytes)) as file:
            file.write(content)
        written.append(target / name)

    pictures = figures(diagnosis)
    put("robot.toml", robot_toml(diagnosis.extended_robot))
    put("model.xml", model_xml)
    for fit, name in zip(diagnosis.fits, fit_files(diagnosis.fits), strict=True):
        write_table(fit_table(fit), target / name)
        written.append(target / name)
    if diagnosis.next_experiment.inputs is not None:
        write_table(diagnosis.next_experiment.inputs, target / NEXT_EXPERIMENT_FILE)
        written.append(target / NEXT_EXPERIMENT_FILE)
    for picture in pictures:
        put(f"{picture.name}.png", picture.png)
    put("report.html", report_html(diagnosis, pictures))
    put("diagnosis.json", json.dumps(to_json(diagnosis), indent=1, allow_nan=False) + "\n")
    return tuple(written)


def fit_files(fits: Sequence[TrialFit]) -> tuple[str, ...]:
    """Return the names of the CSV files that hold the fitted series of trials, no two alike.

    `fitted_<role>_<trial>.csv`: the trial's file without its ending, its folders before it with `_` between
    (`a/t.csv` held out: `fitted_heldout_a_t.csv`). Where two trials would still have one name, on a system
    that takes capitals for small letters too, those that `dataset.toml` lists later get `_2`, `_3` ….
    """
    names: list[str] = []
    for fit in fits:
        path = PurePath(fit.file)
        parts = [part for part in (*path.parent.parts, path.stem) if part not in (path.anchor, "..")]
        trial = "_".join(parts)
        while len(os.fsencode(trial)) > _LONGEST_NAME:
            trial = trial[1:]
        name = "_".join(("fitted", *filter(None, [fit.role]), trial))
        taken = {other.lower() for other in names}
        numbers = (f"{name}_{number}" for number in count(2))
        names.append(next(item for item in chain([name], numbers) if item.lower() not in taken))
    return tuple(f"{name}.csv" for name in names)


def fit_table(fit: TrialFit) -> Table:
    """Return measured, before and after side by side; columns `<output>`, `before_...`, `after_...`."""
    columns = dict(fit.measured.columns)
    for prefix, table in (("before", fit.before), ("after", fit.after)):
        columns |= {f"{prefix}_{name}": table.columns[name] for name in fit.measured.columns}
    return Table(fit.time_s, columns, fit.file)


def _parameters(parameters: Mapping[str, FittedParameter]) -> dict[str, Any]:
    return {name: {"value": item.value, "ci95": list(item.ci95)} for name, item in parameters.items()}


def _heldout(result: UnitResult) -> dict[str, Any]:
    return {
        "rmse_before": result.rmse_before,
        "rmse_after": result.rmse_after,
        "gain_percent": result.gain_percent,
        "gain_percent_ci95": list(result.gain_percent_ci95),
    }


def _finite(value: Any, key: str, undefined: dict[str, str]) -> Any:
    """Return `value` with its numbers rounded; note in `undefined` those that are not finite."""
    if isinstance(value, Mapping):
        return {
            name: _finite(item, f"{key}.{name}" if key else name, undefined) for name, item in value.items()
        }
    if isinstance(value, list):
        return [_finite(item, f"{key}.{index}", undefined) for index, item in enumerate(value)]
    if isinstance(value, bool) or value is None or isinstance(value, str | int):
        return value
    number = float(value)
    if not math.isfinite(number):
        undefined[key] = (
            "no value could be computed from these data" if math.isnan(number) else "infinite: not bounded"
        )
        return None
    return float(f"{number:.{_DIGITS}g}")
