"""Long runs of the controlled catheters, which several claims are about, are made once."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import pytest

from catheter_sim.validation import mitral_control

SHARED = (
    (mitral_control, "joint_control"),
    (mitral_control, "bend_control"),
    (mitral_control, "whole_robot"),
)


def made_once(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return the function with its results kept; robots are compared by their numbers."""
    kept: list[tuple[tuple[Any, ...], Any]] = []

    def result(*arguments: Any) -> Any:
        for known, found in kept:
            if known == arguments:
                return found
        found = function(*arguments)
        kept.append((arguments, found))
        return found

    return result


@pytest.fixture(scope="session", autouse=True)
def runs_made_once() -> Iterator[None]:
    """Let the checks and the tests of this folder share the runs."""
    with pytest.MonkeyPatch.context() as patch:
        for module, name in SHARED:
            patch.setattr(module, name, made_once(getattr(module, name)))
        yield
