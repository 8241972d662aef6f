"""The static models of all kinds by name: the one list that command line, validation and tests read.

A kind's own models (`robots/<kind>/statics.py`) know no effects. These are put around here, once for all.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

from catheter_sim.arrays import Array
from catheter_sim.channels import outputs_of
from catheter_sim.core.inputs import Inputs, require_tip_loads_alone, with_tip_weight
from catheter_sim.core.kind import Kind
from catheter_sim.core.robot import RobotSpec
from catheter_sim.core.statics import StaticModel, StaticRun
from catheter_sim.effects.apply import in_force, with_built_in_effects
from catheter_sim.effects.varying import mixed, mixed_postures, varies, without_variations
from catheter_sim.errors import InputError, unknown
from catheter_sim.robots import KINDS, kind_of


@dataclass(frozen=True)
class TheoryModel:
    """A static model of one kind, for robots with effects.

    Attributes:
        kind: of robots, the only one that it knows.
        model: the kind's own, without effects.
    """

    kind: Kind[Any]
    model: StaticModel[Any]

    @property
    def name(self) -> str:
        """As on the command line."""
        return self.model.name

    @property
    def summary(self) -> str:
        """What it is and where it comes from, one line."""
        return self.model.summary

    @property
    def law(self) -> Callable[[Any, Inputs, Array], StaticRun]:
        """Robot, arriving inputs and gravity to the postures; the robot's `effects` are not read."""
        return self.model.law

    def applies_to(self, robot: RobotSpec) -> bool:
        """Return whether the model knows `robot`, its effects included."""
        return kind_of(robot) is self.kind and not self.lacks(robot)

    def lacks(self, robot: RobotSpec) -> str:
        """Return what of `robot`, of the model's kind, it does not know, in words; "" if nothing."""
        return self.model.lacks(with_built_in_effects(without_variations(robot)) if robot.effects else robot)

    def solve(self, robot: RobotSpec, inputs: Inputs, gravity_mps2: Array) -> StaticRun:
        """Return what is observed of `robot` with its effects, row after row, as inputs are commanded.

        Args:
            robot: as it is specified, of a kind that the model applies to.
            inputs: as commanded; `inputs` of the result are those, too.
            gravity_mps2: in the base frame, shape (3,) [m/s^2].

        Raises:
            InputError: an effect is not possible, the model does not carry the robot, or a row has no
                balance.
        """
        require_tip_loads_alone(inputs, f"static model {self.name!r}")
        if varies(robot):
            mix = mixed(robot, inputs, outputs_of(robot).elements)
            runs = [self.solve(leaf, inputs, gravity_mps2) for leaf in mix.robots]
            return replace(runs[0], postures=mixed_postures(mix, [run.postures for run in runs]))
        acting = in_force(robot, inputs)
        arriving = with_tip_weight(acting.inputs, acting.robot.tip_mass_kg, gravity_mps2)
        run = self.law(acting.robot, arriving, gravity_mps2)
        if not robot.effects and arriving is inputs:
            return run
        return replace(run, inputs=inputs, postures=acting.observed(run.postures))


def _of_all_kinds() -> Iterator[TheoryModel]:
    for kind in KINDS.values():
        for model in kind.statics.MODELS:
            yield TheoryModel(kind, model)


def static_model(name: str, robot: RobotSpec, where: str) -> TheoryModel:
    """Return a static model by its name.

    `where`: what to call the robot in an error.

    Raises:
        InputError: there is no such model, or it does not know the robot.
    """
    fitting = [item.name for item in STATIC_MODELS.values() if item.applies_to(robot)]
    if name in fitting:
        return STATIC_MODELS[name]
    model = STATIC_MODELS.get(name)
    lacking = model.lacks(robot) if model is not None and model.kind is kind_of(robot) else ""
    if lacking:
        listed = ", ".join(fitting) or "(none)"
        raise InputError(
            f"{where}: static model {name!r} does not carry this robot: {lacking}; choices: {listed}"
        )
    raise unknown("static model", name, fitting, where)


STATIC_MODELS: dict[str, TheoryModel] = {item.name: item for item in _of_all_kinds()}
