"""The neuroendoscope's published mappings (Kato 2016), and the friction that its published figures hold."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs, row_name
from catheter_sim.core.robot import Friction
from catheter_sim.core.statics import StaticRun
from catheter_sim.errors import InputError
from catheter_sim.mechanics.hysteresis import tensions_behind
from catheter_sim.robots.continuum.planar import (
    PlanarChain,
    arc_chain,
    drives,
    elastic_moment,
    planar_chain,
    posture,
    require_tension_inputs,
    require_unloaded,
    rest_angles,
    static_run,
)
from catheter_sim.robots.continuum.published import neuroendoscope_section
from catheter_sim.robots.continuum.spec import ContinuumRobot

# ----------------------------------------------------------------------------------------------------
# The neuroendoscope's forward kinematic mappings as published, and the constant-curvature assumption.
#
# Kato et al. 2016 (doi 10.1007/s11548-015-1310-2). Cells bend in circular arcs (its A2), the moment arm is
# the eyelet's offset (A3), weight is left out (A6), tendons do not stretch (A7). The tension that enters is
# that of the first cell: there is no eyelet before it. Angles and tensions are found cell by cell from the
# base, so nothing is solved for.

# One step: tensions at the actuators, angles and tensions before -> angles (n,) and tensions (t, n).
_Step = Callable[[PlanarChain, Array, Array, Array], tuple[Array, Array]]


def fkm(robot: ContinuumRobot, inputs: Inputs, gravity_mps2: Array) -> StaticRun:
    """Return the postures of the extended forward kinematic mapping, as printed (Kato 2016, Eqs 2-9).

    A row of inputs is one time k of the paper; before the first the robot is at rest. The mapping
    only reads the sign of theta^k - theta^(k-1), so **its answer depends on how many rows lead to
    it**, and the rows are taken as they are:

    - In monotone arching the number of rows does not matter.
    - Coming back in few large steps, tension rises from the base until a cell would bend further
      than before; there the sign turns and tension falls along the old distribution. That is the
      peaked profile of the paper's Fig. 14, up to one eyelet's jump in tension too high beyond the
      peak, because nothing says that a cell may stick.
    - Coming back in many small steps, each step moves the peak by one cell and lifts everything
      beyond it by that jump, whatever the step's size: the robot bends further while its tendon is
      let out.
    - A row that repeats the one before it has sgn(0) = 0 in its first cell, so no friction there;
      after n such rows there is none anywhere.

    `fkm_stick` mends this, and no more than this.

    Args:
        robot: every segment bends in the xz plane, one hinge a cell.
        inputs: tensions; no tip force or moment in the plane.
        gravity_mps2: in the base frame, shape (3,) [m/s^2]; none in the plane.

    Raises:
        InputError: the mapping does not know this robot or these inputs.
    """
    return _march("fkm", _printed_step, robot, inputs, gravity_mps2, substeps=False)


def fkm_stick(robot: ContinuumRobot, inputs: Inputs, gravity_mps2: Array) -> StaticRun:
    """Return the postures of the printed mapping, with cells that may stick.

    Eqs 3 and 7 and the ratio of Eq. 4 are the printed ones. What differs is the exponent: Eq. 4 knows
    the two signs of slip only, and sgn(theta^k - theta^(k-1)) contradicts itself where the tension
    propagated for extending would bend the next cell further than before. Here the ratio bounds the
    tension behind an eyelet on both sides, and the moment on the next cell keeps its value between
    the bounds (`slip.tensions_behind`, over all tendons that pass that cell). Where Eq. 4 does not
    contradict itself the two agree. Inputs move linearly from row to row, so that their number does
    not matter.

    Arguments and errors as in `fkm`.
    """
    return _march("fkm_stick", _sticking_step, robot, inputs, gravity_mps2, substeps=True)


def fkm_stick_by_rows(robot: ContinuumRobot, inputs: Inputs, gravity_mps2: Array) -> StaticRun:
    """Return `fkm_stick`'s postures with one step a row, some twenty times sooner, for fits.

    The same in arching; where an antagonistic pair comes back it is within 0.3 mm.

    Arguments and errors as in `fkm`.
    """
    return _march("fkm_stick_by_rows", _sticking_step, robot, inputs, gravity_mps2, substeps=False)


def pcca(robot: ContinuumRobot, inputs: Inputs, gravity_mps2: Array) -> StaticRun:
    """Return the postures under the piecewise-constant-curvature assumption (as compared in Kato 2016).

    No friction: each tendon's tension is the same in all of its cells, so that all cells of a
    section bend alike, theta = sum(d tension) / K.

    Arguments and errors as in `fkm`.
    """
    return _march("pcca", _uniform_step, robot, inputs, gravity_mps2, substeps=False)


def tension_ratio(mu: float, angle: float) -> float:
    """Return the ratio of the tensions behind and before an eyelet, bending further (Kato 2016, Eq. 4).

    alpha = (1 - mu sin|theta/2|) / (1 + mu sin|theta/2|), with the angle [rad] of the cell before
    the eyelet for both neighbours' (the paper's sin(theta_i/2) = sin(theta_(i+1)/2)). For small
    angles it is the capstan's exp(-mu |theta|).

    Raises:
        ArithmeticError: mu sin|theta/2| >= 1: no tension passes, the formula has left its range.
    """
    friction = mu * math.sin(0.5 * abs(angle))
    if friction >= 1.0 or abs(angle) > math.pi:
        raise ArithmeticError(f"a cell bends by {math.degrees(angle):.0f} deg: no tension passes its eyelet")
    return (1.0 - friction) / (1.0 + friction)


def _march(
    model: str, step: _Step, robot: ContinuumRobot, inputs: Inputs, gravity_mps2: Array, substeps: bool
) -> StaticRun:
    chain = planar_chain(robot, model)
    gravity = np.asarray(gravity_mps2, dtype=float)
    require_tension_inputs(inputs, model)
    require_unloaded(inputs, gravity, model)
    angles, tension = rest_angles(chain), np.zeros(chain.offset.shape)
    postures, residual = [], []
    for row, steps in enumerate(drives(chain, inputs, gravity)):
        try:
            for drive in steps if substeps else steps[-1:]:
                angles, tension = step(chain, drive.tension, angles, tension)
        except ArithmeticError as error:
            raise InputError(f"{row_name(inputs, row)}: static model {model!r}: {error}") from None
        p_w, R_w = arc_chain(angles, chain.cell_length)
        postures.append(posture(chain, angles, p_w, R_w, tension, steps[-1]))
        lack = (chain.offset * tension).sum(axis=0) - elastic_moment(chain, angles)
        residual.append(float(np.abs(lack).max()))
    return static_run(model, inputs, gravity, postures, residual)


def _printed_step(chain: PlanarChain, tension: Array, angles: Array, _: Array) -> tuple[Array, Array]:
    """Eqs 7 and 8 with 4, alternately, from the base to the tip."""
    now, entering = np.zeros_like(angles), tension
    in_cells = np.zeros(chain.offset.shape)
    for i in range(len(angles)):
        in_cells[:, i] = np.where(chain.reaches[:, i], entering, 0.0)
        now[i] = _bend_angle(chain, i, _moment(chain, i, in_cells))
        ratio = tension_ratio(chain.mu, now[i])
        entering = entering * ratio ** (np.sign(chain.offset[:, i]) * np.sign(now[i] - angles[i]))
    return now, in_cells


def _sticking_step(chain: PlanarChain, tension: Array, angles: Array, kept: Array) -> tuple[Array, Array]:
    """Eq. 7, and Eq. 4 as the two bounds between which a cell's moment keeps its value."""
    now, entering = np.zeros_like(angles), tension
    in_cells = np.zeros(chain.offset.shape)
    capstan = 1.0  # no eyelet before the first cell
    for i in range(len(angles)):
        here = chain.reaches[:, i]
        behind = tensions_behind(
            entering[here].tolist(), kept[here, i].tolist(), chain.offset[here, i].tolist(), capstan
        )
        in_cells[here, i] = behind
        now[i] = _bend_angle(chain, i, _moment(chain, i, in_cells))
        capstan = 1.0 / tension_ratio(chain.mu, now[i])
        entering = in_cells[:, i]
    return now, in_cells


