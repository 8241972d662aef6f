"""What a model shows does not change how it moves."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.modelling import build
from catheter_sim.robots import kind_of


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["neuroendoscope_section", "spacer_disk", "chest_tube", "chest_tube_section@prototype"]
)
def test_meshes_have_no_mass_and_no_contact(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """With and without its meshes a model has the same masses, inertias and mass matrix."""
    robot = load_robot(name)
    shown = mujoco.MjModel.from_xml_string(build.build_mjcf(robot))
    monkeypatch.setattr(kind_of(robot).model, "add_parts", lambda root, bodies, meshes, parts_of: None)
    bare = mujoco.MjModel.from_xml_string(build.build_mjcf(robot))
    assert shown.ngeom > 0
    assert bare.ngeom == 0
    for field in ("body_mass", "body_inertia", "body_ipos", "dof_M0", "dof_invweight0"):
        assert np.array_equal(getattr(shown, field), getattr(bare, field)), field
    assert not shown.geom_contype.any()
    assert not shown.geom_conaffinity.any()


def test_geoms_are_named_by_part_and_link() -> None:
    """Every link has a backbone geom that carries the link's number and lies on the link's body."""
    model = mujoco.MjModel.from_xml_string(build.build_mjcf(load_robot("neuroendoscope_section")))
    for link in range(1, 31):
        for prefix in ("backbone", "guide"):
            geom = model.geom(f"{prefix}_{link}")
            assert model.body(geom.bodyid.item()).name == f"link_{link}"
    assert model.geom("backbone_0").bodyid.item() == 0


@pytest.mark.slow
def test_rolling_links_are_named_by_link_and_rods_can_be_told_apart() -> None:
    """Every link has its geom on its own body; a pulled rod has a colour, a passive one is grey."""
    robot = load_robot("chest_tube_section")
    model = mujoco.MjModel.from_xml_string(build.build_mjcf(robot))
    for link in range(1, 16):
        assert model.body(model.geom(f"link_{link}").bodyid.item()).name == f"link_{link}"
    assert model.geom("base_0").bodyid.item() == 0
    active, passive = (model.tendon(f"tendon_{name}").id for name in ("active", "passive"))
    assert np.ptp(model.tendon_rgba[active, :3]) > 0.5
    assert np.ptp(model.tendon_rgba[passive, :3]) < 0.1
    for rod, tendon in ((robot.tendons[0], active), (robot.passive_rods[0], passive)):
        assert model.tendon_width[tendon] == pytest.approx(rod.rod_radius_m)
        assert model.tendon_rgba[tendon, 3] == 1.0
