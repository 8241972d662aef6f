"""Which of the simulator's laws a robot needs beside MuJoCo's own step, in the order of their turns."""

from __future__ import annotations

from catheter_sim.gpu.device import Copies, Law
from catheter_sim.simulation.elastic_law import ElasticRemainder
from catheter_sim.simulation.friction import CapstanFriction
from catheter_sim.simulation.rolling import RodElasticity
from catheter_sim.simulation.simulator import Simulator


def laws_of(simulator: Simulator, driven: bool, copies: Copies) -> list[Law]:
    """Return the laws of a simulator for its copies.

    Args:
        simulator: at rest.
        driven: whether displacements are the inputs.
        copies: where they run.
    """
    # Their kernels need Warp, which is an extra.
    from catheter_sim.gpu.catheter import Resistance, Stretching, Tubes
    from catheter_sim.gpu.drive import Drive, Torsion
    from catheter_sim.gpu.elastic import Elastic
    from catheter_sim.gpu.friction import Friction
    from catheter_sim.gpu.rolling import Rolling

    model, parts, catheter = simulator.model, simulator.parts(), simulator.parts().catheter
    drive = Drive(copies, model, parts, driven)
    friction: Friction | None = None
    if isinstance(parts.friction, CapstanFriction):
        measured = catheter is not None and bool(catheter.resistances)
        friction = Friction(copies, model, parts.friction, drive, measured)
    laws: list[Law] = []
    if isinstance(parts.elastic, RodElasticity) and parts.rolling is not None:
        tension = None if friction is None else friction.tension
        laws.append(Rolling(copies, parts.rolling, parts.elastic, drive, tension))
    if catheter is not None:
        if catheter.tubes:
            laws.append(Tubes(copies, catheter.tubes))
        if catheter.resistances:
            laws.append(Resistance(copies, catheter.resistances))
        if len(catheter.torsion):
            laws.append(Torsion(copies, catheter))
        if catheter.stretching:
            laws.append(Stretching(copies, catheter.stretching))
    if driven or friction is not None:
        laws.append(drive)
    if isinstance(parts.elastic, ElasticRemainder):
        laws.append(Elastic(copies, parts.elastic))
    if friction is not None:
        laws.append(friction)
    return laws
