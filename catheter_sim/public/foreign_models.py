"""What somebody else's MJCF gets wrong, given measured data."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from catheter_sim.public.arguments import jobs_of, path_of, progress_of

if TYPE_CHECKING:
    from catheter_sim.foreign.diagnose import ForeignDiagnosis


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
        from catheter_sim.foreign.extended import extended_spec
        from catheter_sim.foreign.report import document

        left = extended_spec(self.result.data.model, self.result.corrected)[1]
        return document(self.result, left)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the report to a folder, as `catheter-sim diagnose` does.

        Raises:
            InputError: the folder cannot be written.
        """
        from catheter_sim.foreign.report import write_foreign

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
