"""One check is one line: ours, what it is compared with, error, tolerance, source; and inputs for checks."""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.posture import Posture
from catheter_sim.tables import replaced_when_whole

# ----------------------------------------------------------------------------------------------------
# What the validation's pictures show, as values: the checks make them, `plots` draws them.


@dataclass(frozen=True)
class Against:
    """One history with friction, answered by the simulation, the complete statics, and a rule on tensions."""

    name: str
    rows_N: Array
    simulated: tuple[Posture, ...]
    analytic: tuple[Posture, ...]
    by_tensions: tuple[Posture, ...]


@dataclass(frozen=True)
class TermCurves:
    """The answers of every balance to the same tensions.

    Attributes:
        weight: "without weight" or "hanging".
        balances: name -> joint angles at `chest_tube_terms.TENSIONS_N`, shape (r, n) [deg].
        tips_mm: name -> tips at `chest_tube_terms.TENSIONS_N`, shape (r, 3) [mm].
        complete, simulated: joint angles at `chest_tube_terms.TENSIONS_N` and at
            `SIMULATED_N` [deg].
        complete_tips_mm: tips by the complete balance at `chest_tube_terms.TENSIONS_N`, shape (r, 3) [mm].
    """

    weight: str
    balances: dict[str, Array]
    tips_mm: dict[str, Array]
    complete: Array
    simulated: Array
    complete_tips_mm: Array


@dataclass(frozen=True)
class Loop:
    """One loop of the section, answered by the simulation and the static models."""

    name: str
    rows_N: Array
    simulated: tuple[Posture, ...]
    analytic: tuple[Posture, ...]
    local: tuple[Posture, ...]
    printed: tuple[Posture, ...]


@dataclass(frozen=True)
class Profiles:
    """Tension along the right tendon at three inputs, in arching and extending, and PCCA's."""

    inputs_N: tuple[float, ...]
    arching: Array
    extending: Array
    analytic_arching: Array
    analytic_extending: Array
    constant: Array


@dataclass(frozen=True)
class ValidatedMotion:
    """A simulated motion and what the models say of it.

    Attributes:
        time_s: shape (r,).
        tip_mm: simulated, shape (r, 3).
        model_mm: by name, shape (r, 3) each.
    """

    time_s: Array
    tip_mm: Array
    model_mm: dict[str, Array]

    def rmse_mm(self, model: str) -> Array:
        """Return a model's root mean square error in x, y, z and in space, shape (4,) [mm]."""
        squared = ((self.model_mm[model] - self.tip_mm) ** 2).mean(axis=0)
        return np.sqrt(np.append(squared, squared.sum()))


# ----------------------------------------------------------------------------------------------------
# One check is one line: ours, what it is compared with, the error, the tolerance, the source.

_COLUMNS = (
    "quantity", "unit", "ours", "analytic", "published", "error", "tolerance", "about", "kind", "verdict",
    "source",
)  # fmt: skip

# What a figure of ours is worth beside the one that it is compared with. Only what is verified or predicted
# is judged.
IMPLEMENTED = "implemented"  # equations and inputs of the paper, coded: nothing is compared
VERIFIED = "verified"  # two models that share no code, or a model and a closed form, against each other
PREDICTED = "predicted"  # a printed or measured figure or claim, by a model that knows nothing of it
FITTED = "fitted to it"  # numbers of the model were chosen so that it comes out
READ_BACK = "read back"  # it went in, or follows from what went in, and comes out again
ASSUMED = "assumed"  # it rests on a number that nobody prints, and another as good gives another figure
MISSED = "not reproduced"  # ours lies elsewhere, and why is not known: neither is shown to be wrong
REFUTED = "refuted"  # ours, or theirs, is shown to be wrong: the findings say which
OUT_OF_REACH = "out of reach"  # what would make it comparable is not printed or not modelled: `source` says
KINDS = (IMPLEMENTED, VERIFIED, PREDICTED, FITTED, READ_BACK, ASSUMED, MISSED, REFUTED, OUT_OF_REACH)
JUDGED = (VERIFIED, PREDICTED)


