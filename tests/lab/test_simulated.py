"""Claims about the stand-in: it hides what it is told to, by laws of its own, and repeats itself exactly."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from catheter_sim.errors import InputError
from catheter_sim.lab.memory import play
from catheter_sim.lab.simulated import SimulatedRig, stand_in
from catheter_sim.tables import Table

ROBOT, COLUMN = "mitral_4dof", "displacement_bending_proximal_mm"
UP_AND_DOWN = np.concatenate([np.linspace(0.0, 1.2, 7), np.linspace(1.2, 0.0, 7)[1:]])


@cache
def rig_with(*hide: str) -> SimulatedRig:
    return stand_in(ROBOT, hide, seed=3)


def pulled(values: np.ndarray, column: str = COLUMN) -> Table:
    return Table(np.arange(float(len(values))), {column: values}, "in.csv")


def read(rig: SimulatedRig, inputs: Table, name: str = "one") -> Table:
    rig.reset()
    rig.play(inputs, name)
    return rig.read()


@pytest.mark.slow
def test_a_name_stands_for_one_play() -> None:
    """The same name gives the same readings, another name another noise of the size that is told."""
    rig = rig_with()
    first, again, other = (read(rig, pulled(UP_AND_DOWN), name) for name in ("one", "one", "two"))
    sizes = []
    for column in rig.columns:
        np.testing.assert_array_equal(first.columns[column], again.columns[column])
        sizes.append(np.nanstd(first.columns[column] - other.columns[column]) / rig.answer()["noise"][column])
    assert 0.9 < np.mean(sizes) < 2.0  # the root of two, of few rows
    assert list(first.columns) == [COLUMN, *rig.columns]


@pytest.mark.slow
def test_hidden_play_is_what_is_seen() -> None:
    """With a hidden dead-band the robot goes where one without goes on the commands behind that band."""
    rig, plain = rig_with("backlash.play=12"), rig_with()
    width_mm = rig.answer()["hidden"][0]["parameters"]["width_mm"]
    assert 0.05 < width_mm < 1.0
    behind = play(UP_AND_DOWN[:, None], np.array([width_mm]))[:, 0]
    seen, expected = read(rig, pulled(UP_AND_DOWN)), read(plain, pulled(behind))
    for column in rig.columns:  # the same name, so the same noise
        np.testing.assert_allclose(seen.columns[column], expected.columns[column], atol=1e-3)
    straight = read(plain, pulled(UP_AND_DOWN))
    assert max(np.nanmax(np.abs(seen.columns[c] - straight.columns[c])) for c in rig.columns) > 1.0


@pytest.mark.slow
def test_sizes_that_are_not_given_show() -> None:
    """A drawn cause is one of the closed list, and the answer tells its law and numbers."""
    answer = rig_with("random").answer()
    (hidden,) = answer["hidden"]
    assert hidden["known"]
    assert hidden["size"] != 0.0
    assert answer["robot"] == ROBOT


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        ((ROBOT, ["rust"]), "--hide: unknown cause 'rust'"),
        ((ROBOT, ["backlash.rust"]), "--hide: unknown form 'backlash.rust'"),
        (
            (ROBOT, ["axial_compression.mount"]),
            "--hide axial_compression.mount: makes no sense on mitral_4dof",
        ),
        ((ROBOT, ["backlash.play=wide"]), "--hide backlash.play=wide: a finite size is needed after ="),
        (("no_robot", []), "unknown robot 'no_robot'"),
    ],
)
def test_what_cannot_be_hidden_is_said(arguments, line) -> None:
    """In one line with the choices."""
    with pytest.raises(InputError) as caught:
        stand_in(*arguments)
    assert line in str(caught.value)


def test_limits_hold_and_columns_are_known() -> None:
    """What the bench cannot do is refused before it is simulated; what it does not measure is named."""
    rig = stand_in(ROBOT, limits={COLUMN: (-1.0, 1.0)})
    with pytest.raises(InputError, match=r"line 8: .* = 1\.2: the bench gives -1 to 1"):
        rig.play(pulled(UP_AND_DOWN), "one")
    with pytest.raises(InputError, match="nothing was played"):
        rig.read()
    rig.play(pulled(0.1 * UP_AND_DOWN), "one")
    with pytest.raises(InputError, match="unknown column 'tip_w_mm'"):
        rig.read(["tip_w_mm"])
