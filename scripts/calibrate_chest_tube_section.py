"""Calibrates the chest-tube section from simulated shapes of its prototype, draw after draw of the noise.

    python scripts/calibrate_chest_tube_section.py --draws 20 -o results/calibration [--jobs 2]

Each draw is a data set with a [calibration] table that goes through the diagnosis, as measured shapes
would. Writes the draws, calibration.csv with every interval, and calibration.png; prints how often the
hidden friction, elastic constant and clearance lie in their own 95 % intervals, and the error of the
calibrated model on held-out tensions beside that of piecewise constant curvature.
"""

from __future__ import annotations

import argparse
import csv
import sys
from collections.abc import Sequence
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from catheter_sim.validation.chest_tube_measured import (
    CALIBRATED_RANGES as RANGES,
)
from catheter_sim.validation.chest_tube_measured import (
    RECOVERED,
    Draw,
    calibrate_draw,
    hidden_values,
    simulated_shapes_mm,
)


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--draws", type=int, default=20)
    parser.add_argument("--jobs", type=int, default=1, help="processes to fit with")
    parser.add_argument("-o", "--output", type=Path, default=Path("results/calibration"))
    options = parser.parse_args()
    shapes = simulated_shapes_mm()
    draws: list[Draw] = []
    for seed in range(options.draws):
        draw = calibrate_draw(options.output / f"draw_{seed:02d}", shapes, seed, options.jobs)
        draws.append(draw)
        missed = [name for name, held in draw.recovered().items() if not held]
        print(
            f"draw {seed:2d}: {draw.diagnosis.verdict}, error on held-out tensions "
            f"{draw.error_percent:.2f} % (noise alone {draw.floor_percent:.2f} %), "
            f"of the true shape {draw.true_error_percent:.2f} %, PCC {draw.pcc_error_percent:.1f} %"
            + (f", missed: {', '.join(missed)}" if missed else "")
        )
    write_table(draws, options.output / "calibration.csv")
    picture(draws, options.output / "calibration.png")
    for name in RECOVERED:
        count = sum(draw.recovered()[name] for draw in draws)
        print(f"{name}: hidden value in its own 95 % interval in {count} of {len(draws)} draws")
    together = sum(all(draw.recovered().values()) for draw in draws)
    print(f"all three at once: {together} of {len(draws)}")
    for what in ("error", "floor", "true_error", "pcc_error"):
        values = [getattr(draw, f"{what}_percent") for draw in draws]
        print(f"{what.replace('_', ' ')}: mean {np.mean(values):.2f} %, largest {max(values):.2f} %")
    return 0


def write_table(draws: Sequence[Draw], path: Path) -> None:
    """Write every calibrated number of every draw."""
    truth = hidden_values()
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["draw", "number", "hidden", "value", "ci95_low", "ci95_high"])
        for draw in draws:
            for name, item in draw.diagnosis.calibrated.items():
                numbers = (truth[name], item.value, *item.ci95)
                writer.writerow([draw.seed, name, *(f"{number:.6g}" for number in numbers)])


def picture(draws: Sequence[Draw], path: Path) -> None:
    """Draw every interval beside the hidden value."""
    truth = hidden_values()
    figure, axes = plt.subplots(1, len(RANGES), figsize=(2.2 * len(RANGES), 4.5), sharey=True)
    for axis, (name, (low, high)) in zip(axes, RANGES.items(), strict=True):
        for draw in draws:
            item = draw.diagnosis.calibrated[name]
            ends = np.clip(item.ci95, low, high if np.isfinite(high) else 10.0 * low)
            held = ends[0] <= truth[name] <= ends[1]
            axis.plot(ends, [draw.seed] * 2, color="tab:blue" if held else "tab:red")
            axis.plot(item.value, draw.seed, ".", color="black", markersize=4)
        axis.axvline(truth[name], color="tab:green", linewidth=1)
        axis.set_xlabel(name.split(".")[-1], fontsize=8)
    axes[0].set_ylabel("draw")
    figure.suptitle("95 % intervals (blue: hold the hidden value, green)")
    figure.tight_layout()
    figure.savefig(path, dpi=120)
    plt.close(figure)


if __name__ == "__main__":
    sys.exit(main())