def _uniform_step(chain: PlanarChain, tension: Array, angles: Array, _: Array) -> tuple[Array, Array]:
    in_cells = np.where(chain.reaches, tension[:, None], 0.0)
    cells = range(len(chain.cell_length))
    return np.array([_bend_angle(chain, i, _moment(chain, i, in_cells)) for i in cells]), in_cells


def _moment(chain: PlanarChain, cell: int, in_cells: Array) -> float:
    """Return the tendons' moment on a cell; equal and opposite ones leave exactly nothing."""
    return math.fsum((chain.offset[:, cell] * in_cells[:, cell]).tolist())


def _bend_angle(chain: PlanarChain, cell: int, moment: float) -> float:
    """Return the angle at which a cell's elastic moment is `moment` (Kato 2016, Eq. 3, where linear)."""
    length = float(chain.cell_length[cell])
    cubic, quintic = float(chain.cubic[cell]), float(chain.quintic[cell])
    linear = moment / float(chain.stiffness[cell])  # the curvature, if the law were linear
    k = linear
    if (cubic != 0.0 or quintic != 0.0) and linear != 0.0:

        def excess(k: float) -> float:
            return k * (1.0 + k * k * (cubic + k * k * quintic)) - linear

        # On a softening law the angle is that on the branch which starts at rest.
        end = linear
        for _ in range(60):
            if excess(end) * linear >= 0.0:
                break
            end *= 1.1
        else:
            raise ArithmeticError(f"cell {cell + 1}: no angle has the elastic moment {moment:.3g} N m")
        k = float(brentq(excess, 0.0, end, xtol=1e-14 * abs(linear), rtol=1e-15))
    return (k + float(chain.rest_curvature[cell])) * length


