"""What `SiteTendons` fills in is what the engine alone leaves, number for number."""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np
import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.simulation.simulator import Simulator
from catheter_sim.simulation.site_tendons import SiteTendons, applies

ROBOTS = (
    ("neuroendoscope", [], "tension"),
    ("neuroendoscope_section", ["mount.axial_stiffness_N_per_mm=50"], "displacement"),
    ("spacer_disk", ["disks_per_segment=4", "links_per_subsegment=3"], "tension"),
    (
        "spacer_disk",
        ["disks_per_segment=4", "segments.first.torsion_stiffness_N_mm2=2000"],
        "displacement",
    ),
    ("chest_tube", [], "tension"),
)
# Made from what follows `mj_step1`, or not written by it at all.
LATER = ("efm_", "qH", "flexvert", "buffer", "arena")
FILLED_IN = (
    *("ten_length", "ten_J", "ten_velocity", "ten_wrapadr", "ten_wrapnum", "wrap_obj", "wrap_xpos"),
    *("actuator_length", "actuator_moment", "actuator_velocity"),
)


def differences(data: mujoco.MjData, other: mujoco.MjData) -> dict[str, float]:
    """Return, by name, how far the arrays of two states are apart at most, as a share of their largest."""
    result: dict[str, float] = {}
    for name in dir(data):
        if name.startswith(("_", *LATER)) or callable(getattr(data, name)):
            continue
        one, two = getattr(data, name), getattr(other, name)
        if isinstance(one, np.ndarray) and one.dtype.kind in "fib" and one.size:
            one, two = one.astype(float), two.astype(float)
            result[name] = float(np.abs(one - two).max() / max(1e-12, np.abs(two).max()))
    return result


def moved(model: mujoco.MjModel, seed: int) -> mujoco.MjData:
    """Return a state away from rest, moving and pulled."""
    rng = np.random.default_rng(seed)
    data = mujoco.MjData(model)
    data.qpos[:] = rng.normal(0.0, 0.1, model.nq)
    data.qvel[:] = rng.normal(0.0, 1.0, model.nv)
    data.ctrl[:] = rng.uniform(0.0, 1.0, model.nu) * 1e-3
    return data


@pytest.mark.slow
@pytest.mark.parametrize(("reference", "settings", "actuation"), ROBOTS)
def test_the_state_after_the_first_half_of_a_step_is_the_engines(
    reference: str, settings: Sequence[str], actuation: str
) -> None:
    """Bent, twisted, on a mount that gives way: every array of the state agrees to rounding.

    So do the speeds after the whole step; of disks on a wire whose tendons are held by their length to 1e-6,
    since springs a thousand times as stiff amplify what arrays of 1e-11 leave open.
    """
    model = Simulator(load_robot(reference, settings), actuation).model
    assert applies(model)
    paths = SiteTendons(model)
    here, there = moved(model, 1), moved(model, 1)
    mujoco.mj_step1(model, there)
    with paths.instead_of_the_engine(here):
        mujoco.mj_step1(model, here)
        assert not here.ten_length.any()
        paths.find(here)
    apart = differences(here, there)
    assert set(FILLED_IN) < set(apart)
    assert {name: share for name, share in apart.items() if share > 1e-11} == {}
    assert np.abs(there.ten_J).max() > 1e-4
    for data in (here, there):
        mujoco.mj_step2(model, data)
    share = 1e-6 if (reference, actuation) == ("spacer_disk", "displacement") else 1e-8
    assert here.qvel == pytest.approx(there.qvel, rel=share, abs=share)


def test_the_engine_finds_the_paths_again_afterwards() -> None:
    """Also where a step fails."""
    simulator = Simulator(load_robot("neuroendoscope_section"))
    model = simulator.model
    count = model.tendon_num.copy()
    seen = []

    def fail() -> None:
        with SiteTendons(model).instead_of_the_engine(simulator.data):
            seen.append(int(model.tendon_num.sum()))
            raise RuntimeError

    with pytest.raises(RuntimeError):
        fail()
    assert seen == [0]
    assert model.tendon_num == pytest.approx(count)


PLAIN = """
<mujoco><worldbody><site name="a"/><body pos="0 0 .1"><joint name="j"/><geom size=".01"/><site name="b"/>
</body></worldbody><tendon><spatial name="t" {tendon}><site site="a"/><site site="b"/></spatial>{other}
</tendon>{rest}</mujoco>
"""


@pytest.mark.parametrize(
    ("tendon", "other", "rest", "known"),
    [
        ("", "", "", True),
        ('stiffness="1"', "", "", False),
        ('damping="1"', "", "", False),
        ('armature="1"', "", "", False),
        ('frictionloss="1"', "", "", False),
        ('range="0 1" limited="true"', "", "", False),
        ("", '<fixed name="f"><joint joint="j" coef="1"/></fixed>', "", False),
        ("", "", '<sensor><tendonpos tendon="t"/></sensor>', False),
        ("", "", '<equality><joint joint1="j"/></equality>', False),
    ],
)
def test_it_is_for_tendons_of_which_it_knows_everything(
    tendon: str, other: str, rest: str, known: bool
) -> None:
    """Springs, dampers, limits, sensors, other paths: the engine's own way."""
    model = mujoco.MjModel.from_xml_string(PLAIN.format(tendon=tendon, other=other, rest=rest))
    assert applies(model) is known
