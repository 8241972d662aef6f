"""Columns to SI and back: units, shared channels, and what cannot be an input."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from catheter_sim.catalogue import load_robot
from catheter_sim.channels import (
    check_output_channels,
    input_channels,
    joint_names,
    output_channels,
    read_inputs,
)
from catheter_sim.core.inputs import slice_inputs
from catheter_sim.errors import InputError
from catheter_sim.tables import Table


def table(**columns: list[float]) -> Table:
    """Return a table of the given columns, a second a row."""
    rows = len(next(iter(columns.values())))
    return Table(np.arange(float(rows)), {name: np.array(item, float) for name, item in columns.items()})


def test_input_names_are_those_promised() -> None:
    """The channels' names are part of what users rely on."""
    assert input_channels(load_robot("neuroendoscope_section")) == ["tension_right_N", "tension_left_N"]
    assert input_channels(load_robot("neuroendoscope")) == [
        "tension_distal_right_N",
        "tension_distal_left_N",
        "tension_proximal_right_N",
        "tension_proximal_left_N",
    ]
    assert input_channels(load_robot("spacer_disk"), "displacement") == [
        f"displacement_{name}_mm" for name in "1234"
    ]


def test_output_names_are_those_promised() -> None:
    """Tip, orientation, every cell, every joint, every tendon."""
    names = output_channels(load_robot("neuroendoscope_section"))
    assert names[:7] == ["tip_x_mm", "tip_y_mm", "tip_z_mm", "tip_qw", "tip_qx", "tip_qy", "tip_qz"]
    assert [name for name in names if name.startswith("body_30_")] == [f"body_30_{a}_mm" for a in "xyz"]
    assert "body_31_x_mm" not in names
    assert [name for name in names if name.startswith("joint_")] == [f"joint_x{k}_deg" for k in range(1, 31)]
    assert names[-2:] == ["tension_right_N", "tension_left_N"]


def test_joints_follow_links_axes_and_twist() -> None:
    """Each link has its hinges: one or two that bend, and one that twists where the segment can."""
    robot = load_robot("spacer_disk", ["disks_per_segment=1", "links_per_subsegment=2"])
    assert joint_names(robot) == [f"{axis}{k}" for k in range(1, 5) for axis in "xyt"]
    first, second = robot.segments
    stiff = dataclasses.replace(first, torsion_stiffness_N_m2=np.inf)
    plane = dataclasses.replace(second, torsion_stiffness_N_m2=np.inf, bending_axes="x")
    robot = dataclasses.replace(robot, segments=(stiff, plane))
    assert joint_names(robot) == ["x1", "y1", "x2", "y2", "x3", "x4"]


@settings(max_examples=50, deadline=None)
@given(tension=st.floats(0, 100), displacement=st.floats(-50, 50), force=st.floats(-5, 5))
def test_inputs_become_si(tension: float, displacement: float, force: float) -> None:
    """Newtons stay newtons, millimetres become metres, forces and moments keep their axis."""
    robot = load_robot("spacer_disk")
    loads = {"force_tip_y_N": [0.0, force], "moment_tip_z_Nm": [force, 0.0]}
    pulled = read_inputs(robot, table(tension_3_N=[0.0, tension], **loads))
    assert pulled.actuation == "tension"
    np.testing.assert_array_equal(pulled.tendon, [[0, 0, 0, 0], [0, 0, tension, 0]])
    np.testing.assert_array_equal(pulled.force_tip, [[0, 0, 0], [0, force, 0]])
    np.testing.assert_array_equal(pulled.moment_tip, [[0, 0, force], [0, 0, 0]])
    moved = read_inputs(robot, table(displacement_2_mm=[0.0, displacement]))
    assert moved.actuation == "displacement"
    np.testing.assert_allclose(moved.tendon, [[0, 0, 0, 0], [0, displacement * 1e-3, 0, 0]])