# ----------------------------------------------------------------------------------------------------
# Which friction coefficient do the published figures of the neuroendoscope hold?
#
# Kato 2016 (doi 10.1007/s11548-015-1310-2) prints no value of mu. Two kinds of printed figures hold it:
#
# - **Loop openings**: the mean distance of the tips in arching and extending at the same tension,
#   9.8 mm at 0.4 N with a single tendon and 13.2 mm at (0.12, 0.48) N with an antagonistic pair.
#   Extending started from "maximum bending of the robot", whose tension is not printed, and the
#   opening hangs on it. It also has a maximum over mu, since a robot with much friction bends less: for
#   one maximum tension an opening fits two values of mu, or none. **Assumed here: full reversal**, a
#   start so far bent that back at the loop's tension the whole tendon runs out; the opening then no
#   longer hangs on where it started.
# - **Distances in arching** between measurement, mapping and the constant-curvature assumption, which need
#   no maximum tension (`tests/reference/arching_distances.py`).
#
# What comes out. With full reversal the first opening gives mu = 0.143 (`fkm`, `fkm_stick`) or 0.128
# (`fkm_exact_arm`), and the second comes out as 13.3 or 13.5 mm against the published 13.2. The distances
# in arching leave 0.26 to 0.34 to `fkm`, and with such a mu both openings need a start from less bending,
# 0.56 N and 0.70 N. The openings fit either way. Fig. 13 does not: its distance between mapping and
# constant curvature falls at the turn and peaks again at 0.3 N, which it does with the friction of the
# arching distances and not with that of full reversal (`validation/neuroendoscope.py`).

_Solve = Callable[[ContinuumRobot, Inputs, Array], StaticRun]

FULL_REVERSAL_N = 1.5  # assumed start of extending; at mu up to 0.2 any above 1 N gives the same opening
_MU_GRID = np.linspace(0.0, 1.0, 26)
_TENSION_GRID_N = np.linspace(0.0, 0.6, 13)  # beyond the loop's own tension
_SAME_OPENING_M = 2e-5  # a root of a jump misses its value by more


@dataclass(frozen=True)
class PublishedLoop:
    """A published opening between arching and extending.

    Attributes:
        opening_m: mean distance of the tips [m].
        arching: (right, left) tensions up to where the tips are compared, shape (r, 2) [N].
        source: where it is printed.
    """

    opening_m: float
    arching: tuple[tuple[float, float], ...]
    source: str


