"""The package's writer of PyMJCF trees against PyMJCF's own."""

from __future__ import annotations

import pytest

from catheter_sim.mjcf import build
from catheter_sim.mjcf._backend import mjcf
from catheter_sim.mjcf.writing import mjcf_text
from catheter_sim.robots.catalogue import load_robot


@pytest.mark.parametrize("reference", ["spacer_disk", "chest_tube_section", "mitral_4dof"])
def test_text_of_a_robot_is_pymjcfs_own(reference: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """For a robot of every kind, character by character."""
    trees: list[mjcf.RootElement] = []

    def keep(root: mjcf.RootElement) -> str:
        trees.append(root)
        return mjcf_text(root)

    monkeypatch.setattr(build, "mjcf_text", keep)
    text = build.build_mjcf(load_robot(reference))
    assert text == trees[0].to_xml_string(precision=9)


@pytest.mark.parametrize("precision", [3, 17])
def test_text_of_odd_names_and_numbers_is_pymjcfs_own(precision: int) -> None:
    """Signs of XML and other alphabets in names, elements without a name, numbers of every size."""
    root = mjcf.RootElement(model='a<b>&"c"\té\'')
    root.option.timestep = 1e-3 / 3.0
    body = root.worldbody.add("body", name="Bär & Söhne", pos=(1e300, -0.0, 1.0 / 3.0))
    body.add("geom", type="sphere", size=(float("inf"),), rgba=(1, 0, 0.5, 1))
    hinge = body.add("joint", name='"', axis=(0, 0, 1), group=3)
    root.actuator.add("motor", joint=hinge, gear=(-1,))
    root.custom.add("text", name="note", data="two\nlines\r")
    assert mjcf_text(root, precision) == root.to_xml_string(precision=precision)
