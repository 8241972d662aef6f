"""A diagnosis written to a folder."""

from __future__ import annotations

import json
import math
import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from catheter_sim.catalogue import robot_toml
from catheter_sim.diagnosis.report.fitted_series import fit_files, fit_table
from catheter_sim.diagnosis.report.result import NEXT_EXPERIMENT_FILE, Cause, Diagnosis
from catheter_sim.diagnosis.report.to_json import to_json
from catheter_sim.errors import InputError
from catheter_sim.tables import replaced_when_whole, write_table

if TYPE_CHECKING:
    from catheter_sim.diagnosis.report.html import Head


def write_results(
    diagnosis: Diagnosis,
    folder: str | os.PathLike[str],
    model_xml: str,
    document: Mapping[str, Any] | None = None,
    head: Head | None = None,
) -> tuple[Path, ...]:
    """Write everything that a diagnosis leaves into `folder`, made if need be; return the files.

    Each file is written whole or not at all, and `diagnosis.json` last, so that a folder with one
    is complete.

    Args:
        diagnosis: what was found.
        folder: where to; files of an earlier diagnosis are replaced.
        model_xml: the extended robot as MJCF.
        document: of diagnosis.json; None: the diagnosis's.
        head: of the report; None: the diagnosis's.

    Raises:
        InputError: the folder cannot be made or written.
    """
    # Here, since these two import this module.
    from catheter_sim.diagnosis.report.html import report_html
    from catheter_sim.diagnosis.report.pictures import figures

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
    put("robot.toml", marked_toml(diagnosis))
    put("model.xml", marked_xml(diagnosis, model_xml))
    for fit, name in zip(diagnosis.fits, fit_files(diagnosis.fits), strict=True):
        write_table(fit_table(fit, diagnosis.dataset), target / name)
        written.append(target / name)
    if diagnosis.next_experiment.inputs is not None:
        write_table(diagnosis.next_experiment.inputs, target / NEXT_EXPERIMENT_FILE)
        written.append(target / NEXT_EXPERIMENT_FILE)
    for picture in pictures:
        put(f"{picture.name}.png", picture.png)
    put("report.html", report_html(diagnosis, pictures, head))
    put("diagnosis.json", json.dumps(document or to_json(diagnosis), indent=1, allow_nan=False) + "\n")
    return tuple(written)


def marked_toml(diagnosis: Diagnosis) -> str:
    """Return the extended robot as TOML; a comment says of each effect whether it is a cause."""
    marks = _marks(diagnosis)

    def marked(match: re.Match[str]) -> str:
        return f"# {marks.get(match[1], 'as specified')}\n{match[0]}"

    text = re.sub(r"^\[effects\.(\w+)\]$", marked, robot_toml(diagnosis.extended_robot), flags=re.MULTILINE)
    return "".join(f"# {line}\n" for line in _origin(diagnosis)) + text


def marked_xml(diagnosis: Diagnosis, model_xml: str) -> str:
    """Return MJCF with a comment that says of each effect whether it is a cause."""
    lines = [*_origin(diagnosis), *(f"{name}: {mark}" for name, mark in _marks(diagnosis).items())]
    comment = "\n  ".join(lines).replace("--", "- -")  # two hyphens end a comment
    return f"<!-- {comment} -->\n{model_xml}" if lines else model_xml


def _marks(diagnosis: Diagnosis) -> dict[str, str]:
    """Return what each effect of the extended robot is, by its name."""
    causes = {cause.name: _mark(cause, "cause", ", probability {:.2f}") for cause in diagnosis.causes}
    return causes | {
        cause.name: _mark(cause, "correction, not established", " ({:.2f})")
        for cause in diagnosis.corrections
    }


def _mark(cause: Cause, what: str, how_probable: str) -> str:
    mark = what if math.isnan(cause.probability) else what + how_probable.format(cause.probability)
    return f"{mark}; may be {' or '.join(cause.one_of[1:])} instead" if cause.members else mark


def _origin(diagnosis: Diagnosis) -> list[str]:
    """Return where the extended robot comes from: the same for the same data, whenever it was made."""
    made = diagnosis.provenance
    if not made.made:
        return []
    return [
        f"catheter-sim {made.version}, diagnosis: {diagnosis.verdict}",
        f"SHA-256 of the data: {made.data_digest}",
    ]
