"""Steps a model that holds several robots, each with its own laws.

    spec = mujoco.MjSpec.from_string(SCENE)                   # an arm, say, with a site "flange"
    attach(spec, section, spec.site("flange"), "section_")    # modelling.attach
    attach(spec, tube, spec.worldbody, "tube_")
    model = spec.compile()
    data = mujoco.MjData(model)
    one = Simulator(section, model=model, data=data, prefix="section_")
    two = Simulator(tube, model=model, data=data, prefix="tube_")
    one.set_inputs(np.array([0.3, 0.0]))
    data.ctrl[model.actuator("shoulder").id] = 0.2            # the rest of the model is driven as ever
    step_together([one, two], 100)
    one.posture().p_w[-1]                                     # in the section's base frame, which moves

What the rest of the model needs in each step goes between these halves: call `before_step` of every
simulator, then `mj_step1`, make `data.qfrc_applied` zero or what else is wanted, call `between` of every
simulator, then `mj_step2`.
"""

from __future__ import annotations

from collections.abc import Sequence

import mujoco

from catheter_sim.errors import InputError
from catheter_sim.simulation.simulator import Simulator


def step_together(simulators: Sequence[Simulator], count: int = 1) -> None:
    """Take `count` steps of the one model that the robots of `simulators` are in, under their inputs.

    `data.qfrc_applied` is the laws' own: forces on the rest of the model go into `data.xfrc_applied`.

    Raises:
        InputError: no simulator, or they have not one model and state in common.
        SimulationDiverged: a law fails on a state that is not finite; otherwise only
            `Simulator.require_finite` looks.
    """
    if not simulators:
        raise InputError("step_together: at least one simulator is needed")
    model, data = simulators[0].model, simulators[0].data
    if any(item.model is not model or item.data is not data for item in simulators):
        names = ", ".join(item.robot.name for item in simulators)
        raise InputError(f"step_together: {names}: not in one model with one state")
    try:
        for _ in range(count):
            for item in simulators:
                item.before_step()
            mujoco.mj_step1(model, data)
            data.qfrc_applied[:] = 0.0
            for item in simulators:
                item.between()
            mujoco.mj_step2(model, data)
    except Exception:
        for item in simulators:
            item.require_finite()  # what failed may be no more than the first to meet a NaN
        raise
