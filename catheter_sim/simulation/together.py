"""Steps and settles a model that holds several robots, each with its own laws.

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

A step moves the whole model, so it needs the laws of every robot in it. A `Simulator` therefore takes the
others of its state along, whichever of them is asked; one that is no longer kept anywhere is left out.

What the rest of the model needs in each step goes between these halves. Call `before_step` of every
simulator, then `mj_step1`, make `data.qfrc_applied` zero or what else is wanted, call `between` of every
simulator, then `mj_step2`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING
from weakref import WeakValueDictionary

import mujoco

from catheter_sim.errors import InputError, shown

if TYPE_CHECKING:
    from catheter_sim.simulation.simulator import Simulator

SETTLE_BLOCK_S = 0.05  # simulated time between two looks whether robots are at rest

# The robots of every state that is shared: number of the `MjData` object and prefix -> simulator. Each holds
# its `MjData`, so a number cannot pass to another one while its entry is here.
_SHARING: WeakValueDictionary[tuple[int, str], Simulator] = WeakValueDictionary()


def share(simulator: Simulator) -> None:
    """Let the others that stand on this simulator's state know it; it replaces one with the same prefix."""
    _SHARING[id(simulator.data), simulator.place.prefix] = simulator


def sharing(simulator: Simulator) -> list[Simulator]:
    """Return all simulators of this one's model and state, itself among them.

    Raises:
        InputError: another one has been made with its prefix, for the same state.
    """
    own = id(simulator.data)
    if not simulator.shares:
        return [simulator]
    if _SHARING.get((own, simulator.place.prefix)) is not simulator:
        raise InputError(
            f"{simulator.robot.name}: a newer Simulator has the prefix {simulator.place.prefix!r} in the "
            "same data: use that one"
        )
    return [other for (data, _), other in list(_SHARING.items()) if data == own]


def step_together(simulators: Sequence[Simulator], count: int = 1) -> None:
    """Take `count` steps of the one model that several robots are in, each under its present inputs.

    Simulators that stand on the same model and data and are not given are taken along.
    `data.qfrc_applied` is the laws' own: forces on the rest of the model go into `data.xfrc_applied`.

    Args:
        simulators: of one model and data.
        count: number of steps.

    Raises:
        InputError: no simulator, they have not one model and data in common, or a newer one has taken the
            place of one of them.
        SimulationDiverged: a law fails on a state that is not finite; otherwise only
            `Simulator.require_finite` looks.

    Examples:
        >>> import catheter_sim as cs
        >>> import mujoco
        >>> robot, spec = cs.load_robot("neuroendoscope_section"), mujoco.MjSpec()
        >>> for prefix in ("left_", "right_"):
        ...     cs.attach(spec, robot, spec.worldbody.add_frame(), prefix)
        >>> model = spec.compile()
        >>> data = mujoco.MjData(model)
        >>> both = [cs.Simulator(robot, model=model, data=data, prefix=p) for p in ("left_", "right_")]
        >>> cs.step_together(both, 10)
        >>> round(data.time / model.opt.timestep)
        10
    """
    _all_of("step_together", simulators)[0].step(count)


def settle_together(simulators: Sequence[Simulator], longest_s: float = 5.0) -> bool:
    """Step under the present inputs until all robots of one model are at rest; return whether they are.

    Args:
        simulators: of one model and data; others of the same are taken along.
        longest_s: simulated time after which it gives up [s].

    Raises:
        InputError: as `step_together`.
        SimulationDiverged: the state of one of them is not finite.

    Examples:
        >>> import catheter_sim as cs
        >>> import mujoco
        >>> robot, spec = cs.load_robot("neuroendoscope_section"), mujoco.MjSpec()
        >>> spec.option.gravity = [0.0, 0.0, 0.0]
        >>> for prefix in ("left_", "right_"):
        ...     cs.attach(spec, robot, spec.worldbody.add_frame(), prefix)
        >>> model = spec.compile()
        >>> data = mujoco.MjData(model)
        >>> both = [cs.Simulator(robot, model=model, data=data, prefix=p) for p in ("left_", "right_")]
        >>> both[0].set_inputs([0.4, 0.0])
        >>> cs.settle_together(both)
        True
        >>> [(1e3 * item.posture().p_w[-1]).round(1).tolist() for item in both]
        [[40.5, 0.0, 36.0], [0.0, 0.0, 60.0]]
    """
    everyone = _all_of("settle_together", simulators)
    first = everyone[0]
    steps = max(1, round(SETTLE_BLOCK_S / first.model.opt.timestep))
    for _ in range(max(1, round(longest_s / (steps * first.model.opt.timestep)))):
        first.step(steps)
        for item in everyone:
            item.require_finite()
        if all(item.at_rest() for item in everyone):
            return True
    return False


def take_steps(simulators: Sequence[Simulator], count: int) -> None:
    """Take `count` steps of a model with the laws of all robots that share it."""
    model, data = simulators[0].model, simulators[0].data
    for _ in range(count):
        for item in simulators:
            item.before_step()
        mujoco.mj_step1(model, data)
        data.qfrc_applied[:] = 0.0
        for item in simulators:
            item.between()
        mujoco.mj_step2(model, data)


def _all_of(what: str, simulators: Sequence[Simulator]) -> list[Simulator]:
    """Return all simulators of the model and data that those given have in common."""
    given = list(simulators) if isinstance(simulators, Sequence) else []
    if not given or not all(hasattr(item, "before_step") for item in given):
        raise InputError(f"{what}: simulators = {shown(simulators)}: a list of Simulators is needed")
    model, data = given[0].model, given[0].data
    if any(item.model is not model or item.data is not data for item in given):
        names = ", ".join(item.robot.name for item in given)
        raise InputError(f"{what}: {names}: not in one model with one state: give them the same data=")
    found = [sharing(item) for item in given]
    return found[0]
