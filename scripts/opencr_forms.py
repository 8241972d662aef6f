"""What each form of a cause buys on OpenCR's robot: sets of causes fitted to its training file.

    python scripts/opencr_forms.py

Every set is fitted to every fourth row of the training file. Printed are the tip's RMS errors in space [mm]
there, on stretches left out of it, and on the held-out file, as it is and without its mean offset. The
held-out file is looked at only to print it. A minute in all.
"""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np

from catheter_sim.diagnosis.dataset import load_dataset
from catheter_sim.diagnosis.fit import fit, residuals
from catheter_sim.diagnosis.prepare import prepare, split_problem
from catheter_sim.diagnosis.problem import Term
from catheter_sim.resources import assets_folder

EVERY = 4
CHANNELS = [f"{part}_{k}" for part in ("base", "middle", "tip") for k in (1, 2, 3)]
KINDS = (("translation", "mm"), ("rotation", "deg"))
RIGID = tuple(f"{what}_{axis}_{unit}" for what, unit in KINDS for axis in "xyz")
SHARED = (
    Term("axial_compression", ("stiffness_N_per_mm",)),
    Term("precurvature", ("curvature_x_per_m", "curvature_y_per_m")),
    Term("actuation_gain", tuple(f"scale_{name}" for name in CHANNELS)),
)
OFFSET, LAG = Term("actuation_offset", ("offset_mm",)), Term("rate", ("lag_s",))
LEVER = Term("measurement_frame", (*RIGID, "ahead_mm"))
YIELDING = Term("nonlinear_stiffness", ("plastic_share", "yield_per_m"))
SETS = {
    "frame with a scale of its lengths": (OFFSET, LAG, Term("measurement_frame", (*RIGID, "scale"))),
    "frame with a marker ahead of the tip": (OFFSET, LAG, LEVER),
    "the same, and a backbone that yields": (OFFSET, LAG, LEVER, YIELDING),
    "the same, offsets of tendons, a play, zeros that creep": (
        Term("actuation_offset", tuple(f"offset_{name}_mm" for name in CHANNELS)),
        Term("backlash", ("width_mm",)),
        Term("drift", ("shift_mm~time.logarithmic(60)",)),
        LEVER,
        YIELDING,
    ),
}


def main() -> int:
    """Print a row for each set; return the exit status."""
    split = split_problem(prepare(load_dataset(assets_folder() / "examples" / "opencr_v4")))
    train = replace(split.train, every=EVERY)
    heldout, size_mm = replace(split.heldout, every=1), float(train.weight[0])
    print(f"{'beside what all have':<56} {'train':>6} {'left out':>8} {'held out':>8} {'aligned':>8}")
    for name, terms in SETS.items():
        found = fit(train, (*SHARED, *terms))
        away = residuals(heldout, found.numbers, found.x[None])[0].reshape(-1, 3)
        inside = [item.reshape(-1, 3) for item in (found.residual, found.left_out)]
        errors = (*inside, away, away - away.mean(axis=0))
        shown = [size_mm * float(np.sqrt((item**2).sum(axis=1).mean())) for item in errors]
        print(f"{name:<56} {shown[0]:>6.2f} {shown[1]:>8.2f} {shown[2]:>8.2f} {shown[3]:>8.2f}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
