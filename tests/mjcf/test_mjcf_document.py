"""A model's tree: what is set is in the text, to the digits that a file needs, however deep it is."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.mjcf.document import ALL_DIGITS, Element, read
from catheter_sim.modelling.build import build_mjcf


def test_numbers_have_twelve_digits() -> None:
    """Of a number, of every one in a row; truth values, whole numbers and texts as MJCF has them."""
    item = Element("joint", name="x", range=(-math.pi, np.float64(1e-17)), limited=True, group=5)
    item.set(pos=np.array([1.0, 0.1 + 0.2, 2e6 / 3.0]), axis="0 0 1", stiffness=1.0 / 3.0, damping=None)
    assert item.text() == (
        '<joint name="x" range="-3.14159265359 1e-17" limited="true" group="5" '
        'pos="1 0.3 666666.666667" axis="0 0 1" stiffness="0.333333333333"/>\n'
    )
    assert 'stiffness="0.3333333333333333"' in item.text(ALL_DIGITS)
    assert item.numbers("pos")[1] == 0.1 + 0.2  # not what is written
    assert item.numbers("axis") == [0.0, 0.0, 1.0]
    assert item.numbers("margin", 0.5) == [0.5]


def test_an_attribute_can_be_taken_out() -> None:
    """What is None is not written, whether it was there before or not."""
    item = Element("geom", mass=0.0, margin=None)
    item.set(mass=None, gap=None)
    assert item.text() == "<geom/>\n"
    assert item.get("mass", "none") == "none"


def test_a_thousand_bodies_inside_one_another() -> None:
    """They are written, read, searched and counted; Python's own limit of calls is lower."""
    root = Element("mujoco")
    body = root.part("worldbody")
    for k in range(1000):
        body = body.add("body", name=f"link_{k}")
    body.add("site", name="tip", pos=(0.0, 0.0, 1e-3))
    again = read(root.text())
    assert again.text() == root.text()
    assert [item.get("name") for item in again.every("body")] == [f"link_{k}" for k in range(1000)]
    assert again.find("site", "tip").parent.get("name") == "link_999"


def test_elements_are_found_moved_and_removed() -> None:
    """An element is in one place; what was removed is neither found nor written."""
    root = read(
        "<mujoco><worldbody><body name='a'><site name='s'/></body><body name='b'/></worldbody></mujoco>"
    )
    a, b, site = root.find("body", "a"), root.find("body", "b"), root.find("site", "s")
    b.append(site)
    assert site.parent is b
    assert not a.children
    a.remove()
    assert root.text() == (
        '<mujoco>\n  <worldbody>\n    <body name="b">\n      <site name="s"/>\n    </body>\n'
        "  </worldbody>\n</mujoco>\n"
    )
    for tag, name in (("body", "a"), ("geom", "s"), ("site", "t")):
        with pytest.raises(KeyError, match=f"no {tag} '{name}'"):
            root.find(tag, name)
    assert root.part("worldbody") is b.parent
    assert root.part("option") in root.children


def test_texts_keep_their_signs() -> None:
    """Signs that mean something in XML, line ends and letters of any script come back as they were."""
    said = "a < b & \"c\" 'd'\n\tµ > ü"
    assert read(Element("text", data=said).text()).get("data") == said


def test_mujoco_refuses_a_name_that_is_there_twice() -> None:
    """The tree itself does not look: who writes a model has it compiled."""
    root = Element("mujoco")
    for _ in range(2):
        root.part("worldbody").add("site", name="tip")
    with pytest.raises(ValueError, match="repeated name 'tip'"):
        mujoco.MjModel.from_xml_string(root.text())


@pytest.mark.slow
@pytest.mark.parametrize("name", ["neuroendoscope_section", "mitral_4dof"])
def test_what_is_written_is_read_and_written_alike(name: str) -> None:
    """Reading a robot's model and writing it again changes no letter, whatever numbers are in it."""
    text = build_mjcf(load_robot(name), motion=True)
    assert read(text).text() == text
    assert "class=" not in text
