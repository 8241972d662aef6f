"""Claims about the published wrist as data: sources, checks, and its way through a file."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from notched_cases import WRIST, changed

from catheter_sim.core.document import from_document, leaves, number_at, to_document
from catheter_sim.errors import InputError
from catheter_sim.robots.notched_tube import published
from catheter_sim.robots.notched_tube.description import check, joint_names, length_m, notches
from catheter_sim.robots.notched_tube.section import section
from catheter_sim.robots.notched_tube.spec import NotchedTubeRobot

DESIGNS = (published.notched_wrist, published.notched_wrist_script, published.notched_wrist_design)


@pytest.mark.parametrize("design", DESIGNS)
def test_every_number_has_a_source(design) -> None:
    """Each number is covered by a source that names a work or says that it is assumed; none is idle."""
    robot = design()

    def covered(key: str, sources: dict[str, str]) -> bool:
        parts = key.split(".")
        return any(sources.get(".".join(parts[:n]), "").strip() for n in range(1, len(parts) + 1))

    keys = [key for key, _ in leaves(to_document(robot))]
    assert [key for key in keys if not covered(key, dict(robot.sources))] == []
    for key, text in robot.sources.items():
        assert any(word in text for word in ("assumed", "by definition", "201", "202")), key
        rest = {name: other for name, other in robot.sources.items() if name != key}
        assert not all(covered(item, rest) for item in keys), key


@pytest.mark.parametrize("design", DESIGNS)
def test_file_and_back(design) -> None:
    """A robot written as a document and read again is the same, to the digits that a file keeps."""
    robot = design()
    again = from_document(NotchedTubeRobot, to_document(robot), "file")
    check(again, "file")
    assert dict(leaves(to_document(again))) == pytest.approx(dict(leaves(to_document(robot))))
    assert again.segments[0].notch_depth_m == pytest.approx(robot.segments[0].notch_depth_m)


def test_numbers_to_calibrate_exist() -> None:
    """What may be calibrated are numbers of the robot."""
    assert all(math.isfinite(number_at(WRIST, key)) for item in published.UNCERTAIN for key in item.keys)


def test_area_of_the_mass_is_the_section() -> None:
    """The area that the mass is computed with is what the notches leave."""
    assert section(WRIST.segments[0]).area_m2 == pytest.approx(published.AREA_M2, rel=1e-3)


def test_layout_stacks_notches_and_uncut_tube() -> None:
    """Notch after notch with its uncut piece, the last one's being the tip's."""
    row = notches(WRIST)
    assert [item.index for item in row] == [1, 2, 3, 4, 5]
    assert np.diff([item.low_z_m for item in row]) == pytest.approx(1.018e-3)
    assert length_m(WRIST) == pytest.approx(5 * 0.508e-3 + 4 * 0.51e-3 + 1.5e-3)
    assert joint_names(WRIST)[::5] == ["x1", "y1", "t1"]
    assert joint_names(replace(WRIST, bending_axes="x")) == ["x1", "x2", "x3", "x4", "x5"]


@pytest.mark.parametrize(
    ("robot", "text"),
    [
        (changed(notch_depth_m=1.2e-3), "notch_depth_mm = 1.2"),
        (changed(inner_radius_m=0.6e-3), "inner_radius_mm = 0.6"),
        (changed(notches=0), "notches = 0"),
        (changed(cut="round"), "cut"),
        (changed(tendon={"radius_m": 0.7e-3}), "radius_mm = 0.7"),
        (changed(tendon={"radius_m": 0.1e-3}), "free channel"),
        (changed(tendon={"stiffness_N_per_m": 0.0}), "stiffness_N_per_mm = 0"),
        (changed(metal=replace(WRIST.material, plateau_slope=1.5)), "plateau_slope = 1.5"),
        (changed(metal=replace(WRIST.material, modulus_Pa=-1.0)), "modulus_Pa = -1"),
        (changed(rest_curvature_x_per_m=900.0), "rest_curvature_x_per_m = 900"),
        (replace(WRIST, actuation="pressure"), "actuation"),
        (replace(WRIST, tendons=WRIST.tendons * 2), "2 tendons"),
        (replace(WRIST, tip_length_m=0.0), "tip_length_mm = 0"),
        (changed(mu=-0.1), "friction.mu = -0.1"),
    ],
)
def test_impossible_numbers_are_named(robot: NotchedTubeRobot, text: str) -> None:
    """One line names the number that is impossible; the wrist itself passes."""
    check(WRIST, "wrist")
    with pytest.raises(InputError, match="wrist") as caught:
        check(robot, "wrist")
    assert text in str(caught.value)
