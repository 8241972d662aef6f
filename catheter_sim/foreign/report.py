"""The files of a diagnosis of a foreign model: `diagnosis.json`, `diagnosis.report`, `model.xml`, the
series."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from html import escape
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from catheter_sim.diagnosis.document import finite_document
from catheter_sim.diagnosis.noise import times_noise
from catheter_sim.diagnosis.notes import Attempts
from catheter_sim.diagnosis.result import CAUSE_FOUND, IMPROVED, NO_DISCREPANCY, UNEXPLAINED
from catheter_sim.files import check_output_folder
from catheter_sim.foreign.causes import SUMMARIES
from catheter_sim.foreign.diagnose import ForeignDiagnosis, Judged
from catheter_sim.foreign.extended import extended_spec
from catheter_sim.foreign.likely import OUTSIDE, Likely
from catheter_sim.foreign.thresholds import SHOWN
from catheter_sim.page.render import png_source, rendered
from catheter_sim.tables import Table, replaced_when_whole, write_table

_SIDES = 1.96
_PANELS = 4  # rows of the picture
_BEFORE, _AFTER = "#b5532a", "#1f5f8b"


def write_foreign(found: ForeignDiagnosis, output: str | Path) -> tuple[str, ...]:
    """Write a diagnosis into a folder, which is made; return the names of what the model's file lacks."""
    folder = check_output_folder(output)
    folder.mkdir(parents=True, exist_ok=True)
    attempt = Attempts()
    left = attempt(
        "model.xml",
        lambda: _write_model(found, folder / "model.xml"),
        lambda: tuple(number.name for number in found.corrected),
    )
    for number, trial in enumerate(found.data.of("heldout")):
        name = f"fitted_{Path(trial.file).stem}.csv"
        attempt(name, partial(_write_series, found, number, folder / name), lambda: None)
    picture = attempt("The picture", lambda: _picture(found), bytes)
    told = replace(found, notes=(*found.notes, *attempt.notes))
    page = attempt(
        "Most of report.html",
        lambda: _page(told, document(told, left), picture),
        lambda: f"<!doctype html><meta charset='utf-8'><h1>{escape(sentence(found))}</h1>",
    )
    _put(folder / "report.html", page)
    told = replace(found, notes=(*found.notes, *attempt.notes))
    _put(folder / "diagnosis.json", json.dumps(document(told, left), indent=1))
    return left


def _put(path: Path, text: str) -> None:
    with replaced_when_whole(path) as file:
        file.write(text)


def _write_model(found: ForeignDiagnosis, path: Path) -> tuple[str, ...]:
    """Write the extended model; return the names of what its file lacks."""
    spec, left = extended_spec(found.data.model, found.corrected)
    spec.compile()
    _put(path, spec.to_xml())
    return left


def _write_series(found: ForeignDiagnosis, number: int, path: Path) -> None:
    """Write what was measured and simulated of a held-out trial."""
    trial = found.data.of("heldout")[number]
    columns: dict[str, Any] = {}
    for k, column in enumerate(found.data.model.columns):
        columns |= {
            f"measured_{column.name}": trial.outputs[:, k],
            f"before_{column.name}": found.before.outputs[number][:, k],
            f"after_{column.name}": found.best.outputs[number][:, k],
        }
    write_table(Table(trial.time_s, columns), path)


def _page(found: ForeignDiagnosis, described: dict[str, Any], picture: bytes) -> str:
    """Return `diagnosis.report`; `picture` is a PNG, b"" where there is none."""
    return rendered(
        "catheter_sim.foreign",
        "report.html",
        {
            "found": {"name": found.data.name, "robot": found.data.robot, "verdict": found.verdict},
            "sentence": sentence(found),
            "document": described,
            "picture": png_source(picture) if picture else "",
            "step_ms": 1e3 * described["timestep_s"],
        },
        {"short": lambda value: "-" if value is None else f"{value:.4g}"},
    )


def _picture(found: ForeignDiagnosis) -> bytes:
    """Return the series of the first held-out trial, of the columns that err most at first, as a PNG."""
    from matplotlib.figure import Figure  # here, as the command line's help is to be there at once

    trial, before, after = found.data.of("heldout")[0], found.before.outputs[0], found.best.outputs[0]
    squares = np.nan_to_num(((before - trial.outputs) / found.noise) ** 2).sum(axis=0)
    chosen = np.argsort(-squares)[:_PANELS]
    figure = Figure(figsize=(11.0, 1.0 + 1.7 * len(chosen)), layout="constrained")
    panels = figure.subplots(len(chosen), 2, sharex=True, squeeze=False)
    for (series, errors), k in zip(panels, chosen, strict=True):
        measured, noise = trial.outputs[:, k], float(found.noise[k])
        series.plot(trial.time_s, measured, ".", color="0.6", ms=3)
        for values, style, colour in ((before[:, k], "--", _BEFORE), (after[:, k], "-", _AFTER)):
            series.plot(trial.time_s, values, style, color=colour)
            errors.plot(trial.time_s, values - measured, style, color=colour, lw=1.0)
        errors.axhspan(-2.0 * noise, 2.0 * noise, color="0.9", lw=0.0)
        series.set_ylabel(found.data.model.columns[int(k)].name, fontsize=8)
    panels[0, 1].set_title("simulated less measured; grey: twice the noise", fontsize=9)
    for panel in panels[-1]:
        panel.set_xlabel("time [s]")
    file = BytesIO()
    figure.savefig(file, format="png", dpi=110)
    return file.getvalue()