@dataclass(frozen=True)
class Identification:
    """A friction coefficient from the single tendon's loop, and its check on the antagonistic one.

    Attributes:
        highest_N: tension from which extending is assumed to start, in both loops.
        mu: the coefficients that give the single tendon's opening; more than one where it is not unique.
        antagonistic_opening_m: what each of them gives for the antagonistic opening.
    """

    highest_N: float
    mu: tuple[float, ...]
    antagonistic_opening_m: tuple[float, ...]


def _single(*tensions: float) -> tuple[tuple[float, float], ...]:
    return tuple((tension, 0.0) for tension in tensions)


def _antagonistic(*tensions: float) -> tuple[tuple[float, float], ...]:
    return tuple((tension, 0.12) for tension in tensions)


SINGLE_LOOP = PublishedLoop(9.8e-3, _single(0.0, 0.1, 0.2, 0.3, 0.4), "Kato 2016, Results: 9.8 mm at 0.4 N")
ANTAGONISTIC_LOOP = PublishedLoop(
    13.2e-3, _antagonistic(0.12, 0.24, 0.36, 0.48), "Kato 2016, Results: 13.2 mm at (0.12, 0.48) N"
)


def identify(solve: _Solve, highest_N: float = FULL_REVERSAL_N) -> Identification:
    """Return the friction that the single tendon's opening gives a model, checked on the other opening."""
    found = friction_from_opening(solve, SINGLE_LOOP, highest_N)
    checks = tuple(loop_opening(solve, ANTAGONISTIC_LOOP, mu, highest_N) for mu in found)
    return Identification(highest_N, found, checks)


def loop_opening(solve: _Solve, loop: PublishedLoop, mu: float, highest_N: float) -> float:
    """Return the distance of a model's tips in arching and extending [m].

    Args:
        solve: a static model of `neuroendoscope_section`.
        loop: which tensions.
        mu: friction coefficient.
        highest_N: right tendon's tension from which extending starts.
    """
    right, left = loop.arching[-1]
    rows = (*loop.arching, (highest_N, left), (right, left))
    tips = _tips(solve, rows, mu)
    return float(np.linalg.norm(tips[-1] - tips[len(loop.arching) - 1]))


def friction_from_opening(solve: _Solve, loop: PublishedLoop, highest_N: float) -> tuple[float, ...]:
    """Return the values of mu in 0 to 1 that give the loop's published opening; often two, or none."""
    return _crossings(lambda mu: loop_opening(solve, loop, mu, highest_N), loop.opening_m, _MU_GRID)


def highest_tension_from_opening(solve: _Solve, loop: PublishedLoop, mu: float) -> tuple[float, ...]:
    """Return the tensions [N] from which extending must start to give the loop's published opening."""
    grid = loop.arching[-1][0] + _TENSION_GRID_N
    return _crossings(lambda tension: loop_opening(solve, loop, mu, tension), loop.opening_m, grid)


def _tips(solve: _Solve, rows: tuple[tuple[float, float], ...], mu: float) -> Array:
    robot = replace(neuroendoscope_section(), friction=Friction(mu))
    count = len(rows)
    inputs = Inputs(
        np.arange(count, dtype=float), "tension", np.array(rows), np.zeros((count, 3)), np.zeros((count, 3))
    )
    return np.array([item.p_w[-1] for item in solve(robot, inputs, np.zeros(3)).postures])


def _crossings(function: Callable[[float], float], value: float, grid: Array) -> tuple[float, ...]:
    """Return where `function` takes `value` on `grid`; where it only jumps across, that is left out."""

    def excess(x: float) -> float:
        return function(x) - value

    excesses = [excess(float(x)) for x in grid]
    found = []
    for i in range(len(grid) - 1):
        if excesses[i] * excesses[i + 1] < 0.0:
            root = float(brentq(excess, float(grid[i]), float(grid[i + 1]), xtol=1e-6))
            if abs(excess(root)) < _SAME_OPENING_M:
                found.append(root)
    return tuple(found)
