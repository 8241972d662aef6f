"""Kinds of spoiled data: each changes what it says, knows no check, and is scored by what is named."""

from __future__ import annotations

import ast
from pathlib import Path

import numpy as np
import pytest

from catheter_sim.channels import input_channels
from catheter_sim.lab.robots import bench_robot
from hidden_effects import spoiled
from hidden_effects.spoiled import scored
from hidden_effects.spoiled_kinds import KINDS, Recording, Trial

OUTPUTS = ("tip_x_mm", "tip_z_mm", "body_15_x_mm", "body_15_z_mm")


def recording() -> Recording:
    """Return seven made-up trials of forty rows of a robot with two tendons."""
    bench = bench_robot("neuroendoscope_section", np.random.default_rng(0))
    trials = []
    for number in range(7):
        generator = np.random.default_rng(number)
        inputs = np.cumsum(generator.normal(size=(40, 2)), axis=0)
        outputs = inputs @ generator.normal(size=(2, 4)) + [0.0, 90.0, 0.0, 45.0]
        role = "train" if number < 5 else "heldout"
        trials.append(Trial(role, np.arange(40.0), inputs, outputs + generator.normal(size=(40, 4))))
    inputs = tuple(input_channels(bench.robot))
    return Recording(bench, inputs, OUTPUTS, np.zeros(3), np.full(4, 0.2), tuple(trials))


def same(one: Recording, other: Recording) -> bool:
    return len(one.trials) == len(other.trials) and all(
        a.role == b.role
        and all(
            np.array_equal(getattr(a, k), getattr(b, k), equal_nan=True)
            for k in ("time_s", "inputs", "outputs")
        )
        for a, b in zip(one.trials, other.trials, strict=True)
    )


def test_there_are_thirty_kinds_and_more() -> None:
    """Beside the sound one; each has a name of its own and words."""
    assert len({kind.name for kind in KINDS}) == len(KINDS) > 30
    assert all(kind.words for kind in KINDS)
    assert [kind.name for kind in KINDS if kind.sound] == ["sound"]


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_a_kind_spoils_and_leaves_what_it_is_given(kind) -> None:
    """The recording that it is given stays as it was; what it returns differs, unless a file is respelled."""
    given = recording()
    if kind.fits(given):
        found = kind.spoil(given, np.random.default_rng(1))
        assert same(given, recording())
        assert same(found, given) is (kind.sound or (kind.respell is not None and len(found.trials) == 7))
        assert same(found, kind.spoil(given, np.random.default_rng(1)))
    if kind.respell is not None:
        lines = ["time_s,a,b", *(f"{row}.5,{row}.25,-{row}.125" for row in range(30))]
        assert kind.respell(list(lines), np.random.default_rng(1)) != lines


def test_nothing_here_knows_the_checks() -> None:
    """No file imports the diagnosis."""
    for path in Path(spoiled.__file__).parent.glob("spoiled*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom):
                assert "diagnosis" not in (node.module or ""), path


def ending(named, verdict="cause_found", failure="", sound=False, found=True) -> tuple[str, bool]:
    answer = {
        "kind": "k",
        "words": "w",
        "seed": 1,
        "draw": 0,
        "robot": "r",
        "recording": 0,
        "sound": sound,
        "alike": ["drift"],
        "hidden": [{"cause": "backlash", "form": "play", "also": []}],
    }
    document = {"verdict": verdict, "causes": [{"name": name} for name in named]} if found else None
    score = scored(answer, document, {"seconds": 1.0, "failure": failure})
    return score["end"], score["right"]


def test_what_is_right() -> None:
    """To suspect, to refuse, to name nothing or what is there; in sound data not to suspect."""
    assert ending([], "data_suspect") == ("data_suspect", True)
    assert ending([], "data_suspect", sound=True) == ("data_suspect", False)
    assert ending([], failure="exit status 2: bad file", found=False) == ("refused", True)
    assert ending([], failure="exit status 1: Traceback", found=False) == ("failed", False)
    assert ending([], "unexplained") == ("no cause", True)
    assert ending(["backlash"]) == ("true cause", True)
    assert ending(["backlash"], sound=True) == ("true cause", True)
    assert ending(["backlash", "drift"]) == ("says the same", True)
    assert ending(["backlash", "payload"]) == ("wrong cause", False)
