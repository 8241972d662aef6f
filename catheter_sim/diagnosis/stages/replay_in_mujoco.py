"""The held-out trials replayed in MuJoCo, and the causes weighed once more beside that.

Where the simulation differs from the twin, it would change the fitted numbers; their intervals are widened by
as much, and a cause whose numbers may then be nothing is taken out.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.causes.weighing import weigh
from catheter_sim.diagnosis.fitting.intervals import shift_by_model
from catheter_sim.diagnosis.fitting.prediction import as_measured, robot_with
from catheter_sim.diagnosis.stages.choose_causes import Choice
from catheter_sim.diagnosis.stages.decide_on_heldout import Settled, with_plausible_causes
from catheter_sim.diagnosis.stages.judge import Verdict
from catheter_sim.diagnosis.stages.pose import Posed
from catheter_sim.diagnosis.stages.run import Run
from catheter_sim.diagnosis.verdict.replay import Replay, replays


@dataclass(frozen=True)
class Replayed:
    """What the simulation does on the held-out trials.

    Attributes:
        replays: one of each trial; (): none was asked for.
        shift: by how much the simulation would change the numbers of the reported hypothesis, in their
            scales, shape (p,); None: unknown.
    """

    replays: tuple[Replay, ...] = ()
    shift: Array | None = None


def replay_in_mujoco(run: Run, posed: Posed, verdict: Verdict, simulation: bool) -> Replayed:
    """Return the held-out trials replayed with the reported hypothesis.

    Args:
        run: where to simulate.
        posed: the trials.
        verdict: has the hypothesis.
        simulation: False: nothing is replayed.
    """
    if not simulation:
        return Replayed()
    run.say("replaying in MuJoCo")
    problem, shown = posed.train, verdict.shown
    robot = robot_with(problem, shown.numbers, shown.x)
    trials, gravity_mps2 = posed.heldout.trials, posed.dataset.gravity_mps2
    found = tuple(
        replace(item, outputs=as_measured(problem, shown.numbers, shown.x, item.outputs))
        for item in replays(robot, trials, problem.columns, gravity_mps2, run.pool, problem.moving)
    )
    return Replayed(found, shift_by_model(posed.heldout, shown, [item.outputs for item in found]))


def weigh_again(run: Run, posed: Posed, choice: Choice, settled: Settled, replayed: Replayed) -> Settled:
    """Return the hypothesis with its causes weighed by the intervals that the simulation widens."""
    if replayed.shift is None or not settled.weighed.after.terms:
        return settled
    again = weigh(settled.scales, settled.weighed, replayed.shift)
    if again.after is settled.weighed.after:
        return replace(settled, weighed=again)
    return with_plausible_causes(run, posed, choice, settled.scales, again, settled.equals, settled.soaked)
