"""Claims about which rows of two recordings pair."""

from __future__ import annotations

import numpy as np
import pytest
from planted import as_inputs

from catheter_sim.core.inputs import Inputs
from catheter_sim.diagnosis.changes.differences import paired


def pulled(*rows: float) -> Inputs:
    """Return inputs in which the first of three tendons is pulled."""
    pull = np.array(rows)
    return as_inputs(np.stack([pull, 0 * pull, 0 * pull], axis=1), "displacement")


def test_the_same_trial_pairs_row_by_row() -> None:
    """Where a trial begins as another one did, each row has that trial's row as its partner, and no other."""
    loop = (0.0, 1.0, 2.0, 1.0, 0.0, 1.0, 2.0)
    errors = [np.arange(7.0)[:, None], 100.0 + np.arange(2.0)[:, None]]
    found = paired(pulled(*loop), [pulled(*loop), pulled(2.0, 1.0)], errors)
    np.testing.assert_allclose(found.error[:, 0], np.arange(7.0))
    assert found.count.tolist() == [1] * 7


def test_rows_pair_by_command_and_direction() -> None:
    """After another beginning, the same command pairs where it was come to in the same direction."""
    errors = [np.array([[0.0], [10.0], [20.0], [30.0], [40.0]])]
    found = paired(pulled(0.5, 2.0, 1.0), [pulled(0.0, 1.0, 2.0, 1.0, 0.0)], errors)
    assert np.isnan(found.error[0, 0])  # 0.5 was never commanded
    assert found.error[1, 0] == 20.0
    assert found.error[2, 0] == 30.0  # on the way home, not out


def test_a_row_passed_between_two_others_pairs_with_the_stretch() -> None:
    """Its partner's error is interpolated; not over a long stretch, nor against the direction."""
    out = np.arange(0.0, 21.0)
    errors = [np.arange(42.0)[:, None] ** 1.0]
    loop = pulled(*out, *out[::-1])
    found = paired(pulled(20.0, 3.25, 0.0, 7.75, 20.0), [loop], errors)
    assert found.error[1, 0] == pytest.approx(41.0 - 3.25)  # on the way home
    assert found.error[3, 0] == pytest.approx(7.75)
    coarse = paired(pulled(20.0, 3.25, 0.0), [pulled(0.0, 10.0, 20.0, 10.0, 0.0)], [np.zeros((5, 1))])
    assert np.isnan(coarse.error[1, 0])


def test_the_scatter_of_interpolated_partners_is_one_rows() -> None:
    """Rows of unit noise tell unit noise, wherever between them another row lies."""
    noise = np.random.default_rng(4)
    loop = pulled(*np.arange(0.0, 21.0))
    errors = [noise.normal(size=(21, 1)) for _ in range(200)]
    found = paired(pulled(0.5, *np.arange(1.3, 20.0)), [loop] * 200, errors)
    assert np.nanmean(found.spread) == pytest.approx(1.0, abs=0.05)


def test_missing_values_have_no_part() -> None:
    """A partner without a measured value gives none; another one does, and several tell their scatter."""
    rows = (0.0, 1.0, 0.0)
    errors = [
        np.array([[0.0], [np.nan], [1.0]]),
        np.array([[0.0], [4.0], [3.0]]),
        np.array([[0.0], [6.0], [5.0]]),
    ]
    found = paired(pulled(*rows), [pulled(*rows)] * 3, errors)
    np.testing.assert_allclose(found.error[:, 0], [0.0, 5.0, 3.0])
    np.testing.assert_allclose(found.spread[1:, 0], [2.0, 4.0])


def test_in_motion_the_same_programme_pairs_row_by_row() -> None:
    """Motors that follow it within a tenth of their range; from where they part by more, nothing does."""
    way = 10.0 * np.sin(np.arange(20.0) / 4.0)
    errors = [np.arange(20.0)[:, None]]
    again = way + 1.5 * (-1.0) ** np.arange(20)
    found = paired(pulled(*again), [pulled(*way)], errors, moving=True)
    np.testing.assert_array_equal(found.error[:, 0], np.arange(20.0))
    again[12:] += 6.0
    found = paired(pulled(*again), [pulled(*way)], errors, moving=True)
    assert found.count.tolist() == [1] * 12 + [0] * 8


def test_in_motion_the_same_command_on_another_way_does_not_pair() -> None:
    """How fast it was come to matters, too: where rows were held, it pairs."""
    loop = pulled(0.0, 1.0, 2.0, 3.0)
    errors = [np.arange(4.0)[:, None]]
    other = pulled(1.0, 2.0, 3.0)
    assert paired(other, [loop], errors, moving=True).count.tolist() == [0, 0, 0]
    assert paired(other, [loop], errors).count.tolist() == [1, 1, 1]
