"""What a diagnosis returns, as values: verdict, causes, figures by unit, the next experiment."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.notes import Note
from catheter_sim.diagnosis.thresholds import SIGNIFICANT_P
from catheter_sim.diagnosis.trials import Dataset
from catheter_sim.tables import Table

# ----------------------------------------------------------------------------------------------------
# What to measure next, as a value.

NEXT_EXPERIMENT_FILE = "next_experiment.csv"


@dataclass(frozen=True)
class Separation:
    """How well inputs tell two causes apart: root mean square of their difference over the noise.

    `twin` is between the chosen cause and the other one, refitted, in the analytic twin; `simulation` between
    the two in the simulation, NaN if it was not asked.
    """

    twin: float
    simulation: float


@dataclass(frozen=True)
class NextExperiment:
    """What to measure next: in words, and as inputs to play, if that helps.

    `inputs` are in file units, None where none helps; `apart` says what they do to effects that these data
    cannot tell apart, by "rival for chosen".
    """

    words: str
    inputs: Table | None = None
    apart: Mapping[str, Separation] = field(default_factory=dict)


# ----------------------------------------------------------------------------------------------------
# What a diagnosis returns: values, and nothing that writes them.

VERDICTS = ("cause_found", "improved", "no_discrepancy", "unexplained", "data_suspect")
CAUSE_FOUND, IMPROVED, NO_DISCREPANCY, UNEXPLAINED, DATA_SUSPECT = VERDICTS
NONE, OUTSIDE = "none", "outside"  # beside the causes' names: no cause, and something outside the list


@dataclass(frozen=True)
class FittedParameter:
    """A fitted number in the unit of its name, its 95 % interval, and the value that does nothing."""

    value: float
    ci95: tuple[float, float]
    null: float | None = None


@dataclass(frozen=True)
class Cause:
    """A cause or a correction: an effect with its fitted parameters.

    Attributes:
        name: from the closed list of effects.
        parameters: by name, unit included ("width_mm").
        gain_percent: this cause's share of the held-out gain [% of the error before].
        form: in which of its forms it acts.
        forms_as_good: others of its forms that explain the training data as well.
        probability: that it is at work, or of a group that one of its members is; NaN: not worked out.
        plausible: False where one of its numbers stands at a bound or beyond what its specification makes
            likely.
        members: of a group of causes that these data cannot tell apart: the probability of each by name, the
            likeliest first; its parameters are those of `name`. Empty: it stands alone.
    """

    name: str
    parameters: Mapping[str, FittedParameter]
    gain_percent: float
    form: str = ""
    forms_as_good: tuple[str, ...] = ()
    probability: float = float("nan")
    plausible: bool = True
    members: Mapping[str, float] = field(default_factory=dict)

    @property
    def one_of(self) -> tuple[str, ...]:
        """Names of the group, the likeliest first; the cause's own where it stands alone."""
        return tuple(self.members) or (self.name,)


@dataclass(frozen=True)
class Candidate:
    """A set of causes that was tried; () is the model with none.

    `heldout_rmse` is in the diagnosis's unit; by `cross_validated_rmse`, inside the training part, the set
    was chosen.
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
class Remainder:
    """What the reported model leaves of one unit's error.

    `times_noise` is the held-out root mean square error over the noise floor; `structure`, names of the tests
    (`structure.TESTS`) that find it to depend on something, strongest first.
    """

    times_noise: float
    structure: tuple[str, ...]


@dataclass(frozen=True)
class DataFault:
    """What looks wrong with the data themselves.

    Attributes:
        what: a sentence.
        where: file, or columns, that it is about; "": all of the data.
        rows: first and last row of the file, counted from 1, from which and to which; (): all.
        is_lack: too little was measured; nothing is wrong with what was.
    """

    what: str
    where: str = ""
    rows: tuple[int, ...] = ()
    is_lack: bool = False

    @property
    def words(self) -> str:
        """Return it as one line."""
        return f"{self.where}: {self.what}" if self.where else self.what


@dataclass(frozen=True)
class Unproved:
    """What fits data that hold too little to name a cause.

    Attributes:
        causes: with their parameters.
        times_noise: root mean square error over the noise, the largest of any unit in training and held-out
            data.
        by_unit: held-out figures.
    """

    causes: tuple[Cause, ...]
    times_noise: float
    by_unit: Mapping[str, UnitResult]


@dataclass(frozen=True)
class Centrelines:
    """Where a robot is in some rows of a trial, computed, as it would be measured.

    Attributes:
        rows: of the trial, counted from 0, rising, shape (k,).
        points: the base ("body_0"), the elements base to tip ("body_1" ...), and the markers measured.
        before: of the calibrated model without causes, shape (k, p, 3) [mm]; NaN of a row without balance.
        after: of the extended model.
    """

    rows: np.ndarray
    points: tuple[str, ...]
    before: Array
    after: Array


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
        shapes: where the robot is; None: it was not computed.
    """

    file: str
    role: str
    time_s: Array
    measured: Table
    before: Table
    after: Table
    shapes: Centrelines | None = None


@dataclass(frozen=True)
class Floor:
    """What a flexible model of the inputs and their history leaves on held-out data.

    Attributes:
        rmse: by unit, each output by itself, on top of the reported model.
        chance: by unit, probability of as much gain over the reported model where there is none.
        tip_mm: the tip's distance in space, root mean square [mm]; None where it was not measured.
    """

    rmse: Mapping[str, float] = field(default_factory=dict)
    chance: Mapping[str, float] = field(default_factory=dict)
    tip_mm: float | None = None

    def gains(self, unit: str) -> bool:
        """Return whether the model learned something that holds on held-out data."""
        return self.chance.get(unit, 1.0) <= SIGNIFICANT_P


