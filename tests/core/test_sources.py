"""Every number of a built-in robot says where it comes from."""

from __future__ import annotations

from collections.abc import Mapping

import pytest

from catheter_sim.catalogue import ROBOTS
from catheter_sim.core.document import leaves, to_document
from catheter_sim.robots.continuum.spec import ContinuumRobot


def without_source(robot: ContinuumRobot, sources: Mapping[str, str]) -> list[str]:
    """Return the dotted keys of the numbers that no key of `sources` covers, whole or as its start."""

    def covered(key: str) -> bool:
        parts = key.split(".")
        return any(sources.get(".".join(parts[:n]), "").strip() for n in range(1, len(parts) + 1))

    return [key for key, _ in leaves(to_document(robot)) if not covered(key)]


@pytest.mark.parametrize("reference", ROBOTS)
def test_every_number_has_a_source(reference: str) -> None:
    """Each number is covered by a source, or by the word "assumed"."""
    robot = ROBOTS[reference]()
    assert without_source(robot, robot.sources) == []


@pytest.mark.parametrize("reference", ROBOTS)
def test_a_removed_source_is_noticed(reference: str) -> None:
    """Without any one of its sources, or with an empty one, a robot fails the check."""
    robot = ROBOTS[reference]()
    for key in robot.sources:
        rest = {name: text for name, text in robot.sources.items() if name != key}
        assert without_source(robot, rest), f"{key} covers nothing"
        assert without_source(robot, rest | {key: " "}), key


@pytest.mark.parametrize("reference", ROBOTS)
def test_sources_name_a_work_or_a_guess(reference: str) -> None:
    """A source names a publication's year, or says that the number is assumed, chosen or by definition."""
    for key, text in ROBOTS[reference]().sources.items():
        says = any(word in text for word in ("assumed", "chosen", "by definition", "201", "202"))
        assert says, f"{key}: {text}"


def test_a_plain_robot_has_none_covered() -> None:
    """The check counts every number: with no sources at all, all of them are missing."""
    robot = ROBOTS["spacer_disk"]()
    missing = without_source(robot, {})
    assert len(missing) == len(list(leaves(to_document(robot)))) > 40
    assert "segments.first.length_mm" in missing
    assert "friction.mu" in missing
