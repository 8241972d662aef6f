"""What the held-out trials say of the chosen causes.

They decide between hypotheses that do as well on the training trials, and a cause that does not pay there is
taken out.
"""

from __future__ import annotations

from dataclasses import dataclass

from catheter_sim.diagnosis.causes.heldout_choice import choose_on_heldout
from catheter_sim.diagnosis.causes.weighing import Scales, Weighed, weigh, with_shares
from catheter_sim.diagnosis.fitting.fit import Fit
from catheter_sim.diagnosis.fitting.noise import times_noise
from catheter_sim.diagnosis.stages.calibrate import Calibrated, noise_beside
from catheter_sim.diagnosis.stages.choose_causes import Choice
from catheter_sim.diagnosis.stages.pose import Posed
from catheter_sim.diagnosis.stages.run import Run
from catheter_sim.diagnosis.verdict.heldout_figures import held_out


@dataclass(frozen=True)
class Settled:
    """The hypothesis that the held-out trials leave.

    Attributes:
        scales: on what its causes were weighed: noise, unit, where to fit.
        weighed: it, its held-out figures, and what was taken out.
        equals: hypotheses that do as well on both parts, one other effect in each.
    """

    scales: Scales
    weighed: Weighed
    equals: tuple[Fit, ...]

    @property
    def unit(self) -> str:
        """Return the unit that is reported first: the worst explained one."""
        return self.scales.unit


def nothing_settled(run: Run, posed: Posed, before: Calibrated) -> Settled:
    """Return the calibrated model without causes, where none could be decided on."""
    train, heldout = posed.train, posed.heldout
    by_unit = held_out(train, heldout, before.fit, before.fit, before.noise)
    unit = max(by_unit, key=lambda name: times_noise(by_unit[name].rmse_after, by_unit[name].noise_floor))
    scales = Scales(train, heldout, before.fit, before.noise, unit, posed.thorough, run.pool)
    return Settled(scales, Weighed(before.fit, by_unit, ()), ())


def decide_on_heldout(run: Run, posed: Posed, before: Calibrated, choice: Choice) -> Settled:
    """Return what the held-out trials leave of the chosen causes."""
    train, heldout = posed.train, posed.heldout
    after, equals = choose_on_heldout(
        train, heldout, choice.fit, choice.selection.equals, posed.thorough, run.pool
    )
    noise = noise_beside(train, after)
    by_unit = held_out(train, heldout, before.fit, after, noise)
    unit = max(by_unit, key=lambda name: times_noise(by_unit[name].rmse_after, by_unit[name].noise_floor))
    run.say("weighing the causes")
    scales = Scales(train, heldout, before.fit, noise, unit, posed.thorough, run.pool)
    return Settled(scales, weigh(scales, with_shares(scales, after)), equals)