@dataclass(frozen=True)
class StructureTest:
    """What one test says of the residuals.

    Attributes:
        name: one of `structure.TESTS`.
        coordinate: on what the residuals depend most, of the test's coordinates; unit included.
        share_percent: of the residuals' mean square, in means along that coordinate [%], chance included.
        p_value: probability of as strong a dependence, of any coordinate of the test, if there is none.
    """

    name: str
    coordinate: str
    share_percent: float
    p_value: float

    @property
    def significant(self) -> bool:
        """Return whether the residuals depend on it (p-value at most `SIGNIFICANT_P`)."""
        return self.p_value <= SIGNIFICANT_P


@dataclass(frozen=True)
class Provenance:
    """Where a report comes from: package version, time in UTC, command, SHA-256 of the data; "": unknown."""

    version: str = ""
    made: str = ""
    command: str = ""
    data_digest: str = ""


@dataclass(frozen=True)
class DiagnosisResult:
    """The answer for one data set, with its evidence.

    Attributes:
        dataset: what was diagnosed.
        verdict: one of `VERDICTS`.
        unit: the unit reported first; where there are several, the worse-explained one.
        by_unit: figures of every unit; holds `unit`.
        causes: established ones, with a probability of at least `ESTABLISHED`, the most probable first; empty
            unless the verdict is "cause_found".
        ranking: every set of causes that was tried, best first; holds the one with none.
        indistinguishable: groups of names that explain these data equally well, of causes and corrections.
        next_experiment: what would tell them apart.
        extended_robot: the specification with calibration and causes in it.
        fits: every trial.
        notes: doubts and facts that a reader must know.
        extra: further figures by name, unit included ("tip_rmse_aligned_after_mm").
        calibrated: numbers of this specimen, by name, beside the specified ones (`null`).
        structure: tests of the residuals, by stage ("before", "after").
        data_faults: what looks wrong with the data; not empty where the verdict is "data_suspect".
        registration: how measured positions were moved into the base frame (`registration.document`).
        chosen_in_training: the causes chosen before the held-out data were looked at.
        absorbs: causes whose numbers are not plausible: by them the fit soaks up what is missing.
        corrections: of the verdicts "cause_found" and "improved": what lowers the held-out error beside the
            causes and is not established, the most probable first.
        provenance: version, time, command and data; empty where nobody said.
        probabilities: that each cause is at work, by name, and "none" and "outside"
            (`diagnosis.probabilities`).
        evidence: what they were worked out from.
        residual: what the reported model leaves, by unit.
        repeatability: by unit, root mean square difference of rows at the same commands and history, over
            sqrt(2); empty where nothing was repeated.
        resolution: step of the readings, by unit that shows one.
        unproved: what fits, where too little was measured and a search was asked for all the same.
        floor: what a flexible model of the inputs leaves.
    """

    dataset: Dataset
    verdict: str
    unit: str
    by_unit: Mapping[str, UnitResult]
    causes: tuple[Cause, ...]
    ranking: tuple[Candidate, ...]
    indistinguishable: tuple[tuple[str, ...], ...]
    next_experiment: NextExperiment
    extended_robot: RobotSpec
    fits: tuple[TrialFit, ...]
    notes: tuple[Note, ...] = ()
    extra: Mapping[str, float] = field(default_factory=dict)
    calibrated: Mapping[str, FittedParameter] = field(default_factory=dict)
    structure: Mapping[str, tuple[StructureTest, ...]] = field(default_factory=dict)
    data_faults: tuple[DataFault, ...] = ()
    registration: Mapping[str, Any] = field(default_factory=dict)
    chosen_in_training: tuple[str, ...] = ()
    absorbs: tuple[Cause, ...] = ()
    probabilities: Mapping[str, float] = field(default_factory=dict)
    evidence: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    residual: Mapping[str, Remainder] = field(default_factory=dict)
    corrections: tuple[Cause, ...] = ()
    repeatability: Mapping[str, float] = field(default_factory=dict)
    resolution: Mapping[str, float] = field(default_factory=dict)
    unproved: Unproved | None = None
    floor: Floor = Floor()
    provenance: Provenance = Provenance()

    @property
    def is_corrected(self) -> bool:
        """Whether the extended robot holds causes or corrections."""
        return self.verdict in (CAUSE_FOUND, IMPROVED)

    @property
    def headline(self) -> UnitResult:
        """The figures of the unit that is reported first."""
        return self.by_unit[self.unit]

    @property
    def was_fitted(self) -> bool:
        """Return whether any model was fitted, so that there are errors to tell."""
        return not math.isnan(self.headline.rmse_before)

    @property
    def has_too_little(self) -> bool:
        """Return whether no cause is named since too little was measured."""
        return bool(self.data_faults) and all(item.is_lack for item in self.data_faults)

    @property
    def shown(self) -> UnitResult:
        """The figures that a page shows first: the headline's, unless the correction gains nothing there.

        A scale of torsion alone leaves positions as they were: then those of the unit that gains most.
        """
        head = self.headline
        if not self.is_corrected or head.gain_percent_ci95[0] > 0.0:
            return head
        best = max(self.by_unit.values(), key=lambda result: result.gain_percent_ci95[0])
        return best if best.gain_percent_ci95[0] > 0.0 else head
