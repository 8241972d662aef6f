"""What the held-out trials say of the chosen causes.

They decide between hypotheses that do as well on the training trials. A cause that does not pay there is
taken out, and so is one whose numbers are not plausible.
"""

from __future__ import annotations

from dataclasses import dataclass

from catheter_sim.diagnosis.causes.again import equals_of
from catheter_sim.diagnosis.causes.heldout_choice import also_equal_on_heldout, choose_on_heldout
from catheter_sim.diagnosis.causes.weighing import Scales, Weighed, weigh, with_shares, without_soaking
from catheter_sim.diagnosis.fitting.fit import Fit
from catheter_sim.diagnosis.fitting.noise import times_noise
from catheter_sim.diagnosis.fitting.problem import Term
from catheter_sim.diagnosis.report.result import Cause
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
        soaked: causes taken out since their numbers are not plausible.
        equals: hypotheses that do as well on both parts, one other effect in each.
    """

    scales: Scales
    weighed: Weighed
    soaked: tuple[Cause, ...]
    equals: tuple[Fit, ...]

    @property
    def unit(self) -> str:
        """Return the unit that is reported first: the worst explained one."""
        return self.scales.unit

    @property
    def terms(self) -> tuple[Term, ...]:
        """Return the causes that the held-out trials leave, plausible or not."""
        return (*self.weighed.after.terms, *(Term(item.name, tuple(item.parameters)) for item in self.soaked))


def nothing_settled(run: Run, posed: Posed, before: Calibrated) -> Settled:
    """Return the calibrated model without causes, where none could be decided on."""
    train, heldout = posed.train, posed.heldout
    by_unit = held_out(train, heldout, before.fit, before.fit, before.noise)
    unit = max(by_unit, key=lambda name: times_noise(by_unit[name].rmse_after, by_unit[name].noise_floor))
    scales = Scales(train, heldout, before.fit, before.noise, unit, posed.thorough, run.pool)
    return Settled(scales, Weighed(before.fit, by_unit, ()), (), ())


def decide_on_heldout(run: Run, posed: Posed, before: Calibrated, choice: Choice) -> Settled:
    """Return what the held-out trials leave of the chosen causes."""
    train, heldout = posed.train, posed.heldout
    after, equals = choose_on_heldout(
        train, heldout, choice.fit, choice.selection.equals, posed.thorough, run.pool
    )
    noise = noise_beside(train, after)
    by_unit = held_out(train, heldout, before.fit, after, noise)
    unit = max(by_unit, key=lambda name: times_noise(by_unit[name].rmse_after, by_unit[name].noise_floor))
    run.say("testing the causes on held-out data")
    scales = Scales(train, heldout, before.fit, noise, unit, posed.thorough, run.pool)
    return with_plausible_causes(
        run, posed, choice, scales, weigh(scales, with_shares(scales, after)), equals
    )


def with_plausible_causes(
    run: Run,
    posed: Posed,
    choice: Choice,
    scales: Scales,
    weighed: Weighed,
    equals: tuple[Fit, ...],
    soaked: tuple[Cause, ...] = (),
) -> Settled:
    """Return a weighed hypothesis without what is not plausible, and with its equals.

    Args:
        run: where to fit.
        posed: the trials.
        choice: the effects that were tried.
        scales: what causes were weighed on.
        weighed: the hypothesis.
        equals: hypotheses that do as well as the one from which causes were taken out.
        soaked: causes that were not plausible before.
    """
    plausible, more = without_soaking(scales, weighed)
    if plausible.after.terms and (more or weighed.weak or weighed.unsure):
        # What was found to be as good was fitted beside causes that are gone now.
        found = equals_of(posed.train, plausible.after, choice.candidates, run.pool)
        equals = also_equal_on_heldout(
            posed.train, posed.heldout, plausible.after, found, posed.thorough, run.pool
        )
    return Settled(scales, plausible, (*soaked, *more), equals if plausible.after.terms else ())