@dataclass(frozen=True)
class Line:
    """One line of the validation table.

    Attributes:
        robot: robot id.
        quantity: what is compared, with the condition.
        unit: of `ours`, `analytic`, `published`, `error` and `tolerance`.
        ours: the simulation's figure, None where the line compares whole histories.
        analytic: the static model's or reference solver's figure, None where there is none.
        published: the figure that the paper prints, None where it prints none.
        kind: what our figure is worth, of `KINDS`.
        error: what is judged, in `unit`; largest deviation where whole histories are compared.
        tolerance: the error allowed, None where the line only informs.
        source: where the compared figure comes from.
        said: what the paper says in words where it prints no figure.

    Raises:
        ValueError: an unknown kind, a tolerance for a figure that is neither verified nor predicted, or a
            prediction of nothing that is printed or measured.
    """

    robot: str
    quantity: str
    unit: str
    error: float
    tolerance: float | None
    source: str
    ours: float | None = None
    analytic: float | None = None
    published: float | None = None
    kind: str = VERIFIED
    said: str = ""

    def __post_init__(self) -> None:
        """Check that the kind is one that the line's figures bear out."""
        if self.kind not in KINDS:
            raise ValueError(f"{self.quantity}: kind {self.kind!r}; choices: {', '.join(KINDS)}")
        if self.kind not in JUDGED and self.tolerance is not None:
            raise ValueError(f"{self.quantity}: {self.kind}, so not to be judged")
        if self.kind == PREDICTED and self.published is None and not self.said:
            raise ValueError(f"{self.quantity}: predicted, and nothing printed or measured stands beside it")

    @property
    def passed(self) -> bool:
        """Return whether the error is a number within the tolerance; lines that only inform pass."""
        return self.tolerance is None or (math.isfinite(self.error) and self.error <= self.tolerance)

    @property
    def verdict(self) -> str:
        """Return "ok", "OUT" or "for information"."""
        if self.tolerance is None:
            return "for information"
        return "ok" if self.passed else "OUT"

    @property
    def about(self) -> str:
        """Return the constant that a judged line is about and whose it is: "simulation: stiffness".

        `scripts/perturb_validation.py` makes it wrong by a tenth to both sides. "-" where nothing is judged.
        """
        return "-" if self.tolerance is None else constant_of(self.robot, self.quantity)


# The constant that a judged line is about: whose robot, and which of its numbers. The first row whose robot
# and part of the quantity fit counts; "" fits all. `gain` is that of the inputs, as a moment arm's would be.
_CONSTANTS: tuple[tuple[str, str, str], ...] = (
    ("", "solver times", "times: order"),
    ("neuroendoscope_section", "loop area", "simulation: friction"),
    ("neuroendoscope_section", "loop, simulation: times that", "simulation: friction"),
    ("neuroendoscope_section", "loop, fkm_sliding: times that", "fkm_sliding: friction"),
    ("neuroendoscope_section", "profiles at B and C", "simulation: friction"),
    ("neuroendoscope_section", "on the way back", "simulation: gain"),
    ("neuroendoscope_section", "fkm_exact_arm: tip", "fkm_exact_arm: stiffness"),
    ("chest_tube_section", "complete: tip", "complete: stiffness"),
    ("chest_tube_section", "missing terms", "printed: stiffness"),
    ("chest_tube_section", "in a tube of EI 1 N m^2", "simulation: length"),
    ("chest_tube_section", "friction, elastic constant and clearance", "simulation: friction"),
    ("chest_tube_section", "error of the true shape", "simulation: length"),
    ("chest_tube_section", "stiffness x0.01", "simulation: friction"),
    ("chest_tube", "simulation: times that", "simulation: friction"),
    ("chest_tube", "complete: times that", "complete: friction"),
    ("mitral_transseptal", "tension, largest error", "simulation: stiffness"),
    ("mitral_transseptal", "held at 60 deg by a motor", "simulation: stiffness"),
    ("mitral_transseptal", "tip of the simulation", "simulation: stiffness"),
    ("mitral_transseptal", "", "simulation: gain"),
    ("mitral_4dof", "tension, largest error", "simulation: stiffness"),
    ("mitral_4dof", "", "simulation: gain"),
    ("spacer_disk", "rate of decay", "simulation: damping"),
    ("spacer_disk", "without damping", "simulation: damping"),
    ("spacer_disk", "section moments apart", "simulation: gain"),
    ("spacer_disk", "tendons in lumens", "CC_sub: stiffness"),
    ("spacer_disk", "scenario ", "static models: stiffness"),
    ("", "", "simulation: stiffness"),
)


