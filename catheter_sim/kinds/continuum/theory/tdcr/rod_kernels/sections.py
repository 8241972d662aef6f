"""The sections of a robot integrated, compiled: eight of one robot's at once, or eight robots' one by one."""

from __future__ import annotations

from catheter_sim.arrays import Array
from catheter_sim.kinds.continuum.theory.tdcr.rod_kernels.columns import (
    CONTINUOUS,
    LENGTH,
    LUMENS,
    PROJECTED,
    STEPS,
)
from catheter_sim.kinds.continuum.theory.tdcr.rod_kernels.lanes import (
    BODY,
    COLUMNS,
    COMPLIANCE,
    INVERSE,
    LOW,
    LOW_SLOPE,
    STEP,
    STIFFNESS,
    STRAIN,
    TENDONS,
    TRIAL,
    TURN,
    WRENCH,
)
from catheter_sim.kinds.continuum.theory.tdcr.rod_kernels.section import integrate, set_body_wrenches
from catheter_sim.kinds.continuum.theory.tdcr.rod_kernels.tendon_forces import add_span_pulls
from catheter_sim.mechanics.compiled import compiled
from catheter_sim.mechanics.eight import LANES, eights, select_less


@compiled
def sections(
    path: int,
    rod: Array,
    hole: Array,
    span: Array,
    wrench: Array,
    strain: Array,
    inverse: Array,
    derive: bool,
    w: Array,
    turn: Array,
    shift: Array,
    turn_slope: Array,
    end: Array,
    here: Array,
    low: Array,
    low_slope: Array,
) -> None:
    """Set the sections' poses, wrenches at their ends, `end` (n, 6), and pulls on their lower disks.

    `end` holds the pulls on the upper disks, too: what it leaves over there has the sign reversed. With
    `derive` also their derivatives by the wrenches at the starts: `turn_slope` (n, 3, 6), `here`, that
    of -end, and `low_slope`, (n, 6, 6). `strain` and `inverse` are those of `start_laws`.
    """
    tendons, n = span.shape
    along = path in (CONTINUOUS, LUMENS)
    columns = 6 if derive else 0
    side_by_side = eights(w.reshape(-1, LANES))
    for first in range(0, n, LANES):
        steps = 1
        for i in range(LANES):
            steps = max(steps, int(rod[min(first + i, n - 1), STEPS]))
        for i in range(LANES):
            j = min(first + i, n - 1)
            for q in range(6):
                w[(WRENCH + q) * LANES + i] = wrench[j, q]
                w[(COMPLIANCE + q) * LANES + i] = rod[j, q]
            w[STEP * LANES + i] = rod[j, LENGTH] / steps
            for k in range(tendons):
                w[(TENDONS + 3 * k) * LANES + i] = span[k, j]
            if along:
                for q in range(6):
                    w[(STIFFNESS + q) * LANES + i] = 1.0 / rod[j, q] if rod[j, q] > 0.0 else 0.0
                    w[(STRAIN + q) * LANES + i] = strain[j, q]
                    for c in range(6):
                        w[(INVERSE + 6 * q + c) * LANES + i] = inverse[j, q, c]
            else:
                for k in range(tendons):
                    both = below = 0.0
                    if path == PROJECTED and span[k, j] > 0.0:
                        if j > 0:
                            below = 0.5 * (span[k, j - 1] + span[k, j])
                        if j + 1 < n and span[k, j + 1] > 0.0:
                            both = 0.5 * (span[k, j] + span[k, j + 1])
                    w[(TENDONS + 3 * k + 1) * LANES + i] = span[k, j] - below
                    w[(TENDONS + 3 * k + 2) * LANES + i] = span[k, j] - both
        integrate(side_by_side, hole, steps, along, columns)
        set_body_wrenches(side_by_side, columns)
        if not along:
            add_span_pulls(side_by_side, hole, columns)
        for i in range(min(LANES, n - first)):
            j = first + i
            for q in range(3):
                shift[j, q] = w[(TRIAL + 4 + q) * LANES + i]
                for c in range(3):
                    turn[j, q, c] = w[(TURN + 3 * q + c) * LANES + i]
            for q in range(6):
                end[j, q] = w[(BODY + q) * LANES + i]
                low[j, q] = w[(LOW + q) * LANES + i] if not along else 0.0
            if not derive:
                continue
            for q in range(3):
                for c in range(6):
                    turn_slope[j, q, c] = w[(TRIAL + 7 + 6 * q + c) * LANES + i]
            for q in range(6):
                for c in range(6):
                    here[j, q, c] = -w[(COLUMNS + 6 * q + c) * LANES + i]
                    low_slope[j, q, c] = w[(LOW_SLOPE + 6 * q + c) * LANES + i] if not along else 0.0


@compiled
def sections_of_eights(
    path: int,
    rod: Array,
    hole: Array,
    span: Array,
    wrench: Array,
    strain: Array,
    inverse: Array,
    derive: bool,
    v: Array,
    turn: Array,
    shift: Array,
    turn_slope: Array,
    end: Array,
    here: Array,
    low: Array,
    low_slope: Array,
) -> None:
    """Do as `sections` for eight robots side by side, section after section; `v`: the workspace of eights."""
    tendons, n = span.shape
    along = path in (CONTINUOUS, LUMENS)
    columns = 6 if derive else 0
    for j in range(n):
        steps = int(rod[j, STEPS])
        v[STEP] = rod[j, LENGTH] / steps
        for q in range(6):
            v[WRENCH + q], v[COMPLIANCE + q] = wrench[j, q], rod[j, q]
        for k in range(tendons):
            v[TENDONS + 3 * k] = span[k, j]
        if along:
            for q in range(6):
                v[STIFFNESS + q] = 1.0 / rod[j, q] if rod[j, q] > 0.0 else 0.0
                v[STRAIN + q] = strain[j, q]
                for c in range(6):
                    v[INVERSE + 6 * q + c] = inverse[j, q, c]
        else:
            for k in range(tendons):
                both = below = 0.0 * span[k, j]
                if path == PROJECTED and j > 0:
                    below = 0.5 * (span[k, j - 1] + span[k, j])
                if path == PROJECTED and j + 1 < n:
                    both = select_less(0.0, span[k, j + 1], 0.5 * (span[k, j] + span[k, j + 1]), 0.0)
                v[TENDONS + 3 * k + 1] = select_less(0.0, span[k, j], span[k, j] - below, 0.0)
                v[TENDONS + 3 * k + 2] = span[k, j] - both
        integrate(v, hole, steps, along, columns)
        set_body_wrenches(v, columns)
        if not along:
            add_span_pulls(v, hole, columns)
        for q in range(3):
            shift[j, q] = v[TRIAL + 4 + q]
            for c in range(3):
                turn[j, q, c] = v[TURN + 3 * q + c]
        for q in range(6):
            end[j, q] = v[BODY + q]
            low[j, q] = 0.0 if along else v[LOW + q]
        if not derive:
            continue
        for c in range(6):
            for q in range(3):
                turn_slope[j, q, c] = v[TRIAL + 7 + 6 * q + c]
            for q in range(6):
                here[j, q, c] = -v[COLUMNS + 6 * q + c]
                low_slope[j, q, c] = 0.0 if along else v[LOW_SLOPE + 6 * q + c]
