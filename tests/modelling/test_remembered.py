"""Models from memory are those written anew."""

from __future__ import annotations

from dataclasses import replace

import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.core.robot import Friction, RobotSpec
from catheter_sim.modelling import build
from catheter_sim.modelling.build import KEPT, build_mjcf, remembered_mjcf


@pytest.fixture
def built(monkeypatch: pytest.MonkeyPatch) -> list[tuple[RobotSpec, str, bool, bool]]:
    """An empty memory; the arguments of what is written, in a list that grows."""
    calls: list[tuple[RobotSpec, str, bool, bool]] = []

    def write(robot: RobotSpec, actuation: str, friction_tails: bool, motion: bool) -> str:
        calls.append((robot, actuation, friction_tails, motion))
        return f"model {len(calls)}"

    monkeypatch.setattr(build, "build_mjcf", write)
    monkeypatch.setattr(build, "_written", [])
    return calls


def test_text_is_the_one_written_anew() -> None:
    """The first time and the second."""
    robot = load_robot("neuroendoscope_section")
    text = build_mjcf(robot)
    assert [remembered_mjcf(robot), remembered_mjcf(load_robot("neuroendoscope_section"))] == [text, text]


def test_every_argument_counts(built: list[tuple[RobotSpec, str, bool, bool]]) -> None:
    """Another number, actuation, friction or use: another model; the robot's own actuation is one."""
    robot = load_robot("neuroendoscope_section")
    wanted = [
        (robot, "tension", False, False),
        (replace(robot, friction=Friction(0.01)), "tension", False, False),
        (robot, "displacement", False, False),
        (robot, "tension", True, False),
        (robot, "tension", False, True),
    ]
    first = [remembered_mjcf(*arguments) for arguments in wanted]
    assert built == wanted
    assert [remembered_mjcf(*arguments) for arguments in wanted] == first
    assert remembered_mjcf(robot) == first[0]
    assert built == wanted


def test_what_is_used_is_kept_and_the_oldest_goes(built: list[tuple[RobotSpec, str, bool, bool]]) -> None:
    """Memory holds `KEPT` models; one that is read is the newest again."""
    robot = load_robot("neuroendoscope_section")
    robots = [replace(robot, friction=Friction(0.01 * k)) for k in range(KEPT + 1)]
    for each in robots[:-1]:
        remembered_mjcf(each)
    assert remembered_mjcf(robots[0]) == "model 1"
    remembered_mjcf(robots[-1])
    assert remembered_mjcf(robots[0]) == "model 1"
    assert remembered_mjcf(robots[1]) == f"model {KEPT + 2}"


def test_what_another_thread_writes_in_the_meantime_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    """While one model is written, another one is, and both are build."""
    first = load_robot("neuroendoscope_section")
    second = replace(first, friction=Friction(0.01))
    calls = []

    def write(robot: RobotSpec, *_: object) -> str:
        calls.append(robot)
        if robot is first:
            remembered_mjcf(second)
        return f"model {len(calls)}"

    monkeypatch.setattr(build, "build_mjcf", write)
    monkeypatch.setattr(build, "_written", [])
    remembered_mjcf(first)
    remembered_mjcf(second)
    assert calls == [first, second]