@settings(max_examples=30, deadline=None)
@given(right=st.floats(0, 100), left=st.floats(0, 100))
def test_shared_channel_is_a_sum_of_tensions(right: float, left: float) -> None:
    """The two proximal tendons of a side carry half of their channel each; a displacement is each one's."""
    robot = load_robot("neuroendoscope")
    columns = {"tension_proximal_right_N": [right], "tension_proximal_left_N": [left]}
    np.testing.assert_allclose(
        read_inputs(robot, table(**columns)).tendon, [[0, 0, right / 2, right / 2, left / 2, left / 2]]
    )
    columns = {"displacement_proximal_right_mm": [right]}
    np.testing.assert_allclose(
        read_inputs(robot, table(**columns)).tendon, [[0, 0, right * 1e-3, right * 1e-3, 0, 0]]
    )


def test_no_channel_at_all_is_zero_input() -> None:
    """A file with time alone drives the robot with zeros, of its own kind of actuation."""
    robot = load_robot("neuroendoscope_section")
    inputs = read_inputs(robot, Table(np.arange(3.0), {}))
    assert inputs.actuation == "tension"
    assert not inputs.tendon.any()
    assert len(inputs) == 3
    assert len(slice_inputs(inputs, slice(0, 2))) == 2
    moved = read_inputs(
        load_robot("neuroendoscope_section", ["actuation=displacement"]), Table(np.zeros(1), {})
    )
    assert moved.actuation == "displacement"


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        ({"tension_middle_N": [0.0]}, "unknown input channel 'tension_middle_N'; choices: tension_right_N"),
        ({"tension_right_mN": [0.0]}, "unknown input channel 'tension_right_mN'"),
        ({"": [0.0]}, "unknown input channel ''"),
        ({"tip_x_mm": [0.0]}, "unknown input channel 'tip_x_mm'"),
        ({"tension_right_N": [0.0], "displacement_left_mm": [0.0]}, "cannot be mixed"),
        ({"tension_right_N": [0.0, -0.1]}, "line 3: tension_right_N = -0.1: a tendon cannot push"),
        ({"tension_right_N": [0.0, np.nan]}, "line 3: tension_right_N: a number is needed"),
        ({"force_tip_x_N": [np.inf]}, "line 2: force_tip_x_N: a number is needed"),
    ],
)
def test_wrong_input_is_named(columns: dict[str, list[float]], message: str) -> None:
    """The line names the channel, the line of the file, and the choices."""
    with pytest.raises(InputError) as caught:
        read_inputs(load_robot("neuroendoscope_section"), table(**columns))
    assert message in str(caught.value)


def test_time_must_increase() -> None:
    """Rows at the same time, or earlier ones, are refused."""
    robot = load_robot("neuroendoscope_section")
    for times in ([0.0, 1.0, 1.0], [0.0, 2.0, 1.0]):
        with pytest.raises(InputError, match="line 4: time_s = 1 does not come after"):
            read_inputs(robot, Table(np.array(times), {}))


def test_unknown_output_names_the_choices() -> None:
    """The choices name the families of columns, not hundreds of them."""
    robot = load_robot("neuroendoscope_section")
    check_output_channels(robot, ["tip_x_mm", "body_30_z_mm", "joint_x30_deg"], "--columns")
    with pytest.raises(InputError) as caught:
        check_output_channels(robot, ["tip_x_mm", "body_31_z_mm"], "--columns")
    assert str(caught.value) == (
        "--columns: unknown output column 'body_31_z_mm'; choices: tip_x_mm, tip_y_mm, tip_z_mm, tip_qw, "
        "tip_qx, tip_qy, tip_qz, tension_right_N, tension_left_N, body_<k>_x_mm ..., joint_<name>_deg"
    )


@pytest.mark.parametrize("start", [0.0, -2.5, 1778538602.521])
def test_the_clock_of_inputs_starts_at_their_first_row(start: float) -> None:
    """Rows mean the same whenever they were recorded: seconds since the first one, to the last digit."""
    robot = load_robot("neuroendoscope_section")
    own = np.array([0.0, 0.0125, 0.025, 1.25])
    stamps = np.array([float(f"{start + time:.4f}") for time in own])
    inputs = read_inputs(robot, Table(stamps, {"tension_right_N": own}))
    np.testing.assert_allclose(inputs.time_s, own, rtol=1e-15, atol=1e-15)
