"""Claims about the random chest: within its ranges, closed, and with room for the robot and its turn."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from catheter_sim.anatomy.anatomies import (
    CHANNEL_M,
    Chest,
    aspiration_point,
    diaphragm,
    lung,
    meshes,
    random_of,
    ranges_of,
    wall_boxes,
)
from reference.steering import insert_way

RANGES = ranges_of(Chest)
ROBOT_RADIUS_M = 3.1e-3  # chest_tube_2025, Table II


@pytest.fixture(params=range(20))
def anatomy(request: pytest.FixtureRequest) -> Chest:
    return random_of(Chest, np.random.default_rng(request.param))


def test_draws_lie_in_their_ranges(anatomy: Chest) -> None:
    """Every number has a range; the wall's is the paper's."""
    values = dataclasses.asdict(anatomy)
    assert values.keys() == RANGES.keys()
    assert all(low <= values[name] <= high for name, (low, high) in RANGES.items())
    assert RANGES["wall_m"] == (26.6e-3, 80.2e-3)


def test_organs_are_closed_and_where_they_are_said_to_be(anatomy: Chest) -> None:
    """Watertight meshes; the lung's nearest point lies an effusion under the wall, the diaphragm beside."""
    seen = meshes(anatomy)
    assert all(mesh.is_watertight and mesh.volume > 0.0 for mesh in seen.values())
    assert seen["lung"].vertices[:, 2].min() == pytest.approx(anatomy.effusion_m, abs=1e-3)
    assert seen["diaphragm"].vertices[:, 0].max() == pytest.approx(-anatomy.diaphragm_away_m, abs=1e-3)
    assert seen["wall"].vertices[:, 2].min() == pytest.approx(-anatomy.wall_m)


def test_channel_is_open_and_as_long_as_the_wall_is_thick(anatomy: Chest) -> None:
    """No box of the wall reaches into the channel, each bounds it, and all of them are as thick as it is."""
    for half, middle in wall_boxes(anatomy):
        beside = np.abs(middle[:2]) - half[:2]
        assert beside.max() == pytest.approx(CHANNEL_M)
        assert middle[2] + half[2] == pytest.approx(0.0)
        assert 2.0 * half[2] == pytest.approx(anatomy.wall_m)


def test_way_to_the_aspiration_point_is_free(anatomy: Chest) -> None:
    """It begins in the channel's mouth, ends at the point, turns by a right angle, and no organ is nearer to
    it than the robot's radius.
    """
    way = insert_way(anatomy)
    assert way[0] == pytest.approx(np.zeros(3), abs=1e-9)
    assert way[-1] == pytest.approx(aspiration_point(anatomy), abs=1.1e-3)
    steps = np.linalg.norm(np.diff(way, axis=0), axis=1)
    assert steps == pytest.approx(1e-3, rel=1e-3)
    first, last = way[1] - way[0], way[-1] - way[-2]
    assert first @ last == pytest.approx(0.0, abs=1e-9)
    for middle, radius in (
        (lung(anatomy), anatomy.lung_radius_m),
        (diaphragm(anatomy), anatomy.diaphragm_radius_m),
    ):
        assert np.linalg.norm(way - middle, axis=1).min() > radius + ROBOT_RADIUS_M