def document(found: ForeignDiagnosis, left: tuple[str, ...]) -> dict[str, Any]:
    """Return the document of `diagnosis.json`; keys are those of other robots where they mean the same."""
    gain, low, high = found.gain_percent()
    before, after = (found.heldout_rms(item) for item in (found.before, found.best))
    noise = _noise_by_unit(found)
    unit = max(before, key=lambda name: times_noise(before[name], noise[name]))
    described = {
        "dataset": found.data.name,
        "robot": found.data.robot,
        "unit": unit,
        "verdict": found.verdict,
        "noise_floor": noise[unit],
        "heldout": {
            "rmse_before": before[unit],
            "rmse_after": after[unit],
            "gain_percent": gain,
            "gain_percent_ci95": [low, high],
        },
        "causes": _causes(found, found.named),
        "corrections": _causes(found, found.corrections),
        "absorbs": _causes(found, found.likely) if found.verdict == UNEXPLAINED else [],
        "probabilities": dict(found.probabilities),
        "evidence_shares": dict(found.weights),
        "ranking": [_ranked(item) for item in found.ranking[:SHOWN]],
        "indistinguishable": [list(group) for group in found.indistinguishable],
        "next_experiment": "none is planned for models from somebody's MJCF",
        "by_unit": {
            name: {
                "noise_floor": noise[name],
                "rmse_before": before[name],
                "rmse_after": after[name],
            }
            for name in before
        },
        "times_noise": {
            "before": found.before.times_noise,
            "after": found.best.times_noise,
        },
        "timestep_s": float(found.data.model.simulated.opt.timestep),
        "not_in_model": list(left),
        "notes": [note.text for note in found.notes],
    }
    finite, undefined = finite_document(described, "")
    return {**finite, "undefined": undefined} if undefined else dict(finite)


def lines(found: ForeignDiagnosis) -> list[str]:
    """Return what the command line says."""
    said = [sentence(found), f"verdict: {found.verdict}"]
    before, after, noise = (
        found.heldout_rms(found.before),
        found.heldout_rms(found.best),
        _noise_by_unit(found),
    )
    said += [
        f"held out, RMSE [{unit}]: {before[unit]:.3g} before, {after[unit]:.3g} after; "
        f"noise {noise[unit]:.2g}"
        for unit in before
    ]
    told = [("cause", item) for item in _causes(found, found.named)]
    told += [("correction", item) for item in _causes(found, found.corrections)]
    for what, cause in told:
        said.append(f"{what}: {cause['name']} ({cause['form']}), probability {cause['probability']:.2f}")
        for name, value in cause["parameters"].items():
            low, high = value["ci95"]
            said.append(f"  {name} = {value['value']:.4g} (95 %: {low:.4g} to {high:.4g})")
    said += [f"the data cannot tell apart: {', '.join(group)}" for group in found.indistinguishable]
    own, used = (
        float(model.opt.timestep) for model in (found.data.model.compiled, found.data.model.simulated)
    )
    if used < own:
        said.append(f"note: simulated with steps of {1e3 * used:g} ms: the file's {1e3 * own:g} ms change it")
    return said + [f"note: {note}" for note in found.notes]


def sentence(found: ForeignDiagnosis) -> str:
    """Return the verdict in words."""
    before, after = found.before.times_noise, found.best.times_noise
    if found.verdict == NO_DISCREPANCY:
        return f"The model agrees with the data to {before:.2g} times their noise."
    falls = f"held-out errors fall from {before:.3g} to {after:.3g} times the noise."
    if found.verdict == CAUSE_FOUND:
        words = " and ".join(_one_of(item.name, tuple(item.members)) for item in found.named)
        return f"The model lacks {words}: {falls}"
    if found.verdict == IMPROVED:
        words = " and ".join(item.name.replace("_", " ") for item in found.corrections)
        chance = found.probabilities[OUTSIDE]
        return (
            f"Corrections improve the model ({words}): {falls} None of them is established: something else "
            f"is at work with probability {chance:.2f}."
        )
    return (
        f"The model errs by {before:.3g} times the noise, and no generic cause explains it: the best one "
        f"leaves {after:.3g}."
    )


def _one_of(name: str, members: tuple[str, ...]) -> str:
    """Return a cause in words, or those that the data cannot tell apart."""
    return " or ".join(f"{item.replace('_', ' ')} ({SUMMARIES[item]})" for item in members or (name,))


def _causes(found: ForeignDiagnosis, chosen: Sequence[Likely]) -> list[dict[str, Any]]:
    """Return causes of the best fit as a document."""
    fit, shares = found.best.fit, found.gain_shares()
    variants = {item.cause: item for item in fit.variants}
    return [
        {
            "name": variant.cause,
            "form": variant.form,
            "gain_percent": shares[variant.cause],
            "probability": item.probability,
            **({"one_of": list(item.members), "members": dict(item.members)} if item.members else {}),
            "parameters": {
                number.name: {
                    "value": fit.values[number],
                    "ci95": [
                        fit.values[number] - _SIDES * fit.spread[number],
                        fit.values[number] + _SIDES * fit.spread[number],
                    ],
                }
                for number in variant.numbers
            },
        }
        for item, variant in ((item, variants[item.name]) for item in chosen)
    ]


def _ranked(item: Judged) -> dict[str, Any]:
    return {
        "causes": list(item.fit.causes),
        "heldout_times_noise": item.times_noise,
        "evidence": item.fit.evidence,
    }


def _noise_by_unit(found: ForeignDiagnosis) -> Mapping[str, float]:
    squares: dict[str, list[float]] = {}
    for column, noise in zip(found.data.model.columns, found.noise, strict=True):
        squares.setdefault(column.unit, []).append(float(noise) ** 2)
    return {unit: float(np.sqrt(np.mean(values))) for unit, values in squares.items()}
