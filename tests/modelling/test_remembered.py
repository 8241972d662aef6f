"""Models from memory are those written anew."""

from __future__ import annotations

import sys
import threading
from dataclasses import replace

import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.core.robot import Friction, RobotSpec
from catheter_sim.modelling import build
from catheter_sim.modelling import build as remembered
from catheter_sim.modelling.build import KEPT, build_mjcf, remembered_mjcf


@pytest.fixture
def built(monkeypatch: pytest.MonkeyPatch) -> list[tuple[RobotSpec, str, bool, bool]]:
    """An empty memory; the arguments of what is written, in a list that grows."""
    calls: list[tuple[RobotSpec, str, bool, bool]] = []

    def write(robot: RobotSpec, actuation: str, friction_tails: bool, motion: bool) -> str:
        calls.append((robot, actuation, friction_tails, motion))
        return f"model {len(calls)}"

    monkeypatch.setattr(remembered, "build_mjcf", write)
    monkeypatch.setattr(remembered, "_written", [])
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
    """While one model is written, another one is, and both are remembered."""
    first = load_robot("neuroendoscope_section")
    second = replace(first, friction=Friction(0.01))
    calls = []

    def write(robot: RobotSpec, *_: object) -> str:
        calls.append(robot)
        if robot is first:
            remembered_mjcf(second)
        return f"model {len(calls)}"

    monkeypatch.setattr(remembered, "build_mjcf", write)
    monkeypatch.setattr(remembered, "_written", [])
    remembered_mjcf(first)
    remembered_mjcf(second)
    assert calls == [first, second]


def test_threads_leave_the_limit_of_calls_as_it_was() -> None:
    """One that goes on when another has ended still has a deep enough limit; then it is as before."""
    before, seen = sys.getrecursionlimit(), []
    entered, second_entered, first_out = threading.Event(), threading.Event(), threading.Event()

    def first() -> None:
        with build._deep_enough():
            entered.set()
            second_entered.wait(0.1)
        first_out.set()

    def second() -> None:
        entered.wait()
        with build._deep_enough():
            second_entered.set()
            first_out.wait()
            seen.append(sys.getrecursionlimit())

    both = [threading.Thread(target=each) for each in (first, second)]
    for each in both:
        each.start()
    for each in both:
        each.join()
    assert seen == [build._DEEPEST_CALLS]
    assert sys.getrecursionlimit() == before < build._DEEPEST_CALLS