def constant_of(robot: str, quantity: str) -> str:
    """Return whose and which constant a judged line is about, by its robot and quantity."""
    return next(
        about for name, part, about in _CONSTANTS if name in ("", robot) and (not part or part in quantity)
    )


@dataclass(frozen=True)
class Validation:
    """All lines of a validation and what it found in words."""

    lines: tuple[Line, ...]
    findings: tuple[str, ...]

    @property
    def passed(self) -> bool:
        """Return whether there are lines and all pass."""
        return bool(self.lines) and all(line.passed for line in self.lines)

    def table_text(self) -> str:
        """Return the table and the findings as plain text."""
        cells = [list(_COLUMNS), *([_cell(line, name) for name in _COLUMNS] for line in self.lines)]
        widths = [max(len(row[i]) for row in cells) for i in range(len(_COLUMNS))]

        def text(row: list[str]) -> str:
            return "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()

        rows = [text(cells[0])]
        for line, row in zip(self.lines, cells[1:], strict=True):
            if f"[{line.robot}]" not in rows:
                rows += ["", f"[{line.robot}]"]
            rows.append(text(row))
        out = sum(not line.passed for line in self.lines)
        judged = sum(line.tolerance is not None for line in self.lines)
        rows.append("")
        rows.append(
            f"{judged - out} of {judged} judged lines within tolerance" + (f", {out} OUT" if out else "")
        )
        return "\n".join([*rows, *(f"- {finding}" for finding in self.findings)])

    def write(self, folder: Path) -> None:
        """Write `validation.json` and `validation.txt` into `folder`."""
        document = {
            "passed": self.passed,
            "lines": [_plain(line) for line in self.lines],
            "findings": list(self.findings),
        }
        with replaced_when_whole(folder / "validation.json") as file:
            json.dump(document, file, indent=1)
            file.write("\n")
        with replaced_when_whole(folder / "validation.txt") as file:
            file.write(self.table_text() + "\n")


def merge(parts: Sequence[Validation]) -> Validation:
    """Return one validation of all lines and findings, in order."""
    lines = tuple(line for part in parts for line in part.lines)
    return Validation(lines, tuple(finding for part in parts for finding in part.findings))


def _plain(line: Line) -> dict[str, object]:
    document: dict[str, object] = asdict(line)
    document |= {"verdict": line.verdict, "about": line.about}
    if not math.isfinite(line.error):
        document["error"] = None  # JSON has no NaN; the verdict says that it did not pass
    return document


def _cell(line: Line, name: str) -> str:
    value = getattr(line, name)
    if value is None:
        return line.said or "-" if name == "published" else "-"
    return f"{value:.4g}" if isinstance(value, float) else str(value)


# ----------------------------------------------------------------------------------------------------
# Histories of inputs that the checks use, and what the checks measure on the answers.

NO_GRAVITY = np.zeros(3)


def history(corners: Sequence[Sequence[float]], step: float, actuation: str = "tension") -> Inputs:
    """Return inputs that run straight through `corners`, shape (c, t), in steps of at most `step`."""
    points = np.array(corners, dtype=float)
    rows = [points[0]]
    for start, end in itertools.pairwise(points):
        count = max(1, int(np.ceil(np.abs(end - start).max() / step - 1e-9)))
        rows += [start + (end - start) * i / count for i in range(1, count + 1)]
    return given(np.array(rows), actuation)


def given(rows: Array, actuation: str = "tension", force_tip: Array | None = None) -> Inputs:
    """Return inputs of the given rows, shape (r, t), one second apart."""
    nothing = np.zeros((len(rows), 3))
    return Inputs(
        np.arange(len(rows), dtype=float),
        actuation,
        np.array(rows, dtype=float),
        nothing if force_tip is None else force_tip,
        nothing,
    )


def tips_mm(postures: Sequence[Posture]) -> Array:
    """Return the tips of `postures`, shape (r, 3) [mm]."""
    return np.array([posture.p_w[-1] * 1e3 for posture in postures])


def largest_distance(a: Array, b: Array) -> float:
    """Return the largest distance between points of two histories, NaN where one is shorter [their unit]."""
    return float(np.linalg.norm(a - b, axis=1).max()) if len(a) == len(b) else float("nan")


def loop_area(x: Array, y: Array) -> float:
    """Return the area inside the closed curve through (x, y), shoelace formula."""
    return float(0.5 * abs(np.dot(x, np.roll(y, 1)) - np.dot(y, np.roll(x, 1))))
