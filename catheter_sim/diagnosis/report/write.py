"""A diagnosis written to a folder."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from catheter_sim.catalogue import robot_toml
from catheter_sim.diagnosis.report.fitted_series import fit_files, fit_table
from catheter_sim.diagnosis.report.result import NEXT_EXPERIMENT_FILE, Diagnosis
from catheter_sim.diagnosis.report.to_json import to_json
from catheter_sim.errors import InputError
from catheter_sim.tables import replaced_when_whole, write_table


def write_results(
    diagnosis: Diagnosis,
    folder: str | os.PathLike[str],
    model_xml: str,
    document: Mapping[str, Any] | None = None,
    sentence: str = "",
) -> tuple[Path, ...]:
    """Write everything that a diagnosis leaves into `folder`, made if need be; return the files.

    Each file is written whole or not at all, and `diagnosis.json` last, so that a folder with one
    is complete.

    Args:
        diagnosis: what was found.
        folder: where to; files of an earlier diagnosis are replaced.
        model_xml: the extended robot as MJCF.
        document: of diagnosis.json; None: the diagnosis's.
        sentence: at the head of the report; "": the diagnosis's.

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
    put("robot.toml", robot_toml(diagnosis.extended_robot))
    put("model.xml", model_xml)
    for fit, name in zip(diagnosis.fits, fit_files(diagnosis.fits), strict=True):
        write_table(fit_table(fit, diagnosis.dataset), target / name)
        written.append(target / name)
    if diagnosis.next_experiment.inputs is not None:
        write_table(diagnosis.next_experiment.inputs, target / NEXT_EXPERIMENT_FILE)
        written.append(target / NEXT_EXPERIMENT_FILE)
    for picture in pictures:
        put(f"{picture.name}.png", picture.png)
    put("report.html", report_html(diagnosis, pictures, sentence))
    put("diagnosis.json", json.dumps(document or to_json(diagnosis), indent=1, allow_nan=False) + "\n")
    return tuple(written)
