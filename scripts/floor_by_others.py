"""Is the floor of a diagnosis the data's, or the learner's? Learns what is left by other models.

    pip install scikit-learn
    catheter-sim diagnose assets/examples/opencr_v4 -o report
    python scripts/floor_by_others.py report

The shipped floor (`catheter_sim.diagnosis.floor`) is a kernel ridge. Here extra trees and small neural
networks learn the same: what the reported model leaves in the training trials, from the inputs, their
history and the computed outputs. History is other than the shipped model's: the inputs so many seconds
before, their way so far, and their largest and least values in a window. The numbers of a learner are chosen
by stretches left out of the training trials; then it predicts the held-out ones. Figures are RMS in space
where the tip is measured in x, y and z, otherwise per output. Exit status 1 where one of them differs from
the shipped floor by more than 10 %.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from catheter_sim.diagnosis.trials import TIP
from catheter_sim.tables import read_table

Array = NDArray[np.float64]
BEFORE_S = (2.0, 5.0, 15.0, 60.0)
STRETCHES = 6
AGREES = 0.10
SEED = 0


def history(time_s: Array, inputs: Array) -> Array:
    """Return what is known of each row of a trial by its inputs, shape (r, k)."""
    found = [inputs]
    for seconds in BEFORE_S:
        then = np.clip(time_s - seconds, time_s[0], None)
        found.append(np.stack([np.interp(then, time_s, column) for column in inputs.T], axis=1))
        first = np.searchsorted(time_s, time_s - seconds)
        spans = [inputs[start : row + 1] for row, start in enumerate(first)]
        found += [np.array([at(part, axis=0) for part in spans]) for at in (np.max, np.min)]
    way = np.abs(np.diff(inputs, axis=0, prepend=inputs[:1])).sum(axis=1).cumsum()
    return np.hstack([*found, way[:, None], (time_s - time_s[0])[:, None]])


def read_fits(report: Path) -> tuple[dict[str, list[tuple[Array, Array]]], list[str]]:
    """Return known and left of each trial by its role, and the outputs' names, from a report's series."""
    found: dict[str, list[tuple[Array, Array]]] = {"train": [], "heldout": []}
    columns: list[str] = []
    for path in sorted(report.glob("fitted_*.csv")):
        table = read_table(str(path)).columns
        columns = [name for name in table if f"after_{name}" in table]
        measured, after = (
            np.stack([table[f"{start}{name}"] for name in columns], axis=1) for start in ("", "after_")
        )
        inputs = np.stack([table[name] for name in table if name.startswith("input_")], axis=1)
        known = np.hstack([history(read_table(str(path)).time_s, inputs), after])
        found[path.name.split("_")[1]].append((known, measured - after))
    return found, columns


def learners() -> dict[str, list[Callable[[], Any]]]:
    """Return the models that are tried, several settings of each kind."""
    from sklearn.ensemble import ExtraTreesRegressor
    from sklearn.neural_network import MLPRegressor
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler

    def trees(leaf: int, share: float) -> Callable[[], Any]:
        return lambda: ExtraTreesRegressor(
            200, min_samples_leaf=leaf, max_features=share, random_state=SEED, n_jobs=-1
        )

    def network(alpha: float, width: int) -> Callable[[], Any]:
        return lambda: make_pipeline(
            StandardScaler(),
            MLPRegressor(
                hidden_layer_sizes=(width, width),
                alpha=alpha,
                max_iter=200,
                early_stopping=True,
                random_state=SEED,
            ),
        )

    return {
        "extra trees": [trees(leaf, share) for leaf in (3, 10, 30) for share in (0.3, 1.0)],
        "small network": [network(alpha, width) for alpha in (0.1, 3.0, 30.0) for width in (16, 48)],
    }


def rms(error: Array, columns: list[str]) -> float:
    """Return the tip's RMS in space where it is measured, else per output."""
    if all(name in columns for name in TIP):
        places = [columns.index(name) for name in TIP]
        return float(np.sqrt(np.nanmean((error[:, places] ** 2).sum(axis=1))))
    return float(np.sqrt(np.nanmean(error**2)))


def main() -> int:
    """Print what each kind of learner leaves; return the exit status."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("report", type=Path, help="folder of a diagnosis")
    options = parser.parse_args()
    try:
        kinds = learners()
    except ImportError:
        print("floor_by_others: error: scikit-learn is not installed", file=sys.stderr)
        return 2
    fits, columns = read_fits(options.report)
    known, left = (np.vstack([item[k] for item in fits["train"]]) for k in (0, 1))
    asked, ahead = (np.vstack([item[k] for item in fits["heldout"]]) for k in (0, 1))
    sound = np.isfinite(left).all(axis=1)
    known, left = known[sound], left[sound]
    size = left.std(axis=0)
    document = json.loads((options.report / "diagnosis.json").read_text(encoding="utf-8"))
    in_space = all(name in columns for name in TIP)
    floor = document["tip_mm"]["floor"] if in_space else next(iter(document["floor"].values()))
    print(f"left by the reported model {rms(ahead, columns):.3f}; shipped floor {floor:.3f}")
    parts = np.array_split(np.arange(len(known)), STRETCHES)
    agree = []
    for kind, settings in kinds.items():
        errors = []
        for make in settings:
            guess = np.zeros_like(left)
            for own in parts:
                others = np.delete(np.arange(len(known)), own)
                guess[own] = make().fit(known[others], left[others] / size).predict(known[own]) * size
            errors.append(rms(left - guess, columns))
        best = int(np.argmin(errors))
        if errors[best] >= rms(left, columns):
            reached = rms(ahead, columns)  # no function does better than none
        else:
            found = settings[best]().fit(known, left / size).predict(asked) * size
            reached = rms(ahead - found, columns)
        agree.append(abs(reached / floor - 1.0) <= AGREES)
        inside = f"stretches left out {errors[best]:.3f} of {rms(left, columns):.3f}"
        print(f"{kind}: {inside}; held out {reached:.3f}", flush=True)
    return 0 if all(agree) else 1


if __name__ == "__main__":
    sys.exit(main())
