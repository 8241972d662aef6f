"""The zero of the input channels is wrong, pretension included."""

from __future__ import annotations

from catheter_sim.core.effect import Effect, Form, Stage
from catheter_sim.effects.shared import common_then_each, shift_names, shift_parameters, shifted

# Bound, and a change that matters: in mm, or in tensions that bend the robot by a radian.
_SIZE = {"N": (100.0, 0.25), "mm": (5.0, 0.1)}
_OFFSET = "offset"


EFFECT = Effect(
    name="actuation_offset",
    summary="the input channels' zero is wrong, so input + offset + offset_<channel> arrives",
    trace="an error that is there at zero input already, and does not depend on direction",
    bench="At zero command, measure every tendon's tension or position at the robot. Set zero and "
    "pretension again before each recording.",
    forms=(
        Form(
            name="zero",
            equation="u' = u + offset + offset_<channel>",
            stage=Stage.COMMAND,
            parameters=lambda robot: shift_parameters(robot, _OFFSET, _SIZE),
            groups=lambda robot: common_then_each(robot, *shift_names(robot, _OFFSET)),
            command=lambda robot, inputs, values: shifted(robot, inputs, _OFFSET, values),
            varies=("level", "sign", "direction", "outward", "largest"),  # with time or the way it is drift
        ),
    ),
)
