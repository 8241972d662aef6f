"""Simulated tendons of a catheter's bending joints that stretch by Nayar 2023, Algorithm 1.

A pair whose `law` is "uhmwpe" stretches over its `length_m` by `elongation.PRINTED`, permanent set and
cycles included, in series with its own stiffness. Before each step its actuator is made the tangent of
that law at the present stretch, so that the integrator knows its stiffness.

Every turn of the strain is a new cycle to the law. Strains that go back by less than `SHAKE` are not:
they would be the settling of the simulation or the noise of a controller's sensor, far below any cycle
that was measured, and are answered along the curve that is left.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from catheter_sim.arrays import Array
from catheter_sim.core.law import Law, RobotInModel, Step
from catheter_sim.kinds.catheter.forces.controls import PairControls
from catheter_sim.kinds.catheter.spec import CatheterRobot, TendonPair
from catheter_sim.kinds.catheter.theory.elongation import (
    PRINTED,
    TendonLaw,
    TendonState,
    permanent_set,
    stretched,
)

SHAKE = 1e-4  # strain: 0.035 mm of 350 mm
DIFFERENCE = 1e-7  # strain, for a slope
LARGEST_STRAIN = 0.5  # no tendon comes near


@dataclass(frozen=True)
class Stretched:
    """A tendon at a stretch.

    Attributes:
        tension_N: below zero where it is slack [N].
        stiffness_N_per_m: slope of the tension over the stretch [N/m].
    """

    tension_N: float
    stiffness_N_per_m: float


class StretchingTendon:
    """One tendon and its history.

    Attributes:
        length: over which it stretches by the law [m].
        compliance: of what is in series with it [m/N].
        state: its history.
    """

    def __init__(self, length_m: float, stiffness_N_per_m: float, law: TendonLaw = PRINTED) -> None:
        """Start with a new tendon.

        Args:
            length_m: over which it stretches by the law.
            stiffness_N_per_m: of what is in series with it; inf: nothing.
            law: parameters of Algorithm 1.
        """
        self.length, self.compliance, self._law = length_m, 1.0 / stiffness_N_per_m, law
        self.state = TendonState()

    def reset(self) -> None:
        """Return to a new tendon."""
        self.state = TendonState()

    def at(self, stretch_m: float) -> Stretched:
        """Return the tendon at a stretch [m], and remember that it was there."""
        law, before = self._law, self.state
        strain = self._strain(stretch_m)
        new = before.phase == "loading" and (before.strain <= 0.0 or strain > 0.0)
        slack = 0.0 if new else permanent_set(law, before)
        state = stretched(law, before, strain)
        forward = strain >= before.strain
        first_slope = law.envelope_N[2] / self.length
        soft = 1.0 / (1.0 / first_slope + self.compliance)
        if state.tension_N <= 0.0:
            # Below zero it says how far it is from being taut, as a slack spring does.
            result = Stretched(soft * min(stretch_m - slack * self.length, 0.0), soft)
        else:
            step = DIFFERENCE if forward else -DIFFERENCE
            slope = (stretched(law, before, strain + step).tension_N - state.tension_N) / step
            slope = max(slope, law.envelope_N[2]) / self.length
            result = Stretched(state.tension_N, 1.0 / (1.0 / slope + self.compliance))
        if _goes_on(before, strain) or abs(strain - before.strain) > SHAKE:
            self.state = state
        return result

    def _strain(self, stretch_m: float) -> float:
        """Return the strain of the law's part of a stretch in series with the spring."""
        if self.compliance == 0.0 or stretch_m <= 0.0:
            return stretch_m / self.length

        def excess(strain: float) -> float:
            tension = stretched(self._law, self.state, strain).tension_N
            return strain * self.length + tension * self.compliance - stretch_m

        return float(brentq(excess, 0.0, min(stretch_m / self.length, LARGEST_STRAIN), xtol=1e-14))


@dataclass(frozen=True)
class StretchArrays:
    """The stretching tendons of a model as plain arrays, each of shape (k,), for where they run elsewhere.

    Attributes:
        actuators, tendons: in MuJoCo.
        rest: unstretched lengths [m].
        length, compliance: as of `StretchingTendon` [m, m/N].
        law: of all.
    """

    actuators: np.ndarray
    tendons: np.ndarray
    rest: Array
    length: Array
    compliance: Array
    law: TendonLaw


class StretchLaws(Law):
    """The stretching tendons of a model, in the order of the actuators that pull them."""

    def __init__(self, robot: CatheterRobot, place: RobotInModel, controls: PairControls) -> None:
        """Find the pairs whose tendons follow the law.

        Args:
            robot: the catheter.
            place: where it is.
            controls: its own, which know the tendons of bending joints.
        """
        model, actuators, pairs = place.model, controls.pulls, controls.pulling_pair
        chosen = [index for index, pair in enumerate(pairs) if stretches(robot.tendons[pair])]
        self._places = np.array(chosen, dtype=int)
        self._actuators = actuators[self._places]
        items = [robot.tendons[int(pairs[index])] for index in chosen]
        self._tendons = [StretchingTendon(item.length_m, item.stiffness_N_per_m, PRINTED) for item in items]
        self._ids = model.actuator_trnid[self._actuators, 0]
        self._rest = model.tendon_lengthspring[self._ids, 0] + np.array([item.slack_m for item in items])
        self._model = model
        self._own = (
            model.actuator_gainprm[self._actuators].copy(),
            model.actuator_biasprm[self._actuators].copy(),
        )

    def layout(self) -> StretchArrays:
        """Return the tendons as plain arrays."""
        return StretchArrays(
            actuators=self._actuators,
            tendons=self._ids,
            rest=self._rest,
            length=np.array([tendon.length for tendon in self._tendons]),
            compliance=np.array([tendon.compliance for tendon in self._tendons]),
            law=PRINTED,
        )

    def reset(self) -> None:
        """Return to new tendons."""
        gain, bias = self._model.actuator_gainprm, self._model.actuator_biasprm
        gain[self._actuators], bias[self._actuators] = self._own
        for tendon in self._tendons:
            tendon.reset()

    def actuate(self, step: Step) -> None:
        """Make the actuators the tangents of the law at the present lengths and controls."""
        data, pulls = step.data, step.pulls
        stretch = data.ctrl[self._actuators] + data.ten_length[self._ids] - self._rest
        for place, actuator, tendon, own in zip(
            self._places, self._actuators, self._tendons, stretch, strict=True
        ):
            found = tendon.at(float(own))
            slope = found.stiffness_N_per_m
            rest = data.ctrl[actuator] + data.ten_length[self._model.actuator_trnid[actuator, 0]]
            pulls.gain[place] = pulls.length_gain[place] = -slope
            pulls.bias[place] = slope * rest - found.tension_N
            self._model.actuator_gainprm[actuator, 0] = -slope
            self._model.actuator_biasprm[actuator, :2] = pulls.bias[place], -slope
        step.pulls_changed = True


def stretches(pair: TendonPair) -> bool:
    """Return whether a pair's tendons follow the measured law."""
    return pair.law == "uhmwpe"


def _goes_on(state: TendonState, strain: float) -> bool:
    """Return whether a strain continues the tendon's phase."""
    onward = strain - state.strain
    return onward <= 0.0 if state.phase == "unloading" else onward >= 0.0 or not math.isfinite(onward)
